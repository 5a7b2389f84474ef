import math
from pathlib import Path

import numpy as np
import pytest

from kernels import series


def test_the_hypotenuse_is_that_of_numpy():
    random = np.random.default_rng(3)
    for x, y in random.uniform(-1, 1, (2000, 2)) * 10.0 ** random.uniform(-150, 150, (2000, 2)):
        # one rounding each of the ratio, its square, the sum, the root and the product, most of them halved
        assert abs(series.hypot(x, y) - np.hypot(x, y)) <= 2 * np.spacing(np.hypot(x, y))


@pytest.mark.parametrize(("x", "y"), [(0.0, 0.0), (-3.0, 0.0), (1e308, 1e308), (math.inf, math.inf), (5e-324, 0.0)])
def test_ends_of_the_range(x, y):
    assert series.hypot(x, y) == pytest.approx(float(np.hypot(x, y)), rel=4e-16)
    assert math.isnan(series.hypot(math.nan, x))


def test_no_kernel_calls_what_numba_compiles_with_the_options_of_its_first_caller():
    for path in (Path(__file__).parents[2] / "kernels").glob("*.py"):
        assert "math.hypot(" not in path.read_text(encoding="utf-8"), path.name
