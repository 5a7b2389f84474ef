r"""The two periods of a freely tumbling body, measured from its motion and in closed form.

A free asymmetric body shows two periods. In the body the angular velocity comes back to itself after P_psi; in space
the body's axes go round the momentum L at mean rates that make P_phi. With the roles of :mod:`kernels.exact` (d the
axis that the polhode encircles) and psi of :mod:`kernels.attitude`:

.. math:: P_\psi = 4K/p, \qquad f = \langle\psi'\rangle/2\pi = (R + Q\,p\,J(K_1)/K)/2\pi

f is the mean frequency about L of the two axes that are not encircled, in either mode; the encircled one's is

.. math:: f_d = f + 1/P_\psi \;(\text{SAM}), \qquad f_d = f - 1/P_\psi \;(\text{LAM})

*Modes.* Short-axis mode (SAM): d is the axis of greatest moment, L² > 2T I_mid; long-axis mode (LAM): of least moment.

*Conventions.* ``period_phi_encircled`` is 1/f_d. ``period_phi_long_axis`` is that of the axis of least moment, which
papers use: 1/f for SAM, 1/f_d for LAM.

*Start.* The energy is given as ``E = 2T I_3/L^2`` with :math:`I_1\le I_2\le I_3`, from 1 (spin about axis 3) to I_3/I_1
(about axis 1); SAM where E < I_3/I_2. The motion starts at L_2 = 0, in units of L/I_3 = 1.

*Measuring.* The direct integrator carries the angular velocity and one vector fixed in space (:mod:`kernels.taylor`).
P_psi is the time until L_2 vanishes for the second time, found by Newton's method on the last step; which axis is
encircled is seen from the component that has kept its sign; the turn about L in that time is the angle of the fixed
vector seen from the axis d, and of the steps' angles the sum gives its windings alone: thousands of nearly equal ones
round alike. A second run with other steps gives the error: three
times the difference, and what rounding grows to between the slowest and the fastest place of the polhode. Neither
closed form nor mode is asked for. Where rounding alone moves a period by a tenth, the motion is on the separatrix for
all that can be seen.

Source: Landau and Lifshitz, Mechanics, section 37; Samarasinha and A'Hearn, Icarus 93 (1991) 194, and Kaasalainen,
Astronomy and Astrophysics 376 (2001) 302, for the modes and the names. The single integral is derived in
:mod:`kernels.attitude`.
"""

import math

import numpy as np

from kernels import attitude, direct, elliptic, solution
from kernels.columns import arrays
from kernels.elliptic import climb, ladder
from kernels.jit import INNER, OPTIONS, njit
from kernels.rigid_body import relabel
from kernels.taylor import carry_12

IMPOSSIBLE, SAM, LAM, SEPARATRIX, PRINCIPAL = range(-1, 4)
MOST_STEPS = 200_000
EPSILON = float(np.finfo(np.float64).eps)
LOST = 0.1  # share of a period that rounding moves it by: on the separatrix for all that can be seen
NEAR = 8.0 * EPSILON  # of the greater term of L^2 - 2T I_mid: rounding of the start makes as much

SMALL = 0.03125  # share of I3 below which I3 - E I1 is formed from the exact product
SLOW = 400.0  # period, in I3/L, beyond which a body is slow by itself and not for being near the separatrix

PERIODS = ("period_psi", "period_phi_long_axis", "period_phi_encircled")


@njit(**OPTIONS)
def possible(least, energy):
    """Return True if a body with ``I_min/I_max = least`` can have the energy ``2T I_max/L^2``: 1 to 1/least."""
    return (energy >= 1.0) & (energy * least <= 1.0 + EPSILON)


@njit(**OPTIONS)
def start(I1, I2, I3, energy):
    """Return (w1, 0, w3) of a body of ascending moments with the energy ``2T I3/L^2``, at L/I3 = 1.

    ``m_1^2 = (E - 1) I1/(I3 - I1)`` and ``m_3^2 = (I3 - E I1)/(I3 - I1)``; for a sphere a spin about axis 3. A small
    numerator of m_3^2 is formed from the exact product: where I2 is near I1, the period goes with 1/m_3. Above SMALL
    the product's rounding moves it by less than a quarter of what is counted for the steps' rounding.
    """
    gap = I3 - I1
    if gap == 0.0:
        return 0.0, 0.0, 1.0
    m1 = math.sqrt(max(0.0, energy - 1.0) * I1 / gap)
    left = I3 - energy * I1
    if left < SMALL * I3:
        product, rest = elliptic.two_product(energy, I1)
        left = (I3 - product) - rest
    m3 = math.sqrt(max(0.0, left) / gap)
    return m1 * (I3 / I1), 0.0, m3


@njit(**OPTIONS)
def mode_of(I1, I2, I3, w1, w3):
    """Return SAM, LAM, SEPARATRIX or PRINCIPAL (a steady rotation) of a start with w2 = 0, ascending moments."""
    if solution.is_stationary(solution.coefficients(I1, I2, I3), (w1, 0.0, w3)):
        return PRINCIPAL
    greater = max(I3 * (I3 - I2) * w3 * w3, I1 * (I2 - I1) * w1 * w1)
    N = solution.separatrix_offset(I1, I2, I3, w1, w3)
    if abs(N) <= NEAR * greater:
        return SEPARATRIX
    return SAM if N > 0.0 else LAM


@njit(**INNER)
def _constants(I1, I2, I3, w1, w2, w3):
    """Return (p, m, 1 - m), the moments by role (s, c, d), and the constants of the attitude."""
    p, m, m1, s, c, d = solution.constants(I1, I2, I3, w1, w2, w3)
    moments = solution.by_role(s, c, d, I1, I2, I3)
    return (p, m, m1), moments, attitude.constants(moments, solution.by_role(s, c, d, w1, w2, w3), p, m, m1)


@njit(**OPTIONS)
def periods(I1, I2, I3, w1, w2, w3):
    """Return P_psi, the mean rate <psi'> about L, and sigma (+1 SAM, -1 LAM); NaN where there is no period.

    Moments and angular velocity near one, in any order; s and rad/s where they are in kg m2 and rad/s.
    """
    (p, m, m1), _, turning = _constants(I1, I2, I3, w1, w2, w3)
    sigma = turning.sigma
    if not (p > 0.0 and m1 > 0.0):
        return math.nan, math.nan, sigma
    K = elliptic.K(m, m1)
    whole = attitude.complete(attitude.landen_complement(m1), turning.nu)
    return 4.0 * K / p, turning.R + turning.Q * p * (whole / K), sigma


@njit(**OPTIONS)
def phase_residual(I1, I2, I3, w1, w2, w3):
    """Return how far ``rate P_psi`` of :func:`periods` is from Montgomery's theorem, rad; NaN without a period.

    That gives the turn about L in one period as ``2T P_psi/L - A``, and asks no elliptic integral of the third kind. A
    is the signed solid angle that the polhode's cone encloses about the axis d, by the trapezoidal rule.
    What both hold alike, ``2T P_psi/L``, is taken out by hand, so that thousands of turns leave no rounding:
    ``R - 2T/L = -sigma A_d mu_c^2 |I_d - I_c|/(I_c (1 + a))``.

    Source: Montgomery, American Journal of Physics 59 (1991) 394.
    """
    (p, m, m1), (_, I_c, I_d), (L, _, a, mu_c, mu_s, _, Q, _, nu, sigma) = _constants(I1, I2, I3, w1, w2, w3)
    if not (p > 0.0 and m1 > 0.0):
        return math.nan
    K = elliptic.K(m, m1)
    slower = (a * L / I_d) * (mu_c * mu_c * (abs(I_d - I_c) / I_c)) / (1.0 + a)
    by_integral = 4.0 * Q * attitude.complete(attitude.landen_complement(m1), nu) - sigma * slower * (4.0 * K / p)
    return abs(by_integral + sigma * (4.0 * mu_s * mu_c * _quarter_area(a, m, m1, K)))


@njit(**INNER)
def _quarter_area(a, m, m1, K):
    """Return ``int_0^K dn/(1 + a dn) du`` by the trapezoidal rule, which converges geometrically over a period."""
    means = ladder(m, m1)
    nodes = math.ceil(K / 0.13) + 4
    root = math.sqrt(m1)
    total = 0.5 * (1.0 / (1.0 + a) + root / (1.0 + a * root))
    for i in range(1, nodes):
        _, _, dn = climb(K * i / nodes, means)
        total += dn / (1.0 + a * dn)
    return total * K / nodes


@njit(**OPTIONS)
def scaled(I1, I2, I3):
    """Return ascending moments in a unit in which the greatest is between 1/2 and 1, without a rounding."""
    unit = solution.unit_of(I3, I3, I3)
    return I1 / unit, I2 / unit, I3 / unit


@njit(nogil=True, **OPTIONS)
def fill_exact(I1, I2, I3, energy, modes, out):
    """Fill modes, and ``out`` (3, n) with PERIODS, in closed form, in units of I3/L; NaN where missing."""
    for i in range(I1.size):
        a, b, c = scaled(I1[i], I2[i], I3[i])
        w1, w2, w3 = start(a, b, c, energy[i])
        modes[i] = mode_of(a, b, c, w1, w3) if possible(a / c, energy[i]) else IMPOSSIBLE
        out[0, i], out[1, i], out[2, i] = math.nan, math.nan, math.nan
        if modes[i] == SAM or modes[i] == LAM:
            period, rate, sigma = periods(a, b, c, w1, w2, w3)
            about = rate + sigma * (2.0 * math.pi / period)
            out[0, i] = period
            out[1, i] = 2.0 * math.pi / (rate if sigma > 0.0 else about)
            out[2, i] = 2.0 * math.pi / about


@njit(**INNER)
def _step_length(c1, c2, c3, size, tolerance):
    """Return the step, in units of I3/L, whose error in some hundred steps of G_12(1) x^13 is a tenth of tolerance."""
    x = (tolerance / (1000.0 * direct.truncation(1.0, 12))) ** (1.0 / 13.0)
    return min(x, 0.25) / (size * max(1.0, abs(c1), abs(c2), abs(c3)))


@njit(**INNER)
def _heading(m, n, axis):
    """Return cosine and sine, to a positive factor, of psi about ``axis`` (1 or 3): of the space-fixed vector.

    The shortest arc from m to the axis e takes a vector n at right angles to m to ``n - n_e (m + e)/(1 + m_e)``, and
    psi is minus its azimuth in the plane of the two other axes. The end of the axis is the one that m is nearer to.
    """
    m_e, m_j, m_k = relabel(*m, axis)
    n_e, n_j, n_k = relabel(*n, axis)
    side = 1.0 if m_e >= 0.0 else -1.0
    bend = n_e * side / (1.0 + abs(m_e))
    return n_j - bend * m_j, -side * (n_k - bend * m_k)


@njit(**INNER)
def _turned(c0, s0, c1, s1):
    """Return angle from one heading to the next, in (-pi, pi]."""
    return math.atan2(c0 * s1 - s0 * c1, c0 * c1 + s0 * s1)


@njit(**INNER)
def _whole_turn(roughly, c0, s0, c1, s1):
    """Return the angle from the first heading to the last, of which a sum of many small ones knows the windings."""
    rest = _turned(c0, s0, c1, s1)
    return rest + 2.0 * math.pi * round((roughly - rest) / (2.0 * math.pi))


@njit(**OPTIONS)
def follow(moments, omega, h):
    """Follow a start with w2 = 0 through one period of w; moments ascending, all near one.

    Returns:
        period (float): Time until w2 vanishes for the second time; NaN where it has not after MOST_STEPS.
        turn (float): psi's growth in it, rad, about the axis that kept its sign.
        encircled (int): That axis: 3 or 1, or 0 where both or neither kept theirs.
        growth (float): Ratio of the fastest to the slowest change of w on the way.
    """
    I1, I2, I3 = moments
    w1, w2, w3 = omega
    k1, k2, k3 = (I2 - I3) / I1 * h, (I3 - I1) / I2 * h, (I1 - I2) / I3 * h
    a, b, c, x, y, z = w1, w2, w3, 0.0, 1.0, 0.0
    kept1, kept3, zeros = True, True, 0
    about1, about3 = 0.0, 0.0
    slowest, fastest = math.inf, 0.0
    L = math.sqrt((I1 * a) ** 2 + (I2 * b) ** 2 + (I3 * c) ** 2)
    m, n = (I1 * a / L, 0.0, I3 * c / L), (x, y, z)
    p1, q1 = _heading(m, n, 1)
    p3, q3 = _heading(m, n, 3)
    first1, first3 = (p1, q1), (p3, q3)
    for k in range(MOST_STEPS):
        a0, b0, c0, x0, y0, z0 = a, b, c, x, y, z
        speed = (k1 * b * c) ** 2 + (k2 * c * a) ** 2 + (k3 * a * b) ** 2
        slowest, fastest = min(slowest, speed), max(fastest, speed)
        a, b, c, x, y, z = carry_12(a, b, c, x, y, z, k1, k2, k3, h)
        share = 1.0
        last = False
        if k > 0 and (b0 > 0.0) != (b > 0.0):
            zeros += 1
            if zeros == 2:
                last = True
                share = b0 / (b0 - b)
                for _ in range(6):
                    a, b, c, x, y, z = carry_12(a0, b0, c0, x0, y0, z0, k1 * share, k2 * share, k3 * share, h * share)
                    share -= b / (k2 * c * a)
        kept1 &= a * w1 > 0.0
        kept3 &= c * w3 > 0.0
        m, n = (I1 * a / L, I2 * b / L, I3 * c / L), (x, y, z)
        r1, s1 = _heading(m, n, 1)
        r3, s3 = _heading(m, n, 3)
        about1 += _turned(p1, q1, r1, s1)
        about3 += _turned(p3, q3, r3, s3)
        p1, q1, p3, q3 = r1, s1, r3, s3
        if last:
            axis = (3 if kept3 else 1) if kept1 != kept3 else 0
            turn = _whole_turn(about3, *first3, p3, q3) if axis == 3 else _whole_turn(about1, *first1, p1, q1)
            return (k + share) * h, turn, axis, math.sqrt(fastest / slowest)
    return math.nan, math.nan, 0, math.nan


@njit(**INNER)
def _phi(period, turn, axis):
    """Return the periods about L of the long axis and of the encircled one, from one period of w and psi's turn."""
    encircled = 2.0 * math.pi * period / (turn + (2.0 * math.pi if axis == 3 else -2.0 * math.pi))
    return (2.0 * math.pi * period / turn if axis == 3 else encircled), encircled


@njit(**OPTIONS)
def measure_one(I1, I2, I3, energy, tolerance, out):
    """Write periods as PERIODS and their errors, measured from two runs, in units of I3/L; return the mode."""
    out[:] = math.nan
    w1, w2, w3 = start(I1, I2, I3, energy)
    if not possible(I1 / I3, energy):
        return IMPOSSIBLE
    c = solution.coefficients(I1, I2, I3)
    if solution.is_stationary(c, (w1, w2, w3)):
        return PRINCIPAL
    h = _step_length(*c, math.hypot(w1, w3), tolerance)
    period, turn, axis, growth = follow((I1, I2, I3), (w1, w2, w3), h)
    other, other_turn, other_axis, _ = follow((I1, I2, I3), (w1, w2, w3), 0.71 * h)
    # rounding moves the state to a neighbouring polhode, which near the separatrix has another period: of the turn
    # about L, which goes on at the rate 2T/L while w stands still, most of that takes no share
    rounding = 8.0 * EPSILON * (4.0 + math.sqrt(period / h))
    share = rounding * (1.0 + growth * growth / min(period, SLOW))
    if axis == 0 or axis != other_axis or not share < LOST:
        return SEPARATRIX
    about = rounding + share * (0.05 + abs(1.0 - energy * period / turn))
    if axis == 1:
        about *= max(1.0, turn / abs(turn - 2.0 * math.pi))
    out[0], out[3] = period, 3.0 * abs(period - other) + share * period
    out[1], out[2] = _phi(period, turn, axis)
    other_long, other_encircled = _phi(other, other_turn, axis)
    out[4] = 3.0 * abs(out[1] - other_long) + about * abs(out[1])
    out[5] = 3.0 * abs(out[2] - other_encircled) + about * abs(out[2])
    return SAM if axis == 3 else LAM


@njit(nogil=True, **OPTIONS)
def fill(bodies, tolerance, modes, out):
    """Fill measured modes, and ``out`` (6, n) with PERIODS and their errors, in units of I3/L."""
    I1, I2, I3, energy = bodies
    for i in range(I1.size):
        modes[i] = measure_one(*scaled(I1[i], I2[i], I3[i]), energy[i], tolerance, out[:, i])


def survey(points, tolerance, measured=True):
    """Return all columns of points, in units.

    Args:
        points (mapping of str to array_like, shape (n,)): I1, I2, I3 (common unit, > 0, in any order: the axes are
            those of ascending moments), energy (2T I_max/L^2, from 1 to I_max/I_min), omega0 (rad s-1, > 0: L = I_max
            omega0).
        tolerance, measured (float, bool): As for :func:`kernels.twist.survey`, of the periods.

    Returns:
        dict of str to numpy.ndarray, shape (n,): mode_exact (int8; -1 where no motion of the body has the energy) and
            PERIODS with ``_exact`` (s); if ``measured``, mode, PERIODS and those with ``_error``. NaN where there is no
            period.
    """
    *moments, energy, omega0 = arrays(*(points[name] for name in ("I1", "I2", "I3", "energy", "omega0")))
    bodies = (*np.sort(moments, axis=0), energy)
    modes, out = np.empty(energy.size, dtype=np.int8), np.empty((3, energy.size))
    fill_exact(*bodies, modes, out)
    columns = {"mode_exact": modes} | {f"{name}_exact": out[k] / omega0 for k, name in enumerate(PERIODS)}
    if measured:
        seen, periods_seen = np.empty(energy.size, dtype=np.int8), np.empty((6, energy.size))
        fill(bodies, tolerance, seen, periods_seen)
        names = (*PERIODS, *(f"{name}_error" for name in PERIODS))
        columns |= {"mode": seen} | dict(zip(names, periods_seen / omega0, strict=True))
    return columns


@njit(**INNER)
def _ratio(I1, I2, I3, m, short):
    """Return P_psi/P_phi (long axis) of the motion of the parameter m in one mode, and its energy 2T I3/L^2.

    From m = (I_s - I_c)(2T I_d - L^2)/[(I_d - I_s)(L^2 - 2T I_c)]: the distance from the axis, |E - E_0|, is a ratio of
    like-signed terms.
    """
    I_d, I_c = (I3, I1) if short else (I1, I3)
    gap_s, gap_c, below = abs(I_d - I2), abs(I2 - I_c), abs(I_d - I_c)
    # y = |2T I_d/L^2 - 1|
    y = m * gap_s * (below / I_d) / (gap_c + m * gap_s * (I_c / I_d))
    side = 1.0 if short else -1.0
    twice_energy = (1.0 + side * y) / I_d  # 2T/L^2
    m_c2 = y * I_c / below
    w_c, w_d = math.sqrt(m_c2) / I_c, math.sqrt(max(0.0, 1.0 - m_c2)) / I_d
    w1, w3 = (w_c, w_d) if short else (w_d, w_c)
    period, rate, _ = periods(I1, I2, I3, w1, 0.0, w3)
    turn = rate * period
    return (turn if short else turn - 2.0 * math.pi) / (2.0 * math.pi), twice_energy * I3


@njit(**OPTIONS)
def _limit(I1, I2, I3, short):
    """Return the ratio's limit as the wobble vanishes; infinite where the body has no such mode."""
    if short:
        return math.sqrt(I1 / (I3 - I1) * I2 / (I3 - I2)) if I3 > I2 else math.inf
    if not I2 > I1:
        return math.inf
    # sqrt(q) - 1 with q = I2 I3/((I3 - I1)(I2 - I1)): for needles both are near 1
    more = I1 / (I3 - I1) * ((I2 + (I3 - I1)) / (I2 - I1))
    return more / (math.sqrt(1.0 + more) + 1.0)


@njit(nogil=True, **OPTIONS)
def _solve(I1, I2, I3, ratio, short):
    """Return the parameter m and the energy of one mode that give the ratio; NaN where it is below the mode's limit.

    The ratio grows with m, from the limit to infinity on the separatrix: bisection in x = ln(1/m1), m1 = exp(-x), which
    resolves both ends.
    """
    if not ratio > _limit(I1, I2, I3, short):
        return math.nan, math.nan
    if (I1 == I2) if short else (I2 == I3):  # a symmetric top: the ratio gives the cosine of the angle of L to its axis
        cosine = I3 / ((1.0 + ratio) * (I3 - I1)) if short else I1 / (I3 - I1) / ratio
        about, across = (1.0, I3 / I1) if short else (I3 / I1, 1.0)
        return 0.0, across + cosine * cosine * (about - across)
    low, high = 0.0, 600.0
    for _ in range(200):
        middle = 0.5 * (low + high)
        value, energy = _ratio(I1, I2, I3, -math.expm1(-middle), short)
        low, high = (middle, high) if value < ratio else (low, middle)
        if not low < 0.5 * (low + high) < high:
            break
    return -math.expm1(-high), energy


def inverse(I1, I2, I3, ratio):
    """Return the one energy in each mode that gives a body its ratio of periods P_psi/P_phi (long axis), or none.

    In either mode the ratio grows with the wobble from ``sqrt(I1 I2/((I3 - I1)(I3 - I2)))`` (SAM, at least 1 for a body
    that can exist) or ``sqrt(I2 I3/((I3 - I1)(I2 - I1))) - 1`` (LAM) to infinity at the separatrix. Ascending moments
    in a common unit and ratios > 0 are broadcast.

    Returns:
        dict of str to numpy.ndarray, shape (2, n): energy (2T I3/L^2) and m, rows SAM and LAM, NaN where the ratio is
            below what the mode can have; least_ratio, that of the vanishing wobble, infinite where the body has no such
            mode.
    """
    I1, I2, I3, ratio = arrays(I1, I2, I3, ratio)
    out = np.empty((3, 2, ratio.size))
    for i, wanted in enumerate(ratio):
        moments = scaled(I1[i], I2[i], I3[i])
        for mode, short in enumerate((True, False)):
            out[:2, mode, i] = _solve(*moments, wanted, short)
            out[2, mode, i] = _limit(*moments, short)
    return dict(zip(("m", "energy", "least_ratio"), out, strict=True))


@njit(nogil=True, **OPTIONS)
def fill_tilts(I1, I2, I3, energy, out):
    """Fill mean, least and greatest angle of L to the encircled axis, rad: (3, n), NaN where there is none."""
    for i in range(I1.size):
        out[0, i], out[1, i], out[2, i] = math.nan, math.nan, math.nan
        least, middle, most = scaled(I1[i], I2[i], I3[i])
        if not possible(least / most, energy[i]):
            continue
        (_, m, m1), _, turning = _constants(least, middle, most, *start(least, middle, most, energy[i]))
        a, mu_c, mu_s = turning.a, turning.mu_c, turning.mu_s
        out[1, i] = math.atan2(mu_c, a)
        out[2, i] = math.atan2(mu_s, a * math.sqrt(m1))
        if m1 > 0.0:
            K = elliptic.K(m, m1)
            means = ladder(m, m1)
            nodes = math.ceil(K / 0.2) + 4
            total = 0.5 * (out[1, i] + out[2, i])
            for k in range(1, nodes):
                sn, cn, dn = climb(K * k / nodes, means)
                total += math.atan2(math.hypot(mu_c * cn, mu_s * sn), a * dn)
            out[0, i] = total / nodes


def tilts(points):
    """Return mean, least and greatest angle of L to the encircled axis, rad, in closed form; as :func:`survey`."""
    *moments, energy = arrays(*(points[name] for name in ("I1", "I2", "I3", "energy")))
    out = np.empty((3, energy.size))
    fill_tilts(*np.sort(moments, axis=0), energy, out)
    return {"tilt_mean": out[0], "tilt_least": out[1], "tilt_greatest": out[2]}
