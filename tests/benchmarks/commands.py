"""What a person waits for each command of a map, beside what it cannot do without.

    python tests/benchmarks/commands.py MAP [ROUNDS]

Seconds of the processor (user and system, children included), which others at work on the machine change less than
the wall clock, medians of fresh processes, everything warm, byte code kept as a person's Python keeps it. The floors
are what the libraries below a command take to load, by themselves and together, loaded as commands load them, in
processes set up as theirs are, and what Numba takes until its first kernel answers from the cache on
the disk. That of `figures` is its libraries, and all of its pictures drawn by Matplotlib and written once more: as they
stand, laid out and measured, of the animation the file alone; by the wall, the drawing is halved between two processes.
The last column is what a command takes above its own floor.
"""

import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time

KERNEL = "from kernels import exact; exact.flip_period(exact.set_up(1.0, 2.0, 3.0, 1e-6, 1.0, 1e-6))"
DRAWING = """\
import sys, time
from pathlib import Path
import numpy as np
from PIL import Image
from sweeps.views import figures, films

at, spent = Path(sys.argv[2] + ".one"), 0.0
with figures.opened(sys.argv[1]) as ds, np.errstate(all="ignore"):
    for draw in figures.pictures(ds).values():
        if figure := draw():
            figures.save(figure, at, "png")
            figure.set_layout_engine("none")
            begun = time.process_time()
            figure.canvas.draw()
            Image.fromarray(np.asarray(figure.canvas.buffer_rgba())).save(at, format="PNG")
            spent += time.process_time() - begun
    for frames in figures.animations(ds).values():
        pictures = list(frames())
        begun = time.process_time()
        films.write(pictures, at.with_suffix(".gif"))
        spent += time.process_time() - begun
print(spent)
"""
OWN = "from sweeps.process import startup; startup.configure(); {code}"
MODEL = "import pydantic; type('Model', (pydantic.BaseModel,), dict())"  # the first model loads most of it
DEFINITION = "NumPy, pydantic, YAML: any definition"
LIBRARIES, BARE = "Matplotlib, h5py, Pillow: any picture", "figures, drawn bare"
MAP = "NumPy, h5py, Rich: any map"
FLOORS = {
    "Python and `sweeps.process.startup`": "pass",
    "NumPy": "import numpy",
    "pydantic, and a model": MODEL,
    "YAML": "import ruamel.yaml",
    DEFINITION: f"import numpy, ruamel.yaml; {MODEL}",
    MAP: "import numpy, h5py, rich.console, rich.table",
    "NumPy, h5py, netCDF4": "import numpy, h5py, netCDF4",
    "Numba": "import numba",
    "Numba, and a kernel from the disk": KERNEL,
    "xarray": "import xarray",
    LIBRARIES: "from matplotlib.figure import Figure; import h5py, PIL.GifImagePlugin",
}
BENEATH = {
    "check": DEFINITION,
    "show": MAP,
    "slice": "NumPy, h5py, netCDF4",
    "body": DEFINITION,
    "figures": BARE,
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


def drawn_bare(path: str, at: str) -> float:
    """Processor time of drawing the pictures of a map alone, s, in a process of its own."""
    words = [sys.executable, "-c", OWN.format(code=f"exec({DRAWING!r})"), path, at]
    return float(subprocess.run(words, capture_output=True, check=True, env=KEPT, text=True).stdout)


def main(path: str, rounds: int = 5) -> None:
    """Prints a line a floor and a command."""
    with tempfile.TemporaryDirectory() as out:
        rows = {name: [sys.executable, "-c", OWN.format(code=code.format(out=out))] for name, code in FLOORS.items()}
        for name, words in COMMANDS.items():
            rows[name] = [sys.executable, "-m", "sweeps", *(word.format(map=path, out=f"{out}/made") for word in words)]
        print(f"{'':40s} {'cpu, s':>8s} {'wall, s':>8s} {'above its floor':>16s}")
        found = {}

        def tell(name, wall, cpu):
            found[name] = cpu
            above = f"{cpu - found[BENEATH[name]]:16.2f}" if name in BENEATH else ""
            print(f"{name:40s} {cpu:8.2f} {wall:8.2f} {above}".rstrip(), flush=True)

        for name, words in rows.items():
            took(words)
            walls, cpus = zip(*(took(words) for _ in range(rounds)), strict=True)
            tell(name, statistics.median(walls), statistics.median(cpus))
            if name == LIBRARIES:
                bare = statistics.median(drawn_bare(path, f"{out}/bare") for _ in range(rounds))
                tell(BARE, statistics.median(walls) + bare / 2, found[name] + bare)


if __name__ == "__main__":
    main(sys.argv[1], *map(int, sys.argv[2:]))
