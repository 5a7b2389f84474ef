r"""Lanes: W perturbed rotations side by side, integrated, sampled and summed up, with nothing kept but sums.

Time runs in radians of spin, :math:`\tau = |\omega_0|t`, and the transverse components in units of the nudge,
:math:`\omega_b = \varepsilon|\omega_0|\beta`, :math:`\omega_c = \varepsilon|\omega_0|\gamma`,
:math:`\omega_a = |\omega_0|\alpha`. In these Euler's equations keep their form,

.. math:: \alpha' = c_a\varepsilon^2\,\beta\gamma, \qquad \beta' = c_b\,\gamma\alpha, \qquad \gamma' = c_c\,\alpha\beta

so every point takes the same work whatever its spin rate, and no nudge is too small to square.

*Shape.* Structure of arrays in one flat scratch array, the row x of lane l at
``S[row.x + l]``; see :mod:`kernels.compile.blocks`.

*Certificate.* Beside the direct solution runs the exact one, by the exact step of :mod:`kernels.free.exact` over each
sample interval, or by its recurrence (:mod:`kernels.free.recurrence`) where the motion is small; neither shares code
with the direct one. The distance of the two in the transverse plane, relative to the largest transverse size reached so
far, is what the direct integration may be trusted to.
"""

from typing import NamedTuple

from kernels.compile.blocks import W
from kernels.compile.columns import numbers
from kernels.compile.jit import INLINE, INNER, OPTIONS, njit, whole_vectors
from kernels.compile.llvm_formulas import formula
from kernels.estimator import measure, reduction
from kernels.free import exact, recurrence, rigid_body, taylor
from kernels.near_axis import propagators

_NAMES = (  # rows of the scratch array, W long each
    # the input: moments in a unit near the greatest, sign of the spin, perturbation, run
    *("Ia", "Ib", "Ic", "spin", "epsilon", "cosine", "sine", "spacing", "steps"),
    # the state, the coefficients of its steps, and the two samples before
    *("a", "b", "c", "ka", "kb", "kc", "b1", "c1", "b2", "c2"),
    # the exact state, the coefficients of its step, and the square of its distance from the direct one, at the sample
    # at which it is largest relative to the perturbation
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
    # its first order: the factor of (β, γ) in the next triple, a line in the spin, and the other factor over βγ
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

NONE, FIRST_ORDER, WHOLE = range(3)  # how much of the reduction is done: see :mod:`kernels.estimator.reduction`


class Work(NamedTuple):
    """Groups of columns computed beside the measurement; compiled code takes it as a plain tuple of bool."""

    certified: bool  #: by comparison with the exact solution
    invariants: bool
    logged: bool  #: the log slope
    reducing: bool  #: to zero amplitude
    rated: bool  #: rates beside their squares; the log slope needs them


@njit(**OPTIONS)
def begin(S):
    """Take sample 0 of every lane: set up state, steps and invariants, clear the sums and open the windows."""
    whole_vectors()
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
    whole_vectors()
    for lane in range(W):
        a, b, c, e = S[row.spin + lane], S[row.cosine + lane], S[row.sine + lane], S[row.epsilon + lane]
        S[row.xa + lane], S[row.xb + lane], S[row.xc + lane] = a, b, c
        moments = S[row.Ia + lane], S[row.Ib + lane], S[row.Ic + lane]
        qa, qb, qc = exact.short_step_constants(moments, (a, e * b, e * c), S[row.spacing + lane])
        S[row.qa + lane], S[row.qb + lane], S[row.qc + lane] = qa * (e * e), qb, qc


@njit(**OPTIONS)
def begin_recurrence(S):
    """Set up as :func:`begin_exact` where the motion is small: its recurrence in place of its step."""
    whole_vectors()
    for lane in range(W):
        a, b, c = S[row.spin + lane], S[row.cosine + lane], S[row.sine + lane]
        S[row.xb + lane], S[row.xc + lane] = b, c
        moments = S[row.Ia + lane], S[row.Ib + lane], S[row.Ic + lane]
        constants = recurrence.constants(moments, S[row.epsilon + lane], (a, b, c), S[row.spacing + lane])
        S[row.da + lane], S[row.db + lane], S[row.dc + lane] = constants[:3]
        S[row.ga + lane], S[row.gb + lane], S[row.gc + lane], S[row.bend + lane] = constants[3:]


@njit(**OPTIONS)
def begin_invariants(S):
    """Note the invariants of every lane at its start."""
    whole_vectors()
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


def _advance_of(step):
    """Return a function that takes steps of one kind in all lanes."""

    @njit(name=f"advance_{step.__name__}", **OPTIONS)
    def advance(S, steps):
        whole_vectors()
        for _ in range(steps):
            for lane in range(W):
                a, b, c = S[row.a + lane], S[row.b + lane], S[row.c + lane]
                coefficients = S[row.ka + lane], S[row.kb + lane], S[row.kc + lane]
                S[row.a + lane], S[row.b + lane], S[row.c + lane] = step(a, b, c, *coefficients)

    return advance


_taylor_8, _near_8, _nearest_8, _taylor_10, _near_10, _nearest_10, _taylor_12, _near_12, _nearest_12 = map(
    _advance_of, taylor.STEPS
)


@njit(**INNER)
def _advance_exact(S):
    whole_vectors()
    for lane in range(W):
        constants = S[row.qa + lane], S[row.qb + lane], S[row.qc + lane]
        a, b, c = exact.step(S[row.a + lane], S[row.b + lane], S[row.c + lane], *constants)
        S[row.a + lane], S[row.b + lane], S[row.c + lane] = a, b, c


@njit(**INNER)
def _advance_recurrence(S):
    whole_vectors()
    for lane in range(W):
        a, b = S[row.a + lane] + S[row.da + lane], S[row.b + lane] + S[row.db + lane]
        c = S[row.c + lane] + S[row.dc + lane]
        bend = recurrence.bend(b, S[row.bend + lane])
        S[row.da + lane] = recurrence.bent(S[row.da + lane], a, S[row.ga + lane], bend)
        S[row.db + lane] = recurrence.bent(S[row.db + lane], b, S[row.gb + lane], bend)
        S[row.dc + lane] = recurrence.bent(S[row.dc + lane], c, S[row.gc + lane], bend)
        S[row.a + lane], S[row.b + lane], S[row.c + lane] = a, b, c


@njit(**OPTIONS)
def advance(S, step, steps):
    """Advance every lane by a sample interval, by so many steps of :mod:`kernels.near_axis.propagators`."""
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
def note_excess(S):
    """Leave the spin's excess at the second sample to :func:`guess`, in the row u1."""
    whole_vectors()
    for lane in range(W):
        S[row.u1 + lane] = S[row.a + lane] * S[row.spin + lane] - 1.0


@njit(**OPTIONS)
def guess(S):
    """Set the first guess of every lane; the current state is the third sample.

    A motion that surely turns has no log slope, and its ellipse is not followed as if it grew. Returns whether some
    lane may have one. Products of βγ are left to :func:`begin_reduction` in the rows half, own and across.
    """
    whole_vectors()
    growing = 0
    for lane in range(W):
        b, c, b1, c1 = S[row.b + lane], S[row.c + lane], S[row.b1 + lane], S[row.c1 + lane]
        b2, c2 = S[row.b2 + lane], S[row.c2 + lane]
        excess = S[row.u1 + lane], S[row.a + lane] * S[row.spin + lane] - 1.0
        S[row.guess + lane] = reduction.corrected_guess(excess, (b, c), (b1, c1), (b2, c2), S[row.drive + lane])
        middle, first = b1 * c1, b2 * c2
        S[row.half + lane], S[row.own + lane], S[row.across + lane] = middle, middle - first, b * c - first
        turns = S[row.guess + lane] > measure.MIN_ROTATING_D
        S[row.log_open + lane] = 0.0 if turns else S[row.log_open + lane]
    for lane in range(W):  # by itself: in the loop above it would keep that from being packed
        growing |= 0 if S[row.guess + lane] > measure.MIN_ROTATING_D else 1
    return growing > 0


@njit(**OPTIONS)
def begin_reduction(S):
    """Set what the reduction of every lane takes from the first guess and the samples that it stands on."""
    whole_vectors()
    for lane in range(W):
        a1, middle, over, twice_over = S[row.u1 + lane], S[row.half + lane], S[row.own + lane], S[row.across + lane]
        quadrature, first, second, third, along, slope = reduction.constants(S[row.guess + lane], S[row.drive + lane])
        S[row.quadrature + lane], S[row.first + lane], S[row.second + lane] = quadrature, first, second
        S[row.third + lane], S[row.along + lane], S[row.slope + lane] = third, along, slope
        S[row.u1 + lane], S[row.half + lane] = 0.5 * a1 - quadrature * over, 0.5 * a1 + quadrature * middle
        by, off, S[row.across + lane] = reduction.first_order(S[row.guess + lane], S[row.drive + lane], a1, twice_over)
        S[row.own + lane] = first * (by * a1 + off)
        S[row.own_slope + lane], S[row.own_offset + lane] = first * by * S[row.spin + lane], first * (off - by)


@njit(**INLINE)
def _take_part(S, lane, excess):
    """Return the clock up to this sample, and the factors of the amplitude's part of the triple that it ends."""
    half = 0.5 * excess
    product = S[row.quadrature + lane] * (S[row.b + lane] * S[row.c + lane])
    u = (half - product) + S[row.half + lane]
    constants = S[row.first + lane], S[row.second + lane], S[row.third + lane], S[row.along + lane], S[row.slope + lane]
    factors = reduction.amplitude_part(u, S[row.u1 + lane], constants)
    S[row.u1 + lane], S[row.half + lane] = u, half + product
    return factors


@formula
def _line(x, slope, start):
    return x * slope + start


@njit(**INLINE)
def _take_first_order(S, lane):
    """Return both factors to the first order."""
    along = S[row.own + lane]
    S[row.own + lane] = _line(S[row.a + lane], S[row.own_slope + lane], S[row.own_offset + lane])
    return along, S[row.across + lane] * (S[row.b1 + lane] * S[row.c1 + lane])


@formula
def _less_amplitude(r, along, across, x, x1, x2):
    """Return a component's residual without the amplitude's part of its triple."""
    return (r - along * x1) - across * ((x - x1) + (x1 - x2))


def _sample_of(reduced):
    """Return a function that takes a sample with one part of the reduction; decided when it is compiled.

    What regimes, certificates and log slopes are told from is not kept where nobody reads it.
    """
    followed, whole = reduced != NONE, reduced == WHOLE

    @njit(name=f"sample_{reduced}", **OPTIONS)
    def sample(S, triple):
        whole_vectors()
        opened = 0  # a whole number: its or-reduction stays packed
        for lane in range(W):
            b, c = S[row.b + lane], S[row.c + lane]
            b1, c1, b2, c2 = S[row.b1 + lane], S[row.c1 + lane], S[row.b2 + lane], S[row.c2 + lane]
            size = measure.dot(b, c, b, c)
            start = S[row.start_size2 + lane]
            inside = (S[row.is_open + lane] > 0.0) & (size <= measure.MAX_GROWTH * measure.MAX_GROWTH * start)
            inside = inside & (size >= measure.MIN_SIZE * measure.MIN_SIZE * start)
            if whole:
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
            if followed:
                if whole:
                    along, across, mu = _take_part(S, lane, excess)
                    S[row.sw + lane] += xx * (mu * (2.0 + mu)) if counts else 0.0
                else:
                    along, across = _take_first_order(S, lane)
                sb = _less_amplitude(rb, along, across, b, b1, b2)
                sc = _less_amplitude(rc, along, across, c, c1, c2)
                S[row.sx + lane] += measure.dot(sb, sc, b1, c1) if counts else 0.0
                S[row.ss + lane] += measure.dot(sb, sc, sb, sc) if counts else 0.0
                turn = measure.dot(b1, c1, c, -b)
                turn = turn * (1.0 + excess) if whole else turn
                S[row.turning + lane] += turn if inside else 0.0
            S[row.max_size2 + lane] = size if inside & (size > S[row.max_size2 + lane]) else S[row.max_size2 + lane]
            S[row.b2 + lane], S[row.c2 + lane] = b1, c1
            S[row.b1 + lane], S[row.c1 + lane] = b, c
            opened |= 1 if inside else 0
        return opened > 0

    return sample


_sample_alone, _sample_first_order, _sample_whole = (_sample_of(reduced) for reduced in (NONE, FIRST_ORDER, WHOLE))


@formula
def _left(ahead, back, two_guess, x):
    """Return residual of two successive differences after D_0."""
    return (ahead - back) + two_guess * x


@njit(**INLINE)
def _exact_sample(state, sums, constants):
    """Return the next step of the recurrence and its sample, of one lane, in registers."""
    b1, c1, back_b, back_c, xx, db, dc = state
    weight, used, sum_rx, sum_rr, sum_xx = sums
    gb, gc, q, two_guess, least, most = constants
    b, c = b1 + db, c1 + dc
    bend = recurrence.bend(b, q)
    db, dc = recurrence.bent(db, b, gb, bend), recurrence.bent(dc, c, gc, bend)
    size = measure.dot(b, c, b, c)
    inside = (weight > 0.0) & (size <= most) & (size >= least)
    weight = 1.0 if inside else 0.0
    ahead_b, ahead_c = b - b1, c - c1  # of the samples as they are rounded
    rb, rc = _left(ahead_b, back_b, two_guess, b1), _left(ahead_c, back_c, two_guess, c1)
    sum_rx += measure.dot(rb, rc, b1, c1) if inside else 0.0
    sum_rr += measure.dot(rb, rc, rb, rc) if inside else 0.0
    sum_xx += xx if inside else 0.0
    return (b, c, ahead_b, ahead_c, size, db, dc), (weight, used + weight, sum_rx, sum_rr, sum_xx)


def _exact_samples_of(count):
    """Return a function of several steps of the recurrence, each with its sample, after the first guess.

    The spin is not followed: no rate is told from it. What lies in registers goes to memory and back once.
    """

    @njit(name=f"exact_samples_{count}", **OPTIONS)
    def samples(S):
        whole_vectors()
        opened = 0
        for lane in range(W):
            b1, c1, b2, c2 = S[row.b1 + lane], S[row.c1 + lane], S[row.b2 + lane], S[row.c2 + lane]
            state = (b1, c1, b1 - b2, c1 - c2, measure.dot(b1, c1, b1, c1), S[row.db + lane], S[row.dc + lane])
            sums = (S[row.is_open + lane], S[row.samples + lane], S[row.rx + lane], S[row.rr + lane], S[row.xx + lane])
            least = measure.MIN_SIZE * measure.MIN_SIZE * S[row.start_size2 + lane]
            most = measure.MAX_GROWTH * measure.MAX_GROWTH * S[row.start_size2 + lane]
            constants = (S[row.gb + lane], S[row.gc + lane], S[row.bend + lane], 2.0 * S[row.guess + lane], least, most)
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
            opened |= 1 if S[row.is_open + lane] > 0.0 else 0
        return opened > 0

    return samples


AT_ONCE = 4  # samples of the recurrence
_exact_sample_alone, _exact_samples = (_exact_samples_of(count) for count in (1, AT_ONCE))


@njit(**OPTIONS)
def sample(S, k, reduced):
    """Take sample k of every lane: window, sense of turning and the sums of the recurrence and of its reduction.

    A closed window selects the old value everywhere, so a lane that has left it no longer changes. The recurrence takes
    part from the third sample on. Returns whether any lane's window is open.
    """
    if reduced == WHOLE:
        return _sample_whole(S, k >= 2)
    if reduced == FIRST_ORDER:
        return _sample_first_order(S, k >= 2)
    return _sample_alone(S, k >= 2)


@njit(**INLINE)
def _compare(S, lane, b, c):
    """Note how far the direct solution is from the exact one."""
    db, dc = S[row.b + lane] - b, S[row.c + lane] - c
    apart, largest = measure.dot(db, dc, db, dc), S[row.max_size2 + lane]
    # a ratio of two rows: no division; written so that a distance that is no number stays
    keeps = (S[row.is_open + lane] == 0.0) | (apart * S[row.distance_size2 + lane] <= S[row.distance2 + lane] * largest)
    S[row.distance2 + lane] = S[row.distance2 + lane] if keeps else apart
    S[row.distance_size2 + lane] = S[row.distance_size2 + lane] if keeps else largest


@njit(**OPTIONS)
def certify(S):
    """Take one exact step of every lane and compare; after :func:`sample`, whose window counts."""
    whole_vectors()
    for lane in range(W):
        constants = S[row.qa + lane], S[row.qb + lane], S[row.qc + lane]
        a, b, c = exact.step(S[row.xa + lane], S[row.xb + lane], S[row.xc + lane], *constants)
        S[row.xa + lane], S[row.xb + lane], S[row.xc + lane] = a, b, c
        _compare(S, lane, b, c)


@njit(**OPTIONS)
def certify_near(S):
    """Take one step as :func:`certify` where the motion is small: of its recurrence."""
    whole_vectors()
    for lane in range(W):
        b, c = S[row.xb + lane] + S[row.db + lane], S[row.xc + lane] + S[row.dc + lane]
        bend = recurrence.bend(b, S[row.bend + lane])
        S[row.db + lane] = recurrence.bent(S[row.db + lane], b, S[row.gb + lane], bend)
        S[row.dc + lane] = recurrence.bent(S[row.dc + lane], c, S[row.gc + lane], bend)
        S[row.xb + lane], S[row.xc + lane] = b, c
        _compare(S, lane, b, c)


@njit(**OPTIONS)
def watch_invariants(S):
    """Compare the invariants of every lane with their start; after :func:`sample`, whose window counts."""
    whole_vectors()
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
def log_sample(S):
    """Add a sample to the log slope of every lane that is inside its window; those inside follow each other.

    Returns whether any lane is inside its window still.
    """
    whole_vectors()
    going = 0  # a whole number: its or-reduction stays packed
    for lane in range(W):
        size = measure.dot(S[row.b + lane], S[row.c + lane], S[row.b + lane], S[row.c + lane])
        grown, is_open = measure.LOG_FROM * measure.LOG_FROM * S[row.start_size2 + lane], S[row.is_open + lane] > 0.0
        log_open, n = S[row.log_open + lane], S[row.log_samples + lane]
        P, up = S[row.log_p + lane], S[row.p_exponent + lane]
        Q, over = S[row.log_q + lane], S[row.q_exponent + lane]
        sums = (log_open, n, P, up, Q, over, S[row.log_first + lane], S[row.log_last + lane])
        inside, sums = measure.add_log_sample(size, grown, S[row.log_cap + lane], is_open, sums)
        S[row.log_open + lane], S[row.log_samples + lane] = sums[:2]
        S[row.log_p + lane], S[row.p_exponent + lane], S[row.log_q + lane], S[row.q_exponent + lane] = sums[2:6]
        S[row.log_first + lane], S[row.log_last + lane] = sums[6:]
        going |= 1 if inside else 0
    return going > 0


@njit(**OPTIONS)
def have_grown(S):
    """Return True if some lane has been large enough for the log slope."""
    whole_vectors()
    grown = 0
    for lane in range(min(W, S.size)):  # so many that LLVM does not know: it would unroll so short a loop, not pack it
        grown |= 1 if S[row.max_size2 + lane] >= measure.LOG_FROM * measure.LOG_FROM * S[row.start_size2 + lane] else 0
    return grown > 0


@njit(**OPTIONS)
def were_logged(S):
    """Return True if some lane's window of the log slope holds a sample."""
    whole_vectors()
    logged = 0
    for lane in range(min(W, S.size)):  # as in :func:`have_grown`
        logged |= 1 if S[row.log_samples + lane] > 0.0 else 0
    return logged > 0


@njit(**INNER)
def _follow_recurrence(S, left):
    """Take the last samples of every lane by the recurrence."""
    opened = True
    while opened and left >= AT_ONCE:
        opened, left = _exact_samples(S), left - AT_ONCE
    while opened and left > 0:
        opened, left = _exact_sample_alone(S), left - 1


@njit(**OPTIONS)
def follow(S, step, steps, intervals, work, reduced):
    """Follow every lane through the run, or until the last window of the block has closed.

    Args:
        S (numpy.ndarray, shape (ROWS * W,)): Scratch, with the first nine rows filled, Ia to steps.
        step, steps (int): Step of :mod:`kernels.near_axis.propagators` for the whole block, RECURRENCE if and only if
            ``reduced`` is not WHOLE in place of EXACT; and how many of them a sample interval takes.
        intervals (int): Number of sample intervals.
        work (tuple of 5 bool): Of :class:`Work`.
        reduced (int): How much of the reduction to zero amplitude is done: NONE, FIRST_ORDER or WHOLE; the first two
            only where the first order is enough (:func:`kernels.estimator.reduction.is_small`).
    """
    certified, invariants, logged, _, _ = work
    begin(S)
    if certified or propagators.IS_EXACT[step]:
        if reduced == WHOLE:
            begin_exact(S)
        else:
            begin_recurrence(S)
    if invariants:
        begin_invariants(S)
    opened, growing, logging = True, False, False
    at_once = step == propagators.RECURRENCE and reduced == NONE and not invariants
    for k in range(1, intervals + 1):
        if at_once and k > 2:
            _follow_recurrence(S, intervals - 2)
            break
        advance(S, step, steps)
        if k == 2:
            growing = guess(S)
            if reduced != NONE:
                begin_reduction(S)
        if opened:  # else every window has closed but the log slope's
            opened = sample(S, k, reduced)
            logging = logging or (growing and logged and have_grown(S))
            if k == 1:
                note_excess(S)
            if certified and reduced == WHOLE:
                certify(S)
            elif certified:
                certify_near(S)
            if invariants:
                watch_invariants(S)
        if logging:
            logging = log_sample(S) or opened
        elif not opened:
            break
