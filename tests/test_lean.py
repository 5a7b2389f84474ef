"""What commands leave out is missed by nobody."""

import os
import subprocess
import sys

import pytest

CODE = """
import xarray as xr
from xarray.namedarray.utils import module_available
module_available("dask")  # as xarray asks itself, and remembers
from sweeps import lean
lean.leave_out()
from xarray.namedarray.utils import is_dask_collection
assert not is_dask_collection(0)
"""


@pytest.mark.slow  # xarray is loaded once more
def test_dask_stays_where_xarray_has_found_it():
    done = subprocess.run([sys.executable, "-c", CODE], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


METADATA = """
import sys
from sweeps import lean
lean.leave_out(alone=True)
import pydantic
Model = type("Model", (pydantic.BaseModel,), {"__annotations__": {"a": int}})
assert Model(a=1).a == 1
assert "importlib.metadata" not in sys.modules
from pydantic.plugin._loader import entry_points
from importlib import metadata
assert len(entry_points(group="console_scripts")) == len(metadata.entry_points(group="console_scripts")) > 1
"""


def test_what_packages_say_of_themselves_is_looked_up_when_asked_for():
    done = subprocess.run([sys.executable, "-c", METADATA], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


TYPES = """
import sys
from sweeps import lean
lean.leave_out(alone=True)
import numpy as np
assert "numpy._typing" not in sys.modules
assert np.linalg.eigh(np.diag([2.0, 1.0])).eigenvalues.tolist() == [1.0, 2.0]
from numpy.typing import NDArray
assert NDArray[np.float64].__origin__ is np.ndarray
"""


def test_numpys_types_are_loaded_when_asked_for():
    done = subprocess.run([sys.executable, "-c", TYPES], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


END = """
import atexit, sys, threading, time
from sweeps import lean
lean.leave_out(alone=True)
class Loaded:
    def __del__(self):
        print("taken down")
loaded = Loaded()
atexit.register(print, "done at the end")
threading.Thread(target=lambda: (time.sleep(0.1), print("waited for"))).start()
sys.stdout.write("said ")
lean.end_at_once(3)
"""


def test_a_command_ends_with_all_that_is_to_be_done_and_takes_nothing_down():
    done = subprocess.run([sys.executable, "-c", END], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (3, "said waited for\ndone at the end\n", "")


UNWRITABLE = """
import sys
from sweeps import lean
lean.leave_out(alone=True)
sys.stdout.write("said ")
lean.end_at_once(3)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="no device that is always full")
def test_words_that_cannot_be_written_are_told_of_as_ever():
    kept = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    with open("/dev/full", "w") as full:
        words = [sys.executable, "-c", UNWRITABLE]
        done = subprocess.run(words, stdout=full, stderr=subprocess.PIPE, text=True, env=kept, check=False)
    assert done.returncode == 120  # Python's own
    assert "No space left" in done.stderr
