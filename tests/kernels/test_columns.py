import numpy as np
import pytest

from kernels.compile import columns
from kernels.estimator import statuses
from kernels.events import flips
from kernels.near_axis import survey
from sweeps.systems.rigid_body.system import CERTIFICATE, FLIPS, TERMS, VARIABLES

TABLES = (survey.COLUMNS, flips.COLUMNS)
EVERY = [column for table in TABLES for column in table]
MAP = VARIABLES | CERTIFICATE | FLIPS | TERMS
POWERS = {"s-2": 2, "s-1": 1, "rad s-1": 1, "s": -1, "1": 0, "rad": 0, None: 0}  # power of time in each unit of a map


@pytest.mark.parametrize("column", EVERY, ids=lambda column: column.name)
def test_a_column_is_what_the_map_says_it_is(column):
    variable = MAP[column.name]
    assert column.power == POWERS[variable.units]
    inside = np.dtype(column.dtype)
    dtype = np.dtype(variable.dtype)
    # a map may store a diagnostic in fewer digits; integers keep their type
    assert inside == dtype or (inside, dtype) == (np.float64, np.float32)


def test_every_measured_variable_of_a_map_is_a_column():
    theory = survey.predict_points({"I1": 1, "I2": 2, "I3": 2.5, "axis": 1, "omega0": 1, "epsilon": 1e-6, "phase": 0})
    names = [column.name for column in EVERY]
    assert len(set(names)) == len(names)
    assert set(names) | set(theory) == set(MAP)


def test_numbers_are_the_places_of_columns_and_the_starts_of_rows():
    assert columns.numbers(("b", "a"))._asdict() == {"b": 0, "a": 1}
    assert columns.numbers(("b", "a"), first=2, width=8)._asdict() == {"b": 16, "a": 24}


def test_every_status_has_its_number():
    for number, name in enumerate(statuses.STATUSES):
        assert getattr(statuses, name.upper()) == number


def test_arrays_have_the_one_form_that_kernels_are_compiled_for():
    axis, broadcast, number = columns.arrays([1, 2, 3], np.broadcast_to(0.5, 3), 2, dtypes=[np.int64, float, float])
    assert axis.dtype == np.int64
    for values, expected in ((broadcast, 0.5), (number, 2.0)):
        assert values.dtype == np.float64
        assert values.flags.c_contiguous
        assert values.flags.writeable
        np.testing.assert_array_equal(values, [expected] * 3)
    assert [values.dtype for values in columns.arrays([1], 2)] == [np.float64, np.float64]
