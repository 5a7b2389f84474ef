r"""The two periods of a freely tumbling body, measured from its motion and in closed form.

A free asymmetric body shows two periods. In the body the angular velocity repeats after P_psi; in space
the body's axes revolve about the momentum L at mean rates that define P_phi. With the roles of
:mod:`kernels.free.exact` (d the axis that the polhode encircles) and psi of :mod:`kernels.free.attitude`:

.. math:: P_\psi = 4K/p, \qquad f = \langle\psi'\rangle/2\pi = (R + Q\,p\,J(K_1)/K)/2\pi

f is the mean frequency about L of the two axes that are not encircled, in either mode; that of the encircled axis is

.. math:: f_d = f + 1/P_\psi \;(\text{SAM}), \qquad f_d = f - 1/P_\psi \;(\text{LAM})

*Modes.* Short-axis mode (SAM): d is the axis of greatest moment, L² > 2T I_mid; long-axis mode (LAM): of least moment.

*Conventions.* ``period_phi_encircled`` is 1/f_d. ``period_phi_long_axis`` is the period of the axis of least moment,
usual in papers: 1/f for SAM, 1/f_d for LAM.

*Start.* The energy is given as ``E = 2T I_3/L^2`` with :math:`I_1\le I_2\le I_3`, from 1 (spin about axis 3) to I_3/I_1
(about axis 1); SAM where E < I_3/I_2. The motion starts at L_2 = 0, in units of L/I_3 = 1.

*Measuring.* L_2 rises from 0 at the start; P_psi is the time until it rises through 0 again
(:mod:`kernels.events.follower`). The component of the encircled axis keeps its sign. Axis 1 revolves about L
by the angle Phi_1 meanwhile, at a rate between L/I_3 and L/I_2 in either mode, and in SAM axis 3 by 2 pi more:

.. math:: P_\phi = 2\pi P_\psi/\Phi_1, \qquad
          1/f_d = 2\pi P_\psi/(\Phi_1 + 2\pi) \;(\text{SAM}), \quad 1/f_d = P_\phi \;(\text{LAM})

A first run with longer steps gives the error: three times the difference, and the rounding, which grows by the ratio of
the fastest to the slowest motion on the polhode. Neither closed form nor mode is used. If rounding alone moves a period
by a tenth, the motion is reported as on the separatrix.

Source: Landau and Lifshitz, Mechanics, section 37; Samarasinha and A'Hearn, Icarus 93 (1991) 194, and Kaasalainen,
Astronomy and Astrophysics 376 (2001) 302, for the modes and the names. The single integral is derived in
:mod:`kernels.free.attitude`.
"""

import math

import numpy as np

from kernels.compile.blocks import W
from kernels.compile.columns import arrays
from kernels.compile.jit import INNER, OPTIONS, njit
from kernels.events import follower
from kernels.events.follower import B, row
from kernels.free import attitude, elliptic, elliptic_constants
from kernels.free.elliptic import climb, ladder

IMPOSSIBLE, SAM, LAM, SEPARATRIX, PRINCIPAL = range(-1, 4)
EPSILON = float(np.finfo(np.float64).eps)
TWO_PI = 2.0 * math.pi
STEPS_IN_A_PERIOD = 100.0  # The steps' error stays below the tolerance over so many of them, a typical number.
MAX_PERIOD_ROUNDING = 0.1  # relative rounding error of a period at which the motion is reported as on the separatrix
MIN_SEPARATRIX_OFFSET = 8.0 * EPSILON  # |L^2 - 2T I_mid| over its greater term that the start's rounding can make

EXACT_PRODUCT_BELOW = 0.03125  # (I3 - E I1)/I3 below which the difference is formed from the exact product
MAX_OWN_PERIOD = 400.0  # I3/L, longer periods are due to equal moments and not to the separatrix

PERIODS = ("period_psi", "period_phi_long_axis", "period_phi_encircled")


@njit(**OPTIONS)
def is_possible(smallest_ratio, energy):
    """Return True if a body of I_min/I_max = ``smallest_ratio`` r can have the energy ``2T I_max/L^2``: 1 to 1/r."""
    return (energy >= 1.0) & (energy * smallest_ratio <= 1.0 + EPSILON)


@njit(**OPTIONS)
def start(I1, I2, I3, energy):
    """Return (w1, 0, w3) of a body of ascending moments with the energy ``2T I3/L^2``, at L/I3 = 1.

    ``m_1^2 = (E - 1) I1/(I3 - I1)`` and ``m_3^2 = (I3 - E I1)/(I3 - I1)``; for a sphere a spin about axis 3. A small
    numerator of m_3^2 is formed from the exact product: where I2 is near I1, the period goes with 1/m_3. Above SMALL
    the product's rounding moves it by less than a quarter of the estimated rounding of the steps.

    Args:
        `I1`, `I2`, `I3` (float): Ascending moments near one.
        energy (float): 2T I3/L^2; a possible value is not checked for.
    """
    gap = I3 - I1
    if gap == 0.0:
        return 0.0, 0.0, 1.0
    m1 = math.sqrt(max(0.0, energy - 1.0) * I1 / gap)
    numerator = I3 - energy * I1
    if numerator < EXACT_PRODUCT_BELOW * I3:
        product, product_error = elliptic.two_product(energy, I1)
        numerator = (I3 - product) - product_error
    m3 = math.sqrt(max(0.0, numerator) / gap)
    return m1 * (I3 / I1), 0.0, m3


@njit(**OPTIONS)
def mode_of(I1, I2, I3, w1, w3):
    """Return SAM, LAM, SEPARATRIX or PRINCIPAL (a steady rotation) of a start with w2 = 0.

    Args:
        `I1`, `I2`, `I3` (float): Ascending moments near one.
        `w1`, `w3` (float): Angular velocity near one.
    """
    if elliptic_constants.is_stationary(elliptic_constants.coefficients(I1, I2, I3), (w1, 0.0, w3)):
        return PRINCIPAL
    greater = max(I3 * (I3 - I2) * w3 * w3, I1 * (I2 - I1) * w1 * w1)
    N = elliptic_constants.separatrix_offset(I1, I2, I3, w1, w3)
    if abs(N) <= MIN_SEPARATRIX_OFFSET * greater:
        return SEPARATRIX
    return SAM if N > 0.0 else LAM


@njit(**INNER)
def _constants(I1, I2, I3, w1, w2, w3):
    """Return (p, m, 1 - m), the moments by role (s, c, d), and the constants of the attitude."""
    p, m, m1, s, c, d = elliptic_constants.constants(I1, I2, I3, w1, w2, w3)
    moments, omega = elliptic_constants.by_role(s, c, d, I1, I2, I3), elliptic_constants.by_role(s, c, d, w1, w2, w3)
    return (p, m, m1), moments, attitude.attitude_terms(moments, omega, p, m, m1)


@njit(**OPTIONS)
def periods(I1, I2, I3, w1, w2, w3):
    """Return P_psi, the mean rate <psi'> about L, and sigma (+1 SAM, -1 LAM); NaN where there is no period.

    Args:
        `I1`, `I2`, `I3` (float): Moments near one, in any order.
        `w1`, `w2`, `w3` (float): Angular velocity near one; in rad/s, the results are in s and rad/s.
    """
    (p, m, m1), _, top = _constants(I1, I2, I3, w1, w2, w3)
    sigma = top.sigma
    if not (p > 0.0 and m1 > 0.0):
        return math.nan, math.nan, sigma
    K = elliptic.K(m, m1)
    J = attitude.complete_third_kind(attitude.landen_complement(m1), top.nu)
    return 4.0 * K / p, top.R + top.Q * p * (J / K), sigma


@njit(**OPTIONS)
def phase_residual(I1, I2, I3, w1, w2, w3):
    """Return the distance of ``rate P_psi`` of :func:`periods` from Montgomery's theorem, rad; NaN without a period.

    By the theorem the rotation about L in one period is ``2T P_psi/L - A``, without an elliptic integral of the third
    kind. A is the signed solid angle that the polhode's cone encloses about the axis d, by the trapezoidal rule. The
    common term ``2T P_psi/L`` is omitted from both, so that thousands of turns leave no rounding:
    ``R - 2T/L = -sigma A_d mu_c^2 |I_d - I_c|/(I_c (1 + a))``.

    Args:
        `I1`, `I2`, `I3` (float): Moments near one, in any order.
        `w1`, `w2`, `w3` (float): Angular velocity near one.

    Source: Montgomery, American Journal of Physics 59 (1991) 394.
    """
    (p, m, m1), (_, I_c, I_d), (L, _, a, mu_c, mu_s, _, Q, _, nu, sigma) = _constants(I1, I2, I3, w1, w2, w3)
    if not (p > 0.0 and m1 > 0.0):
        return math.nan
    K = elliptic.K(m, m1)
    slower = (a * L / I_d) * (mu_c * mu_c * (abs(I_d - I_c) / I_c)) / (1.0 + a)
    integral = 4.0 * Q * attitude.complete_third_kind(attitude.landen_complement(m1), nu) - sigma * slower * (
        4.0 * K / p
    )
    return abs(integral + sigma * (4.0 * mu_s * mu_c * _quarter_area(a, m, m1, K)))


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
def scale_moments(I1, I2, I3):
    """Return the ascending moments `I1`, `I2`, `I3` in a unit in which `I3` is from 1/2 to 1, without a rounding."""
    unit = elliptic_constants.unit_of(I3, I3, I3)
    return I1 / unit, I2 / unit, I3 / unit


@njit(nogil=True, **OPTIONS)
def fill_exact(I1, I2, I3, energy, modes, out):
    """Fill modes and PERIODS in closed form, in units of I3/L.

    Args:
        `I1`, `I2`, `I3` (numpy.ndarray, shape (n,)): Ascending moments in a common unit.
        energy (numpy.ndarray, shape (n,)): 2T I3/L^2.
        modes (numpy.ndarray of int8, shape (n,)): Written: IMPOSSIBLE, SAM, LAM, SEPARATRIX or PRINCIPAL.
        out (numpy.ndarray, shape (3, n)): Written: PERIODS, NaN if missing.
    """
    for i in range(I1.size):
        a, b, c = scale_moments(I1[i], I2[i], I3[i])
        w1, w2, w3 = start(a, b, c, energy[i])
        modes[i] = mode_of(a, b, c, w1, w3) if is_possible(a / c, energy[i]) else IMPOSSIBLE
        out[0, i], out[1, i], out[2, i] = math.nan, math.nan, math.nan
        if modes[i] == SAM or modes[i] == LAM:
            period, rate, sigma = periods(a, b, c, w1, w2, w3)
            rate_encircled = rate + sigma * (2.0 * math.pi / period)
            out[0, i] = period
            out[1, i] = 2.0 * math.pi / (rate if sigma > 0.0 else rate_encircled)
            out[2, i] = 2.0 * math.pi / rate_encircled


@njit(**INNER)
def _start_lane(S, lane, bodies, i, step):
    """Put a lane at the start of body i, to run for a period; not if w is constant or the energy impossible."""
    I1, I2, I3, energy = bodies
    moments = scale_moments(I1[i], I2[i], I3[i])
    omega = start(*moments, energy[i])
    c1, c2, c3 = elliptic_constants.coefficients(*moments)
    rate = math.hypot(omega[0], omega[2]) * max(1.0, abs(c1), abs(c2), abs(c3))
    follower.start_lane(S, lane, moments, omega, (0.0, 1.0, 0.0), step / rate)
    S[row.due_b + lane] = follower.PERIOD
    is_steady = elliptic_constants.is_stationary((c1, c2, c3), omega)
    S[row.active + lane] = 0.0 if is_steady or not is_possible(moments[0] / moments[2], energy[i]) else 1.0


@njit(**INNER)
def _measured_period(S, crossings, lane):
    """Return the period of w, the growth of the azimuth of axis 1 about L in it (rad), and the encircled axis.

    The encircled axis is 3 or 1: its component of w has kept its sign; 0 if both or neither have, or if the period did
    not end. Axis 2, at right angles to L at the start and the end, gives the angle but for whole turns; the half turns
    of axis 1 were counted.
    """
    a, b, c = follower.omega_at(crossings, B, lane)
    x, y, z = follower.vector_at(crossings, B, lane)
    L1, L2, L3 = S[row.Ia + lane] * a, S[row.Ib + lane] * b, S[row.Ic + lane] * c
    angle = math.atan2(L3 * x - L1 * z, math.sqrt(L1 * L1 + L2 * L2 + L3 * L3) * y)
    turns = np.round((math.pi * S[row.changes_azimuth + lane] - angle) / TWO_PI)
    keeps_1, keeps_3 = S[row.changes_a + lane] == 0.0, S[row.changes_c + lane] == 0.0
    period = crossings[B, follower.TIME, lane]
    axis = 0 if keeps_1 == keeps_3 or math.isnan(period) else (3 if keeps_3 else 1)
    return period, angle + TWO_PI * turns, axis


@njit(**INNER)
def _write_periods(S, crossings, lane, energy, out):
    """Write PERIODS of a lane's run, and their errors from those of a coarser run in ``out``; return the mode."""
    if not is_possible(S[row.Ia + lane] / S[row.Ic + lane], energy):
        return IMPOSSIBLE
    if S[row.steps + lane] == 0.0:
        return PRINCIPAL
    period, growth, axis = _measured_period(S, crossings, lane)
    # rounding moves the state to a neighbouring polhode, of a different period near the separatrix; it hardly changes
    # the rate of rotation about L, which is near 2T/L while w is nearly constant
    rounding = 8.0 * EPSILON * (4.0 + math.sqrt(S[row.steps + lane]))
    share = rounding * (1.0 + S[row.fastest + lane] / S[row.slowest + lane] / min(period, MAX_OWN_PERIOD))
    if axis == 0 or not share < MAX_PERIOD_ROUNDING:
        return SEPARATRIX
    free_growth, spin_growth = (growth, growth + TWO_PI) if axis == 3 else (growth + TWO_PI, growth)
    phi_error = (rounding + share * (0.05 + abs(1.0 - energy * period / free_growth))) * max(
        1.0, free_growth / spin_growth
    )
    values = period, TWO_PI * period / growth, TWO_PI * period / spin_growth
    for k in range(3):
        error = 3.0 * abs(values[k] - out[k]) + (share if k == 0 else phi_error) * abs(values[k])
        out[k], out[k + 3] = values[k], error
    return SAM if axis == 3 else LAM


@njit(nogil=True, **OPTIONS)
def fill_measured(bodies, order, tolerance, modes, out):
    """Fill measured modes, PERIODS and their errors, in units of I3/L.

    Args:
        bodies (tuple of 4 arrays, shape (n,)): Ascending moments in a common unit, and the energy 2T I3/L^2.
        order (numpy.ndarray of int64, shape (n,)): Order in which bodies are taken, W at a time; it changes no result,
            and is fast if similar periods are neighbours.
        tolerance (float): Relative error of the periods allowed from the steps.
        modes (numpy.ndarray of int8, shape (n,)): Written, as by :func:`fill_exact`.
        out (numpy.ndarray, shape (6, n)): Written: PERIODS, then their errors, NaN if missing.
    """
    S, crossings = follower.new_block()
    step = follower.largest_step(STEPS_IN_A_PERIOD, tolerance)
    for first in range(0, order.size, W):
        points = order[first : first + W]
        for is_finer in (False, True):
            for lane in range(W):
                i = points[min(lane, points.size - 1)]
                _start_lane(S, lane, bodies, i, follower.FINER * step if is_finer else step)
            follower.follow_lanes(S, crossings, True)
            for lane, i in enumerate(points):
                mode = _write_periods(S, crossings, lane, bodies[3][i], out[:, i])
                modes[i] = mode if mode == modes[i] or not is_finer else SEPARATRIX
        for i in points:
            if modes[i] != SAM and modes[i] != LAM:
                out[:, i] = math.nan


def survey(points, tolerance, measured=True):
    """Return all columns of points, in units.

    Args:
        points (mapping of str to array_like, shape (n,)): I1, I2, I3 (common unit, > 0, in any order: the axes are
            those of ascending moments), energy (2T I_max/L^2, from 1 to I_max/I_min), omega0 (rad s-1, > 0: L = I_max
            omega0).
        tolerance, measured (float, bool): As for :func:`kernels.events.twist.survey`, of the periods.

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
        measured_modes, measured_periods = np.empty(energy.size, dtype=np.int8), np.empty((6, energy.size))
        fill_measured(bodies, np.argsort(out[0]), tolerance, measured_modes, measured_periods)
        names = (*PERIODS, *(f"{name}_error" for name in PERIODS))
        columns |= {"mode": measured_modes} | dict(zip(names, measured_periods / omega0, strict=True))
    return columns


@njit(**INNER)
def _period_ratio(I1, I2, I3, m, short):
    """Return P_psi/P_phi (long axis) of the motion of the parameter m in one mode, and its energy 2T I3/L^2.

    From m = (I_s - I_c)(2T I_d - L^2)/[(I_d - I_s)(L^2 - 2T I_c)]: the distance from the axis, |E - E_0|, is a ratio of
    like-signed terms.
    """
    I_d, I_c = (I3, I1) if short else (I1, I3)
    gap_s, gap_c, gap = abs(I_d - I2), abs(I2 - I_c), abs(I_d - I_c)
    # y = |2T I_d/L^2 - 1|
    y = m * gap_s * (gap / I_d) / (gap_c + m * gap_s * (I_c / I_d))
    side = 1.0 if short else -1.0
    twice_energy = (1.0 + side * y) / I_d  # 2T/L^2
    m_c2 = y * I_c / gap
    w_c, w_d = math.sqrt(m_c2) / I_c, math.sqrt(max(0.0, 1.0 - m_c2)) / I_d
    w1, w3 = (w_c, w_d) if short else (w_d, w_c)
    period, rate, _ = periods(I1, I2, I3, w1, 0.0, w3)
    psi_growth = rate * period
    return (psi_growth if short else psi_growth - 2.0 * math.pi) / (2.0 * math.pi), twice_energy * I3


@njit(**OPTIONS)
def _min_ratio(I1, I2, I3, short):
    """Return the ratio's limit as the wobble vanishes; infinite where the body has no such mode."""
    if short:
        return math.sqrt(I1 / (I3 - I1) * I2 / (I3 - I2)) if I3 > I2 else math.inf
    if not I2 > I1:
        return math.inf
    # sqrt(q) - 1 with q = I2 I3/((I3 - I1)(I2 - I1)): for needles both are near 1
    more = I1 / (I3 - I1) * ((I2 + (I3 - I1)) / (I2 - I1))
    return more / (math.sqrt(1.0 + more) + 1.0)


@njit(nogil=True, **OPTIONS)
def _solve_ratio(I1, I2, I3, ratio, short):
    """Return the parameter m and the energy of one mode that give the ratio; NaN where it is below the mode's limit.

    The ratio grows with m, from the limit to infinity on the separatrix: bisection in x = ln(1/m1), m1 = exp(-x), which
    resolves both ends.
    """
    if not ratio > _min_ratio(I1, I2, I3, short):
        return math.nan, math.nan
    if (I1 == I2) if short else (I2 == I3):  # a symmetric top: the ratio gives the cosine of the angle of L to its axis
        cosine = I3 / ((1.0 + ratio) * (I3 - I1)) if short else I1 / (I3 - I1) / ratio
        about, across = (1.0, I3 / I1) if short else (I3 / I1, 1.0)
        return 0.0, across + cosine * cosine * (about - across)
    low, high = 0.0, 600.0
    for _ in range(200):
        middle = 0.5 * (low + high)
        value, energy = _period_ratio(I1, I2, I3, -math.expm1(-middle), short)
        low, high = (middle, high) if value < ratio else (low, middle)
        if not low < 0.5 * (low + high) < high:
            break
    return -math.expm1(-high), energy


def inverse(I1, I2, I3, ratio):
    """Return the energy in each mode at which a body has a given ratio of periods P_psi/P_phi (long axis), if any.

    In either mode the ratio grows with the wobble from ``sqrt(I1 I2/((I3 - I1)(I3 - I2)))`` (SAM, at least 1 for a
    physically possible body) or ``sqrt(I2 I3/((I3 - I1)(I2 - I1))) - 1`` (LAM) to infinity at the separatrix.

    Args:
        `I1`, `I2`, `I3` (array_like): Ascending moments in a common unit, broadcast with the ratio.
        ratio (array_like): P_psi/P_phi of the axis of least moment, > 0.

    Returns:
        dict of str to numpy.ndarray, shape (2, n): energy (2T I3/L^2) and m, rows SAM and LAM, NaN if the ratio is
            below the limit of the mode; least_ratio, the limit of vanishing wobble, infinite if the body has no such
            mode.
    """
    I1, I2, I3, ratio = arrays(I1, I2, I3, ratio)
    out = np.empty((3, 2, ratio.size))
    for i, target in enumerate(ratio):
        moments = scale_moments(I1[i], I2[i], I3[i])
        for mode, short in enumerate((True, False)):
            out[:2, mode, i] = _solve_ratio(*moments, target, short)
            out[2, mode, i] = _min_ratio(*moments, short)
    return dict(zip(("m", "energy", "least_ratio"), out, strict=True))


@njit(nogil=True, **OPTIONS)
def fill_tilts(I1, I2, I3, energy, out):
    """Fill mean, least and greatest angle of L to the encircled axis, rad.

    Args:
        `I1`, `I2`, `I3` (numpy.ndarray, shape (n,)): Ascending moments in a common unit.
        energy (numpy.ndarray, shape (n,)): 2T I3/L^2.
        out (numpy.ndarray, shape (3, n)): Written; NaN if the energy is impossible, the mean also on the separatrix.
    """
    for i in range(I1.size):
        out[0, i], out[1, i], out[2, i] = math.nan, math.nan, math.nan
        low, middle, high = scale_moments(I1[i], I2[i], I3[i])
        if not is_possible(low / high, energy[i]):
            continue
        (_, m, m1), _, top = _constants(low, middle, high, *start(low, middle, high, energy[i]))
        a, mu_c, mu_s = top.a, top.mu_c, top.mu_s
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
