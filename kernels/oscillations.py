r"""Small oscillations: full motions from a nudge, many side by side, measured mode by mode.

A point is a system with numbers in it, an equilibrium q0 and one of its modes. Its motion is carried as the deviation
:math:`x = (q - q_0)/\varepsilon` in the rows of a scratch array, and advanced by functions that were written for the
system (`advance`, `check`): they come in as arguments, so that this module is compiled once for all systems.

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
from kernels.columns import numbers
from kernels.jit import INLINE, OPTIONS, float64, int64, njit, void, whole_vectors
from kernels.runs import ADVANCE, CHECK, EPSILON, LEAST_SPAN, RUNS, planned, refined
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

# Rows of the measurement's scratch array, each W long; the projections follow from PROJECTION on.
XI, XI1, XI2, OTHER, GUESS, RX, RR, XX, USED, OPEN, START, LARGEST = (W * r for r in range(12))
E0, ED, ES, COARSE, ALLOWED = (W * r for r in range(12, 17))
LOPEN, LCAP, LN, LK, LKK, LY, LKY, LFIRST, LLAST, LIMIT = (W * r for r in range(17, 27))
# The runs of a half and of a quarter of the nudge: samples, recurrence's sums; of the twice extrapolated samples too.
HALF, HALF1, HALF2, HRX, HXX, QUARTER, QUARTER1, QUARTER2, QRX, QXX, ZRX, ZRR, ZXX = (W * r for r in range(27, 40))
COARSE_SPEED, PROJECTION = 40 * W, 41 * W

SIZES = (1.0, 0.5, 0.25)  # of the nudge: each has a run from either side, +, -

# Columns of the raw result, one row a point.
RAW = numbers(
    (
        *(
            "rate2",
            "stderr",
            "reduced",
            "beyond",
            "spread",
            "samples",
            "energy_drift",
            "halving",
            "steps",
        ),
        *("log_slope", "e_folds"),
    )
)


@njit(**OPTIONS)
def _project(Q, P, M, n, twice):
    """Mode coordinates: of the nudged mode into row XI, the largest of the others' sizes into row OTHER."""
    whole_vectors()
    for lane in range(W):
        Q[OTHER + lane] = 0.0
    for k in range(n):
        row = PROJECTION + k * n * W
        for lane in range(W):
            total = 0.0
            for j in range(n):
                x = P[j * W + lane]
                if twice:
                    x = 0.5 * (x - M[j * W + lane])
                total += Q[row + j * W + lane] * x
            if k == 0:
                Q[XI + lane] = total
            else:
                Q[OTHER + lane] = max(Q[OTHER + lane], abs(total))


@njit(**OPTIONS)
def _project_own(Q, P, M, n, twice, row):
    """Coordinate of the nudged mode, into one row."""
    whole_vectors()
    for lane in range(W):
        Q[row + lane] = 0.0
    for j in range(n):
        for lane in range(W):
            x = P[j * W + lane]
            if twice:
                x = 0.5 * (x - M[j * W + lane])
            Q[row + lane] += Q[PROJECTION + j * W + lane] * x


@njit(**OPTIONS)
def _begin(Q, P, states):
    """Take sample 0: clear the sums, open the windows, note the energy; row XI holds the sample."""
    whole_vectors()
    for lane in range(W):
        Q[XI1 + lane], Q[XI2 + lane] = Q[XI + lane], Q[XI + lane]
        Q[GUESS + lane], Q[RX + lane], Q[RR + lane], Q[XX + lane] = 0.0, 0.0, 0.0, 0.0
        Q[USED + lane], Q[OPEN + lane] = 1.0, 1.0
        Q[LARGEST + lane] = abs(Q[XI + lane])
        Q[LOPEN + lane] = 1.0
        Q[E0 + lane], Q[ED + lane] = P[(states + 2) * W + lane], 0.0
        Q[ES + lane] = P[(states + 3) * W + lane]
        Q[HALF1 + lane], Q[HALF2 + lane] = Q[HALF + lane], Q[HALF + lane]
        Q[QUARTER1 + lane], Q[QUARTER2 + lane] = Q[QUARTER + lane], Q[QUARTER + lane]
    for row in (LN, LK, LKK, LY, LKY, LFIRST, LLAST, HRX, HXX, QRX, QXX, ZRX, ZRR, ZXX):
        for lane in range(W):
            Q[row + lane] = 0.0


@njit(**OPTIONS)
def _guess(Q):
    """Set the first guess of every lane from its first three samples."""
    whole_vectors()
    for lane in range(W):
        Q[GUESS + lane] = measure.first_guess(Q[XI + lane], 0.0, Q[XI1 + lane], 0.0, Q[XI2 + lane], 0.0)


@njit(**INLINE)
def _extrapolated(quarter, half, whole):
    """What samples of three sizes of the nudge tend to, without the square and the fourth power of its size."""
    return quarter + (19.0 * (quarter - half) + (whole - half)) / 45.0


@njit(**OPTIONS)
def _sample(Q, P, K, states, triple):
    """Take one sample of every lane: window, recurrence sums, energy; keep the largest state in K.

    Returns whether any lane's window is open, and whether any lane is inside the log slope's window or may now enter.
    """
    whole_vectors()
    opened, logging = 0, 0  # whole numbers: their or-reduction stays packed
    for lane in range(W):
        x, x1, x2 = Q[XI + lane], Q[XI1 + lane], Q[XI2 + lane]
        size = abs(x)
        largest = max(Q[LARGEST + lane], size)
        near = (size <= Q[LIMIT + lane]) | (Q[USED + lane] < reduction.LEAST_FOLLOWED)
        inside = (Q[OPEN + lane] > 0.0) & (size <= measure.WINDOW * Q[START + lane]) & near
        inside = inside & (Q[OTHER + lane] <= max(OTHERS * largest, Q[ALLOWED + lane]))
        weight = 1.0 if inside else 0.0
        Q[OPEN + lane] = weight
        Q[USED + lane] += weight
        rx, rr, xx = measure.leftover(x, 0.0, x1, 0.0, x2, 0.0, Q[GUESS + lane])
        Q[RX + lane] += rx if inside & triple else 0.0
        Q[RR + lane] += rr if inside & triple else 0.0
        Q[XX + lane] += xx if inside & triple else 0.0
        y, y1, y2 = Q[HALF + lane], Q[HALF1 + lane], Q[HALF2 + lane]
        hx, _, hh = measure.leftover(y, 0.0, y1, 0.0, y2, 0.0, Q[GUESS + lane])
        u, u1, u2 = Q[QUARTER + lane], Q[QUARTER1 + lane], Q[QUARTER2 + lane]
        qx, _, qq = measure.leftover(u, 0.0, u1, 0.0, u2, 0.0, Q[GUESS + lane])
        z, z1, z2 = _extrapolated(u, y, x), _extrapolated(u1, y1, x1), _extrapolated(u2, y2, x2)
        zx, zr, zz = measure.leftover(z, 0.0, z1, 0.0, z2, 0.0, Q[GUESS + lane])
        Q[HRX + lane] += hx if inside & triple else 0.0
        Q[HXX + lane] += hh if inside & triple else 0.0
        Q[QRX + lane] += qx if inside & triple else 0.0
        Q[QXX + lane] += qq if inside & triple else 0.0
        Q[ZRX + lane] += zx if inside & triple else 0.0
        Q[ZRR + lane] += zr if inside & triple else 0.0
        Q[ZXX + lane] += zz if inside & triple else 0.0
        Q[HALF2 + lane], Q[HALF1 + lane] = y1, y
        Q[QUARTER2 + lane], Q[QUARTER1 + lane] = u1, u
        drift = abs(P[(states + 2) * W + lane] - Q[E0 + lane])
        scale = P[(states + 3) * W + lane]
        Q[ED + lane] = drift if inside & (drift > Q[ED + lane]) else Q[ED + lane]
        Q[ES + lane] = scale if inside & (scale > Q[ES + lane]) else Q[ES + lane]
        larger = inside & (size > Q[LARGEST + lane])
        Q[LARGEST + lane] = size if larger else Q[LARGEST + lane]
        Q[COARSE + lane] = 1.0 if larger else 0.0
        grown = size >= measure.LOG_FROM * Q[START + lane]
        logging |= 1 if (Q[LOPEN + lane] > 0.0) & (grown | (Q[LN + lane] > 0.0)) else 0
        Q[XI2 + lane], Q[XI1 + lane] = x1, x
        opened |= 1 if inside else 0
    for row in range(0, states * W, W):
        for lane in range(W):
            K[row + lane] = P[row + lane] if Q[COARSE + lane] > 0.0 else K[row + lane]
    return opened > 0, logging > 0


@njit(**OPTIONS)
def _log_sample(Q, k):
    """Add sample k to the log slope of every lane that is inside its window."""
    whole_vectors()
    for lane in range(W):
        size = abs(Q[XI + lane])
        grown = size >= measure.LOG_FROM * Q[START + lane]
        begun = Q[LN + lane] > 0.0
        alone = Q[OTHER + lane] <= max(OTHERS * size, Q[ALLOWED + lane])
        # once entered, the window closes at either end; it can be entered only while the main window is open
        stays = alone & (size <= Q[LCAP + lane]) & (grown | ~begun) & ((Q[OPEN + lane] > 0.0) | begun)
        inside = grown & stays & (Q[LOPEN + lane] > 0.0)
        Q[LOPEN + lane] = Q[LOPEN + lane] if stays else 0.0
        y = measure.logarithm(size)
        Q[LFIRST + lane] = y if inside & ~begun else Q[LFIRST + lane]
        Q[LLAST + lane] = y if inside else Q[LLAST + lane]
        Q[LN + lane], Q[LK + lane], Q[LKK + lane], Q[LY + lane], Q[LKY + lane] = measure.add_to_line(
            Q[LN + lane], Q[LK + lane], Q[LKK + lane], Q[LY + lane], Q[LKY + lane], k, y, inside
        )


@njit(**OPTIONS)
def _own(Q, P, n, lane):
    """Coordinate and speed of the nudged mode, of one run."""
    place, speed = 0.0, 0.0
    for j in range(n):
        factor = Q[PROJECTION + j * W + lane]
        place += factor * P[j * W + lane]
        speed += factor * P[(n + j) * W + lane]
    return place, speed


@njit(**OPTIONS)
def _halve(advance, Q, P, K, n, states, step_row, steps):
    """Run the interval that begins at each lane's largest state twice, with steps and with twice as many."""
    whole_vectors()
    for i in range(states * W):
        P[i] = K[i]
    advance(P, steps)
    for lane in range(W):
        Q[COARSE + lane], Q[COARSE_SPEED + lane] = _own(Q, P, n, lane)
        P[step_row * W + lane] *= 0.5
    for i in range(states * W):
        P[i] = K[i]
    advance(P, 2 * steps)
    for lane in range(W):
        Q[XI + lane], Q[XI1 + lane] = _own(Q, P, n, lane)


@njit(**OPTIONS)
def _estimate(Q, lane, RX, RR, XX, triples, spacing):
    """Signed rate² and its standard error, s-2, from the sums of those rows; NaN where there are too few triples."""
    value, stderr = math.nan, math.nan
    if triples >= 1.0:
        value, slope = measure.rate_squared(Q[GUESS + lane] - 0.5 * Q[RX + lane] / Q[XX + lane], spacing)
        if triples >= 2.0:
            scatter = max(Q[RR + lane] - Q[RX + lane] * Q[RX + lane] / Q[XX + lane], 0.0)
            stderr = slope * math.sqrt(scatter / ((triples - 1.0) * 4.0 * Q[XX + lane]))
    return value, stderr


@njit(**OPTIONS)
def _unload(Q, lane, steps, spacing, scale, row):
    """Turn one lane's sums into its row of the raw result."""
    triples = Q[USED + lane] - 2.0
    row[RAW.rate2], row[RAW.stderr] = _estimate(Q, lane, RX, RR, XX, triples, spacing)
    _, row[RAW.spread] = _estimate(Q, lane, ZRX, ZRR, ZXX, triples, spacing)
    row[RAW.reduced], row[RAW.beyond] = math.nan, math.nan
    if triples >= 1.0:
        half, _ = measure.rate_squared(Q[GUESS + lane] - 0.5 * Q[HRX + lane] / Q[HXX + lane], spacing)
        quarter, _ = measure.rate_squared(Q[GUESS + lane] - 0.5 * Q[QRX + lane] / Q[QXX + lane], spacing)
        reduced = quarter + (quarter - half) * THIRD
        row[RAW.reduced] = reduced
        row[RAW.beyond] = abs(reduced - (half + (half - row[RAW.rate2]) * THIRD)) / 15.0
    row[RAW.samples], row[RAW.steps] = Q[USED + lane], steps
    row[RAW.energy_drift] = Q[ED + lane] / Q[ES + lane] if Q[ES + lane] > 0.0 else 0.0
    # at its largest a mode turns: what a step leaves out, of odd order, is there in its speed, in units of the scale
    apart = math.hypot(Q[COARSE + lane] - Q[XI + lane], (Q[COARSE_SPEED + lane] - Q[XI1 + lane]) / scale)
    row[RAW.halving] = apart / Q[LARGEST + lane]
    row[RAW.log_slope], row[RAW.e_folds] = math.nan, math.nan
    if Q[LN + lane] >= 2.0:
        sums = (Q[LN + lane], Q[LK + lane], Q[LKK + lane], Q[LY + lane], Q[LKY + lane])
        row[RAW.e_folds] = Q[LLAST + lane] - Q[LFIRST + lane]
        row[RAW.log_slope] = measure.line_slope(*sums) / spacing


@njit(**OPTIONS)
def _follow(advance, check, R, K, Q, n, states, steps, pair, intervals):
    """Follow every lane through the run, or until the last window of the block has closed; R (6, rows * W) are runs."""
    P = R[0]
    check(P)
    _project_all(Q, R, n, pair)
    _begin(Q, P, states)
    for k in range(1, intervals + 1):
        for run in range(0, 6, 1 if pair else 2):
            advance(R[run], steps)
        check(P)
        _project_all(Q, R, n, pair)
        if k == 2:
            _guess(Q)
        opened, logging = _sample(Q, P, K, states, k >= 2)
        if logging:
            _log_sample(Q, float(k))
        elif not opened:
            break


@njit(**OPTIONS)
def _project_all(Q, R, n, pair):
    """Mode coordinates of all runs."""
    _project(Q, R[0], R[1], n, pair)
    _project_own(Q, R[2], R[3], n, pair, HALF)
    _project_own(Q, R[4], R[5], n, pair, QUARTER)


@njit(
    void(ADVANCE, CHECK, RUNS, float64[:, ::1], *(int64[::1],) * 3, int64, float64, int64, float64[:, ::1]),
    nogil=True,
    **OPTIONS,
)
def _run_blocks(advance, check, runs, nudge, steps, order, bounds, states, spacing, intervals, raw):
    """Integrate and measure block after block: order[bounds[j]:bounds[j + 1]] are the points of block j."""
    whole_vectors()
    rows, n = runs.starts.shape[2], runs.project.shape[1]
    R, K = np.empty((6, rows * W)), np.empty(states * W)
    Q = np.empty(PROJECTION + n * n * W)
    for j in range(bounds.size - 1):
        first, count = bounds[j], bounds[j + 1] - bounds[j]
        pair = runs.twice[order[first]] > 0
        number = steps[order[first]]
        for lane in range(W):
            i = order[first + min(lane, count - 1)]
            for run in range(6):
                for r in range(rows):
                    R[run, r * W + lane] = runs.starts[i, run, r]
                R[run, (states + 1) * W + lane] = spacing / runs.scale[i] / number
            for k in range(n):
                for r in range(n):
                    Q[PROJECTION + (k * n + r) * W + lane] = runs.project[i, k, r]
            start = nudge[i, 0]
            Q[START + lane], Q[ALLOWED + lane], Q[LIMIT + lane] = start, nudge[i, 1], LARGE / runs.size[i]
            Q[LCAP + lane] = min(measure.LOG_TO * start, measure.LOG_BELOW / runs.size[i])
        for r in range(states * W):
            K[r] = R[0, r]
        _follow(advance, check, R, K, Q, n, states, number, pair, intervals)
        _halve(advance, Q, R[0], K, n, states, states + 1, number)
        for lane in range(count):
            i = order[first + lane]
            _unload(Q, lane, number, spacing / runs.scale[i], runs.scale[i], raw[i])


def run(integrator, runs, nudge, sampling):
    """Integrate and measure points; the raw result before anything is named.

    Parameters
    ----------
    integrator : runs.Integrator
        What is watched is the energy and the sum of its absolute terms.
    runs : runs.Runs
        starts: the runs from +epsilon, -epsilon, and the same of its half and quarter; those from the other side are
        not read where ``twice`` is 0. project: v_k^T a of the nudged mode, then of the others, in units of the whole
        nudge.
    nudge : numpy.ndarray, shape (points, 2)
        Size of the nudged mode's coordinate at the start (the window ends at 10 times it); size that every other mode
        may have, whatever the nudged one has, 0 where they are to stay at rest.
    sampling : runs.Sampling
        How the runs are sampled.

    Returns
    -------
    numpy.ndarray, shape (points, len(RAW))
        Columns of RAW: rate2, stderr, reduced, beyond (b), spread (the standard error of the twice extrapolated
        samples' rate²; s-2), samples, energy_drift, halving, steps, log_slope (s-1) and e_folds; the last two NaN where
        their window held no two samples.
    """
    intervals, spacing, tolerance = sampling

    def kernel(runs, which, *plan):
        raw = np.empty((which.size, len(RAW)))
        _run_blocks(*integrator[:2], runs, nudge[which], *plan, integrator.states, spacing, intervals, raw)
        return raw

    def is_done(raw):
        return converged(raw, intervals, tolerance) | ~np.isfinite(raw[:, RAW.rate2])

    # energies turn twice as fast as the motion but are a part of it only: 1.5 holds both to the tolerance
    return refined(runs, planned(runs.size, sampling, 1.5), kernel, is_done)


def converged(raw, intervals, tolerance):
    """Return True where halving the step changes less than the tolerance plus 4 units of rounding a step."""
    rounding = 4.0 * EPSILON * np.sqrt(raw[:, RAW.steps])
    return (raw[:, RAW.halving] - rounding) * intervals <= tolerance


def status(raw, intervals, tolerance, spacing):
    """Return the status of each row: OK, SHORT_WINDOW, NOT_CONVERGED or NON_FINITE; spacing in 1/S."""
    n = raw[:, RAW.samples]
    short = (n < measure.LEAST_SAMPLES) | ((n - 1.0) * spacing < LEAST_SPAN)
    unmeasured = ~np.isfinite(raw[:, RAW.rate2]) & ~short | ~np.isfinite(raw[:, RAW.halving])
    cases = [unmeasured, short, ~converged(raw, intervals, tolerance)]
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

    Parameters
    ----------
    raw : numpy.ndarray, shape (points, len(RAW))
        As of :func:`run`.
    scale : numpy.ndarray, shape (points,)
        S, in s-1.
    spacing : float
        Spacing of the samples, in 1/S.
    share : numpy.ndarray, shape (points,), or float
        Size of the mode's part of the perturbation, over the whole, in the norm that the kinetic matrix makes.

    Returns
    -------
    measured, reduced : numpy.ndarray
    """
    unit, S2 = 0.5 * EPSILON, scale * scale
    with np.errstate(all="ignore"):
        n, square = raw[:, RAW.samples], raw[:, RAW.reduced] / S2
        span = (n - 1.0) * spacing
        follow = 5.0 / span * np.sqrt(np.abs(square) + 1.0 / span**2) + 4.0 * np.maximum(-square, 0.0)
        integration = raw[:, RAW.halving] * (n - 1.0) * follow
        shift, beyond = np.abs(raw[:, RAW.rate2] / S2 - square), raw[:, RAW.beyond] / S2
        falling = np.minimum(15.0 * beyond / np.maximum(shift, np.finfo(float).tiny), 10.0)
        alone = np.asarray(share) > ALONE
        clear = _turned(square, span) & alone
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
    """What is unknown of the twice extrapolated samples' residuals, in S²: e of :func:`errors`."""
    spread = np.sqrt(np.maximum(raw[:, RAW.samples] - 3.0, 1.0)) / S2
    seen, residual = raw[:, RAW.spread] * spread, raw[:, RAW.stderr] * spread
    rate = np.sqrt(np.maximum(square, 0.0))
    phase = 0.5 * shift * span / rate
    known = np.hypot(shift, HARMONIC * residual) * (phase * phase / (128.0 * math.sqrt(5.0)))
    return np.where(clear, np.maximum(UNKNOWN * seen, seen - 2.0 * known), seen)


def _turned(square, span):
    """Return whether the window holds a whole turn."""
    return np.sqrt(np.maximum(square, 0.0)) * span >= 2.0 * math.pi


def is_too_wide(raw, scale, spacing):
    """Return whether the extrapolation to zero amplitude does not converge, so that no error can be given.

    Where the motion saturates within its window at all three sizes of the perturbation, their rates² agree with one
    another and not with that of zero amplitude. Residuals of the samples extrapolated twice then are no small part of
    the rate² (or of 1/T², T the window's length, where the rate² is smaller).

    Parameters
    ----------
    raw, scale, spacing
        As of :func:`errors`.

    Returns
    -------
    numpy.ndarray of bool
    """
    S2 = scale * scale
    with np.errstate(all="ignore"):
        n, square = raw[:, RAW.samples], raw[:, RAW.reduced] / S2
        span = (n - 1.0) * spacing
        seen = raw[:, RAW.spread] * np.sqrt(np.maximum(n - 3.0, 1.0)) / S2
        return seen > CONVERGED * np.maximum(np.abs(square), 1.0 / span**2)


def regime(rate_squared, error):
    """Return the regime of measured points: MARGINAL where the rate² is not above its error.

    Parameters
    ----------
    rate_squared, error : numpy.ndarray
        In s-2.

    Returns
    -------
    numpy.ndarray of int8
        STABLE, UNSTABLE or MARGINAL.
    """
    marginal = ~(np.abs(rate_squared) > error)
    return np.select([marginal, rate_squared < 0.0], [MARGINAL, UNSTABLE], STABLE).astype(np.int8)
