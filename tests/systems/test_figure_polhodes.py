"""Polhodes: the scene, the curves on both sides of the separatrix, and the body that is drawn."""

from itertools import combinations

import matplotlib
import numpy as np
import pytest

import sweeps
from sweeps.figure.sheets import STYLE
from sweeps.systems.rigid_body.presentation import figure_polhodes
from sweeps.systems.rigid_body.presentation.appearance import APPEARANCE
from sweeps.systems.rigid_body.presentation.figure_polhodes import Scene

ORDERS = [(1.0, 1.5, 2.2), (2.2, 1.0, 1.5), (1.5, 2.2, 1.0), (2.2, 1.5, 1.0), (1.0, 2.2, 1.5), (1.5, 1.0, 2.2)]


def survey(**grid):
    return sweeps.survey({"title": "a map", "axes": [1], "grid": {"omega0": 1.0} | grid})


def draw(ds):
    with matplotlib.rc_context(STYLE):
        figure = figure_polhodes.draw(ds)
        figure.draw_without_rendering()
    return figure


def lines(figure, gid):
    return [line for line in figure.axes[0].lines if line.get_gid() == gid]


@pytest.mark.parametrize("moments", ORDERS)
def test_the_scene_is_the_body_as_it_is_and_no_mirror_image(moments):
    scene = Scene(np.array(moments))
    np.testing.assert_allclose(scene.moments, np.array(moments)[list(scene.axes)] / 1.5, rtol=1e-15)
    assert np.linalg.det([np.eye(3)[list(scene.axes)], scene.view]) == pytest.approx([1.0, 1.0])
    assert scene.moments[1] == 1.0
    assert scene.view[2].min() > 0  # the three positive ends face the reader, the middle one most
    assert np.argmax(scene.view[2]) == 1


@pytest.mark.parametrize("moments", ORDERS)
def test_curves_have_the_colour_of_their_side_of_the_separatrix(moments):
    scene = Scene(np.array(moments))
    curves = figure_polhodes.polhodes(scene)
    assert {kind for kind, _ in curves} == {"stable_minor", "stable_major", "unstable"}
    for kind, curve in curves:
        energy, momentum = curve**2 @ scene.moments, curve**2 @ scene.moments**2
        np.testing.assert_allclose(energy, 1.0, rtol=1e-14)  # all on one ellipsoid
        np.testing.assert_allclose(momentum, momentum[0], rtol=1e-14)
        # L² against 2E·I_mid = 1: beyond it about the greatest moment, short of it about the least
        side = {"stable_minor": -1, "stable_major": 1, "unstable": 0}[kind]
        np.testing.assert_array_equal(np.sign(np.round(momentum - 1.0, 12)), side)


def test_what_is_seen_is_the_near_side():
    scene = Scene(np.array([1.0, 1.5, 2.2]))
    for _, curve in figure_polhodes.polhodes(scene):
        for point, cosine in zip(curve[::40], scene.facing_cosine(curve[::40]), strict=True):
            # from a point of the near side the line of sight leaves the ellipsoid, elsewhere it enters it
            outer_point = point + 1e-6 * scene.view[2]
            assert (outer_point**2 @ scene.moments > 1.0) == (cosine > 0) or abs(cosine) < 1e-5


def test_near_and_far_halves_make_the_curves():
    figure = draw(survey(I1=1.0, I2=1.5, I3=2.2))
    for kind in ("stable_minor", "stable_major", "unstable"):
        near, far = lines(figure, f"{kind} near"), lines(figure, f"{kind} far")
        assert len(near) == len(far) >= 2
        for near_half, far_half in zip(near, far, strict=True):
            assert near_half.get_color() == far_half.get_color() == APPEARANCE.color(kind)
            assert near_half.get_linewidth() > far_half.get_linewidth()
            assert (np.isnan(near_half.get_xdata()) != np.isnan(far_half.get_xdata())).all()
    assert len([patch for patch in figure.axes[0].patches if patch.get_gid() == "direction"]) > 4
    assert len(lines(figure, "spin")) == 3


def test_axes_are_named_in_the_order_of_their_moments():
    figure = draw(survey(I1=2.2, I2=1.0, I3=1.5))
    texts = {text.get_text() for text in figure.axes[0].texts}
    labels = {"axis 2: least\n$I_2$ = 1", "axis 3: middle\n$I_3$ = 1.5", "axis 1: greatest\n$I_1$ = 2.2"}
    assert labels <= texts
    renderer = figure.canvas.get_renderer()
    boxes = [text.get_window_extent(renderer) for text in figure.axes[0].texts if text.get_text()]
    assert len(boxes) == 3
    assert not any(box.overlaps(other) for box, other in combinations(boxes, 2))
    assert all(figure.bbox.x0 <= box.x0 < box.x1 <= figure.bbox.x1 for box in boxes)


def test_the_body_is_the_most_asymmetric_that_can_exist():
    # (1, 1.5, 2.2): 1.467; (1, 1.5, 2.4): 1.5; (1, 1.5, 2.6): cannot exist; (1, 2.1, 2.4): 1.143
    body = figure_polhodes.most_asymmetric_body(survey(I1=1.0, I2=[1.5, 2.1], I3=[2.2, 2.4, 2.6]))
    assert body.moments.tolist() == [1.0, 1.5, 2.4]
    golden = (1 + 5**0.5) / 2
    asymmetries = figure_polhodes.asymmetry(np.random.default_rng(1).uniform(0.1, 1.0, (20_000, 3)))
    assert golden - 0.05 < asymmetries.max() <= golden


@pytest.mark.slow
def test_bodies_are_named():
    ds = sweeps.survey("bodies")
    body = figure_polhodes.most_asymmetric_body(ds)
    assert body.name == "Telephone as a uniform box"  # the water molecule's moments differ more: it breaks the triangle
    assert body.units == "kg m²"
    assert body.name in " ".join(draw(ds).texts[1].get_text().split())
    only = figure_polhodes.most_asymmetric_body(ds.isel(body=[1, 6]))
    assert (only.name, only.units) == ("Moon", "")


@pytest.mark.parametrize("moments", [(1.0, 1.0, 1.5), (1.0, 1.0, 1.0), (1.0, 2.0, 3.5)])
def test_no_picture_without_a_body_of_three_different_moments(moments):
    assert figure_polhodes.draw(survey(**dict(zip(("I1", "I2", "I3"), moments, strict=True)))) is None


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("moments", [(1e-3, 1.0, 1.0005), (1e-47, 1.1e-47, 2e-47), (1.0, 1.0 + 1e-9, 1.5)])
def test_odd_bodies_have_pictures(moments):
    draw(survey(**dict(zip(("I1", "I2", "I3"), moments, strict=True))))
