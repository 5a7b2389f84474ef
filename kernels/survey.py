r"""The batch: a block of points in, a block of columns out, and nothing kept that is not a column.

Points are taken a tile at a time. Those of it that need equally many steps of one order are followed together, W at a
time (:mod:`kernels.lanes`); among them those of like growth stand together, so that a block ends when its last window
closes. The last block of each kind is padded with copies of its last point. None of that changes a bit of any point.

*Blind.* The length of the run, the spacing and the number of steps come from max|c_i|, a bound on every possible rate;
what is written here as measured comes from samples. Linear theory decides in which order points are taken, and no
more; its columns are made elsewhere (:mod:`kernels.linear`).
"""

import math

import numpy as np
from numba import boolean, float64, int64, njit, types

from kernels import (
    circular,
    collapse,
    columns,
    direct,
    findings,
    flips,
    foretold,
    lanes,
    linear,
    measure,
    reduction,
    rigid_body,
    solution,
)
from kernels.blocks import W, cut, scratch
from kernels.findings import COLUMNS, MEASURED
from kernels.options import OPTIONS
from kernels.statuses import NON_FINITE, OK, SHORT_WINDOW

TILE = 4096  # points that are planned, sorted and measured together: their columns stay in a core's own cache
LEVELS = 16  # of growth, by which points of one kind are sorted

POINT = ("I1", "I2", "I3", "axis", "omega0", "epsilon", "phase")
AT = columns.numbers(MEASURED)
POWERS = columns.powers(COLUMNS, flips.COLUMNS)


@njit(nogil=True, **OPTIONS)
def _plan(I1, I2, I3, axis, epsilon, spacing, intervals, tolerance, exactly, plan, keys):
    """Sample spacing (radians of spin), order, steps per sample, reduction and sorting key of each point."""
    spacings, orders, steps, reduced = plan
    known, size, whole, coefficients = -1.0, 0.0, 0.0, (0.0, 0.0, 0.0)
    for i in range(I1.size):
        ca, cb, cc = rigid_body.euler_coefficients(*rigid_body.relabel(I1[i], I2[i], I3[i], axis[i]))
        bound = max(abs(ca), abs(cb), abs(cc))
        spacings[i] = min(spacing, 0.5 / max(1.0, bound))
        if epsilon[i] != known:
            known = epsilon[i]
            size = min(1.0, measure.WINDOW * known * math.exp(0.5))  # the sample after the window's end included
            whole = math.sqrt(1.0 + known * known)  # the rates go with all of |omega|, not with the spin alone
            coefficients = (
                direct.truncation(size, 8),
                direct.truncation(size, 10),
                direct.truncation(size, 12),
            )
        orders[i], steps[i], kind = lanes.EXACT, 1, 0
        if not exactly:
            orders[i], steps[i] = direct.choose(bound * spacings[i] * whole, size, coefficients, intervals, tolerance)
            nearest = orders[i] < -direct.NEAREST
            order = abs(orders[i]) - (direct.NEAREST if nearest else 0)
            kind = (order - 8) // 2 * 3 + (2 if nearest else (1 if orders[i] < 0 else 0))  # 0 to 8
        growth = cb * cc if cb * cc > 0.0 else 0.0
        level = int(min(math.sqrt(growth), 1.0) * (LEVELS - 1)) if growth == growth else 0
        small = reduction.is_small(ca, known, spacings[i] * intervals)
        reduced[i] = lanes.FIRST_ORDER if small else lanes.WHOLE
        orders[i] = -orders[i] if exactly and small else orders[i]
        keys[i] = ((9 * (steps[i] - 1) + kind) * 2 + (0 if small else 1)) * LEVELS + level


_PLANNED = types.Tuple((float64[::1], int64[::1], int64[::1], int64[::1]))
_POINTS = (float64[::1], float64[::1], float64[::1], int64[::1], float64[::1])
PARTS = (
    (_plan, (*_POINTS, float64, int64, float64, boolean, _PLANNED, int64[::1])),
    *lanes.PARTS,
    *findings.PARTS,
)


@njit(nogil=True, **OPTIONS)
def _load(S, lane, moments, spin, epsilon, phase, spacing, steps):
    """Fill the rows of one lane that are given, but for the phase in the place of its sine; moments (I_a, I_b, I_c)."""
    Ia, Ib, Ic = moments
    scale = 1.0 / solution.unit_of(Ia, Ib, Ic)  # powers of two both
    S[lanes.MA + lane], S[lanes.MB + lane], S[lanes.MC + lane] = Ia * scale, Ib * scale, Ic * scale
    S[lanes.SPIN + lane] = spin
    S[lanes.EPSILON + lane], S[lanes.SINE + lane] = epsilon, circular.within(phase)
    S[lanes.SPACING + lane], S[lanes.STEPS + lane] = spacing, steps


@njit(nogil=True, **OPTIONS)
def _keep(S, rows, kept):
    """Columns of a block that are marked, whole rows of lanes at once."""
    for row in range(rows.size):
        if rows[row]:
            for lane in range(W):
                kept[row, lane] = S[(findings.FIRST + row) * W + lane]


@njit(nogil=True, **OPTIONS)
def _run(I1, I2, I3, axis, omega0, epsilon, phase, plan, blocks, intervals, tolerance, rounded, groups, rows, kept, at):
    """Integrate and measure block after block: order[starts[j]:starts[j + 1]] are the points of block j.

    Columns go to ``kept``, shape (blocks, rows, W); ``at`` tells where a point's lane lies in it.
    """
    spacings, orders, steps, reduced = plan
    order, starts = blocks
    certified, invariants, logged, reducing = groups
    S = scratch(findings.ROWS)
    for j in range(starts.size - 1):
        first, count = starts[j], starts[j + 1] - starts[j]
        head = order[first]
        for lane in range(W):
            i = order[first + min(lane, count - 1)]
            spin = 1.0 if omega0[i] > 0.0 else -1.0
            moments = rigid_body.relabel(I1[i], I2[i], I3[i], axis[i])
            _load(S, lane, moments, spin, epsilon[i], phase[i], spacings[i], steps[i])
            known = math.isfinite(omega0[i]) and omega0[i] != 0.0
            S[findings.MORE.spin_rate + lane] = abs(omega0[i]) if known else math.nan
        for lane in range(W):
            S[lanes.COSINE + lane], S[lanes.SINE + lane] = circular.cosine_sine(S[lanes.SINE + lane])
        exactly = abs(orders[head]) == lanes.EXACT
        depth = reduced[head] if reducing or reduced[head] == lanes.WHOLE else lanes.NONE
        lanes.follow(S, orders[head], steps[head], intervals, certified, invariants, logged, depth)
        findings.tell(S, certified, invariants, logged, depth, exactly, rounded, tolerance)
        _keep(S, rows, kept[j])
        for lane in range(count):
            at[order[first + lane]] = j * kept.shape[1] * W + lane


@njit(nogil=True, **OPTIONS)
def _sort_back(rows, kept, at, low, size, out):
    """Columns of ``size`` points in their order, from number ``low`` on, from those in the order of the blocks.

    One column at a time, written as it lies: a point's columns are far apart in memory, and to write them point by
    point takes three times as long.
    """
    for row in range(rows.size):
        if rows[row]:
            column, own = kept[row * W :], out[row][low : low + size]  # both known to be contiguous
            for i in range(size):
                own[i] = column[at[i]]


@njit(nogil=True, **OPTIONS)
def _measure(arrays, spacing, intervals, tolerance, exactly, rounded, groups, rows, out):
    """Measure tile after tile into those rows of ``out`` that are marked; the others are left as they are."""
    I1, I2, I3, axis, omega0, epsilon, phase = arrays
    room = min(I1.size, TILE)
    spacings, orders, steps = np.empty(room), np.empty(room, dtype=np.int64), np.empty(room, dtype=np.int64)
    keys = np.empty(room, dtype=np.int64)
    plan = (spacings, orders, steps, np.empty(room, dtype=np.int64))
    # an odd number of rows: blocks that begin at multiples of half a page would share few lines of the cache
    kept, at = np.empty((room // W + 1, rows.size | 1, W)), np.empty(room, dtype=np.uint64)
    for low in range(0, I1.size, TILE):
        size = min(I1.size - low, TILE)
        part = slice(low, low + size)
        bodies, nudge = (I1[part], I2[part], I3[part], axis[part]), epsilon[part]
        _plan(*bodies, nudge, spacing, intervals, tolerance, exactly, plan, keys)
        order, starts = cut(keys[:size], LEVELS)
        turn = (omega0[part], nudge, phase[part])
        if starts.size - 1 > kept.shape[0]:
            kept = np.empty((starts.size - 1, kept.shape[1], W))
        _run(*bodies, *turn, plan, (order, starts), intervals, tolerance, rounded, groups, rows, kept, at)
        _sort_back(rows, kept.ravel(), at, low, size, out)


def _point_arrays(points):
    """Arrays of one length for the seven coordinates of the points, in the one form that is compiled for."""
    dtypes = [np.int64 if name == "axis" else np.float64 for name in POINT]
    return columns.arrays(*(points[name] for name in POINT), dtypes=dtypes)


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
    """Measured columns of points, in units.

    Parameters
    ----------
    points : mapping of str to array_like, shape (n,)
        I1, I2, I3 (common unit, > 0), axis (1, 2, 3), omega0 (rad s-1, not 0), epsilon (between 0 and 1), phase (rad).
    rotations : float
        Length of the run, in 2 pi/|omega0|.
    samples_per_rotation : int
        Samples in 2 pi/|omega0|; the spacing shrinks where max|c_i| > 1.
    tolerance : float
        Relative error of the perturbation allowed over the run.
    propagator : str
        "direct" (Taylor steps, certified by the exact solution) or "exact" (the exact step, one a sample).
    wanted : collection of str
        Columns to make, of MEASURED; without the drifts, the log slope, the certificate or the errors the work for
        them is saved.
    nonlinear : bool
        Whether to follow the motion on to its flips and its largest tilt (:mod:`kernels.flips`).
    rounded : bool
        Whether the moments are ratios that were rounded once each: errors then hold what that moves.

    Returns
    -------
    dict of str to numpy.ndarray, shape (n,)
        omega_squared with its _stderr and _error, omega_squared_reduced and its _error, amplitude_shift, the terms
        omega_squared_error_scatter, _integration, _amplitude and _rounding (s-2); growth_rate (s-1) and frequency (rad
        s-1) with _stderr, _error, _reduced and _reduced_error, growth_rate_logslope and its _error (s-1); euler_period,
        window_end (s); e_folds, energy_drift, momentum_drift, perturbation_drift, propagation_error (1); samples_used,
        steps_per_sample (int32); regime, status (int8).
        If ``nonlinear``, flip_period, flip_period_exact (s), max_tilt, max_tilt_exact (rad), frequency_exact (rad s-1).
        NaN where missing, -1 for a regime that could not be measured. Nothing is checked and nothing raised.
    """
    arrays = _point_arrays(points)
    n, intervals = arrays[0].size, round(rotations * samples_per_rotation)
    needed = {"omega_squared", "status"} if nonlinear else set()
    rows, out = np.array([name in wanted or name in needed for name in MEASURED]), np.empty((len(MEASURED), n))
    work = {column.work for column in COLUMNS if column.name in wanted}
    certified = propagator == "direct" and bool(work & {findings.CERTIFICATE, findings.ERRORS, findings.LOG_SLOPE})
    reducing = bool(work & {findings.REDUCTION, findings.ERRORS, findings.LOG_SLOPE})
    groups = (certified, findings.INVARIANTS in work, findings.LOG_SLOPE in work, reducing)
    spacing = 2.0 * np.pi / samples_per_rotation
    _measure(arrays, spacing, intervals, tolerance, propagator == "exact", rounded, groups, rows, out)
    found = _nonlinear(arrays, out, tolerance) if nonlinear else {}
    return found | {
        column.name: values.astype(column.dtype, copy=False)
        for column, values in zip(COLUMNS, out, strict=True)
        if column.name in wanted
    }


def flipped(points, tolerance=1e-10):
    """Columns of :mod:`kernels.flips` alone, the points taken as they come: name → values, shape (n,).

    Parameters
    ----------
    points : mapping
        As for :func:`survey`.
    tolerance : float
        Relative error allowed in the measured columns.
    """
    arrays = _point_arrays(points)
    n = arrays[0].size
    found = np.empty((len(flips.COLUMNS), n))
    flips.fill(*arrays, np.arange(n), tolerance, found, np.zeros(n, dtype=bool))
    return dict(zip(flips.MEASURED, found, strict=True))


def _nonlinear(arrays, out, tolerance):
    """Columns of kernels.flips; a search that was given up is a window too short."""
    n, omega0 = arrays[0].size, arrays[4]
    found, given_up = np.empty((len(flips.COLUMNS), n)), np.zeros(n, dtype=bool)
    sound = np.flatnonzero(out[AT.status] != NON_FINITE)
    found[:, out[AT.status] == NON_FINITE] = np.nan
    rate2 = out[AT.omega_squared, sound] / omega0[sound] / omega0[sound]
    order = sound[np.argsort(np.abs(rate2))]  # of like duration together
    flips.fill(*arrays, order, tolerance, found, given_up)
    out[AT.status, given_up & (out[AT.status] == OK)] = SHORT_WINDOW
    return dict(zip(flips.MEASURED, found, strict=True))


@np.errstate(divide="ignore", invalid="ignore")  # a point that is no body gives NaN, and no noise
def theory(points):
    """Columns of linear theory and of the body's shape, in units.

    Parameters
    ----------
    points : mapping of str to array_like, shape (n,)
        As for :func:`measured`.

    Returns
    -------
    dict of str to numpy.ndarray, shape (n,)
        omega_squared_theory (s-2), growth_rate_theory (s-1), frequency_theory (rad s-1), growing_fraction,
        triangle_margin (1), regime_theory, shape (int8).
    """
    I1, I2, I3, axis, omega0, _, phase = _point_arrays(points)
    return foretold.columns_of(I1, I2, I3, axis, omega0, phase)


def motions(points):
    """Number of distinct motions among points: see :mod:`kernels.collapse`."""
    first, _ = collapse.distinct(*_point_arrays(points))
    return first.size


def as_motions(points):
    """The same motions by bodies of the moments (I_a/I_c, I_b/I_c, 1) that spin about axis 1, at their own rates."""
    a, b, c = linear.seen_from(*(points[name] for name in ("I1", "I2", "I3", "axis")))
    return {**points, "I1": a / c, "I2": b / c, "I3": 1.0, "axis": 1}


def collapsed(points, *settings, **options):
    """The columns of :func:`measured`, each distinct motion integrated once and expanded to all its points.

    Takes the arguments of :func:`measured`. What is integrated is the motion itself, moments (I_a/I_c, I_b/I_c, 1) at a
    spin of one, so that a point's bits depend on the point alone; they agree with those of :func:`measured` to the
    rounding of the two ratios.
    """
    arrays = dict(zip(POINT, _point_arrays(points), strict=True))
    first, motion = collapse.distinct(*arrays.values())
    motions = as_motions({name: values[first] for name, values in arrays.items()})
    found = measured(motions | {"omega0": np.sign(motions["omega0"])}, *settings, rounded=True, **options)
    spin = np.abs(arrays["omega0"])
    return {name: _expanded(values, motion, spin, POWERS[name]) for name, values in found.items()}


@njit(nogil=True, **OPTIONS)
def _expanded(values, at, spin, power):
    """Values of motions, in units of the spin, as those of points, by as many factors as :func:`measured` uses."""
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
    """All columns of points: :func:`theory` beside :func:`measured` (or :func:`collapsed`), which does not know it."""
    measure = collapsed if collapse else measured
    return theory(points) | measure(points, *settings, **options)
