"""Code that several processes compiled and stored keeps its names apart."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from numba.core.bytecode import FunctionIdentity

from kernels import options

ROOT = Path(options.__file__).parents[1]
SOURCE = """\
from numba import njit
from kernels.options import OPTIONS

def times(factor):
    @njit(**OPTIONS)
    def multiplied(x):
        return factor * x
    return multiplied

double, triple = times(2.0), times(3.0)

@njit(**OPTIONS)
def both(x):
    return double(x) + 100.0 * triple(x)
"""


@pytest.mark.compiled
def test_a_process_counts_its_functions_from_a_number_of_its_own():
    assert next(FunctionIdentity._unique_ids) > 1 << 30  # below it once in a thousand million processes


@pytest.mark.slow
@pytest.mark.compiled
def test_closures_of_one_place_that_two_processes_compiled_are_not_taken_for_each_other(tmp_path):
    (tmp_path / "closures.py").write_text(SOURCE)
    path = os.pathsep.join([str(ROOT), str(tmp_path)])
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "chosen"), "PYTHONPATH": path}
    found = []
    for called in ("double", "triple", "both"):
        command = [sys.executable, "-c", f"import kernels, closures; print(closures.{called}(1.0))"]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True, cwd=ROOT)
        found.append(float(done.stdout))
    assert found == [2.0, 3.0, 302.0]
