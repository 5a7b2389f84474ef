r"""Small oscillations: full motions from a perturbation, many in parallel, measured mode by mode.

A point is a system with values of its parameters, an equilibrium q0 and a mode. Its motion is advanced by
functions generated for the system (:mod:`kernels.flow.runs`), and sampled as :math:`x = (q - q_0)/\varepsilon`.

With :math:`v_k` the modes (:math:`v^{\mathsf T} a v = 1`) and :math:`a` the kinetic matrix at the equilibrium, the
mode coordinates are

.. math:: \xi_k = v_k^{\mathsf T} a\, x, \qquad
          \xi_k = \tfrac12\left(\xi_k[+\varepsilon] - \xi_k[-\varepsilon]\right) \text{ if two runs are made:}

half the difference of the runs from +ε and −ε has no odd power of ε. Further runs start from half and from a quarter of
the perturbation, with both signs or one likewise. The shift of the rate² then has even powers of ε only, so that of the
rates² f, f_½ and f_¼ of the three sizes, over the same samples,

.. math:: R = \tfrac13\left(4f_{1/2} - f\right), \qquad
          \omega^2_{\text{reduced}} = \tfrac13\left(4f_{1/4} - f_{1/2}\right), \qquad
          b = \tfrac1{15}\left|\omega^2_{\text{reduced}} - R\right|

have no second order, and b is the fourth order of the reduced rate²: 1/64 of that of f. Extrapolated twice,
:math:`\tfrac1{15}(16\,\omega^2_{\text{reduced}} - R)`, it has no fourth order either, and 1/64 of the sixth order of f.
Three rates² do not show the sixth. But the samples, extrapolated likewise,
:math:`\tfrac1{45}(64\,\xi_{1/4} - 20\,\xi_{1/2} + \xi)`, have 1/64 of their sixth order: the root mean square of their
residuals, as a rate², measures it, and for small perturbations it is the scatter of rounding alone. The perturbed mode
is sampled every h and measured by the recurrence of :mod:`kernels.estimator.measure`, which needs no regime. Samples
count until it has grown tenfold or, after the first seven, beyond MAX_AMPLITUDE, or another mode exceeds a tenth of its
largest value. If the perturbation has a given direction, with components of every mode, the remaining modes may be as
large as a component can grow: 10 times the whole perturbation. The log slope of :mod:`kernels.estimator.measure` has
its own window.

*Blind.* Spacing, length and number of steps follow from the scale S of the system (a bound on every possible rate), and
no theoretical rate is used; the theory's mode is used as a direction only.

Lanes are as in :mod:`kernels.compile.blocks`.

Source: Landau and Lifshitz, Mechanics, sections 21 and 23 (normal coordinates).
"""

import math

import numpy as np

from kernels.compile.blocks import W
from kernels.compile.columns import numbers
from kernels.compile.jit import INNER, OPTIONS, PASSED, float64, int64, njit, void
from kernels.estimator import measure, reduction
from kernels.estimator.statuses import NON_FINITE, NOT_CONVERGED, OK, SHORT_WINDOW
from kernels.flow.codes import UNIT
from kernels.flow.runs import (
    CHANGE,
    INPUTS,
    LARGER,
    MIN_SPAN,
    SPACING,
    TAKE_TYPE,
    Measurement,
    has_converged,
    refine_steps,
    zero_limit,
)

STABLE, UNSTABLE, MARGINAL = range(3)

MAX_OTHER_MODE = 0.1  # the window ends if another mode exceeds this fraction of the perturbed one
MAX_AMPLITUDE = 0.3  # the window ends beyond this fraction of the system's size, but not before seven samples

THIRD = 1.0 / 3.0
TWO_RUNS = 5.0 / 3.0  # factor of a run's error in the extrapolation from two runs: 4/3 and 1/3
# Factors of the extrapolation's remainder (see find_errors): of the fourth order, and of its decay; of the sixth
# order, and the smallest unknown fraction of its residuals; of a third harmonic's residual.
BASE_FACTOR, DECAY_FACTOR, SIXTH_FACTOR, MIN_UNKNOWN, HARMONIC_FACTOR = 2.0, 3.0, 2.0, 0.2, 9.0
SHORT_FACTOR = 4.0  # added to SIXTH_FACTOR in a window of less than a turn, in which residuals show less of that order
MIN_LONE_SHARE = 1.0 - 1e-9  # share of the perturbation above which a mode counts as the only moving mode
MIN_RESIDUAL = 10.0  # residuals above this multiple of the rounding are not rounding
MAX_SIXTH = 0.003  # largest sixth order, relative to the rate² or 1/T², at which the extrapolation converges

# Rows of a block, W lanes each, after the first of `runs`: inputs (see `measure_points`), and sums over samples.
START, OTHER_LIMIT, LIMIT, LCAP = range(INPUTS, INPUTS + 4)
XI1, XI2, OTHER_SIZE, GUESS, RX, RR, XX, COUNT, OPEN, LARGEST, E0, ED, ES = range(INPUTS + 4, INPUTS + 17)
LOPEN, LN, LP, LPE, LQ, LQE, LFIRST, LLAST = range(INPUTS + 17, INPUTS + 25)
# Runs of a half and a quarter of the perturbation: samples, recurrence's sums; those of twice extrapolated samples too.
HALF1, HALF2, HRX, HXX, QUARTER1, QUARTER2, QRX, QXX, ZRX, ZRR, ZXX = range(INPUTS + 25, INPUTS + 36)
ROWS = INPUTS + 36
OWN_ROWS = 2  # number of channels of the perturbed mode: its coordinate, and its velocity over S

# Columns of the raw result, one row a point; the first two as of `runs`.
RAW = numbers(
    (
        *("halving", "steps", "rate2", "stderr", "reduced", "beyond", "spread", "samples", "energy_drift"),
        *("log_slope", "e_folds"),
    )
)


@njit(**INNER)
def _add_sample(X, half, quarter, P, Q, states, triple):
    """Add one sample of every lane: window, recurrence sums, energy, whether the state is the largest so far.

    Returns whether any lane's window is open, and whether any lane is inside the log slope's window or may now enter.
    """
    num_open, num_logging = 0, 0  # integers, so that their or-reduction stays packed
    for lane in range(W):
        x, x1, x2 = X[lane], Q[XI1, lane], Q[XI2, lane]
        size = abs(x)
        largest = max(Q[LARGEST, lane], size)
        is_near = (size <= Q[LIMIT, lane]) | (Q[COUNT, lane] < reduction.MIN_FOLLOWED_SAMPLES)
        is_inside = (Q[OPEN, lane] > 0.0) & (size <= measure.MAX_GROWTH * Q[START, lane]) & is_near
        is_inside = is_inside & (Q[OTHER_SIZE, lane] <= max(MAX_OTHER_MODE * largest, Q[OTHER_LIMIT, lane]))
        weight = 1.0 if is_inside else 0.0
        Q[OPEN, lane] = weight
        Q[COUNT, lane] += weight
        rx, rr, xx = measure.residual_sums((x, 0.0), (x1, 0.0), (x2, 0.0), Q[GUESS, lane])
        Q[RX, lane] += rx if is_inside & triple else 0.0
        Q[RR, lane] += rr if is_inside & triple else 0.0
        Q[XX, lane] += xx if is_inside & triple else 0.0
        y, y1, y2 = half[lane], Q[HALF1, lane], Q[HALF2, lane]
        hx, _, hh = measure.residual_sums((y, 0.0), (y1, 0.0), (y2, 0.0), Q[GUESS, lane])
        u, u1, u2 = quarter[lane], Q[QUARTER1, lane], Q[QUARTER2, lane]
        qx, _, qq = measure.residual_sums((u, 0.0), (u1, 0.0), (u2, 0.0), Q[GUESS, lane])
        z, z1, z2 = zero_limit(x, y, u), zero_limit(x1, y1, u1), zero_limit(x2, y2, u2)
        zx, zr, zz = measure.residual_sums((z, 0.0), (z1, 0.0), (z2, 0.0), Q[GUESS, lane])
        Q[HRX, lane] += hx if is_inside & triple else 0.0
        Q[HXX, lane] += hh if is_inside & triple else 0.0
        Q[QRX, lane] += qx if is_inside & triple else 0.0
        Q[QXX, lane] += qq if is_inside & triple else 0.0
        Q[ZRX, lane] += zx if is_inside & triple else 0.0
        Q[ZRR, lane] += zr if is_inside & triple else 0.0
        Q[ZXX, lane] += zz if is_inside & triple else 0.0
        drift = abs(P[(states + 2) * W + lane] - Q[E0, lane])
        scale = P[(states + 3) * W + lane]
        Q[ED, lane] = drift if is_inside & (drift > Q[ED, lane]) else Q[ED, lane]
        Q[ES, lane] = scale if is_inside & (scale > Q[ES, lane]) else Q[ES, lane]
        is_larger = is_inside & (size > Q[LARGEST, lane])
        Q[LARGEST, lane] = size if is_larger else Q[LARGEST, lane]
        Q[LARGER, lane] = 1.0 if is_larger else 0.0
        has_grown = size >= measure.LOG_FROM * Q[START, lane]
        num_logging |= 1 if (Q[LOPEN, lane] > 0.0) & (has_grown | (Q[LN, lane] > 0.0)) else 0
        num_open |= 1 if is_inside else 0
    return num_open > 0, num_logging > 0


@njit(**INNER)
def _add_to_log(X, Q):
    """Add a sample to the log slope of every lane inside its window, if the perturbed mode moves alone."""
    for lane in range(W):
        size = abs(X[lane])
        maximum = Q[LCAP, lane] if Q[OTHER_SIZE, lane] <= max(MAX_OTHER_MODE * size, Q[OTHER_LIMIT, lane]) else -1.0
        P, up, PP, over = Q[LP, lane], Q[LPE, lane], Q[LQ, lane], Q[LQE, lane]
        sums = (Q[LOPEN, lane], Q[LN, lane], P, up, PP, over, Q[LFIRST, lane], Q[LLAST, lane])
        _, sums = measure.add_log_sample(size, measure.LOG_FROM * Q[START, lane], maximum, Q[OPEN, lane] > 0.0, sums)
        Q[LOPEN, lane], Q[LN, lane], Q[LP, lane], Q[LPE, lane], Q[LQ, lane], Q[LQE, lane] = sums[:6]
        Q[LFIRST, lane], Q[LLAST, lane] = sums[6:]


@njit(TAKE_TYPE, **PASSED)
def take_sample(D, P, Q, numbers, _, k):
    """Add one sample of every lane: window, recurrence sums, energy, log slope; return whether any lane goes on."""
    states, channels = numbers[1], D.shape[0] // 3
    x, half, quarter = D[0], D[channels], D[2 * channels]
    for lane in range(W):
        Q[OTHER_SIZE, lane] = 0.0
    for c in range(OWN_ROWS, channels):
        for lane in range(W):
            Q[OTHER_SIZE, lane] = max(Q[OTHER_SIZE, lane], abs(D[c, lane]))
    if k == 0:
        for lane in range(W):
            Q[COUNT, lane], Q[OPEN, lane], Q[LOPEN, lane], Q[LARGER, lane] = 1.0, 1.0, 1.0, 1.0
            Q[LP, lane], Q[LQ, lane] = 1.0, 1.0
            Q[LARGEST, lane] = abs(x[lane])
            Q[E0, lane], Q[ES, lane] = P[(states + 2) * W + lane], P[(states + 3) * W + lane]
    elif k == 2:
        for lane in range(W):
            Q[GUESS, lane] = measure.first_guess((x[lane], 0.0), (Q[XI1, lane], 0.0), (Q[XI2, lane], 0.0))
    goes_on = True
    if k > 0:
        is_open, is_logging = _add_sample(x, half, quarter, P, Q, states, k >= 2)
        if is_logging:
            _add_to_log(x, Q)
        goes_on = is_open or is_logging
    for lane in range(W):
        Q[XI2, lane], Q[XI1, lane] = Q[XI1, lane], x[lane]
        Q[HALF2, lane], Q[HALF1, lane] = Q[HALF1, lane], half[lane]
        Q[QUARTER2, lane], Q[QUARTER1, lane] = Q[QUARTER1, lane], quarter[lane]
    return goes_on


@njit(**INNER)
def _estimate_rate(Q, lane, RX, RR, XX, triples, spacing):
    """Return signed rate² and its standard error, s-2, from the sums in rows RX, RR, XX; NaN for too few triples."""
    value, stderr = math.nan, math.nan
    if triples >= 1.0:
        value, slope = measure.rate_squared(Q[GUESS, lane] - 0.5 * Q[RX, lane] / Q[XX, lane], spacing)
        if triples >= 2.0:
            scatter = max(Q[RR, lane] - Q[RX, lane] * Q[RX, lane] / Q[XX, lane], 0.0)
            stderr = slope * math.sqrt(scatter / ((triples - 1.0) * 4.0 * Q[XX, lane]))
    return value, stderr


@njit(**INNER)
def _write_row(Q, lane, steps, row):
    """Write one lane's sums to its row of the raw result."""
    triples, spacing = Q[COUNT, lane] - 2.0, Q[SPACING, lane]
    row[RAW.rate2], row[RAW.stderr] = _estimate_rate(Q, lane, RX, RR, XX, triples, spacing)
    _, row[RAW.spread] = _estimate_rate(Q, lane, ZRX, ZRR, ZXX, triples, spacing)
    row[RAW.reduced], row[RAW.beyond] = math.nan, math.nan
    if triples >= 1.0:
        half, _ = measure.rate_squared(Q[GUESS, lane] - 0.5 * Q[HRX, lane] / Q[HXX, lane], spacing)
        quarter, _ = measure.rate_squared(Q[GUESS, lane] - 0.5 * Q[QRX, lane] / Q[QXX, lane], spacing)
        reduced = quarter + (quarter - half) * THIRD
        row[RAW.reduced] = reduced
        row[RAW.beyond] = abs(reduced - (half + (half - row[RAW.rate2]) * THIRD)) / 15.0
    row[RAW.samples], row[RAW.steps] = Q[COUNT, lane], steps
    row[RAW.energy_drift] = Q[ED, lane] / Q[ES, lane] if Q[ES, lane] > 0.0 else 0.0
    row[RAW.halving] = Q[CHANGE, lane] / Q[LARGEST, lane]
    row[RAW.log_slope], row[RAW.e_folds] = math.nan, math.nan
    if Q[LN, lane] >= 2.0:
        row[RAW.e_folds] = measure.logarithm(Q[LLAST, lane] / Q[LFIRST, lane])
        products = (Q[LP, lane], Q[LPE, lane], Q[LQ, lane], Q[LQE, lane])
        row[RAW.log_slope] = measure.slope_of_products(Q[LN, lane], *products) / spacing


@njit(void(*(int64[::1],) * 4, float64[:, :, ::1], float64[:, ::1]), nogil=True, **OPTIONS)
def _write_rows(steps, order, bounds, _, blocks, raw):
    """Write each lane's sums to its point's row of the raw result."""
    for j in range(bounds.size - 1):
        for lane in range(bounds[j + 1] - bounds[j]):
            i = order[bounds[j] + lane]
            _write_row(blocks[j], lane, steps[i], raw[i])


def measure_points(integrator, runs, sampling):
    """Integrate and measure points; return the raw results.

    Args:
        integrator (runs.Integrator): Its check writes the energy and the sum of its absolute terms.
        runs (runs.Runs): starts: one run. project: v_k^T a of the perturbed mode's position and of its velocity over S
            (at its largest position a mode is at rest, so that truncation shows in its velocity); then of the remaining
            modes' positions; in units of the whole perturbation. point_data: size of the perturbed mode's coordinate at
            the start (the window ends at 10 times it); size allowed for the remaining modes, whatever the size
            of the perturbed mode, 0 if they must stay at rest.
        sampling (runs.Sampling): How the runs are sampled.

    Returns:
        numpy.ndarray, shape (points, len(RAW)): Columns of RAW: halving, steps, rate2, stderr, reduced, beyond (b),
        spread (the standard error of the twice extrapolated samples' rate²; s-2), samples, energy_drift, log_slope
        (s-1) and e_folds; the last two NaN if their window contains fewer than two samples.
    """

    def write_results(*block):
        raw = np.empty((block[0].size, len(RAW)))
        _write_rows(*block, raw)
        return raw

    start, size = runs.point_data[:, 0], runs.epsilon
    limits = np.stack([MAX_AMPLITUDE / size, np.minimum(measure.LOG_TO * start, measure.LOG_BELOW / size)], axis=1)
    runs = runs._replace(point_data=np.concatenate([runs.point_data, limits], axis=1))
    return refine_steps(integrator, Measurement(take_sample, write_results, (OWN_ROWS, 3), ROWS), runs, sampling)


def row_status(raw, sampling):
    """Return the status of each row: OK, SHORT_WINDOW, NOT_CONVERGED or NON_FINITE.

    Args:
        raw (numpy.ndarray): As returned by :func:`measure_points`.
        sampling (runs.Sampling): How the runs were sampled.
    """
    n = raw[:, RAW.samples]
    is_short = (n < measure.MIN_SAMPLES) | ((n - 1.0) * sampling.spacing < MIN_SPAN)
    has_no_rate = ~np.isfinite(raw[:, RAW.rate2]) & ~is_short | ~np.isfinite(raw[:, RAW.halving])
    cases = [has_no_rate, is_short, ~has_converged(raw, sampling.intervals, sampling.tolerance)]
    return np.select(cases, [NON_FINITE, SHORT_WINDOW, NOT_CONVERGED], OK).astype(np.int8)


def find_errors(raw, scale, spacing, share=1.0):
    r"""Return the reported errors of measured rates² and of their values at zero amplitude, in s-2.

    With :math:`n` samples in a window of length :math:`T = (n - 1)h`, :math:`u = 2^{-53}`, S the scale:

    * integration, :math:`\delta[\frac5T\sqrt{|\omega^2| + 1/T^2} + 4\lambda^2]` as in
      :mod:`kernels.estimator.uncertainty`, δ the change of an interval by halving the step, times the window's number
      of intervals; 5/3 of it, because 4/3 of one run's error and 1/3 of another's add up;
    * amplitude: for the measured rate² its distance d from the reduced one; for both the remainder of the
      extrapolation, :math:`b\,[2 + 3\min(15b/d, 10)] + 2e`. b is the fourth order itself, from three sizes of the
      perturbation, and 15b/d the ratio of successive orders: near 1 and above they do not decay. e is the sixth order,
      which matters if it happens to cancel the fourth in b: the root mean square s of the residuals of the twice
      extrapolated samples, less its known part. The frequency depends on the amplitude too, so that runs of different
      sizes differ by a phase :math:`\Phi = dT/2\omega` in a window of length T. In the sixth order of
      :math:`a(s)\cos(\omega t + s^2\Phi t/T)`, :math:`\frac12s^4(\Phi t/T)^2` of a, and nine times as much of its
      third harmonic, is due to that phase and is no power of the rate²: in the root mean square
      :math:`k = \frac{\Phi^2}{128\sqrt5}\sqrt{d^2 + (9r)^2}`, r that of the residuals of the whole perturbation's run.
      So :math:`e = \max(\frac15s, s - 2k)` for a window of a turn or more, over which k is a mean; else s, and 6e
      instead of 2e as far as e exceeds ten times the rounding below: over less than a turn a change of the amplitude
      cannot be distinguished from a change of the rate²; and 10e if more modes move, since their phases also change;
    * scatter, :math:`e\sqrt{n/(n - 4)}/\sqrt{n - 3}`: the standard error of such residuals;
    * rounding, :math:`8u(|\omega^2| + 4S^2) + 6u|\omega|/h + 0.4u/(h^2\sqrt{n - 2})`, and 5/3 of it: S² for the second
      derivatives of V, in which terms may cancel; over the mode's share of the perturbation: the whole motion rounds.

    *The constants.* For :math:`f(s) = f_0 + c_2s^2 + c_4s^4 + c_6s^6` the error of the reduced rate² is
    :math:`\frac1{64}(c_4 + \frac5{16}c_6)`, and b is :math:`\frac1{64}|c_4 + \frac{21}{16}c_6|`: the error is at most
    :math:`b + |c_6|/64`, and :math:`|c_6|/64` is the sixth order of the twice extrapolated samples. So 1 and 1 are
    derived instead of both 2, to that order; powers that decay by 0.43 a step or faster, of the worst sign, need 2b
    alone. 9 is the square of a third harmonic's phase over that of the first. Assumed, not derived: that the root mean
    square of the residuals is no less than half of the sixth order's share (2e), that higher orders are at most
    :math:`b\,[1 + 3\min(15b/d, 10)] + e`, and that a fifth of s stays unknown in addition to k. These assumptions are
    satisfied at all random points of tests/benchmarks/error_bars.py.

    Args:
        raw (numpy.ndarray, shape (points, len(RAW))): As returned by :func:`measure_points`.
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
        shift, fourth = np.abs(raw[:, RAW.rate2] / S2 - square), raw[:, RAW.beyond] / S2
        decay = np.minimum(15.0 * fourth / np.maximum(shift, np.finfo(float).tiny), 10.0)
        is_alone = np.asarray(share) > MIN_LONE_SHARE
        # the window covers a whole turn
        has_turn = (np.sqrt(np.maximum(square, 0.0)) * span >= 2.0 * math.pi) & is_alone
        sixth = _sixth_order(raw, square, shift, span, S2, has_turn)
        scatter = sixth * np.sqrt(n / np.maximum(n - 4.0, 0.25) / np.maximum(n - 3.0, 1.0))
        rounding = 8.0 * (np.abs(square) + 4.0) + 6.0 * np.sqrt(np.abs(square)) / spacing
        rounding = unit * (rounding + 0.4 / (spacing**2 * np.sqrt(np.maximum(n - 2.0, 1.0))))
        remainder = fourth * (BASE_FACTOR + DECAY_FACTOR * decay) + SIXTH_FACTOR * sixth
        extra = np.where(has_turn, 0.0, np.where(is_alone, SHORT_FACTOR, 2.0 * SHORT_FACTOR))
        remainder += extra * np.maximum(sixth - MIN_RESIDUAL * rounding, 0.0)
        reduced = scatter + TWO_RUNS * (integration + rounding / share) + remainder
    return (reduced + shift) * S2, reduced * S2


def _sixth_order(raw, square, shift, span, S2, has_turn):
    """Return the unknown part of the twice extrapolated samples' residuals, in S²: e of :func:`find_errors`."""
    spread = np.sqrt(np.maximum(raw[:, RAW.samples] - 3.0, 1.0)) / S2
    rms, residual = raw[:, RAW.spread] * spread, raw[:, RAW.stderr] * spread
    rate = np.sqrt(np.maximum(square, 0.0))
    phase = 0.5 * shift * span / rate
    bound = np.hypot(shift, HARMONIC_FACTOR * residual) * (phase * phase / (128.0 * math.sqrt(5.0)))
    return np.where(has_turn, np.maximum(MIN_UNKNOWN * rms, rms - 2.0 * bound), rms)


def is_too_wide(raw, scale, spacing):
    """Return whether the extrapolation to zero amplitude does not converge, so that no error can be given.

    If the motion saturates within its window at all three sizes of the perturbation, their rates² agree but differ from
    that of zero amplitude. Residuals of the samples extrapolated twice then are comparable with the rate² (or with
    1/T², T the window's length, if the rate² is smaller).

    Args:
        raw, scale, spacing: As in :func:`find_errors`.
    """
    S2 = scale * scale
    with np.errstate(all="ignore"):
        n, square = raw[:, RAW.samples], raw[:, RAW.reduced] / S2
        span = (n - 1.0) * spacing
        rms = raw[:, RAW.spread] * np.sqrt(np.maximum(n - 3.0, 1.0)) / S2
        return rms > MAX_SIXTH * np.maximum(np.abs(square), 1.0 / span**2)


def find_regime(rate_squared, error):
    """Return the regime of rates² with errors (s-2), int8: MARGINAL if the rate² does not exceed its error."""
    is_marginal = ~(np.abs(rate_squared) > error)
    return np.select([is_marginal, rate_squared < 0.0], [MARGINAL, UNSTABLE], STABLE).astype(np.int8)
