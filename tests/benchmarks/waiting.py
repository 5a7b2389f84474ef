"""How long a person waits for each sweep that ships, beside what `check` says.

    python tests/benchmarks/waiting.py [NAME …]

Each sweep is run twice, from typing to the report, on one core and in a folder of its own: first with a cache that
holds what the sweeps before it have compiled (nothing, before the first), then warm. What is compared is the
processor's time, which others at work on the machine change less than the wall clock. Pin it to one core (`taskset`),
for where there are two, two processes compile.
"""

import json
import os
import resource
import subprocess
import sys
import tempfile
import time

POLHODE = [sys.executable, "-m", "sweeps"]


def asked(*words: str) -> dict:
    """What a command prints as JSON."""
    return json.loads(subprocess.run([*POLHODE, *words, "--json"], capture_output=True, check=True).stdout)


def waited(name: str) -> tuple[float, float]:
    """Wall clock and processor time of one run, s."""
    with tempfile.TemporaryDirectory() as folder:
        before, begun = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
        subprocess.run([*POLHODE, "run", name, "--cores", "1"], cwd=folder, capture_output=True, check=True)
        wall, after = time.perf_counter() - begun, resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main(names: list[str]) -> None:
    """Prints a line a run."""
    print(f"{'sweep':25s} {'':6s} {'said, s':>8s} {'wall, s':>8s} {'cpu, s':>8s} {'said/cpu':>8s} {'compiling':>10s}")
    with tempfile.TemporaryDirectory() as cache:
        os.environ["XDG_CACHE_HOME"] = cache
        for name in names or asked("check", "--list"):
            for when in ("first", "again"):
                needs = asked("check", name)
                wall, cpu = waited(name)
                figures = f"{needs['wait_seconds']:8.1f} {wall:8.1f} {cpu:8.1f} {needs['wait_seconds'] / cpu:8.2f}"
                print(f"{name:25s} {when:6s} {figures} {needs['compile_seconds']:10.1f}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
