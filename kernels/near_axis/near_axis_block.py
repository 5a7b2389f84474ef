r"""Integration of blocks of W perturbed rotations, which adds up their samples as they come.

Time runs in radians of spin, :math:`\tau = |\omega_0|t`, and the transverse components in units of the
perturbation,
:math:`\omega_b = \varepsilon|\omega_0|\beta`, :math:`\omega_c = \varepsilon|\omega_0|\gamma`,
:math:`\omega_a = |\omega_0|\alpha`. In these Euler's equations keep their form,

.. math:: \alpha' = c_a\varepsilon^2\,\beta\gamma, \qquad \beta' = c_b\,\gamma\alpha, \qquad \gamma' = c_c\,\alpha\beta

so every point takes the same work whatever its spin rate, and no perturbation is too small to square.

*Shape.* Structure of arrays in one flat scratch array, the row x of lane l at
``S[row.x + l]``; see :mod:`kernels.compile.blocks`.

*Certificate.* The exact solution is computed with the direct one, by the exact step of :mod:`kernels.free.exact` over
each sample interval, or by its recurrence (:mod:`kernels.free.recurrence`) if the motion is small; neither shares code
with the direct one. The distance of the two in the transverse plane, relative to the largest transverse size reached so
far, is the error of the direct integration.
"""

from typing import NamedTuple

from kernels.compile.blocks import W
from kernels.compile.columns import numbers
from kernels.compile.jit import INLINE, INNER, OPTIONS, njit
from kernels.compile.llvm_formulas import formula
from kernels.estimator import measure, reduction
from kernels.free import exact, recurrence, rigid_body, taylor
from kernels.near_axis import propagators

_NAMES = (  # rows of the scratch array, W long each
    # the input: moments in a unit near the greatest, sign of the spin, perturbation, run
    *("Ia", "Ib", "Ic", "spin", "epsilon", "cosine", "sine", "spacing", "steps"),
    # the state, the coefficients of its steps, and the two samples before
    *("a", "b", "c", "ka", "kb", "kc", "b1", "c1", "b2", "c2"),
    # the exact state, the coefficients of its step, and the square of its distance from the direct one, taken from the
    # sample with the largest distance relative to the perturbation
    *("xa", "xb", "xc", "qa", "qb", "qc", "distance2"),
    # the measurement: first guess and sums, sense of rotation, samples used, 1 if the window is open, sizes squared
    *("guess", "rx", "rr", "xx", "turning", "samples", "is_open", "start_size2", "max_size2"),
    # invariants: Euler coefficients, moments over the greatest; values at the start and largest changes
    *("cb", "cc", "ja", "jb", "jc", "J_start", "J_change", "J_scale"),
    *("E", "E_change", "L2", "L2_change"),
    # the log slope: 1 if its window can still begin, its upper end, number of samples, products with their exponents
    # (kernels.estimator.measure.slope_of_products), and the sizes squared of the first and the last
    *("log_open", "log_cap", "log_samples", "log_p", "p_exponent", "log_q", "q_exponent"),
    *("log_first", "log_last"),
    # the reduction to zero amplitude: its sums, the clock's excess over the last interval and the last sample's half of
    # the next, the constants of kernels.estimator.reduction.constants, and the largest change of the spin
    *("sx", "ss", "sw", "u1", "half"),
    *("drive", "quadrature", "first", "second", "third", "along", "slope", "wander"),
    # its first order: the factor of (β, γ) in the next triple, a line in the spin, and the second factor over βγ
    *("own", "own_slope", "own_offset", "across"),
    # the exact recurrence of a small motion: first differences, and its constants (kernels.free.recurrence)
    *("da", "db", "dc", "ga", "gb", "gc", "bend"),
    # the square of the perturbation's largest size at the sample of distance2
    "distance_size2",
)
row = numbers(_NAMES, width=W)
ROWS = len(_NAMES)
CLEARED_ROWS = (  # sums and maxima, 0 at the start
    *(row.rx, row.rr, row.xx, row.turning, row.J_change, row.E_change, row.L2_change, row.log_samples, row.p_exponent),
    *(row.q_exponent, row.distance2, row.sx, row.ss, row.sw, row.wander),
)

NO_REDUCTION, FIRST_ORDER, FULL_REDUCTION = range(3)  # orders of the reduction, :mod:`kernels.estimator.reduction`


class Work(NamedTuple):
    """Groups of columns computed in addition to the rate²; compiled code takes it as a plain tuple of bool."""

    with_exact: bool  #: the comparison with the exact solution
    with_invariants: bool  #: the changes of energy, momentum and the perturbation's invariant
    with_log: bool  #: the log slope
    with_reduction: bool  #: the reduction to zero amplitude
    with_rates: bool  #: rates in addition to their squares; the log slope needs them


@njit(**OPTIONS)
def begin_block(S):
    """Take sample 0 of every lane: set up state, steps and invariants, clear the sums and open the windows."""
    for lane in range(W):
        e2 = S[row.epsilon + lane] * S[row.epsilon + lane]
        ca, cb, cc = rigid_body.euler_coefficients(S[row.Ia + lane], S[row.Ib + lane], S[row.Ic + lane])
        h = S[row.spacing + lane] / S[row.steps + lane]
        S[row.ka + lane], S[row.kb + lane], S[row.kc + lane] = ca * e2 * h, cb * h, cc * h
        S[row.cb + lane], S[row.cc + lane] = cb, cc
        a, b, c = S[row.spin + lane], S[row.cosine + lane], S[row.sine + lane]
        S[row.a + lane], S[row.b + lane], S[row.c + lane] = a, b, c
        S[row.b1 + lane], S[row.c1 + lane], S[row.b2 + lane], S[row.c2 + lane] = b, c, b, c
        size = measure.dot(b, c, b, c)
        S[row.start_size2 + lane], S[row.max_size2 + lane] = size, size
        S[row.samples + lane], S[row.is_open + lane], S[row.log_open + lane] = 1.0, 1.0, 1.0
        below = measure.LOG_BELOW / S[row.epsilon + lane]
        S[row.log_cap + lane] = min(measure.LOG_TO * measure.LOG_TO * size, below * below)
        S[row.drive + lane], S[row.guess + lane] = ca * e2 * S[row.spacing + lane] * a, 0.0
        S[row.log_p + lane], S[row.log_q + lane] = 1.0, 1.0
        S[row.log_first + lane], S[row.log_last + lane], S[row.distance_size2 + lane] = 1.0, 1.0, 1.0
    for total in CLEARED_ROWS:
        for lane in range(W):
            S[total + lane] = 0.0


@njit(**OPTIONS)
def begin_exact(S):
    """Set up the exact state and the coefficients of its step, one sample interval long."""
    for lane in range(W):
        a, b, c, e = S[row.spin + lane], S[row.cosine + lane], S[row.sine + lane], S[row.epsilon + lane]
        S[row.xa + lane], S[row.xb + lane], S[row.xc + lane] = a, b, c
        moments = S[row.Ia + lane], S[row.Ib + lane], S[row.Ic + lane]
        qa, qb, qc = exact.short_step_constants(moments, (a, e * b, e * c), S[row.spacing + lane])
        S[row.qa + lane], S[row.qb + lane], S[row.qc + lane] = qa * (e * e), qb, qc


@njit(**OPTIONS)
def begin_recurrence(S):
    """Set up the recurrence of a small motion, in place of :func:`begin_exact`."""
    for lane in range(W):
        a, b, c = S[row.spin + lane], S[row.cosine + lane], S[row.sine + lane]
        S[row.xb + lane], S[row.xc + lane] = b, c
        moments = S[row.Ia + lane], S[row.Ib + lane], S[row.Ic + lane]
        constants = recurrence.constants(moments, S[row.epsilon + lane], (a, b, c), S[row.spacing + lane])
        S[row.da + lane], S[row.db + lane], S[row.dc + lane] = constants[:3]
        S[row.ga + lane], S[row.gb + lane], S[row.gc + lane], S[row.bend + lane] = constants[3:]


@njit(**OPTIONS)
def begin_invariants(S):
    """Store the invariants of every lane at its start."""
    for lane in range(W):
        greatest = max(S[row.Ia + lane], max(S[row.Ib + lane], S[row.Ic + lane]))
        ja, jb, jc = S[row.Ia + lane] / greatest, S[row.Ib + lane] / greatest, S[row.Ic + lane] / greatest
        S[row.ja + lane], S[row.jb + lane], S[row.jc + lane] = ja, jb, jc
        a, b, c = S[row.a + lane], S[row.epsilon + lane] * S[row.b + lane], S[row.epsilon + lane] * S[row.c + lane]
        S[row.E + lane] = rigid_body.twice_energy(a, b, c, ja, jb, jc)
        S[row.L2 + lane] = rigid_body.squared_momentum(a, b, c, ja, jb, jc)
        coefficients = S[row.cb + lane], S[row.cc + lane]
        J, scale = rigid_body.perturbation_invariant(S[row.b + lane], S[row.c + lane], *coefficients)
        S[row.J_start + lane], S[row.J_scale + lane] = J, scale


def _advance_by(step):
    """Return a function that takes steps of one kind in all lanes."""

    @njit(name=f"advance_{step.__name__}", **OPTIONS)
    def advance_lanes(S, steps):
        """Advance every lane by `steps` steps."""
        for _ in range(steps):
            for lane in range(W):
                a, b, c = S[row.a + lane], S[row.b + lane], S[row.c + lane]
                coefficients = S[row.ka + lane], S[row.kb + lane], S[row.kc + lane]
                S[row.a + lane], S[row.b + lane], S[row.c + lane] = step(a, b, c, *coefficients)

    return advance_lanes


_taylor_8, _near_8, _nearest_8, _taylor_10, _near_10, _nearest_10, _taylor_12, _near_12, _nearest_12 = map(
    _advance_by, taylor.STEPS
)


@njit(**INNER)
def _advance_exact(S):
    """Advance every lane by one step of the closed form."""
    for lane in range(W):
        constants = S[row.qa + lane], S[row.qb + lane], S[row.qc + lane]
        a, b, c = exact.step(S[row.a + lane], S[row.b + lane], S[row.c + lane], *constants)
        S[row.a + lane], S[row.b + lane], S[row.c + lane] = a, b, c


@njit(**INNER)
def _advance_recurrence(S):
    """Advance every lane by one step of the recurrence that the exact solution obeys."""
    for lane in range(W):
        a, b = S[row.a + lane] + S[row.da + lane], S[row.b + lane] + S[row.db + lane]
        c = S[row.c + lane] + S[row.dc + lane]
        bend = recurrence.bend_factor(b, S[row.bend + lane])
        S[row.da + lane] = recurrence.next_difference(S[row.da + lane], a, S[row.ga + lane], bend)
        S[row.db + lane] = recurrence.next_difference(S[row.db + lane], b, S[row.gb + lane], bend)
        S[row.dc + lane] = recurrence.next_difference(S[row.dc + lane], c, S[row.gc + lane], bend)
        S[row.a + lane], S[row.b + lane], S[row.c + lane] = a, b, c


@njit(**OPTIONS)
def advance_lanes(S, step, steps):
    """Advance every lane by a sample interval.

    Args:
        `S` (numpy.ndarray, shape (ROWS * W,)): Scratch; the rows a, b, c are changed.
        step, steps (int): Step of :mod:`kernels.near_axis.propagators`, and its number in the interval.
    """
    if step == propagators.TAYLOR_8:
        _taylor_8(S, steps)
    elif step == propagators.NEAR_8:
        _near_8(S, steps)
    elif step == propagators.NEAREST_8:
        _nearest_8(S, steps)
    elif step == propagators.TAYLOR_10:
        _taylor_10(S, steps)
    elif step == propagators.NEAR_10:
        _near_10(S, steps)
    elif step == propagators.NEAREST_10:
        _nearest_10(S, steps)
    elif step == propagators.TAYLOR_12:
        _taylor_12(S, steps)
    elif step == propagators.NEAR_12:
        _near_12(S, steps)
    elif step == propagators.NEAREST_12:
        _nearest_12(S, steps)
    elif step == propagators.EXACT:
        _advance_exact(S)
    else:
        _advance_recurrence(S)


@njit(**OPTIONS)
def store_excess(S):
    """Store the spin's excess at the second sample in the row u1, for :func:`set_first_guess`."""
    for lane in range(W):
        S[row.u1 + lane] = S[row.a + lane] * S[row.spin + lane] - 1.0


@njit(**OPTIONS)
def set_first_guess(S):
    """Set the first guess of every lane; the current state is the third sample.

    A motion that certainly rotates has no log slope. Returns whether any lane may have one. Products of βγ are stored
    for :func:`begin_reduction` in the rows half, own and across.
    """
    num_logging = 0
    for lane in range(W):
        b, c, b1, c1 = S[row.b + lane], S[row.c + lane], S[row.b1 + lane], S[row.c1 + lane]
        b2, c2 = S[row.b2 + lane], S[row.c2 + lane]
        excess = S[row.u1 + lane], S[row.a + lane] * S[row.spin + lane] - 1.0
        S[row.guess + lane] = reduction.corrected_guess(excess, (b, c), (b1, c1), (b2, c2), S[row.drive + lane])
        middle, first = b1 * c1, b2 * c2
        S[row.half + lane], S[row.own + lane], S[row.across + lane] = middle, middle - first, b * c - first
        turns = S[row.guess + lane] > measure.MIN_ROTATING_D
        S[row.log_open + lane] = 0.0 if turns else S[row.log_open + lane]
    for lane in range(W):  # a separate loop: within the loop above it would prevent packed code
        num_logging |= 0 if S[row.guess + lane] > measure.MIN_ROTATING_D else 1
    return num_logging > 0


@njit(**OPTIONS)
def begin_reduction(S):
    """Set the constants of the reduction of every lane, from its first guess and first three samples."""
    for lane in range(W):
        a1, middle = S[row.u1 + lane], S[row.half + lane]
        difference, double_difference = S[row.own + lane], S[row.across + lane]
        quadrature, first, second, third, along, slope = reduction.constants(S[row.guess + lane], S[row.drive + lane])
        S[row.quadrature + lane], S[row.first + lane], S[row.second + lane] = quadrature, first, second
        S[row.third + lane], S[row.along + lane], S[row.slope + lane] = third, along, slope
        S[row.u1 + lane], S[row.half + lane] = 0.5 * a1 - quadrature * difference, 0.5 * a1 + quadrature * middle
        factor, offset, S[row.across + lane] = reduction.first_order(
            S[row.guess + lane], S[row.drive + lane], a1, double_difference
        )
        S[row.own + lane] = first * (factor * a1 + offset)
        S[row.own_slope + lane] = first * factor * S[row.spin + lane]
        S[row.own_offset + lane] = first * (offset - factor)


@njit(**INLINE)
def _full_factors(S, lane, excess):
    """Return the clock up to this sample, and the factors of the amplitude's part of the triple that it ends."""
    half = 0.5 * excess
    product = S[row.quadrature + lane] * (S[row.b + lane] * S[row.c + lane])
    u = (half - product) + S[row.half + lane]
    constants = S[row.first + lane], S[row.second + lane], S[row.third + lane], S[row.along + lane], S[row.slope + lane]
    factors = reduction.amplitude_part(u, S[row.u1 + lane], constants)
    S[row.u1 + lane], S[row.half + lane] = u, half + product
    return factors


@formula
def _linear(x, slope, start):
    return x * slope + start


@njit(**INLINE)
def _first_order_factors(S, lane):
    """Return both factors to the first order."""
    along = S[row.own + lane]
    S[row.own + lane] = _linear(S[row.a + lane], S[row.own_slope + lane], S[row.own_offset + lane])
    return along, S[row.across + lane] * (S[row.b1 + lane] * S[row.c1 + lane])


@formula
def _reduced_residual(r, along, across, x, x1, x2):
    """Return a component's residual without the amplitude's part of its triple."""
    return (r - along * x1) - across * ((x - x1) + (x1 - x2))


def _add_sample_with(reduced):
    """Return a function that adds every lane's sample x_k to the sums, for one order of the reduction.

    The reduction takes the effect of a finite amplitude out of the samples (:mod:`kernels.estimator.reduction`); its
    order is known when the function is compiled, and rows that are not read with it are not written. The sums are those
    of the least-squares fit of x_k + x_(k-2) = 2 d x_(k-1): products of the residual with x_(k-1) and with itself (rx,
    rr), of x_(k-1) with itself (xx), and the same of the reduced residual (sx, ss, sw). A lane's window closes, and
    its samples count no more, once the perturbation has grown or shrunk too far, or the spin has wandered too far.
    """
    is_reduced, is_full = reduced != NO_REDUCTION, reduced == FULL_REDUCTION

    @njit(name=f"sample_{reduced}", **OPTIONS)
    def add_sample(S, triple):
        """Add a sample, with `triple` also the residual of the three last; return True if a window is open."""
        num_open = 0  # a whole number: its or-reduction stays packed
        for lane in range(W):
            b, c = S[row.b + lane], S[row.c + lane]
            b1, c1, b2, c2 = S[row.b1 + lane], S[row.c1 + lane], S[row.b2 + lane], S[row.c2 + lane]
            size = measure.dot(b, c, b, c)
            start = S[row.start_size2 + lane]
            inside = (S[row.is_open + lane] > 0.0) & (size <= measure.MAX_GROWTH * measure.MAX_GROWTH * start)
            inside = inside & (size >= measure.MIN_SIZE * measure.MIN_SIZE * start)
            if is_full:
                excess = S[row.a + lane] * S[row.spin + lane] - 1.0
                wander = abs(excess)
                is_early = S[row.samples + lane] < reduction.MIN_FOLLOWED_SAMPLES
                inside = inside & ((wander <= reduction.MAX_WANDER) | is_early)
                S[row.wander + lane] = wander if inside & (wander > S[row.wander + lane]) else S[row.wander + lane]
            weight = 1.0 if inside else 0.0
            S[row.is_open + lane] = weight
            S[row.samples + lane] += weight
            rb, rc = measure.residual((b, c), (b1, c1), (b2, c2), S[row.guess + lane])
            xx = measure.dot(b1, c1, b1, c1)
            counts = inside & triple
            S[row.rx + lane] += measure.dot(rb, rc, b1, c1) if counts else 0.0
            S[row.rr + lane] += measure.dot(rb, rc, rb, rc) if counts else 0.0
            S[row.xx + lane] += xx if counts else 0.0
            if is_reduced:
                if is_full:
                    along, across, mu = _full_factors(S, lane, excess)
                    S[row.sw + lane] += xx * (mu * (2.0 + mu)) if counts else 0.0
                else:
                    along, across = _first_order_factors(S, lane)
                sb = _reduced_residual(rb, along, across, b, b1, b2)
                sc = _reduced_residual(rc, along, across, c, c1, c2)
                S[row.sx + lane] += measure.dot(sb, sc, b1, c1) if counts else 0.0
                S[row.ss + lane] += measure.dot(sb, sc, sb, sc) if counts else 0.0
                rotation = measure.dot(b1, c1, c, -b)
                rotation = rotation * (1.0 + excess) if is_full else rotation
                S[row.turning + lane] += rotation if inside else 0.0
            S[row.max_size2 + lane] = size if inside & (size > S[row.max_size2 + lane]) else S[row.max_size2 + lane]
            S[row.b2 + lane], S[row.c2 + lane] = b1, c1
            S[row.b1 + lane], S[row.c1 + lane] = b, c
            num_open |= 1 if inside else 0
        return num_open > 0

    return add_sample


_sample_alone, _sample_first_order, _sample_whole = (
    _add_sample_with(reduced) for reduced in (NO_REDUCTION, FIRST_ORDER, FULL_REDUCTION)
)


@formula
def _residual(ahead, back, two_guess, x):
    """Return the residual of two successive differences after D_0."""
    return (ahead - back) + two_guess * x


@njit(**INLINE)
def _exact_sample(state, sums, constants):
    """Return the next step of the recurrence and its sample, of one lane, in registers."""
    b1, c1, back_b, back_c, xx, db, dc = state
    weight, samples_used, sum_rx, sum_rr, sum_xx = sums
    gb, gc, q, two_guess, min_size2, max_size2 = constants
    b, c = b1 + db, c1 + dc
    bend = recurrence.bend_factor(b, q)
    db, dc = recurrence.next_difference(db, b, gb, bend), recurrence.next_difference(dc, c, gc, bend)
    size = measure.dot(b, c, b, c)
    inside = (weight > 0.0) & (size <= max_size2) & (size >= min_size2)
    weight = 1.0 if inside else 0.0
    ahead_b, ahead_c = b - b1, c - c1  # differences of rounded samples
    rb, rc = _residual(ahead_b, back_b, two_guess, b1), _residual(ahead_c, back_c, two_guess, c1)
    sum_rx += measure.dot(rb, rc, b1, c1) if inside else 0.0
    sum_rr += measure.dot(rb, rc, rb, rc) if inside else 0.0
    sum_xx += xx if inside else 0.0
    return (b, c, ahead_b, ahead_c, size, db, dc), (weight, samples_used + weight, sum_rx, sum_rr, sum_xx)


def _exact_samples_of(count):
    """Return a function of several steps of the recurrence, each with its sample, after the first guess.

    The spin is not computed: no rate depends on it. Registers are written to memory once per call.
    """

    @njit(name=f"exact_samples_{count}", **OPTIONS)
    def samples(S):
        """Advance and measure every lane by the factory's number of samples; return True if a window is open."""
        num_open = 0
        for lane in range(W):
            b1, c1, b2, c2 = S[row.b1 + lane], S[row.c1 + lane], S[row.b2 + lane], S[row.c2 + lane]
            state = (b1, c1, b1 - b2, c1 - c2, measure.dot(b1, c1, b1, c1), S[row.db + lane], S[row.dc + lane])
            sums = (S[row.is_open + lane], S[row.samples + lane], S[row.rx + lane], S[row.rr + lane], S[row.xx + lane])
            min_size2 = measure.MIN_SIZE * measure.MIN_SIZE * S[row.start_size2 + lane]
            max_size2 = measure.MAX_GROWTH * measure.MAX_GROWTH * S[row.start_size2 + lane]
            gb, gc, bend, two_guess = S[row.gb + lane], S[row.gc + lane], S[row.bend + lane], 2.0 * S[row.guess + lane]
            constants = (gb, gc, bend, two_guess, min_size2, max_size2)
            if count == 4:
                state, sums = _exact_sample(state, sums, constants)
                state, sums = _exact_sample(state, sums, constants)
                state, sums = _exact_sample(state, sums, constants)
            b1, c1 = state[0], state[1]
            state, sums = _exact_sample(state, sums, constants)
            b, c, _, _, _, S[row.db + lane], S[row.dc + lane] = state
            S[row.is_open + lane], S[row.samples + lane], S[row.rx + lane], S[row.rr + lane], S[row.xx + lane] = sums
            S[row.b2 + lane], S[row.c2 + lane], S[row.b1 + lane], S[row.c1 + lane] = b1, c1, b, c
            S[row.b + lane], S[row.c + lane] = b, c
            num_open |= 1 if S[row.is_open + lane] > 0.0 else 0
        return num_open > 0

    return samples


AT_ONCE = 4  # samples of the recurrence
_exact_sample_alone, _exact_samples = (_exact_samples_of(count) for count in (1, AT_ONCE))


@njit(**OPTIONS)
def add_sample(S, k, reduced):
    """Add sample k of every lane: window, sense of rotation, sums of the recurrence and of its reduction.

    A lane with a closed window no longer changes. Sums include a triple of samples from the third one on.

    Args:
        `S` (numpy.ndarray, shape (ROWS * W,)): Scratch.
        `k` (int): Number of the sample, from 1.
        reduced (int): Order of the reduction.

    Returns:
        bool: Whether any lane's window is open.
    """
    if reduced == FULL_REDUCTION:
        return _sample_whole(S, k >= 2)
    if reduced == FIRST_ORDER:
        return _sample_first_order(S, k >= 2)
    return _sample_alone(S, k >= 2)


@njit(**INLINE)
def _compare_lane(S, lane, b, c):
    """Store the largest distance of the direct solution from the exact one, (b, c)."""
    db, dc = S[row.b + lane] - b, S[row.c + lane] - c
    distance2, size2 = measure.dot(db, dc, db, dc), S[row.max_size2 + lane]
    # a ratio of two rows without division, written so that a NaN distance stays
    keeps = (S[row.is_open + lane] == 0.0) | (
        distance2 * S[row.distance_size2 + lane] <= S[row.distance2 + lane] * size2
    )
    S[row.distance2 + lane] = S[row.distance2 + lane] if keeps else distance2
    S[row.distance_size2 + lane] = S[row.distance_size2 + lane] if keeps else size2


@njit(**OPTIONS)
def compare_exact(S):
    """Take one exact step of every lane and compare; called after :func:`add_sample`, which sets the window."""
    for lane in range(W):
        constants = S[row.qa + lane], S[row.qb + lane], S[row.qc + lane]
        a, b, c = exact.step(S[row.xa + lane], S[row.xb + lane], S[row.xc + lane], *constants)
        S[row.xa + lane], S[row.xb + lane], S[row.xc + lane] = a, b, c
        _compare_lane(S, lane, b, c)


@njit(**OPTIONS)
def compare_recurrence(S):
    """Take one step of the recurrence of small motions and compare, as :func:`compare_exact`."""
    for lane in range(W):
        b, c = S[row.xb + lane] + S[row.db + lane], S[row.xc + lane] + S[row.dc + lane]
        bend = recurrence.bend_factor(b, S[row.bend + lane])
        S[row.db + lane] = recurrence.next_difference(S[row.db + lane], b, S[row.gb + lane], bend)
        S[row.dc + lane] = recurrence.next_difference(S[row.dc + lane], c, S[row.gc + lane], bend)
        S[row.xb + lane], S[row.xc + lane] = b, c
        _compare_lane(S, lane, b, c)


@njit(**OPTIONS)
def compare_invariants(S):
    """Compare the invariants of every lane with their start; called after :func:`add_sample`."""
    for lane in range(W):
        inside = S[row.is_open + lane] > 0.0
        coefficients = S[row.cb + lane], S[row.cc + lane]
        J, scale = rigid_body.perturbation_invariant(S[row.b + lane], S[row.c + lane], *coefficients)
        a, b, c = S[row.a + lane], S[row.epsilon + lane] * S[row.b + lane], S[row.epsilon + lane] * S[row.c + lane]
        energy = rigid_body.twice_energy(a, b, c, S[row.ja + lane], S[row.jb + lane], S[row.jc + lane])
        momentum = rigid_body.squared_momentum(a, b, c, S[row.ja + lane], S[row.jb + lane], S[row.jc + lane])
        jd, ed, ld = abs(J - S[row.J_start + lane]), abs(energy - S[row.E + lane]), abs(momentum - S[row.L2 + lane])
        jd, scale = jd if inside else 0.0, scale if inside else 0.0  # outside none is larger
        ed, ld = ed if inside else 0.0, ld if inside else 0.0
        S[row.J_change + lane] = jd if jd > S[row.J_change + lane] else S[row.J_change + lane]
        S[row.J_scale + lane] = scale if scale > S[row.J_scale + lane] else S[row.J_scale + lane]
        S[row.E_change + lane] = ed if ed > S[row.E_change + lane] else S[row.E_change + lane]
        S[row.L2_change + lane] = ld if ld > S[row.L2_change + lane] else S[row.L2_change + lane]


@njit(**OPTIONS)
def add_log_sample(S):
    """Add a sample to the log slope of every lane inside its window; return whether any lane is inside.

    The samples inside a window are consecutive.
    """
    num_logging = 0  # a whole number: its or-reduction stays packed
    for lane in range(W):
        size = measure.dot(S[row.b + lane], S[row.c + lane], S[row.b + lane], S[row.c + lane])
        min_size2 = measure.LOG_FROM * measure.LOG_FROM * S[row.start_size2 + lane]
        is_open = S[row.is_open + lane] > 0.0
        log_open, n = S[row.log_open + lane], S[row.log_samples + lane]
        P, up = S[row.log_p + lane], S[row.p_exponent + lane]
        Q, difference = S[row.log_q + lane], S[row.q_exponent + lane]
        sums = (log_open, n, P, up, Q, difference, S[row.log_first + lane], S[row.log_last + lane])
        inside, sums = measure.add_log_sample(size, min_size2, S[row.log_cap + lane], is_open, sums)
        S[row.log_open + lane], S[row.log_samples + lane] = sums[:2]
        S[row.log_p + lane], S[row.p_exponent + lane], S[row.log_q + lane], S[row.q_exponent + lane] = sums[2:6]
        S[row.log_first + lane], S[row.log_last + lane] = sums[6:]
        num_logging |= 1 if inside else 0
    return num_logging > 0


@njit(**OPTIONS)
def has_grown_lane(S):
    """Return True if some lane has been large enough for the log slope."""
    num_large = 0
    for lane in range(min(W, S.size)):  # a number unknown to LLVM, which would unroll so short a loop
        min_size2 = measure.LOG_FROM * measure.LOG_FROM * S[row.start_size2 + lane]
        num_large |= 1 if S[row.max_size2 + lane] >= min_size2 else 0
    return num_large > 0


@njit(**INNER)
def _follow_recurrence(S, num_samples):
    """Add the remaining samples of every lane by the recurrence."""
    is_open = True
    while is_open and num_samples >= AT_ONCE:
        is_open, num_samples = _exact_samples(S), num_samples - AT_ONCE
    while is_open and num_samples > 0:
        is_open, num_samples = _exact_sample_alone(S), num_samples - 1


@njit(**OPTIONS)
def integrate_block(S, step, steps, intervals, work, reduced):
    """Integrate every lane through the run, or until the last window of the block has closed.

    Args:
        `S` (numpy.ndarray, shape (ROWS * W,)): Scratch, with the first nine rows filled, Ia to steps.
        step, steps (int): Step of :mod:`kernels.near_axis.propagators` for the whole block, RECURRENCE if and only if
            ``reduced`` is not FULL_REDUCTION in place of EXACT; and their number in a sample interval.
        intervals (int): Number of sample intervals.
        work (tuple of 5 bool): Of :class:`Work`.
        reduced (int): NO_REDUCTION, FIRST_ORDER or FULL_REDUCTION; the first two only if the first order
            suffices (:func:`kernels.estimator.reduction.is_small`).
    """
    with_exact, with_invariants, with_log, _, _ = work
    begin_block(S)
    if with_exact or propagators.IS_EXACT[step]:
        if reduced == FULL_REDUCTION:
            begin_exact(S)
        else:
            begin_recurrence(S)
    if with_invariants:
        begin_invariants(S)
    is_open, can_grow, is_logging = True, False, False
    at_once = step == propagators.RECURRENCE and reduced == NO_REDUCTION and not with_invariants
    for k in range(1, intervals + 1):
        if at_once and k > 2:
            _follow_recurrence(S, intervals - 2)
            break
        advance_lanes(S, step, steps)
        if k == 2:
            can_grow = set_first_guess(S)
            if reduced != NO_REDUCTION:
                begin_reduction(S)
        if is_open:  # else at most the log slope's windows are open
            is_open = add_sample(S, k, reduced)
            is_logging = is_logging or (can_grow and with_log and has_grown_lane(S))
            if k == 1:
                store_excess(S)
            if with_exact and reduced == FULL_REDUCTION:
                compare_exact(S)
            elif with_exact:
                compare_recurrence(S)
            if with_invariants:
                compare_invariants(S)
        if is_logging:
            is_logging = add_log_sample(S) or is_open
        elif not is_open:
            break
