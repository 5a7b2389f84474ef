"""How long a person waits for each sweep that ships, beside what `check` says.

    python tests/benchmarks/waiting.py [NAME …]

Wall clock of `run` on one core, from typing to the report, in a folder of its own, and the processor's time, which
others at work on the machine change less: side by side they share caches. What a sweep calls is compiled beforehand.
"""

import json
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
    """Prints a line a sweep."""
    print(f"{'sweep':20s} {'said, s':>8s} {'wall, s':>8s} {'cpu, s':>8s} {'said/cpu':>8s}")
    for name in names or asked("check", "--list"):
        subprocess.run([*POLHODE, "compile", name], capture_output=True, check=True)
        said = asked("check", name)["wait_seconds"]
        wall, cpu = waited(name)
        print(f"{name:20s} {said:8.1f} {wall:8.1f} {cpu:8.1f} {said / cpu:8.2f}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
