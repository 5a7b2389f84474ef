"""Table of the error bars' coverage and sharpness and of marginal points, cell by cell.

    python tests/benchmarks/error_bars.py [--bodies 1000] [--points 300] [--definitions 2000] [--out results/benchmarks]
    python tests/benchmarks/error_bars.py --only-definitions
    python tests/benchmarks/error_bars.py --only-described

Random bodies that can exist (second moments of mass uniform in 0.05-1), bodies with two moments 1e-1 to 1e-9 apart,
needles and plates (two of three lengths as small as 1e-8), about each axis, with the nudge in two directions, at each
decade of its size; the default sweep; so many random places of each system of small oscillations that ships, mode by
mode; the symmetric top. A cell is judged against linear theory, and the top's against the closed form:

* cover: share of points with a deviation within the error; worst: largest deviation over error;
* sharp: median of error over deviation, over deviations above 1e-14 of the value (of small oscillations: of the
  rate scale's square, for a free mode has the value 0); a dash without such points.

Then random definitions of the rigid body, each parameter drawn over its whole allowed range, with random points: every
column that has an error, against linear theory in 40 digits. Each column has its coverage and its largest deviation
over error, of all points and of the worst tenth (or kind) by any parameter; a missing value needs a status that is
not ``ok``, and a regime that is not ``marginal`` must be that of the moments.

Last, the same of each described system that ships: error_bars_described.py.
"""

import argparse
import sys
from functools import cache
from itertools import chain
from pathlib import Path
from typing import NamedTuple

import mpmath
import numpy as np

sys.path[:0] = [str(Path(__file__).parents[1]), str(Path(__file__).parents[2])]

from kernels.estimator.statuses import OK  # noqa: E402
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


# Random definitions: columns by their theory, kinds of bodies, and directions of the perturbation.
RATES = {"omega_squared": 0, "growth_rate": 1, "frequency": 2}
COLUMNS = (*(f"{name}{end}" for name in RATES for end in ("", "_reduced")), "growth_rate_logslope")
BODIES = ("random", "near-symmetric", "flat", "rod", "symmetric", "sphere", "near a sphere", "impossible")
DIRECTIONS = ("any", "decaying", "growing", "along an axis", "far")
MIN_NORMAL = sys.float_info.min


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


def random_bodies(random, count):
    """Kind (a number of BODIES), relative gap or thickness, and moments (3, count) in any unit."""
    kind = random.choice(len(BODIES), count, p=(0.3, 0.2, 0.12, 0.12, 0.08, 0.02, 0.08, 0.08))
    masses = random.uniform(0.05, 1.0, (3, count))
    gaps = 10.0 ** random.uniform(-16, -0.5, (2, count))
    signed_gaps = gaps * random.choice([-1, 1], (2, count))
    thin = np.where(random.random((2, count)) < 0.2, 0.0, gaps) * masses[1:]
    x, y, z = masses
    kinds = [BODIES.index(name) for name in ("near-symmetric", "symmetric", "sphere", "near a sphere", "rod")]
    y = np.select([kind == k for k in kinds], [x * (1 + signed_gaps[0]), x, x, x * (1 + signed_gaps[0]), thin[0]], y)
    z = np.select([kind == k for k in kinds[2:]], [x, x * (1 + signed_gaps[1]), gaps[1] * z], z)
    z = np.where(kind == BODIES.index("flat"), thin[1], z)
    masses = random.permuted(np.stack([x, y, z]), axis=0)
    possible = np.roll(masses, -1, axis=0) + np.roll(masses, -2, axis=0)
    moments = np.where(kind == BODIES.index("impossible"), 10.0 ** random.uniform(-3, 3, (3, count)), possible)
    return kind, gaps[0], moments * np.where(random.random(count) < 0.5, 1.0, 10.0 ** random.uniform(-290, 290, count))


def random_points(random, count):
    """Return points over the whole allowed range, and the kinds of their bodies and directions."""
    kind, gap, three = random_bodies(random, count)
    axis, share = random.integers(1, 4, count), random.random(count)
    spread = (10.0 ** random.uniform(-12, np.log10(0.9), count), random.uniform(0.02, 0.9, count))
    epsilon = np.select([share < 0.45, share < 0.9], spread, 10.0 ** random.uniform(-300, -12, count))
    powers = np.where(random.random(count) < 0.5, random.uniform(-1, 1, count), random.uniform(-150, 150, count))
    omega0 = random.choice([-1, 1], count) * 10.0**powers
    a, b, c = linear.moments_from_axis(*three, axis)
    cb, rate = (c - a) / b, np.sqrt(np.maximum((c - a) / b * ((a - b) / c), 0.0))
    towards = random.choice(len(DIRECTIONS), count, p=(0.4, 0.3, 0.1, 0.1, 0.1))
    slope = [np.arctan2(side * rate, cb * np.sign(omega0)) for side in (-1, 1)]
    along = random.integers(0, 4, count) * np.pi / 2
    ways = (random.uniform(0, 2 * np.pi, count), *slope, along, 10.0 ** random.uniform(0, 15, count))
    points = dict(zip(("I1", "I2", "I3"), three, strict=True)) | {"axis": axis, "omega0": omega0, "epsilon": epsilon}
    points["phase"] = np.choose(towards, ways)
    return points, {"body": kind, "gap": gap, "direction": towards, "unit": three.max(axis=0)}


def random_integration(random, max_samples):
    """How runs are made: any of the contract's ranges, with at most so many samples."""
    from sweeps.systems.rigid_body.system import PROPAGATORS, RigidBodyIntegration

    few_range, many_range = np.log([4, 40]), np.log([4, 1e3 if random.random() < 0.7 else 1e9])
    per_rotation = int(np.exp(random.uniform(*(few_range if random.random() < 0.6 else many_range))))
    samples = round(np.exp(random.uniform(np.log(8), np.log(max_samples))))
    return RigidBodyIntegration(
        rotations=samples / per_rotation,
        samples_per_rotation=per_rotation,
        tolerance=10.0 ** random.uniform(-13, -3),
        propagator=str(random.choice([*PROPAGATORS])),
        collapse=bool(random.random() < 0.2),
    )


def linear_theory(points):
    """Ω², growth rate and frequency as pairs (double, remainder), from 40 digits; shape (3, 2, n)."""
    three = np.stack([points[name] for name in ("I1", "I2", "I3")])
    pairs = np.empty((3, 2, three.shape[1]))
    with mpmath.workdps(40):
        for i, (axis, omega0) in enumerate(zip(points["axis"], points["omega0"], strict=True)):
            a, b, c = (mpmath.mpf(float(three[(axis - 1 + k) % 3, i])) for k in range(3))
            square = (a - b) * (a - c) / (b * c)
            rate = mpmath.sqrt(abs(square)) * abs(float(omega0))
            for row, value in enumerate(
                (square * mpmath.mpf(float(omega0)) ** 2, rate * (square < 0), rate * (square > 0))
            ):
                pairs[row, :, i] = float(value), float(value - float(value))
    return pairs


def random_definitions(count, points=50, seed=1, max_samples=2e4):
    """Return a table of all points of random definitions: values drawn, measured, and deviations over errors.

    A deviation over error is NaN if the value or its error is missing.
    """
    from sweeps.systems.rigid_body.system import SYSTEM

    random, tables = np.random.default_rng(seed), []
    for _ in range(count):
        integration = random_integration(random, max_samples)
        values, facts = random_points(random, points)
        columns = SYSTEM.columns(values, integration)
        theory = linear_theory(values)
        settings = ("rotations", "samples_per_rotation", "tolerance", "propagator", "collapse")
        row = values | facts | {name: np.full(points, getattr(integration, name)) for name in settings}
        row |= {name: columns[name] for name in ("regime", "regime_theory", "status", "samples_used", "encircles")}
        for name in COLUMNS:
            truth, remainder = theory[RATES[name.removesuffix("_reduced").removesuffix("_logslope")]]
            with np.errstate(all="ignore"):
                row[name] = np.abs((columns[name] - truth) - remainder) / columns[f"{name}_error"]
            row[f"{name} lost"] = ~np.isfinite(columns[name]) | ~(columns[f"{name}_error"] >= MIN_NORMAL)
        tables.append(row)
    return {name: np.concatenate([table[name] for table in tables]) for name in tables[0]}


def wrong_regimes(table):
    """Which points have a regime that is neither left open nor that of the moments."""
    return ~np.isin(table["regime"], (-1, linear.MARGINAL)) & (table["regime"] != table["regime_theory"])


def lost_in_silence(table):
    """Which points have status ok and no Ω², measured or reduced, or no normal double as its error."""
    return (table["status"] == OK) & (table["omega_squared lost"] | table["omega_squared_reduced lost"])


def tenths(values):
    """The tenth (0 to 9) that each value lies in; of words and few numbers, the number of the value."""
    different, numbers = np.unique(values, return_inverse=True)
    if different.size <= 10:
        return numbers
    return np.clip(np.searchsorted(np.quantile(values, np.linspace(0, 1, 11)), values, side="right") - 1, 0, 9)


PARAMETERS = (
    *("rotations", "samples_per_rotation", "tolerance", "propagator", "collapse", "epsilon", "phase", "direction"),
    *("omega0", "spin", "axis", "body", "gap", "unit", "samples_used"),
)


def of_columns(table, columns, parameters):
    """Lines of a table of random definitions: each column, whole and in its worst tenth by any parameter."""
    yield "| column | points | within the error | worst | least within, of a tenth | its worst |"
    yield "|---|---|---|---|---|---|"
    for name in columns:
        ratio = table[name]
        has_value = ~np.isnan(ratio)
        tenth_parts = [
            (parameter, tenth, has_value & (tenths(table[parameter]) == tenth))
            for parameter in parameters
            for tenth in range(10)
        ]
        tenth_parts = [(p, t, ratio[selection]) for p, t, selection in tenth_parts if selection.any()]
        parameter, tenth, worst = min(tenth_parts, key=lambda part: np.mean(part[2] <= 1.0))
        yield (
            f"| {name} | {has_value.sum():,} | {100 * np.mean(ratio[has_value] <= 1.0):.3f} % | "
            f"{ratio[has_value].max():.2f} | "
            f"{100 * np.mean(worst <= 1.0):.2f} % ({parameter}, {tenth + 1}) | {worst.max():.2f} |"
        )


def of_definitions(table):
    """Lines of the table of random definitions of the rigid body: its columns, regimes and statuses."""
    yield from of_columns(table | {"spin": np.abs(table["omega0"])}, COLUMNS, PARAMETERS)
    marginal, is_missing = np.mean(table["regime"] == linear.MARGINAL), table["status"] != OK
    yield ""
    yield (
        f"{is_missing.size:,} points: {wrong_regimes(table).sum()} wrong regimes, {100 * marginal:.1f} % marginal, "
        f"{lost_in_silence(table).sum()} missing with status ok, {100 * is_missing.mean():.2f} % with another status"
    )


def oscillations(name, count, epsilon):
    """Cells of each mode of a system of small oscillations that ships, by value, and how many regimes are wrong."""
    import oscillators

    values = oscillators.points(*_description(name), count, oscillators.LIBRARY[name], epsilon=epsilon)
    columns = _model(name).survey(values)
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


def _description(name):
    import oscillators

    system = oscillators.description_of(name)
    return system, len(system.kept)


@cache
def _model(name):
    from sweeps.mechanics.model import Model

    return Model(_description(name)[0])


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
    import oscillators

    yield ""
    yield "| system | ε | mode | measured | reduced | wrong, of all modes |"
    yield "|---|---|---|---|---|---|"
    for name in oscillators.LIBRARY if systems is None else systems:
        for epsilon in (e for e in decades if e <= 0.1):
            cells_by_mode, num_wrong = oscillations(name, count, epsilon)
            for mode, cells in cells_by_mode.items():
                yield f"| {name} | {epsilon:.0e} | {mode} | {' | '.join(map(str, cells.values()))} | {num_wrong} |"


def lines_of_described(count, points=25, seed=1, names=None):
    """Lines of the tables of described systems: so many random definitions of each, of so many places."""
    import error_bars_described

    yield from error_bars_described.lines(
        error_bars_described.random_tables(count, points, seed, names=names, integrations=random_integration)
    )


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bodies", type=int, default=1000, help="bodies of a kind, each about three axes, twice")
    parser.add_argument("--points", type=int, default=300, help="places of each system of small oscillations")
    parser.add_argument("--definitions", type=int, default=2000, help="random definitions, 50 points each")
    parser.add_argument("--only-definitions", action="store_true", help="leave out the other tables")
    parser.add_argument("--only-described", action="store_true", help="random definitions of described systems alone")
    parser.add_argument("--seed", type=int, default=1, help="of the random definitions")
    parser.add_argument("--out", type=Path, help="folder for coverage.md")
    arguments = parser.parse_args(argv)
    lines = []
    print("each cell: cover, worst, sharp")
    every = []
    if not (arguments.only_definitions or arguments.only_described):
        every += [rows(arguments.bodies, arguments.points), ("",)]
    if not arguments.only_described:
        every.append(of_definitions(random_definitions(arguments.definitions, seed=arguments.seed)))
    if not arguments.only_definitions:
        every += [("",), lines_of_described(max(1, arguments.definitions // 60), seed=arguments.seed)]
    for line in chain.from_iterable(every):
        print(line, flush=True)
        lines.append(line)
    if arguments.out:
        arguments.out.mkdir(parents=True, exist_ok=True)
        (arguments.out / "coverage.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
