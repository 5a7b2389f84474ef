"""Ratios of speeds over time: what a change has made slower, told in red, whatever the machine.

    python tests/benchmarks/history.py [--file results/benchmarks/history.jsonl] [--points 20000]

Each ratio is of processor times within one round, everybody in turn, medians of rounds; greater is better. A line of
JSON (time, processor, fingerprint of the kernels, ratios) is added to the file; what is more than 15 % below the median
of the last five lines of this processor is printed in red. Nothing is asserted. To plot it:
``pandas.json_normalize([json.loads(line) for line in open(file)]).plot(x="time")``.
"""

import argparse
import datetime
import json
import statistics
import sys
import time
from pathlib import Path

import numpy as np

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[2])]

import attitude  # noqa: E402
import roof  # noqa: E402
from kernel import BARE, part_of_default  # noqa: E402

import sweeps  # noqa: E402
from kernels import survey  # noqa: E402
from kernels.fingerprint import fingerprint  # noqa: E402

FILE = Path("results/benchmarks/history.jsonl")
DROP, BEFORE = 0.15, 5
RED, PLAIN = "\033[31m", "\033[0m"
RATIOS = {  # what is better the more of the first fits into the second's time
    "kernel over the roof of multiply-adds": ("roof", "rates alone"),
    "all columns over rates alone": ("rates alone", "all columns"),
    "direct over exact": ("exact", "rates alone"),
    "attitude over exact step": ("exact steps", "attitude steps"),
    "pipeline over kernel": ("all columns", "pipeline"),
}


def runs(count):
    """Name → what is timed, of about so many points of the default sweep."""
    settings, points = part_of_default(count)
    size = max(2, round((count / 24) ** 0.5))
    grid = {"I1": {"start": 0.0008, "stop": 0.002, "num": size}, "I2": {"start": 0.012, "stop": 0.02, "num": size}}
    whole = {"grid": grid | {"I3": 0.0175, "omega0": np.linspace(1, 10, 8).tolist()}}
    chains = np.linspace(0.5, 1.5, roof.CHAINS * roof.LANES).reshape(roof.CHAINS, roof.LANES)
    lanes, steps = attitude.prepared(), max(20, count // 10)
    return {
        "roof": lambda: [roof.multiply_adds(chains, 0.999, 0.001) for _ in range(max(1, count // 2000))],
        "rates alone": lambda: survey.measured(points, *settings, wanted=BARE),
        "all columns": lambda: survey.measured(points, *settings),
        "exact": lambda: survey.measured(points, *settings, propagator="exact", wanted=BARE),
        "exact steps": lambda: attitude.step_rates(lanes, steps),
        "attitude steps": lambda: attitude.step_attitudes(lanes, steps),
        "pipeline": lambda: sweeps.survey(whole),
    }


def measured(count, rounds):
    """Name of each ratio → its median over rounds."""
    timed, found = runs(count), []
    for run in timed.values():
        run()
    for _ in range(rounds):
        times = {}
        for name, run in timed.items():
            begun = time.process_time()
            run()
            times[name] = time.process_time() - begun
        found.append({name: times[above] / times[below] for name, (above, below) in RATIOS.items()})
    return {name: statistics.median(each[name] for each in found) for name in RATIOS}


def processor():
    """The processor's name, as Linux and LLVM have it."""
    import llvmlite.binding as llvm

    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.exists() else []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return f"{names[0] if names else 'unknown'} ({llvm.get_host_cpu_name()})"


def earlier(file, name):
    """The last lines of one processor."""
    if not file.exists():
        return []
    lines = [json.loads(line) for line in file.read_text().splitlines() if line.strip()]
    return [line["ratios"] for line in lines if line["processor"] == name][-BEFORE:]


def told(ratios, before):
    """A line for each ratio, red where it has dropped."""
    for name, value in ratios.items():
        known = [each[name] for each in before if name in each]
        text = f"{name:40s} {value:8.3f}"
        if known:
            change = value / statistics.median(known) - 1.0
            text += f"   {100 * change:+.0f} %"
            text = f"{RED}{text}: slower than before{PLAIN}" if change < -DROP else text
        yield text


def main(arguments=None):
    """Measure, tell, and add a line to the file."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--file", type=Path, default=FILE, help="where lines are kept")
    parser.add_argument("--points", type=int, default=20_000)
    parser.add_argument("--rounds", type=int, default=7)
    given = parser.parse_args(arguments)
    name, ratios = processor(), measured(given.points, given.rounds)
    print("\n".join(told(ratios, earlier(given.file, name))))
    now = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
    line = {"time": now, "processor": name, "kernels": fingerprint()[:16], "ratios": ratios}
    given.file.parent.mkdir(parents=True, exist_ok=True)
    with given.file.open("a", encoding="utf-8") as lines:
        lines.write(json.dumps(line) + "\n")


if __name__ == "__main__":
    main()
