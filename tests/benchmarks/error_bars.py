"""Table of the error bars' coverage and sharpness and of marginal points, cell by cell.

    python tests/benchmarks/error_bars.py [--bodies 1000] [--points 300] [--definitions 2000] [--out results/benchmarks]
    python tests/benchmarks/error_bars.py --only-definitions     (or --only twist)
    python tests/benchmarks/error_bars.py --only-described

Random bodies that can exist (second moments of mass uniform in 0.05-1), bodies with two moments 1e-1 to 1e-9 apart,
needles and plates (two of three lengths as small as 1e-8), about each axis, with the nudge in two directions, at each
decade of its size; the default sweep; so many random places of each system of small oscillations that ships, mode by
mode; the symmetric top. A cell is judged against linear theory, and the top's against the closed form:

* cover: share of points with a deviation within the error; worst: largest deviation over error;
* sharp: median of error over deviation, over deviations above 1e-14 of the value (of small oscillations: of the
  rate scale's square, for a free mode has the value 0); a dash without such points.

Then random definitions of bodies, each parameter drawn over its whole allowed range, with random points: every column
that has an error, against theory in many digits: random_motions.py. Last, the same of each described system that ships:
error_bars_described.py.
"""

import argparse
import sys
from itertools import chain
from pathlib import Path
from typing import NamedTuple

import numpy as np

sys.path[:0] = [str(Path(__file__).parents[k]) for k in (1, 2)]

import described  # noqa: E402
import error_bars_described  # noqa: E402
import oscillators  # noqa: E402
import random_motions  # noqa: E402

from kernels.events import symmetric_top  # noqa: E402
from kernels.flow.oscillations import MARGINAL  # noqa: E402
from kernels.free import linear  # noqa: E402
from kernels.near_axis import survey  # noqa: E402

SETTINGS = (4.0, 16, 1e-10)
DECADES = (1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 0.3)
TOPS = (100.0, 10.0, 0.9, *(10.0**-k for k in range(1, 10)))  # ends of a range from 0.3 of it
GAPS = tuple(10.0**-k for k in range(1, 10))
PHASES = (0.6, 2.1)
DEFAULT = "default sweep"
SEEN = 1e-14  # relative deviation that is more than the rounding of the theory itself


class Cell(NamedTuple):
    """One cell of the table: number of points, and the quality of their errors."""

    points: int
    cover: float
    worst: float
    sharp: float

    def __str__(self):
        sharp = f"{self.sharp:.1f}" if np.isfinite(self.sharp) else "–"
        return f"{100 * self.cover:.2f} %, {self.worst:.2f}, {sharp}"


def judge(value, error, truth, unit=None):
    """The cell of some points; those without a number are left out, and without a unit those of the value 0."""
    has_value = np.isfinite(value) & np.isfinite(truth) & ((truth != 0.0) | (unit is not None))
    value, error, truth = value[has_value], error[has_value], truth[has_value]
    if not value.size:
        return Cell(0, 1.0, 0.0, np.nan)
    deviation = np.abs(value - truth)
    is_large = deviation > SEEN * (np.abs(truth) if unit is None else unit[has_value])
    ratio = np.divide(deviation, error, out=np.where(deviation > 0.0, np.inf, 0.0), where=error > 0.0)
    sharp = float(np.median(error[is_large] / deviation[is_large])) if is_large.any() else np.nan
    return Cell(value.size, float(np.mean(deviation <= error)), float(ratio.max()), sharp)


def moments(kind, count, seed):
    """Principal moments (3, count) of bodies of one kind."""
    random = np.random.default_rng(seed)
    masses = random.uniform(0.05, 1.0, (3, count))
    small = 10.0 ** random.uniform(-8, -1, count)
    if kind == "near-symmetric":
        masses[1] = masses[0] * (1 + random.choice(GAPS, count) * random.choice([-1, 1], count))
    elif kind == "needles and plates":
        needle = random.random(count) < 0.5
        masses = np.where(needle, [small * masses[0], small * masses[1], np.ones(count)], [masses[0], masses[1], small])
    masses = np.take_along_axis(masses, random.permuted(np.tile(np.arange(3)[:, None], (1, count)), axis=0), 0)
    return masses.sum(axis=0) - masses


def points(kind, count, epsilon, seed=1):
    """Bodies of one kind about each axis, nudged in each direction."""
    three = moments(kind, count, seed)
    axis, phase, body = (x.ravel() for x in np.meshgrid((1, 2, 3), PHASES, np.arange(count), indexing="ij"))
    columns = dict(zip(("I1", "I2", "I3"), three[:, body], strict=True))
    return columns | {
        "axis": axis,
        "phase": phase,
        "omega0": np.ones(axis.size),
        "epsilon": np.full(axis.size, epsilon),
    }


def default_sweep(count):
    """At least so many points of the default sweep (or all), evenly taken, its own size of the nudge."""
    from sweeps.points import catalogue
    from sweeps.points.loading import read_sweep

    grid = read_sweep(catalogue.shipped_files()[catalogue.DEFAULT]).grid
    every = max(1, grid.size // count)
    return {name: np.ascontiguousarray(x[::every]) for name, x in grid.points(0, grid.size).items()}


def rigid(kind, count, epsilon, **options):
    """Row of one kind at one size of the nudge: cells by value, shares, and the median deviation of the reduced."""
    points_drawn = default_sweep(count) if kind == DEFAULT else points(kind, count, epsilon)
    columns = survey.survey(points_drawn, *SETTINGS, **options)
    theory, regime = columns["omega_squared_theory"], columns["regime"]
    names = ("omega_squared", "omega_squared_reduced", "growth_rate", "frequency", "growth_rate_logslope")
    cells = {}
    for name in names:
        truth = name.removesuffix("_reduced").removesuffix("_logslope") + "_theory"
        cells[name] = judge(columns[name], columns[f"{name}_error"], columns[truth])
    with np.errstate(divide="ignore", invalid="ignore"):
        deviation = np.abs(columns["omega_squared_reduced"] / theory - 1.0)
    is_wrong = (regime != columns["regime_theory"]) & (regime != linear.MARGINAL)
    return cells, float(np.mean(regime == linear.MARGINAL)), int(is_wrong.sum()), float(np.nanmedian(deviation))


def oscillations(name, count, epsilon):
    """Cells of each mode of a system of small oscillations that ships, by value, and how many regimes are wrong."""
    model = described.model_of(name)
    values = described.points(model, count, oscillators.LIBRARY[name], epsilon=epsilon)
    columns = model.survey(values)
    is_ok, unit = columns["status"] == 0, columns["rate_scale"] ** 2
    cells, num_wrong = {}, 0
    for mode in np.unique(values["mode"]):
        selection = is_ok & (values["mode"] == mode)
        cells[int(mode)] = {
            x: judge(*(columns[y][selection] for y in (x, f"{x}_error", "omega_squared_theory")), unit[selection])
            for x in ("omega_squared", "omega_squared_reduced")
        }
        regimes = [columns[x][selection] for x in ("regime", "regime_theory")]
        num_wrong += int(np.sum((regimes[0] != regimes[1]) & (regimes[0] != MARGINAL) & (regimes[1] != MARGINAL)))
    return cells, num_wrong


def top(count, gap, seed=1):
    """Return the cells of both precession rates of symmetric tops with ratios of moments at this distance from 1."""
    random = np.random.default_rng(seed)
    ratio = 1.0 + gap * random.choice([-1, 1] if gap < 1.0 else [1], count) * random.uniform(0.3, 1.0, count)
    values = {"ratio": ratio, "omega3": random.uniform(-20, 20, count), "half_angle": random.uniform(0.1, 80, count)}
    columns = symmetric_top.survey(values, *SETTINGS)
    truth = columns["precession_rate_theory"]
    return {x: judge(columns[x], columns[f"{x}_error"], truth) for x in ("precession_rate", "momentum_precession_rate")}


def rows(count, points=300, decades=DECADES, systems=None, gaps=TOPS):
    """Lines of the table, in Markdown."""
    values = "measured | reduced | growth rate | frequency | log slope"
    yield f"| bodies | ε | {values} | marginal | wrong | reduced, median off |"
    yield "|---|---|---|---|---|---|---|---|---|---|"
    for kind in ("random", "near-symmetric", "needles and plates"):
        for epsilon in decades:
            yield _rigid_row(kind, f"{epsilon:.0e}", rigid(kind, count, epsilon))
    yield _rigid_row(DEFAULT, "its own", rigid(DEFAULT, 6 * count, 0.0))
    yield from _oscillation_rows(points, decades, systems)
    yield ""
    yield "| symmetric top, I3/I1 from 1 by | ω | L |"
    yield "|---|---|---|"
    for gap in gaps:
        yield f"| {gap:.0e} | {' | '.join(map(str, top(count, gap).values()))} |"


def _rigid_row(kind, epsilon, figures):
    cells, marginal, num_wrong, deviation = figures
    cell_text = " | ".join(map(str, cells.values()))
    return f"| {kind} | {epsilon} | {cell_text} | {100 * marginal:.2f} % | {num_wrong} | {deviation:.0e} |"


def _oscillation_rows(count, decades, systems):
    yield ""
    yield "| system | ε | mode | measured | reduced | wrong, of all modes |"
    yield "|---|---|---|---|---|---|"
    for name in oscillators.LIBRARY if systems is None else systems:
        for epsilon in (e for e in decades if e <= 0.1):
            cells_by_mode, num_wrong = oscillations(name, count, epsilon)
            for mode, cells in cells_by_mode.items():
                yield f"| {name} | {epsilon:.0e} | {mode} | {' | '.join(map(str, cells.values()))} | {num_wrong} |"


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bodies", type=int, default=1000, help="bodies of a kind, each about three axes, twice")
    parser.add_argument("--points", type=int, default=300, help="places of each system of small oscillations")
    parser.add_argument("--definitions", type=int, default=2000, help="random definitions of each system")
    parser.add_argument("--only-definitions", action="store_true", help="random definitions of bodies alone")
    parser.add_argument("--only-described", action="store_true", help="random definitions of described systems alone")
    parser.add_argument("--only", choices=random_motions.COLUMNS, help="random definitions of this system alone")
    parser.add_argument("--seed", type=int, default=1, help="of the random definitions")
    parser.add_argument("--out", type=Path, help="folder for coverage.md")
    arguments = parser.parse_args(argv)
    count, seed, lines = arguments.definitions, arguments.seed, []
    print("each cell: cover, worst, sharp")
    every = []
    if not (arguments.only or arguments.only_definitions or arguments.only_described):
        every += [rows(arguments.bodies, arguments.points), ("",)]
    if not arguments.only_described:
        names = [arguments.only] if arguments.only else random_motions.COLUMNS
        every += [random_motions.lines_of(name, count, seed) for name in names]
    if not (arguments.only or arguments.only_definitions):
        tables = error_bars_described.random_tables(max(1, count // 60), 25, seed)
        every.append(error_bars_described.lines(tables))
    for line in chain.from_iterable(every):
        print(line, flush=True)
        lines.append(line)
    if arguments.out:
        arguments.out.mkdir(parents=True, exist_ok=True)
        (arguments.out / "coverage.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
