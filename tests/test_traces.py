"""Polhode leaves an importing process unchanged: the state of a fresh process before and after every entry."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
# Dependencies of Polhode: their import changes a process, and is no trace of Polhode.
DEPENDENCIES = (
    "dask.array h5py matplotlib.figure netCDF4 numba pandas pydantic rich.progress ruamel.yaml scipy.stats xarray"
)
IMPORTS = f"import importlib\nfor other in {DEPENDENCIES.split()!r}: importlib.import_module(other)\n"
SEEN = """
import gc, json, logging, os, signal, sys, threading, warnings
import matplotlib, multiprocessing, numba, numpy

print("SEEN" + json.dumps({
    "finders": [str(finder) for finder in sys.meta_path],
    "path hooks": [str(hook).split(" at ")[0] for hook in sys.path_hooks],
    "no modules": sorted(n for n, m in sys.modules.items() if m is None or getattr(m, "__spec__", 0) is None),
    "environment": dict(os.environ),
    "Numba": {name: str(value) for name, value in vars(numba.config).items() if name.isupper()},
    "warnings": sorted(str(one) for one in warnings.filters),
    # Python settles on its first method itself once it has spawned a process
    "start method": multiprocessing.get_start_method(allow_none=True) or multiprocessing.get_all_start_methods()[0],
    "Matplotlib": {name: str(value) for name, value in matplotlib.rcParams.copy().items()},
    "NumPy": [str(numpy.geterr()), str(numpy.get_printoptions())],
    "garbage": [gc.isenabled(), gc.get_threshold(), gc.get_freeze_count()],
    "signals": [str(signal.getsignal(number)) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)],
    "hooks": [str(hook).split(" at ")[0] for hook in (sys.excepthook, sys.unraisablehook, threading.excepthook)],
    "streams": [(s.errors, s.encoding, s.line_buffering) for s in (sys.stdout, sys.stderr)],
    "process": [os.getcwd(), os.umask(os.umask(0)), logging.root.level],
}))
"""
GRID = {"I1": 1.0, "I2": [2.0, 2.5], "I3": [3.0, 3.2], "omega0": 1.0}
FEW = {"grid": GRID, "axes": [2], "integration": {"variables": ["omega_squared", "regime"]}}  # soon drawn
ENTRIES = f"""
import kernels, sweeps
from sweeps.__main__ import main
main([]); main(['check', 'tiny']); main(['check', 'nowhere.yaml']); main(['body', '--moments', '1', '2', '2.5'])
ds = sweeps.survey({{"grid": {GRID!r}}})
from kernels.free import exact, linear; from kernels.near_axis import survey; exact.rotation
import sweeps.accessor
ds.to_netcdf('map.nc'); sweeps.open_map('map.nc').close()
sweeps.plot.stability(ds, axis=2)
sweeps.tumbler(10.0, 12.0)
open('few.json', 'w').write({json.dumps(FEW)!r})
main(['show', 'map.nc']); main(['run', 'few.json'])
"""


def states_of_process(code, folder):
    """Return the states of a fresh process with all dependencies of Polhode, before and after some code."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "MPLCONFIGDIR": str(folder)}
    environment.pop("PYTEST_CURRENT_TEST", None)
    command = [sys.executable, "-c", IMPORTS + SEEN + code + "\n" + SEEN]
    process = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert process.returncode == 0, process.stderr
    output = re.sub(r"0x[0-9a-f]+", "ADDRESS", process.stdout)
    return [json.loads(line.removeprefix("SEEN")) for line in output.splitlines() if line.startswith("SEEN")]


def difference(before, after):
    """Return the items that disappeared and those that appeared."""
    if isinstance(before, dict):
        before, after = ([f"{name}={value}" for name, value in of.items()] for of in (before, after))
    return [str(item) for item in before if item not in after], [str(item) for item in after if item not in before]


@pytest.mark.slow
def test_nothing_is_left_in_the_process(tmp_path):
    before, after = states_of_process(ENTRIES, tmp_path)
    changes = {name: difference(before[name], value) for name, value in after.items() if value != before[name]}
    assert changes == {}
