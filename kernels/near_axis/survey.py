r"""The batch: a block of points in, a block of columns out, and nothing kept that is not a column.

Points are taken a tile at a time. Those of it that need equally many steps of one order are followed together, W at a
time (:mod:`kernels.near_axis.near_axis_block`); among them those of like growth stand together, so that a block ends
when its last window closes. The last block of each kind is padded with copies of its last point. None of that changes a
bit of any point.

*Blind.* The length of the run, the spacing and the number of steps come from max|c_i|, a bound on every possible rate;
what is written here as measured comes from samples. Linear theory decides in which order points are taken, and no
more; its columns are made elsewhere (:mod:`kernels.free.linear`).
"""

import math
from itertools import chain
from typing import NamedTuple

import numpy as np

from kernels.compile import columns
from kernels.compile.blocks import W, cut, scratch
from kernels.compile.jit import OPTIONS, njit, whole_vectors
from kernels.estimator import measure, reduction
from kernels.estimator.statuses import NON_FINITE, OK, SHORT_WINDOW
from kernels.events import flips
from kernels.free import collapse, direct, linear, rigid_body
from kernels.free.elliptic_constants import unit_of
from kernels.free.sincos import FAR, cosine_sine, within
from kernels.near_axis import estimates, near_axis_block, propagators
from kernels.near_axis.estimates import COLUMNS, MEASURED, aux
from kernels.near_axis.near_axis_block import row
from kernels.near_axis.propagators import PROPAGATORS

TILE = 4096  # points that are planned, sorted and measured together: their columns stay in a core's own cache
LEVELS = 16  # of growth, by which points of one kind are sorted
# A tile's rows, so far apart (multiples of a page would share few lines of the cache): first what blocks gather, in the
# order of the rows of lanes that it fills, but for |omega0| or NaN in the cosine's place and the phase in the sine's.
PITCH, GATHERED = TILE + 72, 8
_NAMES = ("Ia", "Ib", "Ic", "spin", "epsilon", "rate", "phase", "spacing", "bound")
tile = columns.numbers(_NAMES, width=PITCH)
LAID_OUT = (tile.Ia, tile.Ib, tile.Ic, tile.rate, tile.epsilon, tile.phase)  # I1, I2, I3, omega0, epsilon, phase

TYPES = (np.float64, np.int32, np.int8)
POWERS = {column.name: column.power for column in COLUMNS + flips.COLUMNS}
LEAST_SPIN = 1e-143  # s-1, below which the error of Ω², at least 5e-21 of its square, may be no normal double


class PointPlan(NamedTuple):
    """How each point is followed, one array each; compiled code takes it as a plain tuple of arrays."""

    growth: np.ndarray  #: level, 0 to LEVELS - 1, by which points that may share a block are sorted
    depth: np.ndarray  #: of the reduction that the point needs: near_axis_block.FIRST_ORDER or near_axis_block.WHOLE
    step: np.ndarray  #: of :mod:`kernels.near_axis.propagators`
    steps: np.ndarray  #: a sample interval


class RunSettings(NamedTuple):
    """How every point is followed."""

    spacing: float  #: between samples, radians of spin, where no rate asks for less
    intervals: int
    tolerance: float  #: relative error of the perturbation allowed over the run
    rounded: bool  #: whether the moments are ratios that were rounded once each


@njit(nogil=True, **OPTIONS)
def _lay_out(T, values):
    """Write points of a tile side by side into its rows, phases that are far off brought back."""
    for k in range(len(LAID_OUT)):
        begin, column = LAID_OUT[k], values[k]
        for i in range(column.size):
            T[begin + i] = column[i]
    phase, far = values[5], 0
    for i in range(phase.size):
        far |= 0 if abs(phase[i]) <= FAR else 1
    if far > 0:
        for i in range(phase.size):
            T[tile.phase + i] = within(phase[i])


@njit(nogil=True, **OPTIONS)
def _plan(T, axis, spacing, intervals, plan):
    """Write moments in lanes' order, sample spacing (radians of spin), bound on the rates, and the plan of exact steps.

    No branch is left in the loop, which is packed.
    """
    growth, depth, step, steps = plan
    for i in range(axis.size):
        Ia, Ib, Ic = rigid_body.relabel(T[tile.Ia + i], T[tile.Ib + i], T[tile.Ic + i], axis[i])
        ca, cb, cc = rigid_body.euler_coefficients(Ia, Ib, Ic)
        bound = max(abs(ca), abs(cb), abs(cc))
        point_spacing = min(spacing, 0.5 / max(1.0, bound))
        T[tile.bound + i], T[tile.spacing + i] = bound, point_spacing
        square = cb * cc if cb * cc > 0.0 else 0.0
        growth[i] = int(min(math.sqrt(square), 1.0) * (LEVELS - 1)) if square == square else 0
        is_small = reduction.is_small(ca, T[tile.epsilon + i], point_spacing * intervals)
        depth[i] = near_axis_block.FIRST_ORDER if is_small else near_axis_block.WHOLE
        step[i], steps[i] = propagators.RECURRENCE if is_small else propagators.EXACT, 1
        scale, omega0 = 1.0 / unit_of(Ia, Ib, Ic), T[tile.rate + i]  # the scale a power of two
        T[tile.Ia + i], T[tile.Ib + i], T[tile.Ic + i] = Ia * scale, Ib * scale, Ic * scale
        T[tile.spin + i] = 1.0 if omega0 > 0.0 else -1.0
        T[tile.rate + i] = abs(omega0) if (omega0 - omega0 == 0.0) & (omega0 != 0.0) else math.nan


@njit(nogil=True, **OPTIONS)
def _choose(T, intervals, tolerance, plan):
    """Write the Taylor steps that the points need into the plan, in place of exact ones."""
    _, _, step, steps = plan
    latest, size, whole, coefficients = -1.0, 0.0, 0.0, (0.0, 0.0, 0.0)
    for i in range(steps.size):
        epsilon = T[tile.epsilon + i]
        if epsilon != latest:
            latest = epsilon
            size = min(1.0, measure.MAX_GROWTH * latest * math.exp(0.5))  # the sample after the window's end included
            whole = math.sqrt(1.0 + latest * latest)  # the rates go with all of |omega|, not with the spin alone
            coefficients = (
                direct.truncation(size, direct.ORDERS[0]),
                direct.truncation(size, direct.ORDERS[1]),
                direct.truncation(size, direct.ORDERS[2]),
            )
        x = T[tile.bound + i] * T[tile.spacing + i] * whole
        step[i], steps[i] = direct.choose(x, size, coefficients, intervals, tolerance)


@njit(nogil=True, **OPTIONS)
def _sort(plan):
    """Return the order of points and the starts of blocks (:func:`kernels.compile.blocks.cut`), by a plan's fields."""
    growth, depth, step, steps = plan
    keys = np.empty(steps.size, dtype=np.int64)
    for i in range(steps.size):
        kind = ((steps[i] - 1) * len(propagators.ORDER) + step[i]) * 2 + (depth[i] == near_axis_block.WHOLE)
        keys[i] = kind * LEVELS + growth[i]
    return cut(keys, LEVELS)


@njit(nogil=True, **OPTIONS)
def _gather(S, T, points, steps):
    """Fill the rows of a block that are given; copies of the last point fill what its points leave."""
    whole_vectors()
    for lane in range(W):
        i = np.uint64(points[min(lane, points.size - 1)])
        for r in range(GATHERED):
            S[r * W + lane] = T[np.uint64(r * PITCH) + i]
    for lane in range(W):
        S[aux.spin_rate + lane], S[row.steps + lane] = S[row.cosine + lane], steps
        S[row.cosine + lane], S[row.sine + lane] = cosine_sine(S[row.sine + lane])


@njit(nogil=True, **OPTIONS)
def _keep(S, rows, out):
    """Copy some columns of a block, whole rows of lanes at once."""
    whole_vectors()
    for k in range(rows.size):
        first = (estimates.FIRST + rows[k]) * W
        in_row, out_row = S[first : first + W], out[k]
        for lane in range(W):
            out_row[lane] = in_row[lane]


@njit(nogil=True, **OPTIONS)
def _run(T, plan, blocks, run, work, out):
    """Integrate and measure block after block: order[starts[j]:starts[j + 1]] are the points of block j.

    ``out`` holds the numbers ``rows`` of those wanted; ``blocks_out``, shape (blocks, rows, W), where they go; and
    ``at``, where in it each point's lane lies.
    """
    order, starts = blocks
    rows, blocks_out, at = out
    _, intervals, tolerance, rounded = run
    _, depth, step, steps = plan
    reducing = work[3]
    S = scratch(estimates.ROWS)
    for j in range(starts.size - 1):
        points = order[starts[j] : starts[j + 1]]
        i = points[0]  # any point of the block
        reduced = depth[i] if reducing or depth[i] == near_axis_block.WHOLE else near_axis_block.NONE
        _gather(S, T, points, steps[i])
        near_axis_block.follow(S, step[i], steps[i], intervals, work, reduced)
        estimates.fill(S, work, reduced, step[i], rounded, tolerance)
        _keep(S, rows, blocks_out[j])
        for lane in range(points.size):
            at[points[lane]] = j * blocks_out.shape[1] * W + lane


@njit(nogil=True, **OPTIONS)
def _sort_back(first, blocks, at, low, size, out):
    """Write columns of ``size`` points in their order, from number ``low`` on, from those in the order of the blocks.

    Columns of one type are one table; the first one is number ``first`` of a block. One column at a time,
    written as it lies: a point's columns are far apart in memory, and to write them point by point takes three times
    as long.
    """
    for k in range(out.shape[0]):
        column, sorted_column = blocks[(first + k) * W :], out[k][low : low + size]  # both known to be contiguous
        for i in range(size):
            sorted_column[i] = column[at[i]]


def _measure(points, propagator, run, work, rows, tables):
    """Measure tile after tile into tables of one type each; ``rows`` are their columns' numbers, table after table."""
    reals, counts, kinds = tables
    I1, I2, I3, axis, omega0, epsilon, phase = points
    room = min(I1.size, TILE)
    T, whole_plan = np.empty(PITCH * (GATHERED + 1)), [np.empty(room, dtype=np.int64) for _ in PointPlan._fields]
    # an odd number of rows: blocks that begin at multiples of half a page would share few lines of the cache
    blocks, at = np.empty((room // W + 1, rows.size | 1, W)), np.empty(room, dtype=np.uint32)
    for low in range(0, I1.size, TILE):
        size = min(I1.size - low, TILE)
        part, plan = slice(low, low + size), tuple(values[:size] for values in whole_plan)
        _lay_out(T, (I1[part], I2[part], I3[part], omega0[part], epsilon[part], phase[part]))
        _plan(T, axis[part], run.spacing, run.intervals, plan)
        if propagator == "direct":
            _choose(T, run.intervals, run.tolerance, plan)
        order, starts = _sort(plan)
        if starts.size - 1 > blocks.shape[0]:
            blocks = np.empty((starts.size - 1, blocks.shape[1], W))
        _run(T, plan, (order, starts), tuple(run), work, (rows, blocks, at))
        flat = blocks.ravel()
        _sort_back(0, flat, at, low, size, reals)
        _sort_back(reals.shape[0], flat, at, low, size, counts)
        _sort_back(reals.shape[0] + counts.shape[0], flat, at, low, size, kinds)


def measured(
    points,
    rotations,
    samples_per_rotation,
    tolerance,
    propagator="direct",
    wanted=MEASURED,
    nonlinear=False,
    rounded=False,
):
    """Return the measured columns of points, in units.

    Args:
        points (mapping of str to array_like, shape (n,)): I1, I2, I3 (common unit, > 0), axis (1, 2, 3), omega0 (rad
            s-1, not 0), epsilon (between 0 and 1), phase (rad).
        rotations (float): Length of the run, in 2 pi/|omega0|.
        samples_per_rotation (int): Samples in 2 pi/|omega0|; the spacing shrinks where max|c_i| > 1.
        tolerance (float): Relative error of the perturbation allowed over the run.
        propagator (str): One of PROPAGATORS: "direct" (Taylor steps, certified by the exact solution) or "exact" (the
            exact step, one a sample).
        wanted (collection of str): Columns to make, of MEASURED; without the drifts, the log slope, the certificate,
            the rates or the errors the work for them is saved.
        nonlinear (bool): Whether to follow the motion on to its flips and its largest tilt
            (:mod:`kernels.events.flips`).
        rounded (bool): Whether the moments are ratios that were rounded once each: errors then hold what that moves.

    Returns:
        dict of str to numpy.ndarray, shape (n,): omega_squared with its _stderr and _error, omega_squared_reduced and
            its _error, amplitude_shift, the terms omega_squared_error_scatter, _integration, _amplitude and _rounding
            (s-2); growth_rate (s-1) and frequency (rad s-1) with _stderr, _error, _reduced and _reduced_error,
            growth_rate_logslope and its _error (s-1); euler_period, window_end (s); e_folds, energy_drift,
            momentum_drift, perturbation_drift, propagation_error (1); samples_used, steps_per_sample (int32); regime,
            status (int8). If ``nonlinear``, flip_period, flip_period_exact (s), max_tilt, max_tilt_exact (rad),
            frequency_exact (rad s-1). NaN where missing, -1 for a regime that could not be measured. Nothing is checked
            and nothing raised.
    """
    points = rigid_body.points_of(points)
    n = points.I1.size
    needed = {"omega_squared", "status"} if nonlinear else set()
    requested = [column for column in COLUMNS if column.name in wanted or column.name in needed]
    requested.sort(key=lambda column: TYPES.index(column.dtype))
    rows = np.array([MEASURED.index(column.name) for column in requested], dtype=np.int64)
    tables = tuple(np.empty((sum(column.dtype is dtype for column in requested), n), dtype=dtype) for dtype in TYPES)
    work = {column.work for column in COLUMNS if column.name in wanted}
    rated = bool(work & {estimates.RATES, estimates.LOG_SLOPE})
    certified = PROPAGATORS[propagator].is_certified and (
        rated or bool(work & {estimates.CERTIFICATE, estimates.ERRORS})
    )
    reducing = rated or bool(work & {estimates.REDUCTION, estimates.ERRORS})
    done = near_axis_block.Work(certified, estimates.INVARIANTS in work, estimates.LOG_SLOPE in work, reducing, rated)
    spacing, intervals = 2.0 * np.pi / samples_per_rotation, round(rotations * samples_per_rotation)
    run = RunSettings(spacing, intervals, tolerance, rounded)
    _measure(points, propagator, run, tuple(done), rows, tables)
    result = {column.name: values for column, values in zip(requested, chain(*tables), strict=True)}
    followed = _nonlinear(points, result, tolerance) if nonlinear else {}
    _leave_out_unrepresentable(result, points.omega0)
    return followed | {name: result[name] for name in MEASURED if name in wanted}


def _leave_out_unrepresentable(result, omega0):
    """Mark as missing what is in s-2 where doubles cannot hold it and its error; the status is then NON_FINITE."""
    spin = np.abs(omega0)
    lost = spin < LEAST_SPIN
    squares = [values for name, values in result.items() if POWERS[name] == 2]
    if spin.size and spin.max() > 1.0 / LEAST_SPIN:
        for values in squares:
            lost |= np.isinf(values)
    if not lost.any():
        return
    for values in squares:
        values[lost] = np.nan
    if "status" in result:
        status = result["status"]
        status[lost & (status == OK)] = NON_FINITE


def flipped(points, tolerance=1e-10):
    """Return the columns of :mod:`kernels.events.flips` alone, name → values, shape (n,), as :func:`measured`.

    The tolerance is the relative error allowed in the measured columns.
    """
    points = rigid_body.points_of(points)
    n = points.I1.size
    out = np.empty((len(flips.COLUMNS), n))
    flips.fill(points, np.arange(n), tolerance, out, np.zeros(n, dtype=bool))
    return dict(zip(flips.MEASURED, out, strict=True))


def _nonlinear(points, measured, tolerance):
    """Return the columns of kernels.events.flips; a search that was given up is a window too short."""
    n, omega0, status = points.I1.size, points.omega0, measured["status"]
    out, given_up = np.empty((len(flips.COLUMNS), n)), np.zeros(n, dtype=bool)
    sound = np.flatnonzero(status != NON_FINITE)
    out[:, status == NON_FINITE] = np.nan
    rate2 = measured["omega_squared"][sound] / omega0[sound] / omega0[sound]
    order = sound[np.argsort(np.abs(rate2))]  # of like duration together
    flips.fill(points, order, tolerance, out, given_up)
    status[given_up & (status == OK)] = SHORT_WINDOW
    return dict(zip(flips.MEASURED, out, strict=True))


@np.errstate(divide="ignore", invalid="ignore")  # a point that is no body gives NaN, and no noise
def theory(points):
    """Return the columns of linear theory, of the body's shape and of the axis that its motion encircles, in units.

    omega_squared_theory (s-2), growth_rate_theory (s-1), frequency_theory (rad s-1), growing_fraction, triangle_margin
    (1), regime_theory, shape, encircles (int8), shape (n,), of points as for :func:`measured`.
    """
    return linear.columns_of(rigid_body.points_of(points))


def motions(points):
    """Return the number of distinct motions among points: see :mod:`kernels.free.collapse`."""
    first, _ = collapse.distinct(rigid_body.points_of(points))
    return first.size


def as_motions(points):
    """Return the same motions by bodies of moments (I_a/I_c, I_b/I_c, 1) that spin about axis 1, at their own rates."""
    a, b, c = linear.seen_from(*(points[name] for name in ("I1", "I2", "I3", "axis")))
    return {**points, "I1": a / c, "I2": b / c, "I3": 1.0, "axis": 1}


def collapsed(points, *settings, **options):
    """Return the columns of :func:`measured`, each distinct motion integrated once and expanded to its points.

    Takes the arguments of :func:`measured`. What is integrated is the motion itself, moments (I_a/I_c, I_b/I_c, 1) at a
    spin of one, so that a point's bits depend on the point alone; they agree with those of :func:`measured` to the
    rounding of the two ratios.
    """
    points = rigid_body.points_of(points)
    first, motion = collapse.distinct(points)
    motions = as_motions({name: values[first] for name, values in points._asdict().items()})
    of_motions = measured(motions | {"omega0": np.sign(motions["omega0"])}, *settings, rounded=True, **options)
    spin = np.abs(points.omega0)
    expanded = {name: _expanded(values, motion, spin, POWERS[name]) for name, values in of_motions.items()}
    _leave_out_unrepresentable(expanded, points.omega0)
    return expanded


@njit(nogil=True, **OPTIONS)
def _expanded(values, at, spin, power):
    """Return the points' values from those of motions in units of the spin, by the factors of :func:`measured`."""
    out = np.empty(at.size, dtype=values.dtype)
    if power == 0:
        for i in range(at.size):
            out[i] = values[at[i]]
    elif power > 0:
        for i in range(at.size):
            out[i] = values[at[i]] * spin[i] if power == 1 else values[at[i]] * spin[i] * spin[i]
    else:
        for i in range(at.size):
            out[i] = values[at[i]] / spin[i]
    return out


def survey(points, *settings, collapse=False, **options):
    """Return all columns of points: :func:`theory` beside :func:`measured` (or :func:`collapsed`), which ignores it.

    Theory is spared where columns are ``wanted`` and none of its own among them.
    """
    measure = collapsed if collapse else measured
    measurement = measure(points, *settings, **options)
    predicts = any(name in options.get("wanted", linear.NAMES) for name in linear.NAMES)
    return theory(points) | measurement if predicts else measurement
