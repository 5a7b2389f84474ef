r"""The batch: a block of points in, a block of columns out, and nothing kept that is not a column.

Time runs in radians of spin, :math:`\tau = |\omega_0|t`, and the transverse components in units of the nudge,
:math:`\omega_b = \varepsilon|\omega_0|\beta`, :math:`\omega_c = \varepsilon|\omega_0|\gamma`,
:math:`\omega_a = |\omega_0|\alpha`. In these Euler's equations keep their form,

.. math:: \alpha' = c_a\varepsilon^2\,\beta\gamma, \qquad \beta' = c_b\,\gamma\alpha, \qquad \gamma' = c_c\,\alpha\beta

so every point takes the same work whatever its spin rate, and no nudge is too small to square.

*Lanes.* W points at a time are integrated side by side: structure of arrays in one flat scratch array, row r of lane l
at ``S[r*W + l]``, and the lane loop innermost, so that LLVM makes packed instructions of it. Points that need equally
many steps share blocks, the last block is padded with copies of its last point, and no lane reads another: a point's
bits depend on the point alone.

*Blind.* The length of the run, the spacing and the number of steps come from max|c_i|, a bound on every possible rate;
what is written here is measured from samples. The columns of linear theory are made elsewhere (:mod:`kernels.linear`).
"""

import math

import numpy as np
from numba import njit

from kernels import direct, linear, measure, rigid_body
from kernels.rigid_body import OPTIONS

OK, SHORT_WINDOW, NOT_CONVERGED, NON_FINITE = range(4)

W = 32
EPSILON = float(np.finfo(np.float64).eps)

# Rows of the scratch array, each W long: the state, its steps and the two samples before.
A, B, C, KA, KB, KC, B1, C1, B2, C2 = (W * r for r in range(10))
# The measurement: first guess and sums, sense of turning, samples used, whether the window is open.
GUESS, RX, RR, XX, TURN, USED, OPEN, START, LARGEST = (W * r for r in range(10, 19))
# The state of largest size, for the halving test, and the coarse result.
AM, BM, CM, BH, CH = (W * r for r in range(19, 24))
# Invariants: coefficients, start and largest change.
CB, CC, J0, JD, JS, EA, EB, EC, E0, ED, LA, LB, LC, L0, LD = (W * r for r in range(24, 39))
# The log slope: whether its window can still come, its upper end, and its sums.
LOPEN, LCAP, LN, LK, LKK, LY, LKY, LFIRST, LLAST = (W * r for r in range(39, 48))
ROWS = 48

# Columns of the raw result, one row a point, dimensionless.
RATE2, STDERR, SIZE, FLOOR, SAMPLES, SPACING, SENSE = range(7)
LOGSLOPE, EFOLDS, EDRIFT, LDRIFT, JDRIFT, HALVING, STEPS = range(7, 14)
RAW = 14


@njit(**OPTIONS)
def _plan(I1, I2, I3, axis, epsilon, spacing, intervals, tolerance, spacings, steps):
    """Sample spacing (radians of spin) and steps per sample of each point, from a bound on every possible rate."""
    for i in range(I1.size):
        ca, cb, cc = rigid_body.euler_coefficients(*rigid_body.relabel(I1[i], I2[i], I3[i], axis[i]))
        bound = max(abs(ca), abs(cb), abs(cc))
        spacings[i] = min(spacing, 0.5 / max(1.0, bound))
        x = bound * spacings[i]
        size = min(1.0, measure.WINDOW * epsilon[i] * math.exp(x))
        x *= math.sqrt(1.0 + epsilon[i] * epsilon[i])  # the rates go with all of |omega|, not with the spin alone
        steps[i] = direct.steps_per_sample(x, size, intervals, tolerance)


@njit(**OPTIONS)
def _load(S, lane, moments, spin_sign, epsilon, phase, spacing, steps):
    """Set up one lane at its start; moments are (I_a, I_b, I_c)."""
    Ia, Ib, Ic = moments
    ca, cb, cc = rigid_body.euler_coefficients(Ia, Ib, Ic)
    h = spacing / steps
    S[A + lane], S[B + lane], S[C + lane] = spin_sign, math.cos(phase), math.sin(phase)
    S[KA + lane], S[KB + lane], S[KC + lane] = ca * epsilon * epsilon * h, cb * h, cc * h
    S[CB + lane], S[CC + lane] = cb, cc
    greatest = max(Ia, Ib, Ic)
    ja, jb, jc = Ia / greatest, Ib / greatest, Ic / greatest
    e2 = epsilon * epsilon
    S[EA + lane], S[EB + lane], S[EC + lane] = ja, jb * e2, jc * e2
    S[LA + lane], S[LB + lane], S[LC + lane] = ja * ja, jb * jb * e2, jc * jc * e2
    S[START + lane] = S[B + lane] * S[B + lane] + S[C + lane] * S[C + lane]
    below = measure.LOG_BELOW / epsilon
    S[LCAP + lane] = min(measure.LOG_TO * measure.LOG_TO * S[START + lane], below * below)


@njit(**OPTIONS)
def _begin(S):
    """Take sample 0: clear the sums, open the windows and note the invariants at the start."""
    for row in (GUESS, RX, RR, XX, TURN, JD, JS, ED, LD, LN, LK, LKK, LY, LKY, LFIRST, LLAST):
        for lane in range(W):
            S[row + lane] = 0.0
    for lane in range(W):
        a, b, c = S[A + lane], S[B + lane], S[C + lane]
        S[AM + lane], S[BM + lane], S[CM + lane] = a, b, c
        S[B1 + lane], S[C1 + lane], S[B2 + lane], S[C2 + lane] = b, c, b, c
        S[USED + lane], S[OPEN + lane], S[LOPEN + lane] = 1.0, 1.0, 1.0
        S[LARGEST + lane] = S[START + lane]
        J, S[JS + lane] = rigid_body.perturbation_invariant(b, c, S[CB + lane], S[CC + lane])
        S[J0 + lane] = J
        S[E0 + lane] = S[EA + lane] * (a * a) + (S[EB + lane] * (b * b) + S[EC + lane] * (c * c))
        S[L0 + lane] = S[LA + lane] * (a * a) + (S[LB + lane] * (b * b) + S[LC + lane] * (c * c))


@njit(**OPTIONS)
def _advance(S, steps):
    """Advance every lane by one sample interval."""
    for _ in range(steps):
        for lane in range(W):
            a, b, c = direct.step(S[A + lane], S[B + lane], S[C + lane], S[KA + lane], S[KB + lane], S[KC + lane])
            S[A + lane] = a
            S[B + lane] = b
            S[C + lane] = c


@njit(**OPTIONS)
def _sample(S, triple):
    """Take one sample of every lane: window, turning, recurrence sums and invariants.

    A closed window selects the old value everywhere, so a lane that has left it no longer changes. The recurrence
    takes part from the third sample on (``triple``).
    """
    for lane in range(W):
        a, b, c = S[A + lane], S[B + lane], S[C + lane]
        b1, c1, b2, c2 = S[B1 + lane], S[C1 + lane], S[B2 + lane], S[C2 + lane]
        size = b * b + c * c
        inside = (S[OPEN + lane] > 0.0) & (size <= measure.WINDOW * measure.WINDOW * S[START + lane])
        weight = 1.0 if inside else 0.0
        S[OPEN + lane] = weight
        S[USED + lane] += weight
        rx, rr, xx = measure.leftover(b, c, b1, c1, b2, c2, S[GUESS + lane])
        S[RX + lane] += rx if inside & triple else 0.0
        S[RR + lane] += rr if inside & triple else 0.0
        S[XX + lane] += xx if inside & triple else 0.0
        turn = (b1 * c - c1 * b) * a  # the sense relative to the spin, whose sign a carries
        S[TURN + lane] += turn if inside else 0.0
        J, scale = rigid_body.perturbation_invariant(b, c, S[CB + lane], S[CC + lane])
        jd = abs(J - S[J0 + lane])
        S[JD + lane] = jd if inside & (jd > S[JD + lane]) else S[JD + lane]
        S[JS + lane] = scale if inside & (scale > S[JS + lane]) else S[JS + lane]
        E = S[EA + lane] * (a * a) + (S[EB + lane] * (b * b) + S[EC + lane] * (c * c))
        ed = abs(E - S[E0 + lane])
        S[ED + lane] = ed if inside & (ed > S[ED + lane]) else S[ED + lane]
        L = S[LA + lane] * (a * a) + (S[LB + lane] * (b * b) + S[LC + lane] * (c * c))
        ld = abs(L - S[L0 + lane])
        S[LD + lane] = ld if inside & (ld > S[LD + lane]) else S[LD + lane]
        larger = inside & (size > S[LARGEST + lane])
        S[LARGEST + lane] = size if larger else S[LARGEST + lane]
        S[AM + lane] = a if larger else S[AM + lane]
        S[BM + lane] = b if larger else S[BM + lane]
        S[CM + lane] = c if larger else S[CM + lane]
        S[B2 + lane], S[C2 + lane] = b1, c1
        S[B1 + lane], S[C1 + lane] = b, c


@njit(**OPTIONS)
def _guess(S):
    """Set the first guess of every lane from its first three samples; the current state is the third."""
    for lane in range(W):
        S[GUESS + lane] = measure.first_guess(
            S[B + lane], S[C + lane], S[B1 + lane], S[C1 + lane], S[B2 + lane], S[C2 + lane]
        )


@njit(**OPTIONS)
def _log_sample(S, k):
    """Add sample k to the log slope of every lane that is inside its window."""
    for lane in range(W):
        size = S[B + lane] * S[B + lane] + S[C + lane] * S[C + lane]
        grown = size >= measure.LOG_FROM * measure.LOG_FROM * S[START + lane]
        begun = S[LN + lane] > 0.0
        # once entered, the window closes at either end; it can be entered only while the main window is open
        stays = (size <= S[LCAP + lane]) & (grown | ~begun) & ((S[OPEN + lane] > 0.0) | begun)
        inside = grown & stays & (S[LOPEN + lane] > 0.0)
        S[LOPEN + lane] = S[LOPEN + lane] if stays else 0.0
        y = 0.5 * measure.logarithm(size)
        first = inside & (S[LN + lane] == 0.0)
        S[LFIRST + lane] = y if first else S[LFIRST + lane]
        S[LLAST + lane] = y if inside else S[LLAST + lane]
        S[LN + lane] += 1.0 if inside else 0.0
        S[LK + lane] += k if inside else 0.0
        S[LKK + lane] += k * k if inside else 0.0
        S[LY + lane] += y if inside else 0.0
        S[LKY + lane] += k * y if inside else 0.0


@njit(**OPTIONS)
def _watch(S):
    """Whether any lane's window is open, and whether any lane is inside the log slope's window or may now enter it."""
    opened, logging = 0, 0  # whole numbers: their or-reduction stays packed
    for lane in range(W):
        size = S[B + lane] * S[B + lane] + S[C + lane] * S[C + lane]
        grown = size >= measure.LOG_FROM * measure.LOG_FROM * S[START + lane]
        opened |= 1 if S[OPEN + lane] > 0.0 else 0
        logging |= 1 if (S[LOPEN + lane] > 0.0) & (grown | (S[LN + lane] > 0.0)) else 0
    return opened > 0, logging > 0


@njit(**OPTIONS)
def _halve(S, steps):
    """Run the interval that begins at each lane's largest state twice, with steps and with twice as many."""
    for lane in range(W):
        S[A + lane], S[B + lane], S[C + lane] = S[AM + lane], S[BM + lane], S[CM + lane]
    _advance(S, steps)
    for lane in range(W):
        S[BH + lane], S[CH + lane] = S[B + lane], S[C + lane]
        S[A + lane], S[B + lane], S[C + lane] = S[AM + lane], S[BM + lane], S[CM + lane]
        S[KA + lane] *= 0.5
        S[KB + lane] *= 0.5
        S[KC + lane] *= 0.5
    _advance(S, 2 * steps)


@njit(**OPTIONS)
def _floor(moments, size):
    """Size of a rate² (in spin²) that a finite amplitude, or the rounding of the moments, makes by itself.

    With components up to ``size`` the effective Omega² wanders by c_a max(c_b, c_c) size²; a body that can exist has
    c_i <= 1, and the allowance of 10 size² holds it. A difference of moments is known to one rounding of the greater.
    """
    Ia, Ib, Ic = moments
    ca, cb, cc = rigid_body.euler_coefficients(Ia, Ib, Ic)
    amplitude = 10.0 * size * size * max(1.0, abs(ca) * max(abs(cb), abs(cc)))
    rounding = 2.0 * EPSILON * (abs(cb) * max(Ia, Ib) / Ic + abs(cc) * max(Ia, Ic) / Ib)
    return max(amplitude, rounding)


@njit(**OPTIONS)
def _unload(S, lane, moments, epsilon, spacing, steps, row):
    """Turn one lane's sums into its row of the raw result."""
    used = S[USED + lane]
    row[RATE2], row[STDERR] = measure.estimate(
        S[GUESS + lane], S[RX + lane], S[RR + lane], S[XX + lane], used - 2.0, spacing
    )
    row[SIZE] = epsilon * math.sqrt(S[LARGEST + lane])
    row[SAMPLES], row[SPACING], row[STEPS] = used, spacing, steps
    row[SENSE] = S[TURN + lane]
    slope = measure.line_slope(S[LN + lane], S[LK + lane], S[LKK + lane], S[LY + lane], S[LKY + lane])
    row[LOGSLOPE] = slope / spacing
    row[EFOLDS] = S[LLAST + lane] - S[LFIRST + lane] if S[LN + lane] >= 2.0 else math.nan
    row[EDRIFT] = S[ED + lane] / S[E0 + lane]
    row[LDRIFT] = S[LD + lane] / S[L0 + lane]
    row[JDRIFT] = S[JD + lane] / S[JS + lane] if S[JS + lane] > 0.0 else 0.0
    difference = math.hypot(S[BH + lane] - S[B + lane], S[CH + lane] - S[C + lane])
    row[HALVING] = difference / math.sqrt(S[LARGEST + lane])
    row[FLOOR] = _floor(moments, row[SIZE])


@njit(nogil=True, **OPTIONS)
def _run_blocks(I1, I2, I3, axis, omega0, epsilon, phase, spacings, steps, order, starts, intervals, raw):
    """Integrate and measure block after block: order[starts[j]:starts[j + 1]] are the points of block j."""
    S = np.empty(ROWS * W)
    for j in range(starts.size - 1):
        first, count = starts[j], starts[j + 1] - starts[j]
        n = steps[order[first]]
        for lane in range(W):
            i = order[first + min(lane, count - 1)]
            moments = rigid_body.relabel(I1[i], I2[i], I3[i], axis[i])
            spin = 1.0 if omega0[i] > 0.0 else -1.0
            _load(S, lane, moments, spin, epsilon[i], phase[i], spacings[i], n)
        _begin(S)
        _follow(S, n, intervals)
        _halve(S, n)
        for lane in range(count):
            i = order[first + lane]
            moments = rigid_body.relabel(I1[i], I2[i], I3[i], axis[i])
            _unload(S, lane, moments, epsilon[i], spacings[i], n, raw[i])


@njit(**OPTIONS)
def _follow(S, steps, intervals):
    """Follow every lane through the run, or until the last window of the block has closed."""
    for k in range(1, intervals + 1):
        _advance(S, steps)
        if k == 2:
            _guess(S)
        _sample(S, k >= 2)
        opened, logging = _watch(S)
        if logging:
            _log_sample(S, float(k))
        elif not opened:
            break


def _blocks(steps):
    """Order of the points and starts of the blocks: points of equally many steps together, W at a time."""
    order = np.argsort(steps, kind="stable")
    bounds = np.flatnonzero(np.diff(steps[order])) + 1
    groups = zip(np.r_[0, bounds], np.r_[bounds, steps.size], strict=True)
    starts = np.concatenate([np.arange(lo, hi, W) for lo, hi in groups])
    return order, np.r_[starts, steps.size]


def _point_arrays(points):
    """Contiguous arrays of one length for the seven coordinates of the points."""
    names = ("I1", "I2", "I3", "axis", "omega0", "epsilon", "phase")
    arrays = np.broadcast_arrays(*(np.atleast_1d(points[name]) for name in names))
    kinds = (np.int64 if name == "axis" else np.float64 for name in names)
    return tuple(np.ascontiguousarray(x, dtype=kind) for x, kind in zip(arrays, kinds, strict=True))


def run(points, rotations, samples_per_rotation, tolerance):
    """Integrate and measure points; the raw result before anything is named.

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

    Returns
    -------
    numpy.ndarray, shape (n, RAW)
        Dimensionless columns RATE2 ... STEPS; nothing is checked and nothing raised.
    """
    I1, I2, I3, axis, omega0, epsilon, phase = _point_arrays(points)
    intervals = round(rotations * samples_per_rotation)
    spacings, steps = np.empty(I1.size), np.empty(I1.size, dtype=np.int64)
    raw = np.empty((I1.size, RAW))
    if I1.size:
        spacing = 2.0 * np.pi / samples_per_rotation
        _plan(I1, I2, I3, axis, epsilon, spacing, intervals, tolerance, spacings, steps)
        order, starts = _blocks(steps)
        _run_blocks(I1, I2, I3, axis, omega0, epsilon, phase, spacings, steps, order, starts, intervals, raw)
    return raw


def _regime(raw, sphere):
    """Measured regime of each row: from the signed rate², its error and floor, and the sense of turning."""
    marginal = ~(np.abs(raw[:, RATE2]) > np.fmax(5.0 * raw[:, STDERR], raw[:, FLOOR]))
    cases = [sphere, marginal, raw[:, RATE2] < 0.0, raw[:, SENSE] < 0.0]
    kinds = [linear.SPHERE, linear.MARGINAL, linear.UNSTABLE, linear.STABLE_MINOR]
    return np.select(cases, kinds, linear.STABLE_MAJOR).astype(np.int8)


def _status(raw, spin, tolerance, intervals):
    """Status of each row; the halving test allows 4 units of rounding a step, added up as random signs do."""
    rounding = 4.0 * EPSILON * np.sqrt(raw[:, STEPS])
    converged = (raw[:, HALVING] - rounding) * intervals <= tolerance
    not_converged = ~converged  # a halving test that overflowed has failed too
    short = raw[:, SAMPLES] < measure.LEAST_SAMPLES
    unmeasured, unfollowed = (~np.isfinite(raw[:, column] * spin) for column in (RATE2, HALVING))
    # fewer than three samples of a sound motion give no rate either, but that is a short window
    cases = [unmeasured & (unfollowed | ~short), short, not_converged]
    return np.select(cases, [NON_FINITE, SHORT_WINDOW, NOT_CONVERGED], OK).astype(np.int8)


def measured(points, rotations, samples_per_rotation, tolerance):
    """Measured columns of points, in units.

    Parameters
    ----------
    points, rotations, samples_per_rotation, tolerance
        As for :func:`run`.

    Returns
    -------
    dict of str to numpy.ndarray, shape (n,)
        omega_squared, omega_squared_stderr (s-2); growth_rate, growth_rate_stderr, growth_rate_logslope (s-1);
        frequency, frequency_stderr (rad s-1); e_folds, energy_drift, momentum_drift, perturbation_drift (1);
        window_end (s); samples_used, steps_per_sample (int32); regime, status (int8). NaN where missing, -1 for a
        regime that could not be measured.
    """
    raw = run(points, rotations, samples_per_rotation, tolerance)
    I1, I2, I3, _, omega0, _, _ = _point_arrays(points)
    spin = np.where(np.isfinite(omega0) & (omega0 != 0.0), np.abs(omega0), np.nan)
    status = _status(raw, spin, tolerance, round(rotations * samples_per_rotation))
    known = np.isfinite(raw[:, RATE2] * spin)
    regime = np.where(known, _regime(raw, (I1 == I2) & (I2 == I3)), -1).astype(np.int8)
    # rates come from dimensionless squares: a spin of 1e-150 rad/s squared leaves the normal doubles
    growth_rate, frequency = (np.where(known, rate * spin, np.nan) for rate in linear.rates(raw[:, RATE2], regime))
    logged = (regime == linear.UNSTABLE) & np.isfinite(raw[:, EFOLDS])
    long = logged & (raw[:, EFOLDS] >= measure.LEAST_EFOLDS)
    return {
        "omega_squared": raw[:, RATE2] * spin * spin,
        "omega_squared_stderr": raw[:, STDERR] * spin * spin,
        "growth_rate": growth_rate,
        "growth_rate_stderr": _rate_stderr(raw[:, STDERR], growth_rate, spin),
        "frequency": frequency,
        "frequency_stderr": _rate_stderr(raw[:, STDERR], frequency, spin),
        "growth_rate_logslope": np.where(long, raw[:, LOGSLOPE] * spin, np.nan),
        "e_folds": np.where(logged, raw[:, EFOLDS], np.nan),
        "regime": regime,
        "samples_used": raw[:, SAMPLES].astype(np.int32),
        "window_end": (raw[:, SAMPLES] - 1.0) * raw[:, SPACING] / spin,
        "steps_per_sample": raw[:, STEPS].astype(np.int32),
        "status": status,
        "energy_drift": raw[:, EDRIFT],
        "momentum_drift": raw[:, LDRIFT],
        "perturbation_drift": raw[:, JDRIFT],
    }


def _rate_stderr(stderr, rate, spin):
    """Standard error of a rate from that of its square in spin²; NaN where the rate is 0."""
    return np.divide(0.5 * stderr * spin, rate / spin, out=np.full_like(rate, np.nan), where=rate > 0.0)


@np.errstate(divide="ignore", invalid="ignore")  # a point that is no body gives NaN, and no noise
def theory(points):
    """Columns of linear theory and of the body's shape, in units.

    Parameters
    ----------
    points : mapping of str to array_like, shape (n,)
        As for :func:`run`.

    Returns
    -------
    dict of str to numpy.ndarray, shape (n,)
        omega_squared_theory (s-2), growth_rate_theory (s-1), frequency_theory (rad s-1), growing_fraction,
        triangle_margin (1), regime_theory, shape (int8).
    """
    I1, I2, I3, axis, omega0, _, phase = _point_arrays(points)
    spin = np.abs(omega0)
    regime = linear.regime(I1, I2, I3, axis)
    growth_rate, frequency = (rate * spin for rate in linear.rates(linear.omega_squared(I1, I2, I3, 1.0, axis), regime))
    return {
        "omega_squared_theory": linear.omega_squared(I1, I2, I3, omega0, axis),
        "growth_rate_theory": growth_rate,
        "frequency_theory": frequency,
        "regime_theory": regime,
        "shape": rigid_body.shape(I1, I2, I3),
        "growing_fraction": linear.growing_fraction(I1, I2, I3, omega0, axis, phase),
        "triangle_margin": rigid_body.triangle_margin(I1, I2, I3),
    }


def survey(points, rotations, samples_per_rotation, tolerance):
    """All columns of points: :func:`theory` beside :func:`measured`, which does not know it."""
    return theory(points) | measured(points, rotations, samples_per_rotation, tolerance)
