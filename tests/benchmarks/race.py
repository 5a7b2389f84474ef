"""The race: one task for Polhode and its peers, error against trajectories per second.

    python tests/benchmarks/race.py [--quick]

Everybody measures the signed rate² of the same nudged bodies from the same samples (bodies.py), each in its best mode
(contenders.py). Errors are of the samples, against the closed form in mpmath at 30 digits. Every round times everybody
once, at every accuracy, side by side; ratios are taken within a round, and their medians printed. Processor time is
printed with wall time, as it depends less on other work on the machine. Tables and figure go to results/benchmarks/.
"""

import argparse
import math
import os
import platform
import statistics
import time
from dataclasses import dataclass, field
from itertools import chain, product
from pathlib import Path

import bodies as task
import contenders
import numba
import numpy as np

from sweeps.process import machine

OUT = Path(__file__).resolve().parents[2] / "results" / "benchmarks"
ERROR = 1e-10  # error of the samples, relative to the perturbation, for which speeds are compared
SIZES = {  # rounds, share of each contender's bodies, bodies compared with the exact solution
    "full": (7, 1.0, 32),
    "quick": (5, 0.25, 12),
    "tiny": (2, 0.002, 3),
}


@dataclass
class Entry:
    """One contender at one setting: its errors, and its speeds round by round."""

    contender: contenders.Contender
    setting: float
    bodies: task.Bodies
    error: float  # worst error of the samples
    rate_error: float
    walls: list = field(default_factory=list)  # trajectories per second of each round
    busy: list = field(default_factory=list)  # trajectories per second of processor time of each round


def entrants(threads):
    """Return the available contenders, and the reasons why the missing ones are not."""
    present, absent = [], {}
    for kind in contenders.ALL:
        try:
            present.append(kind(threads))
        except Exception as reason:  # a peer may fail to load in many ways, and each is a row
            absent[kind.name] = f"{type(reason).__name__}: {reason}".splitlines()[0]
    return present, absent


def subset(bodies, contender, share):
    """Evenly spaced bodies, as many as suit the contender's speed."""
    count = max(round(contender.size * share), 4)
    count = max(contender.chunk, count // contender.chunk * contender.chunk)
    return bodies[np.linspace(0, len(bodies) - 1, count).astype(int)]


def judge_entry(contender, setting, bodies, sample, expected):
    """Return an entry with its errors, after a first call of the rates, which compiles."""
    contender.rates(bodies, setting)
    bodies_of_chunk = sample[np.arange(max(contender.chunk, len(sample))) % len(sample)]
    rates = contender.rates(bodies_of_chunk, setting)[0][: len(sample), 0]
    rate_error = np.abs(rates - [task.rate_of(x[:, 0], x[:, 1])[0] for x in expected]).max()
    error = task.errors(contender.samples(sample, setting), expected).max()
    print(f"{contender.name}, {setting:g}: error {error:.1e}", flush=True)
    return Entry(contender, setting, bodies, float(error), float(rate_error))


def time_round(entry):
    """Add the speeds of one round, the processor time of a contender's own processes included."""
    wall, processor = time.perf_counter(), time.process_time()
    _, elsewhere = entry.contender.rates(entry.bodies, entry.setting)
    entry.busy.append(len(entry.bodies) / (time.process_time() - processor + elsewhere))
    entry.walls.append(len(entry.bodies) / (time.perf_counter() - wall))


def run_race(size, threads):
    """Return contender → entries, the missing contenders, and the conditions."""
    rounds, share, judges = SIZES[size]
    bodies = task.draw(max(round(contenders.Direct.size * share), 256))
    sample = bodies[np.linspace(0, len(bodies) - 1, judges).astype(int)]
    expected = task.truth(sample)
    present, absent = entrants(threads)
    entries = {}
    for contender in present:
        selection = subset(bodies, contender, share)
        entries[contender.name] = [judge_entry(contender, x, selection, sample, expected) for x in contender.settings]
    loads = [os.getloadavg()[0]]
    for _ in range(rounds):
        # entries of similar errors are neighbours
        for entry in sorted(chain(*entries.values()), key=lambda entry: -max(entry.error, 1e-16)):
            time_round(entry)
        loads.append(os.getloadavg()[0])
    for contender in present:
        contender.close()
    about = (
        f"{processor_name()}, {machine.num_processors()} cores, {threads} threads; medians of {rounds} rounds; load "
    )
    return entries, absent, f"{about}average {min(loads):.1f} to {max(loads):.1f}"


def processor_name():
    """Return the processor's name."""
    if Path("/proc/cpuinfo").exists():
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), platform.machine())
    return platform.processor() or platform.machine()


def speed_at(entries, error, speeds):
    """Speed of one contender at an error: between its settings in log-log, the fastest if all are better.

    NaN where none is good enough. Only settings count that no setting beats in both error and speed.
    """
    front = []
    for entry_error, speed in sorted(zip((e.error for e in entries), speeds, strict=True)):
        if not front or speed > front[-1][1]:
            front.append((max(entry_error, 1e-17), speed))
    if front[0][0] > error:
        return math.nan
    logs = np.log(np.array(front))
    return float(np.exp(np.interp(math.log(error), logs[:, 0], logs[:, 1])))


def ratios(entries):
    """Return "Polhode / peer" → medians over the rounds of the ratios at equal error, by the wall and by processor."""
    speeds = {}
    for name, of_name in entries.items():
        for clock in ("walls", "busy"):
            by_round = zip(*(getattr(entry, clock) for entry in of_name), strict=True)
            speeds[name, clock] = np.array([speed_at(of_name, ERROR, speeds_of_round) for speeds_of_round in by_round])
    pairs = [
        pair for pair in product(entries, repeat=2) if [name.startswith("Polhode") for name in pair] == [True, False]
    ]
    return {
        f"{ours} / {peer}": [float(np.median(speeds[ours, c] / speeds[peer, c])) for c in ("walls", "busy")]
        for ours, peer in pairs
    }


def report(entries, absent, about):
    """Return the tables as Markdown."""
    lines = [
        f"{about}.",
        "",
        "| contender | setting | threads | worst error | rate² off by | trajectories/s | per s of processor |",
        "|---|---|---|---|---|---|---|",
    ]
    for name, of_name in entries.items():
        for e in of_name:
            speeds = f"{statistics.median(e.walls):,.0f} | {statistics.median(e.busy):,.0f}"
            errors = f"{e.error:.1e} | {e.rate_error:.1e}"
            lines.append(f"| {name} | {e.setting:.3g} | {e.contender.threads} | {errors} | {speeds} |")
    lines += [f"| {name} | – | – | – | not here: {why} | – | – |" for name, why in absent.items()]
    lines += ["", f"| ratio at an error of {ERROR:.0e} | by the wall | by processor time |", "|---|---|---|"]
    lines += [f"| {name} | {wall:.3g} | {busy:.3g} |" for name, (wall, busy) in ratios(entries).items()]
    lines += ["", "| contender | version | mode |", "|---|---|---|"]
    first = [of_name[0].contender for of_name in entries.values()]
    return "\n".join([*lines, *(f"| {c.name} | {c.version()} | {c.mode} |" for c in first)]) + "\n"


def draw_figure(entries, about, path):
    """Draw work and precision: error against trajectories per second."""
    import matplotlib as mpl

    from sweeps.figure import canvas, colors, marks, sheets

    subtitle = f"signed rate² from {task.SAMPLES} samples up to ω₀t = {task.END:g}; {about}"
    with mpl.rc_context(sheets.STYLE):
        figure = canvas.make_figure(7.2, 4.6, "The same task for everybody", subtitle)
        axes = figure.add_subplot()
        for i, (name, of_name) in enumerate(entries.items()):
            style = {
                "marker": marks.SERIES_MARKERS[i % len(marks.SERIES_MARKERS)],
                "color": colors.SERIES_COLORS[i % len(colors.SERIES_COLORS)],
                "linestyle": "-" if i < len(colors.SERIES_COLORS) else "--",
            }
            x, y = [statistics.median(e.walls) for e in of_name], [e.error for e in of_name]
            axes.plot(x, y, markersize=4, linewidth=1.1, label=name, **style)
        axes.axhline(ERROR, color=colors.FAINT, linewidth=0.8, zorder=0)
        axes.set(xscale="log", yscale="log", xlabel="trajectories per second", ylabel="worst error of the perturbation")
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
        figure.savefig(path)


def main():
    """Run the race, print and write its tables and its figure."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.set_defaults(size="full")
    for size, words in (("quick", "fewer bodies"), ("tiny", "next to none: a test of the race")):
        parser.add_argument(f"--{size}", dest="size", action="store_const", const=size, help=words)
    threads = machine.num_processors()
    parser.add_argument("--threads", type=int, default=threads, help="threads for everybody (all cores)")
    parser.add_argument("--out", type=Path, default=OUT, help="folder for race.md and race.png")
    options = parser.parse_args()
    numba.set_num_threads(options.threads)
    entries, absent, about = run_race(options.size, options.threads)
    tables = report(entries, absent, about)
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "race.md").write_text(tables, encoding="utf-8")
    draw_figure(entries, about, options.out / "race.png")
    print("\n" + tables)


if __name__ == "__main__":
    main()
