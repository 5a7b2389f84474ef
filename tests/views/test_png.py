"""PNG files as Pillow and Matplotlib read them."""

import numpy as np
import pytest
from matplotlib import image
from PIL import Image

from sweeps.views import png


@pytest.mark.parametrize("opaque", [True, False])
@pytest.mark.parametrize("shape", [(1, 1), (7, 300), (200, 3)])
def test_others_read_the_pixels_that_were_written(tmp_path, shape, opaque):
    pixels = np.random.default_rng(1).integers(0, 256, (*shape, 4), dtype=np.uint8)
    if opaque:
        pixels[..., 3] = 255
    png.write(pixels, tmp_path / "a.png", 200.0)
    with Image.open(tmp_path / "a.png") as read:
        read.verify()  # the checksums
    with Image.open(tmp_path / "a.png") as read:
        assert read.mode == ("RGB" if opaque else "RGBA")
        assert read.info["dpi"] == pytest.approx((200.0, 200.0), abs=0.01)
        assert read.info["Software"].startswith("Matplotlib")
        np.testing.assert_array_equal(np.asarray(read.convert("RGBA")), pixels)
    seen = image.imread(tmp_path / "a.png")
    np.testing.assert_array_equal(np.round(seen * 255)[..., :3], pixels[..., :3])
