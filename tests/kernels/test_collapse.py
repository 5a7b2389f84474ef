import numpy as np
import pytest

from kernels.free import collapse, rigid_body
from kernels.near_axis import survey

NAMES = rigid_body.Spins._fields


def grid(**values):
    mesh = np.meshgrid(*(np.atleast_1d(values[name]) for name in NAMES), indexing="ij")
    return {
        name: (x.reshape(-1).astype(np.int64) if name == "axis" else x.reshape(-1).astype(float))
        for name, x in zip(NAMES, mesh, strict=True)
    }


def motion(point):
    """Return the five numbers of a motion, by fractions of the parameters."""
    moments = [point[name] for name in ("I1", "I2", "I3")]
    a, b, c = (np.arange(3) + int(point["axis"]) - 1) % 3
    return moments[a] / moments[c], moments[b] / moments[c], point["epsilon"], point["phase"], point["omega0"] > 0


def first_of_each(points):
    """Return the first point of each point's motion, by the two arrays."""
    first, motion = collapse.distinct(rigid_body.Spins(*points))
    assert (np.diff(first) > 0).all()
    assert motion[first].tolist() == list(range(first.size))
    return first[motion].tolist()


def test_points_of_one_motion_are_told():
    points = grid(
        I1=[0.5, 1, 2], I2=[0.7, 1], I3=[1, 2], axis=[1, 2, 3], omega0=[-2, 1, 5], epsilon=[1e-6, 0.1], phase=[0, 1]
    )
    order = np.random.default_rng(1).permutation(points["axis"].size)  # neighbours that have but one ratio in common
    points = {name: values[order] for name, values in points.items()}
    rows = [motion(dict(zip(NAMES, row, strict=True))) for row in zip(*points.values(), strict=True)]
    first_indices = {}
    expected = [first_indices.setdefault(row, i) for i, row in enumerate(rows)]
    assert first_of_each(points.values()) == expected
    assert survey.count_motions(points) == len(first_indices) < 0.6 * len(rows)


def test_any_signs_of_nought_and_what_is_no_number():
    points = grid(I1=1.0, I2=2.0, I3=3.0, axis=1, omega0=[1.0, 2.0], epsilon=0.1, phase=[0.0, -0.0, np.nan])
    assert first_of_each(points.values()) == [0, 0, 2, 0, 0, 5]


@pytest.mark.compiled
def test_a_collapsed_points_bits_depend_on_the_point_alone():
    points = grid(
        I1=[0.3, 0.6, 0.9],
        I2=[0.5, 1.0, 1.5],
        I3=[0.7, 1.4, 2.1],
        axis=[1, 2, 3],
        omega0=[1.0, 3.0],
        epsilon=1e-3,
        phase=1,
    )
    all_columns = survey.measure_collapsed(points, 4.0, 16, 1e-10)
    for num_chunks in (2, 5, 27):
        for chunk in np.array_split(np.random.default_rng(num_chunks).permutation(points["I1"].size), num_chunks):
            columns = survey.measure_collapsed({name: values[chunk] for name, values in points.items()}, 4.0, 16, 1e-10)
            for name in all_columns:
                np.testing.assert_array_equal(columns[name], all_columns[name][chunk], err_msg=name)
