"""Errors of free bodies, throws, tumblers, symmetric tops and attitudes: random definitions, column by column.

Called by error_bars.py. Each parameter is drawn over its whole allowed range. Each column that has an error is
compared with a reference that shares nothing with the kernels: of free bodies linear theory in 40 digits, of throws a
Taylor series in long doubles (``tests/precise.py``), of tumblers and of the spin axis in space Legendre's integrals
in 50 digits, of tops (I3/I1 - 1) omega3 in 200 digits. Each column has its coverage and its largest deviation over
error, of all points and of the worst tenth (or kind) by any parameter. A value or an error that is missing must have
a status that is not ``ok``, and a regime that is not ``marginal`` must be that of the moments.
"""

import math
import sys

import mpmath as mp
import numpy as np
import precise

from kernels.estimator import statuses
from kernels.events import tumbling
from kernels.free import linear

PERIODS = tumbling.PERIODS
RATES = {"omega_squared": 0, "growth_rate": 1, "frequency": 2}  # columns by their theory
COLUMNS = {
    "rigid_body": (*(f"{name}{end}" for name in RATES for end in ("", "_reduced")), "growth_rate_logslope"),
    "twist": ("twist", "time_of_turn"),
    "tumbling": PERIODS,
    "symmetric_top": ("precession_rate", "momentum_precession_rate"),
    "attitude": ("space_rate",),
}
BODY = ("body", "gap", "unit")
SPIN = ("epsilon", "phase", "direction", "omega0", "spin", "axis", *BODY)
PARAMETERS = {
    "rigid_body": ("rotations", "samples_per_rotation", "tolerance", "propagator", "collapse", "samples_used", *SPIN),
    "twist": ("tolerance", "chi", "theta", "thrown", "omega0", *BODY),
    "tumbling": ("tolerance", "energy", "placed", "omega0", *BODY),
    "symmetric_top": ("tolerance", "rotations", "samples_per_rotation", "ratio", "shaped", "omega3", "half_angle"),
    "attitude": ("rotations", "samples_per_rotation", "tolerance", *SPIN),
}
FASTEST = 20.0  # change of a racket, in L/I2: the series takes some ten steps in the time of one unit of it

# Kinds of bodies, and directions of the perturbation.
BODIES = ("random", "near-symmetric", "flat", "rod", "symmetric", "sphere", "near a sphere", "impossible")
DIRECTIONS = ("any", "decaying", "growing", "along an axis", "far")


def either_sign(random, count, low, high):
    """Numbers of either sign, evenly spread over the decades between two powers of ten."""
    return random.choice([-1.0, 1.0], count) * 10.0 ** random.uniform(low, high, count)


def spins(random, count):
    """Spin rates, half of them near 1 and half anywhere in the allowed range."""
    return 10.0 ** np.where(random.random(count) < 0.5, random.uniform(-1, 1, count), random.uniform(-150, 150, count))


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


def bodies(random, count):
    """Return moments in any unit and order, and their kinds."""
    kind, gap, three = random_bodies(random, count)
    values = dict(zip(("I1", "I2", "I3"), three, strict=True)) | {"omega0": spins(random, count)}
    return values, {"body": kind, "gap": gap, "unit": three.max(axis=0)}


def throws(random, count):
    """Throws of any body: any angles, next to an axis, next to the separatrix."""
    values, facts = bodies(random, count)
    low, middle, high = np.sort([values[f"I{i}"] for i in (1, 2, 3)], axis=0)
    quarter = random.integers(-2, 3, count) * (0.5 * math.pi)
    ways = (
        random.uniform(-math.pi, math.pi, count),
        either_sign(random, count, -16, 0),
        quarter + either_sign(random, count, -16, 0),
        either_sign(random, count, 0, 15),
        quarter,
    )
    chi = np.choose(random.choice(5, count, p=(0.3, 0.3, 0.2, 0.1, 0.1)), ways)
    a, b = (middle - low) / low, (high - middle) / high
    with np.errstate(divide="ignore", invalid="ignore"):
        edge = np.arctan(np.sqrt(a / b) / np.abs(np.sin(chi))) + either_sign(random, count, -16, -1)
    across = 0.5 * math.pi + either_sign(random, count, -16, 0)
    along = np.where(random.random(count) < 0.5, 0.0, math.pi) + either_sign(random, count, -16, 0)
    tilts = (np.full(count, 0.5 * math.pi), random.uniform(0, math.pi, count), across, along, edge)
    manner = random.choice(5, count, p=(0.3, 0.25, 0.15, 0.1, 0.2))
    theta = np.nan_to_num(np.choose(manner, tilts), nan=1.0)
    return values | {"chi": chi, "theta": np.clip(theta, 0.0, math.pi)}, facts | {"thrown": manner}


def tumblers(random, count):
    """Tumblers of any body: any energy, next to either axis, next to the separatrix, and next to impossible bodies."""
    values, facts = bodies(random, count)
    low, middle, high = np.sort([values[f"I{i}"] for i in (1, 2, 3)], axis=0)
    max_energy, edge, share = high / low, high / middle, random.random(count)
    near = 10.0 ** random.uniform(-16, 0, count)
    ways = (
        1.0 + (max_energy - 1.0) * share,
        max_energy**share,
        1.0 + (edge - 1.0) * near,
        max_energy - (max_energy - edge) * near,
        edge + np.where(share < 0.5, max_energy - edge, 1.0 - edge) * near,
        max_energy * (1.0 + near * (share - 0.5)),
    )
    manner = random.choice(6, count, p=(0.2, 0.15, 0.15, 0.15, 0.3, 0.05))
    return values | {"energy": np.maximum(1.0, np.choose(manner, ways))}, facts | {"placed": manner}


def tops(random, count):
    """Tops of any ratio and half-angle, spun either way at any rate."""
    manner = random.choice(4, count, p=(0.4, 0.35, 0.2, 0.05))
    ratios = (random.uniform(0.0, 2.0, count), 1.0 + either_sign(random, count, -16, -1))
    ratio = np.choose(manner, (*ratios, 10.0 ** random.uniform(-150, 150, count), np.ones(count)))
    near = 90.0 * (1.0 - 10.0 ** random.uniform(-15, -1, count))
    ways = (random.uniform(0.01, 89.0, count), near, 10.0 ** random.uniform(-100, 1, count))
    angle = np.choose(random.choice(3, count, p=(0.5, 0.25, 0.25)), ways)
    spin = spins(random, count) * random.choice([-1.0, 1.0], count)
    return {"ratio": ratio, "omega3": spin, "half_angle": angle}, {"shaped": manner}


def in_pairs(values):
    """Return numbers of many digits as (double, remainder)."""
    first = np.array([float(x) for x in values])
    return first, np.array([float(x - f) if math.isfinite(f) else 0.0 for x, f in zip(values, first, strict=True)])


def rigid_body_theory(table, is_known):
    """Return Ω², growth rate and frequency of linear theory."""
    pairs = np.empty((3, 2, is_known.size))
    with mp.workdps(40):
        for i, (axis, omega0) in enumerate(zip(table["axis"], table["omega0"], strict=True)):
            a, b, c = (mp.mpf(float(table[f"I{(axis - 1 + k) % 3 + 1}"][i])) for k in range(3))
            square = (a - b) * (a - c) / (b * c)
            rate = mp.sqrt(abs(square)) * abs(float(omega0))
            pairs[:, :, i] = np.transpose(
                in_pairs([square * mp.mpf(float(omega0)) ** 2, rate * (square < 0), rate * (square > 0)])
            )
    theory = {name: RATES[name.removesuffix("_reduced").removesuffix("_logslope")] for name in COLUMNS["rigid_body"]}
    return {name: pairs[number] for name, number in theory.items()}, is_known


def twist_theory(table, is_known):
    """Return twist and time of the turn of throws with known numbers."""
    names = ("I1", "I2", "I3", "chi", "theta")
    low, middle, high = np.sort([table[name] for name in names[:3]], axis=0)
    cosine, sine, side = np.cos(table["theta"]), np.sin(table["theta"]), table["chi"]
    energy = cosine**2 * (middle / low) + sine**2 * (np.cos(side) ** 2 + np.sin(side) ** 2 * (middle / high))
    fastest = np.sqrt(energy * (middle / low)) * np.maximum(
        1.0, np.maximum((high - middle) / low, (high - low) / middle)
    )
    is_requested = is_known & (fastest < FASTEST)
    pairs = np.full((2, 2, is_known.size), np.nan)
    if is_requested.any():
        unit = table["I2"][is_requested]
        arguments = [table[name][is_requested] for name in names]
        arguments[:3] = (np.longdouble(x) / unit for x in arguments[:3])
        first = precise.turns(*arguments)
        first[1] /= np.longdouble(table["omega0"][is_requested])
        pairs[:, 0, is_requested] = first.astype(float)
        pairs[:, 1, is_requested] = (first - pairs[:, 0, is_requested]).astype(float)
    return dict(zip(COLUMNS["twist"], pairs, strict=True)), is_requested


def tumbling_theory(table, is_known):
    """Return periods of tumblers with known numbers: infinitely wrong without a period."""
    pairs = np.full((3, 2, is_known.size), np.nan)
    with mp.workdps(50):
        for i in np.flatnonzero(is_known):
            three = [mp.mpf(x) for x in sorted(float(table[name][i]) for name in ("I1", "I2", "I3"))]
            three = [x / three[2] for x in three]
            of = precise.legendre(three, mp.mpf(float(table["energy"][i])), mp.mpf(1))
            values = (math.inf,) * 3 if of is None else [x / mp.mpf(float(table["omega0"][i])) for x in of[:3]]
            pairs[:, :, i] = np.transpose(in_pairs(values))
    return dict(zip(PERIODS, pairs, strict=True)), is_known


def top_theory(table, is_known):
    """The rate of precession of tops, of both kinds."""
    with mp.workdps(200):
        rates = [
            (mp.mpf(float(r)) - 1) * mp.mpf(float(w)) for r, w in zip(table["ratio"], table["omega3"], strict=True)
        ]
        return dict.fromkeys(COLUMNS["symmetric_top"], in_pairs(rates)), is_known


def attitude_theory(table, is_known):
    """Return the mean rate of the spin axis about L, for motions that encircle L."""
    pairs = np.full((2, is_known.size), np.nan)
    with mp.workdps(50):
        for i in np.flatnonzero(is_known | np.isin(table["regime"], (linear.STABLE_MAJOR, linear.STABLE_MINOR))):
            spin, epsilon, phase = (mp.mpf(float(table[name][i])) for name in ("omega0", "epsilon", "phase"))
            three = [mp.mpf(float(table[f"I{k}"][i])) for k in (1, 2, 3)]
            unit, axis = max(three), int(table["axis"][i]) - 1
            w = [mp.mpf(1), epsilon * mp.cos(phase), epsilon * mp.sin(phase)]
            a, b, c = (three[(axis + k) % 3] / unit for k in range(3))
            T2 = a + b * w[1] ** 2 + c * w[2] ** 2
            L = mp.sqrt(a**2 + (b * w[1]) ** 2 + (c * w[2]) ** 2)
            of = precise.legendre(sorted([a, b, c]), T2, L)
            if of is not None and a == (max if of[3] else min)(a, b, c):
                pairs[:, i] = np.ravel(in_pairs([2 * mp.pi / of[2] * abs(spin)]))
    return {"space_rate": pairs}, is_known & np.isfinite(pairs[0])


def integration_of(name, random, max_samples):
    """How the motions of a definition are followed."""
    from sweeps.systems.bodies.body import Once
    from sweeps.systems.rigid_body.system import RigidBodyIntegration
    from sweeps.systems.symmetric_top.system import TopIntegration

    like = random_integration(random, max_samples)
    if name == "rigid_body":
        return like
    length = {"rotations": like.rotations, "samples_per_rotation": like.samples_per_rotation}
    if name in ("twist", "tumbling"):
        return Once(tolerance=like.tolerance)
    if name == "symmetric_top":
        return TopIntegration(tolerance=like.tolerance, **length)
    return RigidBodyIntegration(tolerance=like.tolerance, attitude=True, **length)


def system_of(name):
    """The system that makes the columns."""
    from sweeps import systems

    return systems.resolve("rigid_body" if name == "attitude" else name)


GENERATORS = {"twist": throws, "tumbling": tumblers, "symmetric_top": tops}
THEORY = {
    "rigid_body": rigid_body_theory,
    "twist": twist_theory,
    "tumbling": tumbling_theory,
    "symmetric_top": top_theory,
    "attitude": attitude_theory,
}
MIN_NORMAL = sys.float_info.min


def random_definitions(name, count, points, seed=1, max_samples=2e3):
    """Table of all points of random definitions of one system; deviations over errors under the columns' names.

    A deviation is NaN if the value is missing or has no reference.
    """
    random, tables = np.random.default_rng(seed), []
    for _ in range(count):
        integration = integration_of(name, random, max_samples)
        values, facts = GENERATORS.get(name, random_points)(random, points)
        settings = {k: np.full(points, getattr(integration, k)) for k in PARAMETERS[name] if hasattr(integration, k)}
        tables.append({**system_of(name).columns(values, integration), **values, **facts, **settings})
    table = {k: np.concatenate([table_of[k] for table_of in tables]) for k in tables[0]}
    has_value = np.any([np.isfinite(table[column]) for column in COLUMNS[name]], axis=0)
    theory, is_requested = THEORY[name](table, has_value)
    table |= {"told": has_value, "asked": is_requested}
    for column in COLUMNS[name]:
        first, remainder = theory[column]
        value, error = table[column], table[f"{column}_error"]
        table[f"{column} value"], table[f"{column} truth"] = value, first
        with np.errstate(all="ignore"):
            deviation = np.abs((value - first) - remainder)
            ratio = np.where((deviation == 0.0) & (error == 0.0), 0.0, deviation / error)
            table[column] = np.where(is_requested & np.isfinite(value), ratio, np.nan)
        table[f"{column} lost"] = ~np.isfinite(value) | ~(error >= MIN_NORMAL)
    return table


def lost_in_silence(name, table):
    """Which points have status ok and a column without a number, or without a normal double as its error."""
    columns = ("omega_squared", "omega_squared_reduced") if name == "rigid_body" else COLUMNS[name]  # no rate is lost
    is_missing = np.any([table[f"{column} lost"] for column in columns], axis=0)
    if name == "tumbling":  # modes mark points without a period
        is_missing &= np.isin(table["mode"], (tumbling.SAM, tumbling.LAM))
    if name == "attitude":  # the spin axis precesses about L if the motion encircles it
        is_missing &= np.isfinite(table["space_rate truth"])
    if name == "twist":  # along the handle there is no turn
        is_missing &= table["theta"] > 0.0
    return is_missing & (table["status"] == statuses.OK)


def wrong_regimes(table):
    """Which points of free bodies have a regime that is neither left open nor that of the moments."""
    return ~np.isin(table["regime"], (-1, linear.MARGINAL)) & (table["regime"] != table["regime_theory"])


def tenths(values):
    """The tenth (0 to 9) that each value lies in; of words and few numbers, the number of the value."""
    different, numbers = np.unique(values, return_inverse=True)
    if different.size <= 10:
        return numbers
    return np.clip(np.searchsorted(np.quantile(values, np.linspace(0, 1, 11)), values, side="right") - 1, 0, 9)


HEADER = (
    "| column | points | within the error | worst | least within, of a tenth | its worst |",
    "|---|---|---|---|---|---|",
)


def row_of(label, ratio, parameters):
    """Return the row of a column of deviations over errors, whole and in its worst tenth by any parameter.

    Args:
        label: text of its first cell.
        ratio: deviations over errors, NaN without a value.
        parameters: name → values.
    """
    has_value = ~np.isnan(ratio)
    tenth_parts = [
        (parameter, tenth, has_value & (tenths(values) == tenth))
        for parameter, values in parameters.items()
        for tenth in range(10)
    ]
    tenth_parts = [(p, t, ratio[selection]) for p, t, selection in tenth_parts if selection.any()]
    parameter, tenth, worst = min(tenth_parts, key=lambda part: (np.mean(part[2] <= 1.0), -part[2].max()))
    return (
        f"| {label} | {has_value.sum():,} | {100 * np.mean(ratio[has_value] <= 1.0):.3f} % | "
        f"{ratio[has_value].max():.2f} | "
        f"{100 * np.mean(worst <= 1.0):.2f} % ({parameter}, {tenth + 1}) | {worst.max():.2f} |"
    )


def lines_of(name, count, seed):
    """Yield the lines of the table of random definitions of one system: so many, of 8 points, of bodies 50."""
    points, max_samples = (50, 2e4) if name == "rigid_body" else (8, 2e3)
    yield from lines(name, random_definitions(name, count, points, seed, max_samples))


def lines(name, table):
    """Lines of the table of one system."""
    spin = np.abs(table["omega0"]) if "spin" in PARAMETERS[name] else 0.0
    yield f"{name}:"
    yield from HEADER
    parameters = {parameter: (table | {"spin": spin})[parameter] for parameter in PARAMETERS[name]}
    yield from (row_of(column, table[column], parameters) for column in COLUMNS[name])
    if name == "rigid_body":
        marginal = np.mean(table["regime"] == linear.MARGINAL)
        yield f"{wrong_regimes(table).sum()} wrong regimes, {100 * marginal:.1f} % marginal"
    yield (
        f"{table['told'].size:,} points: {table['told'].sum():,} measured, {table['asked'].sum():,} with a reference, "
        f"{np.sum(table['status'] != statuses.OK):,} with a status that is not ok, "
        f"{lost_in_silence(name, table).sum()} missing with status ok"
    )
    yield ""
