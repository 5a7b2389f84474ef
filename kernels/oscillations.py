r"""Small oscillations: full motions from a nudge, many side by side, measured mode by mode.

A point is a system with numbers in it, an equilibrium q0 and one of its modes. Its motion is advanced by functions that
were written for the system (:mod:`kernels.runs`), and sampled as :math:`x = (q - q_0)/\varepsilon`.

With :math:`v_k` the modes (:math:`v^{\mathsf T} a v = 1`) and :math:`a` the kinetic matrix at the equilibrium, the
mode coordinates are

.. math:: \xi_k = v_k^{\mathsf T} a\, x, \qquad
          \xi_k = \tfrac12\left(\xi_k[+\varepsilon] - \xi_k[-\varepsilon]\right) \text{ where two runs are made:}

half the difference of the runs from +ε and −ε has no odd power of ε. Further runs start from half and from a quarter of
the nudge, from both sides or one alike. What moves the rate² then goes with even powers of ε, so that of the rates² f,
f_½ and f_¼ of the three sizes, over the same samples,

.. math:: R = \tfrac13\left(4f_{1/2} - f\right), \qquad
          \omega^2_{\text{reduced}} = \tfrac13\left(4f_{1/4} - f_{1/2}\right), \qquad
          b = \tfrac1{15}\left|\omega^2_{\text{reduced}} - R\right|

have nothing of the second order, and b is what the reduced rate² has of the fourth: 1/64 of what f has. Extrapolated
twice, :math:`\tfrac1{15}(16\,\omega^2_{\text{reduced}} - R)`, it has nothing of the fourth either, and 1/64 of what f
has of the sixth. Neither can be seen in three rates². But the samples, extrapolated alike,
:math:`\tfrac1{45}(64\,\xi_{1/4} - 20\,\xi_{1/2} + \xi)`, have 1/64 of the sixth order of theirs: the root mean square
of their residuals, as a rate², says how large that is, and at small nudges it is the scatter of rounding alone.
The nudged mode is sampled every h and
measured by the recurrence of :mod:`kernels.measure`, which asks for no regime. Samples count until it has grown
tenfold or, after the first seven, beyond LARGE, or another mode exceeds a tenth of its largest value so far. Where the
nudge has a direction of its own and every mode its share of it, the others may be as large as a share can grow: 10
times the whole nudge. The log slope of
:mod:`kernels.measure` is taken besides, in its own window.

*Blind.* Spacing, length and number of steps come from the scale S of the system (a bound on every possible rate), and
nothing here knows a theoretical rate; the theory's mode is used as a direction only.

Lanes are as in :mod:`kernels.blocks`.

Source: Landau and Lifshitz, Mechanics, sections 21 and 23 (normal coordinates).
"""

import math

import numpy as np

from kernels import measure, reduction
from kernels.blocks import W
from kernels.codes import UNIT
from kernels.columns import numbers
from kernels.jit import INNER, OPTIONS, PASSED, float64, int64, njit, void, whole_vectors
from kernels.runs import CHANGE, GIVEN, LARGER, LEAST_SPAN, SPACING, TAKEN, Measurement, at_zero, has_converged, refined
from kernels.statuses import NON_FINITE, NOT_CONVERGED, OK, SHORT_WINDOW

STABLE, UNSTABLE, MARGINAL = range(3)

OTHERS = 0.1  # the window ends where another mode exceeds this part of the nudged one
LARGE = 0.3  # the window ends beyond this part of the system's own size, but not before seven samples

THIRD = 1.0 / 3.0
BOTH = 5.0 / 3.0  # what comes together of two runs' errors in their extrapolation
# In what the extrapolation leaves (see errors): of the fourth order, and how fast orders fall; of the sixth, of whose
# residuals so much at least is unknown; by how much a third harmonic's residual counts.
NEXT, GROWING, SIXTH, UNKNOWN, HARMONIC = 2.0, 3.0, 2.0, 0.2, 9.0
SHORT = 4.0  # added to SIXTH in a window of less than a turn, whose residuals show less of the sixth order
ALONE = 1.0 - 1e-9  # least share of the perturbation with which a mode counts as the only one that moves
SEEN = 10.0  # times the rounding: residuals that are more are no rounding
CONVERGED = 0.003  # largest sixth order, relative to the rate² or 1/T², with which the extrapolation counts

# Rows of a block, W lanes each, after the first of `runs`: what is given (see `run`), and what samples sum up to.
START, ALLOWED, LIMIT, LCAP = range(GIVEN, GIVEN + 4)
XI1, XI2, OTHER, GUESS, RX, RR, XX, USED, OPEN, LARGEST, E0, ED, ES = range(GIVEN + 4, GIVEN + 17)
LOPEN, LN, LP, LPE, LQ, LQE, LFIRST, LLAST = range(GIVEN + 17, GIVEN + 25)
# The runs of a half and of a quarter of the nudge: samples, recurrence's sums; of the twice extrapolated samples too.
HALF1, HALF2, HRX, HXX, QUARTER1, QUARTER2, QRX, QXX, ZRX, ZRR, ZXX = range(GIVEN + 25, GIVEN + 36)
ROWS = GIVEN + 36
OWN = 2  # rows of what is measured that are the nudged mode's: its coordinate, and its speed over S

# Columns of the raw result, one row a point; the first two as of `runs`.
RAW = numbers(
    (
        *("halving", "steps", "rate2", "stderr", "reduced", "beyond", "spread", "samples", "energy_drift"),
        *("log_slope", "e_folds"),
    )
)


@njit(**INNER)
def _sample(X, half, quarter, P, Q, states, triple):
    """Take one sample of every lane: window, recurrence sums, energy, whether the state is the largest so far.

    Returns whether any lane's window is open, and whether any lane is inside the log slope's window or may now enter.
    """
    whole_vectors()
    opened, logging = 0, 0  # whole numbers: their or-reduction stays packed
    for lane in range(W):
        x, x1, x2 = X[lane], Q[XI1, lane], Q[XI2, lane]
        size = abs(x)
        largest = max(Q[LARGEST, lane], size)
        near = (size <= Q[LIMIT, lane]) | (Q[USED, lane] < reduction.LEAST_FOLLOWED)
        inside = (Q[OPEN, lane] > 0.0) & (size <= measure.WINDOW * Q[START, lane]) & near
        inside = inside & (Q[OTHER, lane] <= max(OTHERS * largest, Q[ALLOWED, lane]))
        weight = 1.0 if inside else 0.0
        Q[OPEN, lane] = weight
        Q[USED, lane] += weight
        rx, rr, xx = measure.leftover((x, 0.0), (x1, 0.0), (x2, 0.0), Q[GUESS, lane])
        Q[RX, lane] += rx if inside & triple else 0.0
        Q[RR, lane] += rr if inside & triple else 0.0
        Q[XX, lane] += xx if inside & triple else 0.0
        y, y1, y2 = half[lane], Q[HALF1, lane], Q[HALF2, lane]
        hx, _, hh = measure.leftover((y, 0.0), (y1, 0.0), (y2, 0.0), Q[GUESS, lane])
        u, u1, u2 = quarter[lane], Q[QUARTER1, lane], Q[QUARTER2, lane]
        qx, _, qq = measure.leftover((u, 0.0), (u1, 0.0), (u2, 0.0), Q[GUESS, lane])
        z, z1, z2 = at_zero(x, y, u), at_zero(x1, y1, u1), at_zero(x2, y2, u2)
        zx, zr, zz = measure.leftover((z, 0.0), (z1, 0.0), (z2, 0.0), Q[GUESS, lane])
        Q[HRX, lane] += hx if inside & triple else 0.0
        Q[HXX, lane] += hh if inside & triple else 0.0
        Q[QRX, lane] += qx if inside & triple else 0.0
        Q[QXX, lane] += qq if inside & triple else 0.0
        Q[ZRX, lane] += zx if inside & triple else 0.0
        Q[ZRR, lane] += zr if inside & triple else 0.0
        Q[ZXX, lane] += zz if inside & triple else 0.0
        drift = abs(P[(states + 2) * W + lane] - Q[E0, lane])
        scale = P[(states + 3) * W + lane]
        Q[ED, lane] = drift if inside & (drift > Q[ED, lane]) else Q[ED, lane]
        Q[ES, lane] = scale if inside & (scale > Q[ES, lane]) else Q[ES, lane]
        larger = inside & (size > Q[LARGEST, lane])
        Q[LARGEST, lane] = size if larger else Q[LARGEST, lane]
        Q[LARGER, lane] = 1.0 if larger else 0.0
        grown = size >= measure.LOG_FROM * Q[START, lane]
        logging |= 1 if (Q[LOPEN, lane] > 0.0) & (grown | (Q[LN, lane] > 0.0)) else 0
        opened |= 1 if inside else 0
    return opened > 0, logging > 0


@njit(**INNER)
def _log_sample(X, Q):
    """Add a sample to the log slope of every lane that is inside its window, where the nudged mode moves alone."""
    whole_vectors()
    for lane in range(W):
        size = abs(X[lane])
        most = Q[LCAP, lane] if Q[OTHER, lane] <= max(OTHERS * size, Q[ALLOWED, lane]) else -1.0
        P, up, PP, over = Q[LP, lane], Q[LPE, lane], Q[LQ, lane], Q[LQE, lane]
        sums = (Q[LOPEN, lane], Q[LN, lane], P, up, PP, over, Q[LFIRST, lane], Q[LLAST, lane])
        _, sums = measure.logged(size, measure.LOG_FROM * Q[START, lane], most, Q[OPEN, lane] > 0.0, sums)
        Q[LOPEN, lane], Q[LN, lane], Q[LP, lane], Q[LPE, lane], Q[LQ, lane], Q[LQE, lane] = sums[:6]
        Q[LFIRST, lane], Q[LLAST, lane] = sums[6:]


@njit(TAKEN, **PASSED)
def take(D, P, Q, numbers, _, k):
    """Take one sample of every lane: window, recurrence sums, energy, log slope; return whether any lane goes on."""
    whole_vectors()
    states, channels = numbers[1], D.shape[0] // 3
    x, half, quarter = D[0], D[channels], D[2 * channels]
    for lane in range(W):
        Q[OTHER, lane] = 0.0
    for c in range(OWN, channels):
        for lane in range(W):
            Q[OTHER, lane] = max(Q[OTHER, lane], abs(D[c, lane]))
    if k == 0:
        for lane in range(W):
            Q[USED, lane], Q[OPEN, lane], Q[LOPEN, lane], Q[LARGER, lane] = 1.0, 1.0, 1.0, 1.0
            Q[LP, lane], Q[LQ, lane] = 1.0, 1.0
            Q[LARGEST, lane] = abs(x[lane])
            Q[E0, lane], Q[ES, lane] = P[(states + 2) * W + lane], P[(states + 3) * W + lane]
    elif k == 2:
        for lane in range(W):
            Q[GUESS, lane] = measure.first_guess((x[lane], 0.0), (Q[XI1, lane], 0.0), (Q[XI2, lane], 0.0))
    going = True
    if k > 0:
        opened, logging = _sample(x, half, quarter, P, Q, states, k >= 2)
        if logging:
            _log_sample(x, Q)
        going = opened or logging
    for lane in range(W):
        Q[XI2, lane], Q[XI1, lane] = Q[XI1, lane], x[lane]
        Q[HALF2, lane], Q[HALF1, lane] = Q[HALF1, lane], half[lane]
        Q[QUARTER2, lane], Q[QUARTER1, lane] = Q[QUARTER1, lane], quarter[lane]
    return going


@njit(**INNER)
def _estimate(Q, lane, RX, RR, XX, triples, spacing):
    """Return signed rate² and its standard error, s-2, from the sums of those rows; NaN for too few triples."""
    value, stderr = math.nan, math.nan
    if triples >= 1.0:
        value, slope = measure.rate_squared(Q[GUESS, lane] - 0.5 * Q[RX, lane] / Q[XX, lane], spacing)
        if triples >= 2.0:
            scatter = max(Q[RR, lane] - Q[RX, lane] * Q[RX, lane] / Q[XX, lane], 0.0)
            stderr = slope * math.sqrt(scatter / ((triples - 1.0) * 4.0 * Q[XX, lane]))
    return value, stderr


@njit(**INNER)
def _unload(Q, lane, steps, row):
    """Turn one lane's sums into its row of the raw result."""
    triples, spacing = Q[USED, lane] - 2.0, Q[SPACING, lane]
    row[RAW.rate2], row[RAW.stderr] = _estimate(Q, lane, RX, RR, XX, triples, spacing)
    _, row[RAW.spread] = _estimate(Q, lane, ZRX, ZRR, ZXX, triples, spacing)
    row[RAW.reduced], row[RAW.beyond] = math.nan, math.nan
    if triples >= 1.0:
        half, _ = measure.rate_squared(Q[GUESS, lane] - 0.5 * Q[HRX, lane] / Q[HXX, lane], spacing)
        quarter, _ = measure.rate_squared(Q[GUESS, lane] - 0.5 * Q[QRX, lane] / Q[QXX, lane], spacing)
        reduced = quarter + (quarter - half) * THIRD
        row[RAW.reduced] = reduced
        row[RAW.beyond] = abs(reduced - (half + (half - row[RAW.rate2]) * THIRD)) / 15.0
    row[RAW.samples], row[RAW.steps] = Q[USED, lane], steps
    row[RAW.energy_drift] = Q[ED, lane] / Q[ES, lane] if Q[ES, lane] > 0.0 else 0.0
    row[RAW.halving] = Q[CHANGE, lane] / Q[LARGEST, lane]
    row[RAW.log_slope], row[RAW.e_folds] = math.nan, math.nan
    if Q[LN, lane] >= 2.0:
        row[RAW.e_folds] = measure.logarithm(Q[LLAST, lane] / Q[LFIRST, lane])
        row[RAW.log_slope] = (
            measure.slope_of_products(Q[LN, lane], Q[LP, lane], Q[LPE, lane], Q[LQ, lane], Q[LQE, lane]) / spacing
        )


@njit(void(*(int64[::1],) * 4, float64[:, :, ::1], float64[:, ::1]), nogil=True, **OPTIONS)
def _unload_blocks(steps, order, bounds, _, blocks, raw):
    """Turn each lane's sums into its point's row of the raw result."""
    for j in range(bounds.size - 1):
        for lane in range(bounds[j + 1] - bounds[j]):
            i = order[bounds[j] + lane]
            _unload(blocks[j], lane, steps[i], raw[i])


def run(integrator, runs, sampling):
    """Integrate and measure points; the raw result before anything is named.

    Args:
        integrator (runs.Integrator): What is watched is the energy and the sum of its absolute terms.
        runs (runs.Runs): starts: one run. project: v_k^T a of the nudged mode's place and of its speed over S, for at
            its largest a mode turns, and what a step leaves out is in its speed; then of the others' places; in units
            of the whole nudge. given: size of the nudged mode's coordinate at the start (the window ends at 10 times
            it); size that every other mode may have, whatever the nudged one has, 0 where they are to stay at rest.
        sampling (runs.Sampling): How the runs are sampled.

    Returns:
        numpy.ndarray, shape (points, len(RAW)): Columns of RAW: halving, steps, rate2, stderr, reduced, beyond (b),
        spread (the standard error of the twice extrapolated samples' rate²; s-2), samples, energy_drift, log_slope
        (s-1) and e_folds; the last two NaN where their window held no two samples.
    """

    def unloaded(*block):
        raw = np.empty((block[0].size, len(RAW)))
        _unload_blocks(*block, raw)
        return raw

    start, size = runs.given[:, 0], runs.size
    limits = np.stack([LARGE / size, np.minimum(measure.LOG_TO * start, measure.LOG_BELOW / size)], axis=1)
    runs = runs._replace(given=np.concatenate([runs.given, limits], axis=1))
    return refined(integrator, Measurement(take, unloaded, (OWN, 3), ROWS), runs, sampling)


def status(raw, intervals, tolerance, spacing):
    """Return the status of each row: OK, SHORT_WINDOW, NOT_CONVERGED or NON_FINITE; spacing in 1/S."""
    n = raw[:, RAW.samples]
    short = (n < measure.LEAST_SAMPLES) | ((n - 1.0) * spacing < LEAST_SPAN)
    unmeasured = ~np.isfinite(raw[:, RAW.rate2]) & ~short | ~np.isfinite(raw[:, RAW.halving])
    cases = [unmeasured, short, ~has_converged(raw, intervals, tolerance)]
    return np.select(cases, [NON_FINITE, SHORT_WINDOW, NOT_CONVERGED], OK).astype(np.int8)


def errors(raw, scale, spacing, share=1.0):
    r"""Return the reported errors of measured rates² and of their values reduced to zero amplitude, in s-2.

    With :math:`n` samples in a window of length :math:`T = (n - 1)h`, :math:`u = 2^{-53}`, S the scale:

    * integration, :math:`\delta[\frac5T\sqrt{|\omega^2| + 1/T^2} + 4\lambda^2]` as in :mod:`kernels.uncertainty`, δ
      what halving the step changes in an interval, times those of the window; 5/3 of it, for 4/3 of one run's and 1/3
      of another's come together;
    * amplitude: of the measured rate² the distance d from the reduced one; of both what the extrapolation leaves,
      :math:`b\,[2 + 3\min(15b/d, 10)] + 2e`. b is the fourth order itself, from three sizes of the nudge, and 15b/d
      how fast orders fall: near 1 and above it they do not. e is the sixth order, which counts where it happens to
      cancel the fourth in b: of the twice extrapolated samples the residuals' root mean square s, less what is known
      of it. For the frequency goes with the amplitude too, and runs of different sizes part by a phase
      :math:`\Phi = dT/2\omega` in a window of length T. Of the sixth order of :math:`a(s)\cos(\omega t + s^2\Phi t/T)`
      the part :math:`\frac12s^4(\Phi t/T)^2` of a, and nine times as much of its third harmonic, is that phase and
      no power of the rate²: in the root mean square :math:`k = \frac{\Phi^2}{128\sqrt5}\sqrt{d^2 + (9r)^2}`, r that
      of the residuals of the whole nudge's run. So :math:`e = \max(\frac15s, s - 2k)` of a window of a turn or more,
      over which k is a mean; else s, and 6e in place of 2e as far as e exceeds ten times
      the rounding below: over less than a turn a change of the amplitude hides in that of the rate²; and 10e where
      other modes move too, whose phases change as well;
    * scatter, :math:`e\sqrt{n/(n - 4)}/\sqrt{n - 3}`: the standard error of such residuals;
    * rounding, :math:`8u(|\omega^2| + 4S^2) + 6u|\omega|/h + 0.4u/(h^2\sqrt{n - 2})`, and 5/3 of it: S² for the second
      derivatives of V, whose terms may cancel; over the mode's share of the perturbation, for the whole motion rounds.

    *The constants.* Of :math:`f(s) = f_0 + c_2s^2 + c_4s^4 + c_6s^6` the reduced rate² is off by
    :math:`\frac1{64}(c_4 + \frac5{16}c_6)`, and b is :math:`\frac1{64}|c_4 + \frac{21}{16}c_6|`: the distance is at
    most :math:`b + |c_6|/64`, and :math:`|c_6|/64` is what the twice extrapolated samples have of the sixth order. So
    1 and 1 are derived in place of both 2, to that order; powers that fall by 0.43 a step or faster, of the worst sign,
    need 2b alone. 9 is the square of a third harmonic's phase over that of the first. Assumed, not derived: that the
    root mean square of the residuals is no less than half of the sixth order's share (2e), that higher orders leave no
    more than :math:`b\,[1 + 3\min(15b/d, 10)] + e`, and that a fifth of s stays unknown beside k. These hold all random
    places of tests/benchmarks/error_bars.py.

    Args:
        raw (numpy.ndarray, shape (points, len(RAW))): As of :func:`run`.
        scale (numpy.ndarray, shape (points,)): S, in s-1.
        spacing (float): Spacing of the samples, in 1/S.
        share (numpy.ndarray, shape (points,), or float): Size of the mode's part of the perturbation, over the whole,
            in the norm that the kinetic matrix makes.

    Returns:
        numpy.ndarray: measured, and reduced.
    """
    unit, S2 = 0.5 * UNIT, scale * scale
    with np.errstate(all="ignore"):
        n, square = raw[:, RAW.samples], raw[:, RAW.reduced] / S2
        span = (n - 1.0) * spacing
        follow = 5.0 / span * np.sqrt(np.abs(square) + 1.0 / span**2) + 4.0 * np.maximum(-square, 0.0)
        integration = raw[:, RAW.halving] * (n - 1.0) * follow
        shift, beyond = np.abs(raw[:, RAW.rate2] / S2 - square), raw[:, RAW.beyond] / S2
        falling = np.minimum(15.0 * beyond / np.maximum(shift, np.finfo(float).tiny), 10.0)
        alone = np.asarray(share) > ALONE
        clear = (np.sqrt(np.maximum(square, 0.0)) * span >= 2.0 * math.pi) & alone  # the window holds a whole turn
        sixth = _sixth(raw, square, shift, span, S2, clear)
        scatter = sixth * np.sqrt(n / np.maximum(n - 4.0, 0.25) / np.maximum(n - 3.0, 1.0))
        rounding = 8.0 * (np.abs(square) + 4.0) + 6.0 * np.sqrt(np.abs(square)) / spacing
        rounding = unit * (rounding + 0.4 / (spacing**2 * np.sqrt(np.maximum(n - 2.0, 1.0))))
        left = beyond * (NEXT + GROWING * falling) + SIXTH * sixth
        hidden = np.where(clear, 0.0, np.where(alone, SHORT, 2.0 * SHORT))
        left += hidden * np.maximum(sixth - SEEN * rounding, 0.0)
        reduced = scatter + BOTH * (integration + rounding / share) + left
    return (reduced + shift) * S2, reduced * S2


def _sixth(raw, square, shift, span, S2, clear):
    """Return the unknown part of the twice extrapolated samples' residuals, in S²: e of :func:`errors`."""
    spread = np.sqrt(np.maximum(raw[:, RAW.samples] - 3.0, 1.0)) / S2
    seen, residual = raw[:, RAW.spread] * spread, raw[:, RAW.stderr] * spread
    rate = np.sqrt(np.maximum(square, 0.0))
    phase = 0.5 * shift * span / rate
    bound = np.hypot(shift, HARMONIC * residual) * (phase * phase / (128.0 * math.sqrt(5.0)))
    return np.where(clear, np.maximum(UNKNOWN * seen, seen - 2.0 * bound), seen)


def is_too_wide(raw, scale, spacing):
    """Return whether the extrapolation to zero amplitude does not converge, so that no error can be given.

    Where the motion saturates within its window at all three sizes of the perturbation, their rates² agree with one
    another and not with that of zero amplitude. Residuals of the samples extrapolated twice then are no small part of
    the rate² (or of 1/T², T the window's length, where the rate² is smaller). Arguments as of :func:`errors`.
    """
    S2 = scale * scale
    with np.errstate(all="ignore"):
        n, square = raw[:, RAW.samples], raw[:, RAW.reduced] / S2
        span = (n - 1.0) * spacing
        seen = raw[:, RAW.spread] * np.sqrt(np.maximum(n - 3.0, 1.0)) / S2
        return seen > CONVERGED * np.maximum(np.abs(square), 1.0 / span**2)


def regime(rate_squared, error):
    """Return the regime of rates² with errors (s-2), int8: MARGINAL where the rate² is not above its error."""
    marginal = ~(np.abs(rate_squared) > error)
    return np.select([marginal, rate_squared < 0.0], [MARGINAL, UNSTABLE], STABLE).astype(np.int8)
