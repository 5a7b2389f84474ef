import matplotlib
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import sweeps
from sweeps.figure.sheets import STYLE
from sweeps.systems.symmetric_top.presentation import figure_tops
from sweeps.systems.symmetric_top.system import SYSTEM
from sweeps.views import figures

TOPS = {
    "system": "symmetric_top",
    "grid": {"ratio": [0.5, 1.0, 1.001, 1.5, 2.5], "omega3": [-2.0, 1e-9], "half_angle": [10.0, 45.0, 80.0]},
}


tops = pytest.fixture(lambda: sweeps.survey(TOPS), scope="module")


def by_gid(figure, gid):
    return [artist for ax in figure.axes for artist in ax.get_children() if artist.get_gid() == gid]


def draw(ds):
    with matplotlib.rc_context(STYLE):
        figure = figure_tops.draw_precession(ds)
        figure.draw_without_rendering()
    return figure


def test_the_measured_rates_stand_on_the_formulas_line(tops):
    figure = draw(tops)
    points = np.concatenate([line.get_xydata() for line in by_gid(figure, "measured")])
    assert set(points[:, 0]) == {0.5, 1.0, 1.001, 1.5, 2.5}
    np.testing.assert_allclose(points[:, 1], points[:, 0] - 1.0, atol=1e-6)  # drawn to six digits
    (line,) = by_gid(figure, "theory")
    np.testing.assert_array_equal(line.get_ydata(), line.get_xdata() - 1.0)
    assert by_gid(figure, "impossible")
    assert not by_gid(draw(tops.isel(ratio=slice(0, 4))), "impossible")


def test_every_map_of_the_system_has_its_picture(tops, tmp_path):
    single_point = tops.isel(ratio=[0], omega3=[0], half_angle=[0])  # the pictures of all points are drawn above
    paths = list(figures.draw_all(single_point, tmp_path))
    assert [path.name for path in paths] == ["precession.png", "cones.png", "theory_against_measured.png"]
    assert min(path.stat().st_size for path in paths) > 20_000
    assert figure_tops.draw_cones(tops.isel(ratio=[1])) is None  # a sphere has none


@pytest.mark.parametrize("ratio", [0.5, 1.8])
def test_the_cones_are_those_of_the_motion(ratio):
    """Angles of the angular velocity and of the figure axis to L, from quaternions; it turns with L/I1."""
    trajectory = SYSTEM.motion({"ratio": ratio, "omega3": 2.0, "half_angle": 25.0}, 7.0, 15, 1e-10)
    attitude = Rotation.from_quat(np.stack([trajectory[f"q{i}"] for i in range(4)], axis=1), scalar_first=True)
    omega = np.stack([trajectory[f"omega{i}"] for i in (1, 2, 3)], axis=1)
    L = omega[0] * [1.0, 1.0, ratio]
    in_space, axis = attitude.apply(omega), attitude.apply([0.0, 0.0, 1.0])
    theta, body_cone = figure_tops.cone_angles(ratio, np.radians(25.0))

    def angle(a, b):
        return np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), (a * b).sum(axis=1))

    to_L = np.tile(L, (15, 1))
    np.testing.assert_allclose(angle(axis, to_L), theta, atol=1e-13)
    np.testing.assert_allclose(angle(in_space, to_L), abs(body_cone), atol=1e-13)
    np.testing.assert_allclose(angle(in_space, axis), np.radians(25.0), atol=1e-13)
    np.testing.assert_allclose(Rotation.from_rotvec(0.5 * L).apply(axis[:-1]), axis[1:], atol=1e-13)
    assert (body_cone > 0) == (ratio > 1)
