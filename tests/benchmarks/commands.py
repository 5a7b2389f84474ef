"""What a person waits for each command of a map, beside what it cannot do without.

    python tests/benchmarks/commands.py MAP [ROUNDS]

Seconds of the processor (user and system, children included), which others at work on the machine change less than
the wall clock, medians of fresh processes, everything warm, byte code kept as a person's Python keeps it. The floors
are what the libraries below a command take to load, by themselves and together, loaded as commands load them, in
processes that end as theirs do (`sweeps.lean`), and what Numba takes until its first kernel answers from the cache on
the disk. The last column is what a command takes above its own floor.
"""

import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time

KERNEL = "from kernels import exact; exact.flip_period(1.0, 2.0, 3.0, 1e-6, 1.0, 1e-6)"
DRAWN = (
    "from matplotlib.figure import Figure; f = Figure(layout='constrained'); f.subplots(2, 2); "
    "f.savefig({out!r} + '.png')"
)
LEAN = "from sweeps import lean; lean.leave_out(alone=True); {code}; lean.end_at_once()"
MODEL = "import pydantic; type('Model', (pydantic.BaseModel,), dict())"  # the first model loads most of it
DEFINITION = "NumPy, pydantic, YAML: any definition"
MAP = "NumPy, h5py, Rich: any map"
FLOORS = {
    "Python and `sweeps.lean`": "pass",
    "NumPy": "import numpy",
    "pydantic, and a model": MODEL,
    "YAML": "import ruamel.yaml",
    DEFINITION: f"import numpy, ruamel.yaml; {MODEL}",
    MAP: "import numpy, h5py, rich.console, rich.table",
    "NumPy, h5py, netCDF4": "import numpy, h5py, netCDF4",
    "Numba": "import numba",
    "Numba, and a kernel from the disk": KERNEL,
    "xarray": "import xarray",
    "Matplotlib, and four empty axes": DRAWN,
}
BENEATH = {
    "check": DEFINITION,
    "show": MAP,
    "slice": "NumPy, h5py, netCDF4",
    "body": DEFINITION,
    "figures": "Matplotlib, and four empty axes",
    "report": MAP,
}
KEPT = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
COMMANDS = {
    "run of what is finished": ["run"],
    "check": ["check"],
    "show": ["show", "{map}"],
    "slice": ["slice", "{map}", "--axis", "2", "--I3", "0.01748", "--omega0", "10", "-o", "{out}.nc"],
    "body": ["body", "--ratios", "5", "10", "13", "--omega0", "10"],
    "figures": ["figures", "{map}", "-o", "{out}"],
    "report": ["report", "{map}", "-o", "{out}.html"],
}


def took(words: list[str]) -> tuple[float, float]:
    """Wall clock and processor time of one process, s."""
    before, begun = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run(words, capture_output=True, check=True, env=KEPT)
    wall, after = time.perf_counter() - begun, resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main(path: str, rounds: int = 5) -> None:
    """Prints a line a floor and a command."""
    with tempfile.TemporaryDirectory() as out:
        rows = {name: [sys.executable, "-c", LEAN.format(code=code.format(out=out))] for name, code in FLOORS.items()}
        for name, words in COMMANDS.items():
            rows[name] = [sys.executable, "-m", "sweeps", *(word.format(map=path, out=f"{out}/made") for word in words)]
        print(f"{'':40s} {'cpu, s':>8s} {'wall, s':>8s} {'above its floor':>16s}")
        found = {}
        for name, words in rows.items():
            took(words)
            walls, cpus = zip(*(took(words) for _ in range(rounds)), strict=True)
            found[name] = statistics.median(cpus)
            above = f"{found[name] - found[BENEATH[name]]:16.2f}" if name in BENEATH else ""
            print(f"{name:40s} {found[name]:8.2f} {statistics.median(walls):8.2f} {above}".rstrip(), flush=True)


if __name__ == "__main__":
    main(sys.argv[1], *map(int, sys.argv[2:]))
