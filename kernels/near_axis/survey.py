r"""Measurement of the rates of perturbed spins: arrays of points in, arrays of columns out.

Points are measured tile by tile. Points of a tile that need the same steps are integrated together, W at a
time (:mod:`kernels.near_axis.near_axis_block`); points of similar growth share a block, which ends
when its last window closes. The last block of each kind is padded with copies of its last point. None of that changes a
bit of any point.

*Blind.* The length of the run, the spacing and the number of steps come from max|c_i|, a bound on every possible rate;
measured columns come from samples. Linear theory decides only the order of the points; its columns are computed in
another module (:mod:`kernels.free.linear`).
"""

import math
from typing import NamedTuple

import numpy as np

from kernels.compile import columns
from kernels.compile.blocks import W, cut, scratch
from kernels.compile.jit import OPTIONS, njit
from kernels.estimator import measure, reduction
from kernels.estimator.statuses import NON_FINITE, OK, SHORT_WINDOW
from kernels.events import flips
from kernels.free import collapse, direct, linear, rigid_body
from kernels.free.elliptic_constants import unit_of
from kernels.free.sincos import MAX_ANGLE, cosine_sine, reduce_angle
from kernels.near_axis import estimates, near_axis_block, propagators
from kernels.near_axis.estimates import COLUMNS, MEASURED, aux
from kernels.near_axis.near_axis_block import row
from kernels.near_axis.propagators import PROPAGATORS

TILE = 4096  # number of points that are planned, sorted and measured together: their columns stay in a core's cache
GROWTH_LEVELS = 16  # number of levels of predicted growth, by which points of equal steps are sorted
# Distance of a tile's rows (at multiples of a page they would share few lines of the cache), and number of rows that
# blocks gather: in the order of a block's rows, with |omega0| or NaN as the cosine, and the phase as the sine.
ROW_LENGTH, NUM_GATHERED = TILE + 72, 8
_NAMES = ("Ia", "Ib", "Ic", "spin", "epsilon", "rate", "phase", "spacing", "bound")
tile = columns.numbers(_NAMES, width=ROW_LENGTH)
LAID_OUT = (tile.Ia, tile.Ib, tile.Ic, tile.rate, tile.epsilon, tile.phase)  # I1, I2, I3, omega0, epsilon, phase

POWERS = {column.name: column.power for column in COLUMNS + flips.COLUMNS}
MIN_SPIN = 1e-143  # s-1; below it the error of Ω², at least 5e-21 times its square, may be no normal double


class PointPlan(NamedTuple):
    """Steps and order of the points, one array each; compiled code takes it as a plain tuple of arrays."""

    growth: np.ndarray  #: level, 0 to GROWTH_LEVELS - 1, by which points that may share a block are sorted
    depth: np.ndarray  #: order of the reduction: FIRST_ORDER or FULL_REDUCTION of :mod:`near_axis_block`
    step: np.ndarray  #: number of the step in :mod:`kernels.near_axis.propagators`
    steps: np.ndarray  #: number of steps per sample interval


class RunSettings(NamedTuple):
    """Sampling and accuracy of all points."""

    spacing: float  #: spacing of samples, radians of spin; shorter for points with faster rates
    intervals: int
    tolerance: float  #: relative error of the perturbation allowed over the run
    rounded: bool  #: whether the moments are ratios that were rounded once each


@njit(nogil=True, **OPTIONS)
def _write_tile(T, values):
    """Write points of a tile side by side into its rows, phases that are far off brought back."""
    for k in range(len(LAID_OUT)):
        begin, column = LAID_OUT[k], values[k]
        for i in range(column.size):
            T[begin + i] = column[i]
    phase, far = values[5], 0
    for i in range(phase.size):
        far |= 0 if abs(phase[i]) <= MAX_ANGLE else 1
    if far > 0:
        for i in range(phase.size):
            T[tile.phase + i] = reduce_angle(phase[i])


@njit(nogil=True, **OPTIONS)
def _plan_points(T, axis, spacing, intervals, plan):
    """Write a tile's scaled moments, sample spacing (radians of spin), bound on the rates and plan of exact steps.

    Moments become those of the axes a (the spin's), b, c, divided by a power of two. The rate becomes its absolute
    value, NaN if it is 0 or not finite; its sign goes to `spin`. Columns of the plan: the level of growth, by which
    points are sorted into blocks; the order of the amplitude's reduction; the kind of step; steps per sample. No branch
    is left in the loop, which is packed.
    """
    growth, depth, step, steps = plan
    for i in range(axis.size):
        Ia, Ib, Ic = rigid_body.relabel(T[tile.Ia + i], T[tile.Ib + i], T[tile.Ic + i], axis[i])
        ca, cb, cc = rigid_body.euler_coefficients(Ia, Ib, Ic)
        bound = max(abs(ca), abs(cb), abs(cc))
        point_spacing = min(spacing, 0.5 / max(1.0, bound))
        T[tile.bound + i], T[tile.spacing + i] = bound, point_spacing
        square = cb * cc if cb * cc > 0.0 else 0.0
        growth[i] = int(min(math.sqrt(square), 1.0) * (GROWTH_LEVELS - 1)) if square == square else 0
        is_small = reduction.is_small(ca, T[tile.epsilon + i], point_spacing * intervals)
        depth[i] = near_axis_block.FIRST_ORDER if is_small else near_axis_block.FULL_REDUCTION
        step[i], steps[i] = propagators.RECURRENCE if is_small else propagators.EXACT, 1
        scale, omega0 = 1.0 / unit_of(Ia, Ib, Ic), T[tile.rate + i]  # the scale a power of two
        T[tile.Ia + i], T[tile.Ib + i], T[tile.Ic + i] = Ia * scale, Ib * scale, Ic * scale
        T[tile.spin + i] = 1.0 if omega0 > 0.0 else -1.0
        T[tile.rate + i] = abs(omega0) if (omega0 - omega0 == 0.0) & (omega0 != 0.0) else math.nan


@njit(nogil=True, **OPTIONS)
def _choose_steps(T, intervals, tolerance, plan):
    """Write the Taylor steps that the points need into the plan, in place of exact steps."""
    _, _, step, steps = plan
    latest, size, size_factor, coefficients = -1.0, 0.0, 0.0, (0.0, 0.0, 0.0)
    for i in range(steps.size):
        epsilon = T[tile.epsilon + i]
        if epsilon != latest:
            latest = epsilon
            size = min(1.0, measure.MAX_GROWTH * latest * math.exp(0.5))  # includes the sample after the window's end
            size_factor = math.sqrt(1.0 + latest * latest)  # the rates go with all of |omega|, not with the spin alone
            low, middle, high = direct.ORDERS
            coefficients = direct.truncation(size, low), direct.truncation(size, middle), direct.truncation(size, high)
        x = T[tile.bound + i] * T[tile.spacing + i] * size_factor
        step[i], steps[i] = direct.choose_steps(x, size, coefficients, intervals, tolerance)


@njit(nogil=True, **OPTIONS)
def _sort_points(plan):
    """Return the order of points and the starts of blocks (:func:`kernels.compile.blocks.cut`), by a plan's fields."""
    growth, depth, step, steps = plan
    keys = np.empty(steps.size, dtype=np.int64)
    for i in range(steps.size):
        kind = ((steps[i] - 1) * len(propagators.ORDER) + step[i]) * 2 + (depth[i] == near_axis_block.FULL_REDUCTION)
        keys[i] = kind * GROWTH_LEVELS + growth[i]
    return cut(keys, GROWTH_LEVELS)


@njit(nogil=True, **OPTIONS)
def _gather_block(S, T, points, steps):
    """Fill the rows of a block that are given; copies of the last point fill what its points leave."""
    for lane in range(W):
        i = np.uint64(points[min(lane, points.size - 1)])
        for r in range(NUM_GATHERED):
            S[r * W + lane] = T[np.uint64(r * ROW_LENGTH) + i]
    for lane in range(W):
        S[aux.spin_rate + lane], S[row.steps + lane] = S[row.cosine + lane], steps
        S[row.cosine + lane], S[row.sine + lane] = cosine_sine(S[row.sine + lane])


@njit(nogil=True, **OPTIONS)
def _copy_columns(S, rows, out):
    """Copy some columns of a block, whole rows of lanes at once."""
    for k in range(rows.size):
        first = (estimates.FIRST_COLUMN + rows[k]) * W
        in_row, out_row = S[first : first + W], out[k]
        for lane in range(W):
            out_row[lane] = in_row[lane]


@njit(nogil=True, **OPTIONS)
def _measure_blocks(T, plan, blocks, run, work, out):
    """Integrate and measure block after block: order[starts[j]:starts[j + 1]] are the points of block j.

    ``out``: the numbers ``rows`` of the requested columns; ``blocks_out``, shape (blocks, rows, W), to which they are
    written; and ``at``, the index in it of each point's lane.
    """
    order, starts = blocks
    rows, blocks_out, at = out
    _, intervals, tolerance, rounded = run
    _, depth, step, steps = plan
    with_reduction = work[3]
    S = scratch(estimates.ROWS)
    for j in range(starts.size - 1):
        points = order[starts[j] : starts[j + 1]]
        i = points[0]  # any point of the block
        is_reduced = with_reduction or depth[i] == near_axis_block.FULL_REDUCTION
        reduced = depth[i] if is_reduced else near_axis_block.NO_REDUCTION
        _gather_block(S, T, points, steps[i])
        near_axis_block.integrate_block(S, step[i], steps[i], intervals, work, reduced)
        estimates.write_columns(S, work, reduced, step[i], rounded, tolerance)
        _copy_columns(S, rows, blocks_out[j])
        for lane in range(points.size):
            at[points[lane]] = j * blocks_out.shape[1] * W + lane


@njit(nogil=True, **OPTIONS)
def _unsort_columns(blocks, at, low, size, out):
    """Write columns of ``size`` points in their order, from number ``low`` on, from those in the order of the blocks.

    One column at a time, written as it lies: a point's columns are far apart in memory, and to write them point by
    point takes three times as long.
    """
    for k in range(out.shape[0]):
        column, sorted_column = blocks[k * W :], out[k][low : low + size]  # both known to be contiguous
        for i in range(size):
            sorted_column[i] = column[at[i]]


def _measure_tiles(points, propagator, run, work, rows):
    """Return the columns with the numbers ``rows`` of all points, shape (columns, n), measured tile after tile."""
    I1, I2, I3, axis, omega0, epsilon, phase = points
    tile_size, out = min(I1.size, TILE), np.empty((rows.size, I1.size))
    T = np.empty(ROW_LENGTH * (NUM_GATHERED + 1))
    whole_plan = [np.empty(tile_size, dtype=np.int64) for _ in PointPlan._fields]
    # an odd number of rows: blocks that begin at multiples of half a page would share few lines of the cache
    blocks, at = np.empty((tile_size // W + 1, rows.size | 1, W)), np.empty(tile_size, dtype=np.uint32)
    for low in range(0, I1.size, TILE):
        size = min(I1.size - low, TILE)
        chunk, plan = slice(low, low + size), tuple(values[:size] for values in whole_plan)
        _write_tile(T, (I1[chunk], I2[chunk], I3[chunk], omega0[chunk], epsilon[chunk], phase[chunk]))
        _plan_points(T, axis[chunk], run.spacing, run.intervals, plan)
        if propagator == "direct":
            _choose_steps(T, run.intervals, run.tolerance, plan)
        order, starts = _sort_points(plan)
        if starts.size - 1 > blocks.shape[0]:
            blocks = np.empty((starts.size - 1, blocks.shape[1], W))
        _measure_blocks(T, plan, (order, starts), tuple(run), work, (rows, blocks, at))
        _unsort_columns(blocks.ravel(), at, low, size, out)
    return out


def measure_points(
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
        propagator (str): A key of PROPAGATORS: "direct" (Taylor steps, certified by the exact solution) or "exact" (the
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
    needed_names = {"omega_squared", "status"} if nonlinear else set()
    requested = [column for column in COLUMNS if column.name in wanted or column.name in needed_names]
    rows = np.array([MEASURED.index(column.name) for column in requested], dtype=np.int64)
    work = {column.work for column in COLUMNS if column.name in wanted}
    with_rates = bool(work & {estimates.RATES, estimates.LOG_SLOPE})
    with_exact = PROPAGATORS[propagator].is_certified and (
        with_rates or bool(work & {estimates.CERTIFICATE, estimates.ERRORS})
    )
    with_reduction = with_rates or bool(work & {estimates.REDUCTION, estimates.ERRORS})
    work_flags = near_axis_block.Work(
        with_exact, estimates.INVARIANTS in work, estimates.LOG_SLOPE in work, with_reduction, with_rates
    )
    spacing, intervals = 2.0 * np.pi / samples_per_rotation, round(rotations * samples_per_rotation)
    run = RunSettings(spacing, intervals, tolerance, rounded)
    table = _measure_tiles(points, propagator, run, tuple(work_flags), rows)
    result = {
        column.name: values.astype(column.dtype, copy=False) for column, values in zip(requested, table, strict=True)
    }
    flip_columns = _flip_columns(points, result, tolerance) if nonlinear else {}
    _leave_out_unrepresentable(result, points.omega0)
    return flip_columns | {name: result[name] for name in MEASURED if name in wanted}


def _leave_out_unrepresentable(result, omega0):
    """Set columns in s-2 to NaN if doubles cannot represent them and their errors; the status is then NON_FINITE."""
    spin = np.abs(omega0)
    is_unrepresentable = spin < MIN_SPIN
    squares = [values for name, values in result.items() if POWERS[name] == 2]
    if spin.size and spin.max() > 1.0 / MIN_SPIN:
        for values in squares:
            is_unrepresentable |= np.isinf(values)
    if not is_unrepresentable.any():
        return
    for values in squares:
        values[is_unrepresentable] = np.nan
    if "status" in result:
        status = result["status"]
        status[is_unrepresentable & (status == OK)] = NON_FINITE


def measure_flips(points, tolerance=1e-10):
    """Return the columns of :mod:`kernels.events.flips` alone, name → values, shape (n,), as :func:`measure_points`.

    The tolerance is the relative error allowed in the measured columns.
    """
    points = rigid_body.points_of(points)
    n = points.I1.size
    out = np.empty((len(flips.COLUMNS), n))
    flips.fill_columns(points, np.arange(n), tolerance, out, np.zeros(n, dtype=bool))
    return dict(zip(flips.MEASURED, out, strict=True))


def _flip_columns(points, measured, tolerance):
    """Return the columns of kernels.events.flips; a search without a result has the status short_window."""
    n, omega0, status = points.I1.size, points.omega0, measured["status"]
    out, at_limit = np.empty((len(flips.COLUMNS), n)), np.zeros(n, dtype=bool)
    finite_points = np.flatnonzero(status != NON_FINITE)
    out[:, status == NON_FINITE] = np.nan
    rate2 = measured["omega_squared"][finite_points] / omega0[finite_points] / omega0[finite_points]
    order = finite_points[np.argsort(np.abs(rate2))]  # points of similar duration share a block
    flips.fill_columns(points, order, tolerance, out, at_limit)
    status[at_limit & (status == OK)] = SHORT_WINDOW
    return dict(zip(flips.MEASURED, out, strict=True))


@np.errstate(divide="ignore", invalid="ignore")  # an impossible body gives NaN without a warning
def predict_points(points):
    """Return the columns of linear theory, of the body's shape and of the axis that its motion encircles, in units.

    omega_squared_theory (s-2), growth_rate_theory (s-1), frequency_theory (rad s-1), growing_fraction, triangle_margin
    (1), regime_theory, shape, encircles (int8), shape (n,), of points as for :func:`measure_points`.
    """
    return linear.predict_columns(rigid_body.points_of(points))


def count_motions(points):
    """Return the number of distinct motions among points: see :mod:`kernels.free.collapse`."""
    first, _ = collapse.distinct(rigid_body.points_of(points))
    return first.size


def as_motions(points):
    """Return the same motions by bodies of moments (I_a/I_c, I_b/I_c, 1) that spin about axis 1, at their own rates."""
    a, b, c = linear.moments_from_axis(*(points[name] for name in ("I1", "I2", "I3", "axis")))
    return {**points, "I1": a / c, "I2": b / c, "I3": 1.0, "axis": 1}


def measure_collapsed(points, *settings, **options):
    """Return the columns of :func:`measure_points`, each distinct motion integrated once and expanded to its points.

    Takes the arguments of :func:`measure_points`. The motion has the moments (I_a/I_c, I_b/I_c, 1) and a spin of
    one, so that a point's bits depend on the point alone; they agree with those of :func:`measure_points` to the
    rounding of the two ratios.
    """
    points = rigid_body.points_of(points)
    first, motion = collapse.distinct(points)
    motions = as_motions({name: values[first] for name, values in points._asdict().items()})
    of_motions = measure_points(motions | {"omega0": np.sign(motions["omega0"])}, *settings, rounded=True, **options)
    spin = np.abs(points.omega0)
    of_points = {name: _expand_values(values, motion, spin, POWERS[name]) for name, values in of_motions.items()}
    _leave_out_unrepresentable(of_points, points.omega0)
    return of_points


@np.errstate(all="ignore")
def _expand_values(values, at, spin, power):
    """Return the values of points from those of motions in units of the spin, from -1 to 2 times its power."""
    expanded = values[at]
    for _ in range(power):
        expanded = expanded * spin
    return expanded / spin if power < 0 else expanded


def survey(points, *settings, collapse=False, **options):
    """Return all columns of points, those of :func:`predict_points` and :func:`measure_points`.

    Theory is left out if columns are ``wanted`` and none of its columns is among them.

    Args:
        points (mapping of str to array_like): As in :func:`measure_points`.
        settings, options: Further arguments of :func:`measure_points`.
        collapse (bool): Whether to integrate each distinct motion only once, by :func:`measure_collapsed`.
    """
    measure = measure_collapsed if collapse else measure_points
    measurement = measure(points, *settings, **options)
    predicts = any(name in options.get("wanted", linear.NAMES) for name in linear.NAMES)
    return predict_points(points) | measurement if predicts else measurement
