"""What commands leave out is missed by nobody."""

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
