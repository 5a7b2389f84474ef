"""The race: one task for Polhode and its peers, error against trajectories per second.

    python tests/benchmarks/race.py [--quick]

Everybody measures the signed rate² of the same nudged bodies from the same samples (bodies.py), each in its best mode
(contenders.py). Errors are of the samples, against the closed form in mpmath at 30 digits. Every round times everybody
once, at every accuracy, side by side; ratios are taken within a round, and their medians printed. Processor time is
printed with wall time, as it depends less on other work on the machine. Tables and figure go to results/benchmarks/.
Compile times are those of a first call; the kernels' own is 0 if they are in the cache (NUMBA_CACHE_DIR empties it).
"""

import argparse
import json
import math
import os
import platform
import statistics
import time
from dataclasses import asdict, dataclass, field
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
    """One contender at one setting: its measurements, round by round."""

    name: str
    setting: float
    threads: int
    count: int
    alone: bool = False  # on one thread only to be set against all of them
    error: float = math.nan
    median_error: float = math.nan
    rate_error: float = math.nan
    compile_seconds: float = math.nan
    wall: list = field(default_factory=list)
    processor: list = field(default_factory=list)

    @property
    def speed(self):
        """Trajectories per second of each round."""
        return [self.count / seconds for seconds in self.wall]

    @property
    def thrift(self):
        """Trajectories per second of processor time of each round."""
        return [self.count / seconds for seconds in self.processor]


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


def judge_entry(contender, setting, alone, bodies, sample, expected):
    """An entry with its errors; the first call's time beyond the second's is the time of compiling."""
    entry = Entry(contender.name, setting, contender.threads, len(bodies), alone)
    begin = time.perf_counter()
    contender.rates(bodies, setting)
    first = time.perf_counter() - begin
    samples = contender.samples(sample, setting)
    errors = task.errors(samples, expected)
    entry.error, entry.median_error = float(errors.max()), float(np.median(errors))
    bodies_of_chunk = sample[np.arange(max(contender.chunk, len(sample))) % len(sample)]
    rates = contender.rates(bodies_of_chunk, setting)[0][: len(sample), 0]
    true_rates = [task.rate_of(x[:, 0], x[:, 1])[0] for x in expected]
    entry.rate_error = float(np.abs(rates - true_rates).max())
    begin = time.perf_counter()
    contender.rates(bodies, setting)
    entry.compile_seconds = max(first - (time.perf_counter() - begin), 0.0)
    return entry


def time_call(call):
    """Wall time and processor time of a call, the latter with the call's reported time in other processes."""
    wall, processor = time.perf_counter(), time.process_time()
    elsewhere = call()
    return time.perf_counter() - wall, time.process_time() - processor + (elsewhere or 0.0)


def run_race(size, threads):
    """All that is measured, as one mapping."""
    rounds, share, judges = SIZES[size]
    bodies = task.draw(max(round(contenders.Direct.size * share), 256))
    sample = bodies[np.linspace(0, len(bodies) - 1, judges).astype(int)]
    expected = task.truth(sample)
    present, absent = entrants(threads)
    alone = [kind(1) for kind in (contenders.Direct, contenders.Exact)] if threads > 1 else []
    lanes = []
    for contender in present + alone:
        lane_bodies = subset(bodies, contender, share)
        middle = contender.settings[len(contender.settings) // 2]
        for setting in (middle,) if contender in alone else contender.settings:
            lanes.append(
                (
                    contender,
                    lane_bodies,
                    judge_entry(contender, setting, contender in alone, lane_bodies, sample, expected),
                )
            )
            print(f"{contender.name}, {setting:g}: error {lanes[-1][2].error:.1e}", flush=True)
    loads = run_rounds(rounds, lanes)
    for contender in present + alone:
        contender.close()
    entries = [entry for _, _, entry in lanes]
    return {
        "machine": conditions(threads) | {"load_average": loads, "rounds": rounds, "bodies_judged": judges},
        "versions": {contender.name: contender.version() for contender in present},
        "modes": {contender.name: contender.mode for contender in present},
        "absent": absent,
        "entries": entries,
    }


def run_rounds(rounds, lanes):
    """Time everybody in every round; return the load averages."""
    loads = [os.getloadavg()[0]]
    for _ in range(rounds):
        # entries of similar errors are neighbours
        for contender, lane_bodies, entry in sorted(lanes, key=lambda lane: -max(lane[2].error, 1e-16)):
            wall, processor = time_call(lambda c=contender, p=lane_bodies, e=entry: c.rates(p, e.setting)[1])
            entry.wall.append(wall)
            entry.processor.append(processor)
        loads.append(os.getloadavg()[0])
    return loads


def conditions(threads):
    """Return the conditions of the figures."""
    model = platform.processor() or platform.machine()
    if Path("/proc/cpuinfo").exists():
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        model = next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), model)
    return {
        "processor": model,
        "cores": machine.num_processors(),
        "threads": threads,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "system": f"{platform.system()} {platform.machine()}",
    }


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


def of_contender(result, name):
    """The entries that race under a name."""
    return [entry for entry in result["entries"] if entry.name == name and not entry.alone]


def equal_error(result, error=ERROR):
    """By contender: speeds at equal error, round by round, by the wall and by processor time."""
    speeds_by_name = {}
    for name in result["versions"]:
        entries = of_contender(result, name)
        rounds = range(len(entries[0].wall))
        speeds_by_name[name] = {
            "wall": [speed_at(entries, error, [e.speed[i] for e in entries]) for i in rounds],
            "processor": [speed_at(entries, error, [e.thrift[i] for e in entries]) for i in rounds],
        }
    return speeds_by_name


def median_ratio(above, below):
    """Median over the rounds of the ratio within each."""
    return statistics.median(a / b for a, b in zip(above, below, strict=True))


def ratios(result):
    """The race's figures: {what: (by the wall, by processor time)}."""
    speeds = equal_error(result)
    peers = [name for name in speeds if not name.startswith("Polhode")]
    peers = [name for name in peers if not math.isnan(speeds[name]["wall"][0])]
    figures = {}
    if peers:
        threads = {name: of_contender(result, name)[0].threads for name in peers}
        best = max(peers, key=lambda name: statistics.median(speeds[name]["processor"]) * threads[name])
        for ours in ("Polhode direct", "Polhode exact"):
            for name in dict.fromkeys([best, *peers]):
                label = f"{ours} / {name}" + (" (the best peer)" if name == best else "")
                figures[label] = tuple(median_ratio(speeds[ours][k], speeds[name][k]) for k in ("wall", "processor"))
    for entry_alone in (entry for entry in result["entries"] if entry.alone):
        all_of_them = next(e for e in of_contender(result, entry_alone.name) if e.setting == entry_alone.setting)
        figures[f"{entry_alone.name}, {all_of_them.threads} threads / 1"] = (
            median_ratio(all_of_them.speed, entry_alone.speed),
            math.nan,
        )
    return figures


def report(result):
    """The tables as Markdown."""
    about = result["machine"]
    loads = about["load_average"]
    lines = [
        f"{about['processor']}, {about['cores']} cores, {about['threads']} threads; Python {about['python']}, NumPy "
        f"{about['numpy']}; medians of {about['rounds']} rounds, load average {min(loads):.1f} to {max(loads):.1f}.",
        "",
        "| contender | setting | threads | worst error | median error | rate² off by | trajectories/s "
        "| per s of processor | compile, s |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for e in result["entries"]:
        lines.append(
            f"| {e.name} | {e.setting:.3g} | {e.threads} | {e.error:.1e} | {e.median_error:.1e} | {e.rate_error:.1e} | "
            f"{statistics.median(e.speed):,.0f} | {statistics.median(e.thrift):,.0f} | {e.compile_seconds:.1f} |"
        )
    lines += [f"| {name} | – | – | – | – | – | not here: {why} | – | – |" for name, why in result["absent"].items()]
    lines += ["", f"| ratio (peers: at an error of {ERROR:.0e}) | by the wall | by processor time |", "|---|---|---|"]
    lines += [f"| {name} | {wall:.3g} | {processor:.3g} |" for name, (wall, processor) in ratios(result).items()]
    lines += ["", "| contender | version | mode |", "|---|---|---|"]
    lines += [f"| {name} | {version} | {result['modes'][name]} |" for name, version in result["versions"].items()]
    return "\n".join(lines) + "\n"


def draw_figure(result, path):
    """Work and precision: error against trajectories per second."""
    import matplotlib as mpl

    from sweeps.figure import canvas, colors, marks, sheets

    about = result["machine"]
    subtitle = (
        f"signed rate² from {task.SAMPLES} samples up to ω₀t = {task.END:g}; {about['processor']}, {about['threads']} "
        f"threads; medians of {about['rounds']} rounds; load average {max(about['load_average']):.0f}"
    )
    with mpl.rc_context(sheets.STYLE):
        figure = canvas.make_figure(7.2, 4.6, "The same task for everybody", subtitle)
        axes = figure.add_subplot()
        for i, name in enumerate(result["versions"]):
            entries = of_contender(result, name)
            marker = marks.SERIES_MARKERS[i % len(marks.SERIES_MARKERS)]
            color = colors.SERIES_COLORS[i % len(colors.SERIES_COLORS)]
            dashes = "-" if i < len(colors.SERIES_COLORS) else "--"
            x, y = [statistics.median(e.speed) for e in entries], [e.error for e in entries]
            axes.plot(x, y, marker=marker, color=color, linestyle=dashes, markersize=4, linewidth=1.1, label=name)
        axes.axhline(ERROR, color=colors.FAINT, linewidth=0.8, zorder=0)
        axes.set(xscale="log", yscale="log", xlabel="trajectories per second", ylabel="worst error of the perturbation")
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
        figure.savefig(path)


def write(result, out):
    """Table, raw figures and picture."""
    out.mkdir(parents=True, exist_ok=True)
    (out / "race.md").write_text(report(result), encoding="utf-8")
    raw = result | {"entries": [asdict(e) for e in result["entries"]]}
    raw["ratios"] = ratios(result)
    (out / "race.json").write_text(json.dumps(raw, indent=1), encoding="utf-8")
    draw_figure(result, out / "race.png")


def main():
    """Run the race, print and write its results."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.set_defaults(size="full")
    parser.add_argument("--quick", dest="size", action="store_const", const="quick", help="fewer bodies")
    parser.add_argument(
        "--tiny", dest="size", action="store_const", const="tiny", help="next to none: a test of the race"
    )
    parser.add_argument(
        "--threads", type=int, default=machine.num_processors(), help="threads for everybody (all cores)"
    )
    parser.add_argument("--out", type=Path, default=OUT, help="folder for race.md, race.json and race.png")
    options = parser.parse_args()
    numba.set_num_threads(options.threads)
    result = run_race(options.size, options.threads)
    write(result, options.out)
    print("\n" + report(result))


if __name__ == "__main__":
    main()
