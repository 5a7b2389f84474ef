"""Kernels as plain Python against the same kernels compiled: both give the same results.

Runs only where nothing is compiled (NUMBA_DISABLE_JIT=1), together with the tests that count the coverage of kernels.
"""

import os
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numba import config

from kernels.near_axis import survey

pytestmark = pytest.mark.skipif(not config.DISABLE_JIT, reason="the kernels are compiled here")
KNOWS_NOTHING = """
import pickle, sys
from kernels.near_axis import survey
calls = pickle.load(sys.stdin.buffer)
pickle.dump([getattr(survey, name)(*given, **options) for name, given, options in calls], sys.stdout.buffer)
"""
BODIES = [(1.0, 2.0, 2.7), (0.3, 0.5, 0.78), (1.0, 1.0, 1.5), (1e-4, 1.0, 1.00005), (1.0, 2.0, np.nan), (1.0, 1.5, 9.0)]
SHORT, LONG = (1.0, 16, 1e-9), (2.0, 16, 1e-9)


def points(epsilon, bodies=BODIES, axes=(1, 2, 3)):
    """Bodies about every axis: ordinary bodies, a top, a needle, a point without numbers and an impossible body."""
    I1, I2, I3, axis = np.array([(*body, axis) for body in bodies for axis in axes]).T
    sense = np.where(np.arange(I1.size) % 2, 1.0, -1.0)
    return {"I1": I1, "I2": I2, "I3": I3, "axis": axis, "omega0": 3.0 * sense, "epsilon": epsilon, "phase": 0.6}


CALLS = {
    "small nudge": ("survey", (points(1e-6), *LONG), {}),
    "large nudge": ("survey", (points(0.05), *SHORT), {}),
    "exact": ("survey", (points(1e-3), *LONG), {"propagator": "exact"}),
    "collapsed": ("survey", (points(1e-2), *SHORT), {"collapse": True}),
    "few columns": ("measure_points", (points(1e-4), *SHORT), {"wanted": ("omega_squared", "status")}),
    "flips": ("measure_points", (points(0.2, BODIES[:2]), *SHORT), {"nonlinear": True}),
}


@pytest.fixture(scope="module")
def compiled():
    """Return the results of the compiled kernels for the same calls, in a separate process."""
    environment = {name: value for name, value in os.environ.items() if name != "NUMBA_DISABLE_JIT"}
    options = {"cwd": Path(survey.__file__).parents[2], "env": environment, "capture_output": True, "check": True}
    process = subprocess.run([sys.executable, "-c", KNOWS_NOTHING], input=pickle.dumps([*CALLS.values()]), **options)
    return dict(zip(CALLS, pickle.loads(process.stdout), strict=True))


@pytest.mark.parametrize("name", CALLS)
def test_plain_python_gives_what_is_compiled(compiled, name):
    function, arguments, options = CALLS[name]
    plain = getattr(survey, function)(*arguments, **options)
    assert plain.keys() == compiled[name].keys()
    rounding = 1e-12 * arguments[0]["omega0"] ** 2
    for column, expected in compiled[name].items():
        values = plain[column]
        assert values.dtype == expected.dtype
        if column in ("omega_squared", "omega_squared_reduced"):
            # products and sums are contracted where they are compiled: rounding, within the point's own error
            error = np.nan_to_num(compiled[name].get("omega_squared_error", 0.0))
            assert (np.abs(np.nan_to_num(values - expected)) <= error + rounding).all()
        elif expected.dtype.kind == "i" or column.endswith(("_theory", "_exact")):
            np.testing.assert_allclose(values, expected, rtol=1e-13, err_msg=column)
        np.testing.assert_array_equal(np.isnan(values), np.isnan(expected), err_msg=column)
