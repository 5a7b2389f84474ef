r"""Lanes: W perturbed rotations side by side, integrated, sampled and summed up, with nothing kept but sums.

Time runs in radians of spin, :math:`\tau = |\omega_0|t`, and the transverse components in units of the nudge,
:math:`\omega_b = \varepsilon|\omega_0|\beta`, :math:`\omega_c = \varepsilon|\omega_0|\gamma`,
:math:`\omega_a = |\omega_0|\alpha`. In these Euler's equations keep their form,

.. math:: \alpha' = c_a\varepsilon^2\,\beta\gamma, \qquad \beta' = c_b\,\gamma\alpha, \qquad \gamma' = c_c\,\alpha\beta

so every point takes the same work whatever its spin rate, and no nudge is too small to square.

*Shape.* Structure of arrays in one flat scratch array, row r of lane l at ``S[r*W + l]``; see
:mod:`kernels.compile.blocks`.

*Certificate.* Beside the direct solution runs the exact one, by the exact step of :mod:`kernels.free.exact` over each
sample interval, or by its recurrence (:mod:`kernels.free.recurrence`) where the motion is small; neither shares code
with the direct one. The distance of the two in the transverse plane, relative to the largest transverse size reached so
far, is what the direct integration may be trusted to.
"""

from typing import NamedTuple

from kernels.compile.blocks import W
from kernels.compile.jit import INLINE, INNER, OPTIONS, njit, whole_vectors
from kernels.compile.llvm_formulas import formula
from kernels.estimator import measure, reduction
from kernels.free import exact, recurrence, rigid_body, taylor
from kernels.near_axis import propagators

# Rows of the scratch array, each W long. Given: the moments in a unit near the greatest, the nudge and the run.
MA, MB, MC, SPIN, EPSILON, COSINE, SINE, SPACING, STEPS = (W * r for r in range(9))
# The state, its steps, and the two samples before.
A, B, C, KA, KB, KC, B1, C1, B2, C2 = (W * r for r in range(9, 19))
# The exact state, its step, and the square of its distance from the direct one where that was relatively largest.
XA, XB, XC, QA, QB, QC, APART = (W * r for r in range(19, 26))
# The measurement: first guess and sums, sense of turning, samples used, whether the window is open, sizes squared.
GUESS, RX, RR, XX, TURN, USED, OPEN, START, LARGEST = (W * r for r in range(26, 35))
# Invariants: Euler coefficients and moments over the greatest, values at the start and largest changes.
CB, CC, JA, JB, JC, J0, JD, JS, E0, ED, L0, LD = (W * r for r in range(35, 47))
# The log slope: whether its window can still come, its upper end, how many samples, their products with the exponents
# (:func:`kernels.estimator.measure.slope_of_products`), and the sizes squared of the first and the last.
LOPEN, LCAP, LN, LP, LPE, LQ, LQE, LFIRST, LLAST = (W * r for r in range(47, 56))
# The reduction to zero amplitude: its sums, the clock's excess over the last interval and the last sample's half of the
# next, the constants of :func:`kernels.estimator.reduction.constants`, and the spin's largest wandering.
SX, SS, SW, U1, HALF = (W * r for r in range(56, 61))
DRIVE, QUADRATURE, FIRST, SECOND, THIRD, ALONG, SLOPE, WANDER = (W * r for r in range(61, 69))
# Its first order: the factor of (β, γ) in the triple to come, a line in the spin, and by what βγ makes the other one.
OWN, OWN_BY, OWN_FROM, ACROSS = (W * r for r in range(69, 73))
# The exact recurrence of a small motion: first differences, and its constants (:mod:`kernels.free.recurrence`).
DA, DB, DC, GA, GB, GC, BEND = (W * r for r in range(73, 80))
# The square of the largest transverse size when the two were APART.
APART_OVER = W * 80
ROWS = 81

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
        e2 = S[EPSILON + lane] * S[EPSILON + lane]
        ca, cb, cc = rigid_body.euler_coefficients(S[MA + lane], S[MB + lane], S[MC + lane])
        h = S[SPACING + lane] / S[STEPS + lane]
        S[KA + lane], S[KB + lane], S[KC + lane] = ca * e2 * h, cb * h, cc * h
        S[CB + lane], S[CC + lane] = cb, cc
        a, b, c = S[SPIN + lane], S[COSINE + lane], S[SINE + lane]
        S[A + lane], S[B + lane], S[C + lane] = a, b, c
        S[B1 + lane], S[C1 + lane], S[B2 + lane], S[C2 + lane] = b, c, b, c
        size = measure.dot(b, c, b, c)
        S[START + lane], S[LARGEST + lane] = size, size
        S[USED + lane], S[OPEN + lane], S[LOPEN + lane] = 1.0, 1.0, 1.0
        below = measure.LOG_BELOW / S[EPSILON + lane]
        S[LCAP + lane] = min(measure.LOG_TO * measure.LOG_TO * size, below * below)
        S[DRIVE + lane], S[GUESS + lane] = ca * e2 * S[SPACING + lane] * a, 0.0
        S[LP + lane], S[LQ + lane] = 1.0, 1.0
        S[LFIRST + lane], S[LLAST + lane], S[APART_OVER + lane] = 1.0, 1.0, 1.0
    for row in (RX, RR, XX, TURN, JD, ED, LD, LN, LPE, LQE, APART, SX, SS, SW, WANDER):
        for lane in range(W):
            S[row + lane] = 0.0


@njit(**OPTIONS)
def begin_exact(S):
    """Set up the exact state and the coefficients of its step, one sample interval long."""
    whole_vectors()
    for lane in range(W):
        a, b, c, e = S[SPIN + lane], S[COSINE + lane], S[SINE + lane], S[EPSILON + lane]
        S[XA + lane], S[XB + lane], S[XC + lane] = a, b, c
        moments = S[MA + lane], S[MB + lane], S[MC + lane]
        qa, qb, qc = exact.short_step_constants(moments, (a, e * b, e * c), S[SPACING + lane])
        S[QA + lane], S[QB + lane], S[QC + lane] = qa * (e * e), qb, qc


@njit(**OPTIONS)
def begin_recurrence(S):
    """Set up as :func:`begin_exact` where the motion is small: its recurrence in place of its step."""
    whole_vectors()
    for lane in range(W):
        a, b, c = S[SPIN + lane], S[COSINE + lane], S[SINE + lane]
        S[XB + lane], S[XC + lane] = b, c
        moments = S[MA + lane], S[MB + lane], S[MC + lane]
        first = recurrence.constants(moments, S[EPSILON + lane], (a, b, c), S[SPACING + lane])
        S[DA + lane], S[DB + lane], S[DC + lane], S[GA + lane], S[GB + lane], S[GC + lane], S[BEND + lane] = first


@njit(**OPTIONS)
def begin_invariants(S):
    """Note the invariants of every lane at its start."""
    whole_vectors()
    for lane in range(W):
        greatest = max(S[MA + lane], max(S[MB + lane], S[MC + lane]))
        ja, jb, jc = S[MA + lane] / greatest, S[MB + lane] / greatest, S[MC + lane] / greatest
        S[JA + lane], S[JB + lane], S[JC + lane] = ja, jb, jc
        a, b, c = S[A + lane], S[EPSILON + lane] * S[B + lane], S[EPSILON + lane] * S[C + lane]
        S[E0 + lane] = rigid_body.twice_energy(a, b, c, ja, jb, jc)
        S[L0 + lane] = rigid_body.squared_momentum(a, b, c, ja, jb, jc)
        J, scale = rigid_body.perturbation_invariant(S[B + lane], S[C + lane], S[CB + lane], S[CC + lane])
        S[J0 + lane], S[JS + lane] = J, scale


def _advance_of(step):
    """Return a function that takes steps of one kind in all lanes."""

    @njit(name=f"advance_{step.__name__}", **OPTIONS)
    def advance(S, steps):
        whole_vectors()
        for _ in range(steps):
            for lane in range(W):
                S[A + lane], S[B + lane], S[C + lane] = step(
                    S[A + lane], S[B + lane], S[C + lane], S[KA + lane], S[KB + lane], S[KC + lane]
                )

    return advance


_taylor_8, _near_8, _nearest_8, _taylor_10, _near_10, _nearest_10, _taylor_12, _near_12, _nearest_12 = map(
    _advance_of, taylor.STEPS
)


@njit(**INNER)
def _advance_exact(S):
    whole_vectors()
    for lane in range(W):
        S[A + lane], S[B + lane], S[C + lane] = exact.step(
            S[A + lane], S[B + lane], S[C + lane], S[QA + lane], S[QB + lane], S[QC + lane]
        )


@njit(**INNER)
def _advance_recurrence(S):
    whole_vectors()
    for lane in range(W):
        a, b, c = S[A + lane] + S[DA + lane], S[B + lane] + S[DB + lane], S[C + lane] + S[DC + lane]
        bend = recurrence.bend(b, S[BEND + lane])
        S[DA + lane] = recurrence.bent(S[DA + lane], a, S[GA + lane], bend)
        S[DB + lane] = recurrence.bent(S[DB + lane], b, S[GB + lane], bend)
        S[DC + lane] = recurrence.bent(S[DC + lane], c, S[GC + lane], bend)
        S[A + lane], S[B + lane], S[C + lane] = a, b, c


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
    """Leave the spin's excess at the second sample to :func:`guess`, in U1."""
    whole_vectors()
    for lane in range(W):
        S[U1 + lane] = S[A + lane] * S[SPIN + lane] - 1.0


@njit(**OPTIONS)
def guess(S):
    """Set the first guess of every lane; the current state is the third sample.

    A motion that surely turns has no log slope, and its ellipse is not followed as if it grew. Returns whether some
    lane may have one. Products of βγ are left to :func:`begin_reduction` in HALF, OWN and ACROSS.
    """
    whole_vectors()
    growing = 0
    for lane in range(W):
        b, c, b1, c1 = S[B + lane], S[C + lane], S[B1 + lane], S[C1 + lane]
        b2, c2 = S[B2 + lane], S[C2 + lane]
        excess = S[U1 + lane], S[A + lane] * S[SPIN + lane] - 1.0
        S[GUESS + lane] = reduction.corrected_guess(excess, (b, c), (b1, c1), (b2, c2), S[DRIVE + lane])
        middle, first = b1 * c1, b2 * c2
        S[HALF + lane], S[OWN + lane], S[ACROSS + lane] = middle, middle - first, b * c - first
        turns = S[GUESS + lane] > measure.SURELY_TURNS
        S[LOPEN + lane] = 0.0 if turns else S[LOPEN + lane]
    for lane in range(W):  # by itself: in the loop above it would keep that from being packed
        growing |= 0 if S[GUESS + lane] > measure.SURELY_TURNS else 1
    return growing > 0


@njit(**OPTIONS)
def begin_reduction(S):
    """Set what the reduction of every lane takes from the first guess and the samples that it stands on."""
    whole_vectors()
    for lane in range(W):
        a1, middle, over, twice_over = S[U1 + lane], S[HALF + lane], S[OWN + lane], S[ACROSS + lane]
        quadrature, first, second, third, along, slope = reduction.constants(S[GUESS + lane], S[DRIVE + lane])
        S[QUADRATURE + lane], S[FIRST + lane], S[SECOND + lane] = quadrature, first, second
        S[THIRD + lane], S[ALONG + lane], S[SLOPE + lane] = third, along, slope
        S[U1 + lane], S[HALF + lane] = 0.5 * a1 - quadrature * over, 0.5 * a1 + quadrature * middle
        by, off, S[ACROSS + lane] = reduction.first_order(S[GUESS + lane], S[DRIVE + lane], a1, twice_over)
        S[OWN + lane] = first * (by * a1 + off)
        S[OWN_BY + lane], S[OWN_FROM + lane] = first * by * S[SPIN + lane], first * (off - by)


@njit(**INLINE)
def _take_part(S, lane, excess):
    """Return the clock up to this sample, and the factors of the amplitude's part of the triple that it ends."""
    half = 0.5 * excess
    product = S[QUADRATURE + lane] * (S[B + lane] * S[C + lane])
    u = (half - product) + S[HALF + lane]
    constants = S[FIRST + lane], S[SECOND + lane], S[THIRD + lane], S[ALONG + lane], S[SLOPE + lane]
    factors = reduction.amplitude_part(u, S[U1 + lane], constants)
    S[U1 + lane], S[HALF + lane] = u, half + product
    return factors


@formula
def _line(x, slope, start):
    return x * slope + start


@njit(**INLINE)
def _take_first_order(S, lane):
    """Return both factors to the first order."""
    along = S[OWN + lane]
    S[OWN + lane] = _line(S[A + lane], S[OWN_BY + lane], S[OWN_FROM + lane])
    return along, S[ACROSS + lane] * (S[B1 + lane] * S[C1 + lane])


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
            b, c = S[B + lane], S[C + lane]
            b1, c1, b2, c2 = S[B1 + lane], S[C1 + lane], S[B2 + lane], S[C2 + lane]
            size = measure.dot(b, c, b, c)
            start = S[START + lane]
            inside = (S[OPEN + lane] > 0.0) & (size <= measure.WINDOW * measure.WINDOW * start)
            inside = inside & (size >= measure.DECAYED * measure.DECAYED * start)
            if whole:
                excess = S[A + lane] * S[SPIN + lane] - 1.0
                wander = abs(excess)
                inside = inside & ((wander <= reduction.WANDER) | (S[USED + lane] < reduction.LEAST_FOLLOWED))
                S[WANDER + lane] = wander if inside & (wander > S[WANDER + lane]) else S[WANDER + lane]
            weight = 1.0 if inside else 0.0
            S[OPEN + lane] = weight
            S[USED + lane] += weight
            rb, rc = measure.residual((b, c), (b1, c1), (b2, c2), S[GUESS + lane])
            xx = measure.dot(b1, c1, b1, c1)
            counts = inside & triple
            S[RX + lane] += measure.dot(rb, rc, b1, c1) if counts else 0.0
            S[RR + lane] += measure.dot(rb, rc, rb, rc) if counts else 0.0
            S[XX + lane] += xx if counts else 0.0
            if followed:
                if whole:
                    along, across, mu = _take_part(S, lane, excess)
                    S[SW + lane] += xx * (mu * (2.0 + mu)) if counts else 0.0
                else:
                    along, across = _take_first_order(S, lane)
                sb = _less_amplitude(rb, along, across, b, b1, b2)
                sc = _less_amplitude(rc, along, across, c, c1, c2)
                S[SX + lane] += measure.dot(sb, sc, b1, c1) if counts else 0.0
                S[SS + lane] += measure.dot(sb, sc, sb, sc) if counts else 0.0
                turn = measure.dot(b1, c1, c, -b)
                turn = turn * (1.0 + excess) if whole else turn
                S[TURN + lane] += turn if inside else 0.0
            S[LARGEST + lane] = size if inside & (size > S[LARGEST + lane]) else S[LARGEST + lane]
            S[B2 + lane], S[C2 + lane] = b1, c1
            S[B1 + lane], S[C1 + lane] = b, c
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
            b1, c1, b2, c2 = S[B1 + lane], S[C1 + lane], S[B2 + lane], S[C2 + lane]
            state = (b1, c1, b1 - b2, c1 - c2, measure.dot(b1, c1, b1, c1), S[DB + lane], S[DC + lane])
            sums = (S[OPEN + lane], S[USED + lane], S[RX + lane], S[RR + lane], S[XX + lane])
            least = measure.DECAYED * measure.DECAYED * S[START + lane]
            most = measure.WINDOW * measure.WINDOW * S[START + lane]
            constants = (S[GB + lane], S[GC + lane], S[BEND + lane], 2.0 * S[GUESS + lane], least, most)
            if count == 4:
                state, sums = _exact_sample(state, sums, constants)
                state, sums = _exact_sample(state, sums, constants)
                state, sums = _exact_sample(state, sums, constants)
            b1, c1 = state[0], state[1]
            state, sums = _exact_sample(state, sums, constants)
            b, c, _, _, _, S[DB + lane], S[DC + lane] = state
            S[OPEN + lane], S[USED + lane], S[RX + lane], S[RR + lane], S[XX + lane] = sums
            S[B2 + lane], S[C2 + lane], S[B1 + lane], S[C1 + lane], S[B + lane], S[C + lane] = b1, c1, b, c, b, c
            opened |= 1 if S[OPEN + lane] > 0.0 else 0
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
    db, dc = S[B + lane] - b, S[C + lane] - c
    apart, largest = measure.dot(db, dc, db, dc), S[LARGEST + lane]
    # a ratio of two rows: no division; written so that a distance that is no number stays
    keeps = (S[OPEN + lane] == 0.0) | (apart * S[APART_OVER + lane] <= S[APART + lane] * largest)
    S[APART + lane] = S[APART + lane] if keeps else apart
    S[APART_OVER + lane] = S[APART_OVER + lane] if keeps else largest


@njit(**OPTIONS)
def certify(S):
    """Take one exact step of every lane and compare; after :func:`sample`, whose window counts."""
    whole_vectors()
    for lane in range(W):
        a, b, c = exact.step(S[XA + lane], S[XB + lane], S[XC + lane], S[QA + lane], S[QB + lane], S[QC + lane])
        S[XA + lane], S[XB + lane], S[XC + lane] = a, b, c
        _compare(S, lane, b, c)


@njit(**OPTIONS)
def certify_near(S):
    """Take one step as :func:`certify` where the motion is small: of its recurrence."""
    whole_vectors()
    for lane in range(W):
        b, c = S[XB + lane] + S[DB + lane], S[XC + lane] + S[DC + lane]
        bend = recurrence.bend(b, S[BEND + lane])
        S[DB + lane] = recurrence.bent(S[DB + lane], b, S[GB + lane], bend)
        S[DC + lane] = recurrence.bent(S[DC + lane], c, S[GC + lane], bend)
        S[XB + lane], S[XC + lane] = b, c
        _compare(S, lane, b, c)


@njit(**OPTIONS)
def watch_invariants(S):
    """Compare the invariants of every lane with their start; after :func:`sample`, whose window counts."""
    whole_vectors()
    for lane in range(W):
        inside = S[OPEN + lane] > 0.0
        J, scale = rigid_body.perturbation_invariant(S[B + lane], S[C + lane], S[CB + lane], S[CC + lane])
        a, b, c = S[A + lane], S[EPSILON + lane] * S[B + lane], S[EPSILON + lane] * S[C + lane]
        energy = rigid_body.twice_energy(a, b, c, S[JA + lane], S[JB + lane], S[JC + lane])
        momentum = rigid_body.squared_momentum(a, b, c, S[JA + lane], S[JB + lane], S[JC + lane])
        jd, ed, ld = abs(J - S[J0 + lane]), abs(energy - S[E0 + lane]), abs(momentum - S[L0 + lane])
        jd, scale = jd if inside else 0.0, scale if inside else 0.0  # outside none is larger
        ed, ld = ed if inside else 0.0, ld if inside else 0.0
        S[JD + lane] = jd if jd > S[JD + lane] else S[JD + lane]
        S[JS + lane] = scale if scale > S[JS + lane] else S[JS + lane]
        S[ED + lane] = ed if ed > S[ED + lane] else S[ED + lane]
        S[LD + lane] = ld if ld > S[LD + lane] else S[LD + lane]


@njit(**OPTIONS)
def log_sample(S):
    """Add a sample to the log slope of every lane that is inside its window; those inside follow each other.

    Returns whether any lane is inside its window still.
    """
    whole_vectors()
    going = 0  # a whole number: its or-reduction stays packed
    for lane in range(W):
        size = measure.dot(S[B + lane], S[C + lane], S[B + lane], S[C + lane])
        grown, is_open = measure.LOG_FROM * measure.LOG_FROM * S[START + lane], S[OPEN + lane] > 0.0
        P, up, Q, over = S[LP + lane], S[LPE + lane], S[LQ + lane], S[LQE + lane]
        sums = (S[LOPEN + lane], S[LN + lane], P, up, Q, over, S[LFIRST + lane], S[LLAST + lane])
        inside, sums = measure.logged(size, grown, S[LCAP + lane], is_open, sums)
        S[LOPEN + lane], S[LN + lane], S[LP + lane], S[LPE + lane], S[LQ + lane], S[LQE + lane] = sums[:6]
        S[LFIRST + lane], S[LLAST + lane] = sums[6:]
        going |= 1 if inside else 0
    return going > 0


@njit(**OPTIONS)
def have_grown(S):
    """Return True if some lane has been large enough for the log slope."""
    whole_vectors()
    grown = 0
    for lane in range(min(W, S.size)):  # so many that LLVM does not know: it would unroll so short a loop, not pack it
        grown |= 1 if S[LARGEST + lane] >= measure.LOG_FROM * measure.LOG_FROM * S[START + lane] else 0
    return grown > 0


@njit(**OPTIONS)
def were_logged(S):
    """Return True if some lane's window of the log slope holds a sample."""
    whole_vectors()
    logged = 0
    for lane in range(min(W, S.size)):  # as in :func:`have_grown`
        logged |= 1 if S[LN + lane] > 0.0 else 0
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
        S (numpy.ndarray, shape (ROWS * W,)): Scratch, with the rows MA ... STEPS filled.
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
