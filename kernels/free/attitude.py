r"""Attitude of the free rigid body in closed form, any body, any start, any time; and the exact attitude step.

**Equations.**  With the angular velocity w in the body (rad/s) and q the unit quaternion that turns body axes into
space axes, scalar first, ``q' = q (0, w)/2``.  L = |I w| is constant and so is I w in space.

**Shortest arc.**  Let ``m = I w/L`` and d be the axis that the polhode encircles (:mod:`kernels.free.exact`), named so
that ``m_d >= 0``: if w_d is negative, two axes are reversed.  P(m) = (1 + m_d, m x e_d), normalised, rotates m to
e_d by the shortest arc, and the remaining rotation is about e_d::

    q(t) = P(m(0))* . (cos psi/2, e_d sin psi/2) . P(m(t)),     psi' = (w_d + 2T/L)/(1 + m_d)

Both terms above are positive and ``1 + m_d >= 1``: principal spins, symmetric tops, the sphere and the separatrix are
no special cases.

**The integral.**  ``w_d = A_d dn u``, ``m_d = a dn u`` with ``a = I_d A_d/L``.  The descending Landen transformation
(DLMF 22.7.4) ``dn u = (1 - k1 s^2)/(1 + k1 s^2)``, with s = sn(v | k1^2), v = u/(1 + k1) and
``k1 = m/(1 + sqrt m1)^2``, makes psi' rational in s^2, and from u = 0 on::

    Psi(u) = R t + Q J(v),      J(v) = int_0^v s^2/(1 + nu s^2) dv = s^3/3 R_J(c^2, d^2, 1, 1 + nu s^2)
    R  = (A_d + 2T/L)/(1 + a),      nu = k1 mu_c^2/(1 + a)^2
    Q  = -2 k1 (1 + k1) A_d (Delta_d/L^2)/(p (1 + a)^2),     Delta_d = L^2 - 2 T I_d

One integral of the third kind with characteristic -nu in [-1, 0], and no arctangent: if d is the axis of
greatest moment every term is positive, and nothing is lost at a = 1.  ``mu_c^2 = 1 - a^2`` and ``mu_s^2 = 1 - a^2 m1``
are the squares of the greatest m_c and m_s, formed as sums of like-signed terms.

**No phase.**  The addition theorem makes the increment over any time t algebraic in the mid-point: with
``delta = p t/2`` and sn, cn, dn those of delta::

    zeta = a [a dn + i mu_c mu_s sn cn]/(a^2 + mu_c^2 sn^2)
    psi(t) - psi(0) = 2 Psi(delta) + 2 sigma {arg[m_d(t/2) + zeta] - arg[a + zeta]}

sigma = +1 where d is the axis of greatest moment, -1 where it is the least.  Real parts are positive, so the principal
values hold for every t.  For one step length h all but m_d(t + h/2) is constant: the exact attitude step, which needs
neither an elliptic integral nor a sine in the loop.  It steps m, which obeys the exact step of w with coefficients of
its own, and errs by a rounding a step.  Along the unstable axis (the separatrix, and ``m1`` near 0) each rounding grows
by e^{pt}, up to a turn: a step from the state alone is inaccurate there, whereas the closed form computes from the
start on which side of the separatrix it is.

Source: derived from the equations above; P(m) and psi' after Celledoni, Fasso, Saefstroem and Zanna, SIAM J. Sci.
Comput. 30 (2008) 2084, with the signs derived anew; the step is not found in print.  R_J: Carlson, Numer. Algorithms
10 (1995) 13; complete integral: Bulirsch, Numer. Math. 13 (1969) 305.
"""

import math
from typing import NamedTuple

import numpy as np

from kernels.compile.jit import INLINE, INNER, OPTIONS, njit
from kernels.compile.llvm_formulas import formula
from kernels.free import elliptic_constants
from kernels.free.elliptic import Ladder, climb, jacobi_short, ladder
from kernels.free.rigid_body import relabel

MAX_ARGUMENT = 700.0  # largest argument of sech that does not underflow; the ratios in arg are constant beyond
SETTLED_TANH = 20.0  # the argument from which tanh is one to rounding


@njit(**OPTIONS)
def carlson_rj(x, y, z, p):
    """Return Carlson's symmetric integral of the third kind R_J for 0 <= x <= y <= z <= p, at most x zero.

    Duplication until the spread is small, then the series to seventh order; relative error about 4e-16.
    Source: Carlson, Numer. Algorithms 10 (1995) 13, algorithm for R_J; DLMF 19.26.22, 19.36.2.

    Args:
        `x`, `y`, `z`, `p` (float): Arguments, not checked.
    """
    mean = 0.2 * (x + y + z + 2.0 * p)
    delta = (p - x) * (p - y) * (p - z)
    X, Y, Z = mean - x, mean - y, mean - z
    power, total = 1.0, 0.0
    spread = max(abs(X), abs(Y), abs(Z), abs(mean - p))
    for _ in range(600):
        if spread * power < 2e-3 * mean:
            break
        rx, ry, rz, rp = math.sqrt(x), math.sqrt(y), math.sqrt(z), math.sqrt(p)
        shift = rx * ry + ry * rz + rz * rx
        d = (rp + rx) * (rp + ry) * (rp + rz)
        e = math.sqrt(delta * power) * power / d  # sqrt of Carlson's e_m
        total += power / d * (math.atan(e) / e if e > 0.0 else 1.0)
        x, y, z, p = 0.25 * (x + shift), 0.25 * (y + shift), 0.25 * (z + shift), 0.25 * (p + shift)
        mean = 0.25 * (mean + shift)
        power *= 0.25
    X, Y, Z = X * power / mean, Y * power / mean, Z * power / mean
    P = -0.5 * (X + Y + Z)
    e2 = X * Y + X * Z + Y * Z - 3.0 * P * P
    e3 = X * Y * Z + 2.0 * e2 * P + 4.0 * P * P * P
    e4 = (2.0 * X * Y * Z + e2 * P + 3.0 * P * P * P) * P
    e5 = X * Y * Z * P * P
    series = e2 * (-3.0 / 14.0 + 9.0 * e2 / 88.0 - 9.0 * e3 / 52.0) + e3 / 6.0 - 3.0 * e4 / 22.0 + 3.0 * e5 / 26.0
    return power * (1.0 + series) / (mean * math.sqrt(mean)) + 6.0 * total


@njit(**OPTIONS)
def complete_third_kind(complement, nu):
    """Return ``int_0^K s^2/(1 + nu s^2) dv``, s = sn(v), for a modulus of complement k' > 0 and nu >= 0.

    Bulirsch's ``cel(k', 1 + nu, 0, 1)``: arithmetic-geometric means, all terms positive; relative error 4e-16.
    """
    kc, p, a, b = complement, math.sqrt(1.0 + nu), 0.0, 1.0
    b /= p
    e, em = kc, 1.0
    for _ in range(40):
        f = a
        a += b / p
        g = e / p
        b = 2.0 * (b + f * g)
        p += g
        g = em
        em += kc
        if abs(g - kc) <= 1e-8 * g:
            break
        kc = 2.0 * math.sqrt(e)
        e = kc * em
    return 0.5 * math.pi * (b + a * em) / (em * (em + p))


class AttitudeTerms(NamedTuple):
    """Constants of the attitude of one trajectory, with the symbols of the module's docstring."""

    L: float
    T2: float  #: twice the energy
    a: float  #: with mu_c and mu_s, the greatest m_d, m_c and m_s
    mu_c: float
    mu_s: float
    R: float  #: R and Q (0 if p = 0) are rates, k1 and nu modulus and characteristic of Psi
    Q: float
    k1: float
    nu: float
    sigma: float  #: +1 where d is the axis of greatest moment, -1 where it is the least


class Frame(NamedTuple):
    """The axes (d, j, k) of a motion in cyclic order, and L in them."""

    d: int  #: the axis that the polhode encircles
    side: float  #: -1 if w_d is negative and half a turn about j makes it positive, else 1
    on_j: bool  #: whether sn runs on j
    g: tuple  #: I/L
    m: tuple  #: direction of L at the start


class Attitude(NamedTuple):
    """One motion, set up by :func:`prepare` for :func:`attitude_at`; ``complete`` is J(K) of the modulus k1."""

    motion: elliptic_constants.Motion
    terms: AttitudeTerms
    frame: Frame
    ladder: Ladder
    ladder_k1: Ladder
    complete: float


@njit(**INLINE)
def attitude_terms(moments, omega, p, m, m1):
    """Return the :class:`AttitudeTerms` of one trajectory; straight-line code for loops over lanes.

    Args:
        moments (tuple of 3 floats): Moments near one, by role (s, c, d).
        omega (tuple of 3 floats): Angular velocity near one, by role, and not constant in time.
        `p`, `m`, `m1` (float): From :func:`kernels.free.elliptic_constants.constants`.
    """
    I_s, I_c, I_d = moments
    w_s, w_c, w_d = omega
    L_s, L_c, L_d = I_s * w_s, I_c * w_c, I_d * w_d
    L2 = L_s * L_s + L_c * L_c + L_d * L_d
    L, T2 = math.sqrt(L2), L_s * w_s + L_c * w_c + L_d * w_d
    gap = abs(I_d - I_c)
    safe = gap if gap > 0.0 else 1.0
    A_d = math.sqrt(w_d * w_d + abs((I_s - I_c) / I_d) * (I_s / safe) * (w_s * w_s))
    mu_c2 = min(1.0, (L_s * (abs(I_d - I_s) / safe) * (I_c * w_s) + L_c * L_c) / L2)
    a = I_d * A_d / L
    mu_s2 = min(1.0, mu_c2 + a * a * m)
    sigma = 1.0 if I_d > I_c else -1.0
    root = 1.0 + math.sqrt(m1)
    k1 = m / (root * root)
    R = (A_d + T2 / L) / (1.0 + a)
    square = (1.0 + a) * (1.0 + a)
    Q = sigma * 2.0 * k1 * (1.0 + k1) * A_d * (mu_c2 * (gap / I_c)) / square
    Q = Q / p if p > 0.0 else 0.0
    return AttitudeTerms(L, T2, a, math.sqrt(mu_c2), math.sqrt(mu_s2), R, Q, k1, k1 * mu_c2 / square, sigma)


@njit(**INLINE)
def middle_shift(terms, sn, cn, dn):
    """Return the complex zeta of the module's docstring.

    Args:
        terms (AttitudeTerms): Constants of the trajectory.
        `sn`, `cn`, `dn` (float): Elliptic functions of half the step.
    """
    a, mu_c, mu_s = terms.a, terms.mu_c, terms.mu_s
    below = a * a + mu_c * mu_c * (sn * sn)
    scale = a / (below if below > 0.0 else 1.0)
    return (scale * (a * dn) if below > 0.0 else 1.0), scale * (mu_c * mu_s * (sn * cn))


@njit(**OPTIONS)
def third_kind(v, top):
    """Return J(v) of the module's docstring for any v and the :class:`Attitude` ``top``."""
    nu = top.terms.nu
    if top.motion.m1 <= 0.0 and abs(v) > SETTLED_TANH:
        root = math.sqrt(nu)
        arc = math.atan(root * math.tanh(v)) / root if root > 0.0 else math.tanh(v)
        return (v - arc) / (1.0 + nu)
    s, c, d = climb(v, top.ladder_k1)
    turns = math.floor(v * top.ladder_k1.ah / math.pi + 0.5)
    if turns % 2.0 != 0.0:
        s, c = -s, -c
    if c < 0.0:  # v/2K was rounded across a half
        turns += math.copysign(1.0, s)
        s, c = -s, -c
    within_period = s * s * s / 3.0 * carlson_rj(min(c * c, d * d), d * d, 1.0, 1.0 + nu * s * s)
    return within_period + 2.0 * turns * top.complete


@njit(**INLINE)
def heading(q, n, m):
    """Return cos and sin of psi/2, to a positive factor: ``P(n) q P(m)*`` with the axis a on the side of L.

    Args:
        `q` (tuple of 4 floats): Attitude since the start, scalar first, axes in the cyclic order (a, b, c).
        `n` (tuple of 3 floats): Direction of L in the body at the start, n_a > 0.
        `m` (tuple of 3 floats): Direction of L in the body at the end, m_a > 0.
    """
    q0, qa, qb, qc = q
    n_a, n_b, n_c = n
    m_a, m_b, m_c = m
    P, N = 1.0 + m_a, 1.0 + n_a
    # q times P(m)* = (P, 0, -m_c, m_b)
    t0 = q0 * P + qb * m_c - qc * m_b
    ta = qa * P + qb * m_b + qc * m_c
    tb = qb * P - q0 * m_c - qa * m_b
    tc = qc * P + q0 * m_b - qa * m_c
    # P(n) = (N, 0, n_c, -n_b) times that
    return N * t0 - n_c * tb + n_b * tc, N * ta + n_c * tc + n_b * tb


@njit(**INLINE)
def partial_attitude(n, x, y):
    """Return ``P(n)* (x + y e_d)`` as a quaternion (scalar, d, j, k).

    Args:
        `n` (tuple of 3 floats): Direction of L in the body at the start, by axes (d, j, k).
        `x`, `y` (float): cos(psi/2) and sin(psi/2).
    """
    n_d, n_j, n_k = n
    N = 1.0 + n_d
    return N * x, N * y, n_j * y - n_k * x, n_j * x + n_k * y


@njit(**OPTIONS)
def prepare(moments, start):
    """Return the :class:`Attitude` of a motion, of moments and an angular velocity at its start in any units."""
    I1, I2, I3, _ = elliptic_constants.scaled(moments[0], moments[1], moments[2])
    w1, w2, w3, unit = elliptic_constants.scaled(start[0], start[1], start[2])
    top = elliptic_constants.set_up_near_one(I1, I2, I3, w1, w2, w3)
    s, c, d = top.axes
    on_j = s == d % 3 + 1
    w_s, w_c, w_d = top.w
    side = -1.0 if w_d < 0.0 else 1.0
    w = (w_s, side * w_c, side * w_d) if on_j else (side * w_s, w_c, side * w_d)
    terms = attitude_terms(elliptic_constants.by_role(s, c, d, I1, I2, I3), w, top.p, top.m, top.m1)
    g = relabel(I1 / terms.L, I2 / terms.L, I3 / terms.L, d)
    w_d, w_j, w_k = (w[2], w[0], w[1]) if on_j else (w[2], w[1], w[0])
    motion = elliptic_constants.Motion(top.p, top.m, top.m1, top.axes, top.c, w, unit)
    frame = Frame(d, side, on_j, g, (g[0] * w_d, g[1] * w_j, g[2] * w_k))
    complement = landen_complement(top.m1)
    ladder_k1 = ladder(terms.k1 * terms.k1, complement * complement)
    return Attitude(motion, terms, frame, ladder(top.m, top.m1), ladder_k1, complete_third_kind(complement, terms.nu))


@njit(**OPTIONS)
def half_turn(t, top):
    """Return half of psi, rad, at the time t (in the unit of ``top``, an :class:`Attitude`)."""
    p, _, m1, _, c, w, _ = top.motion
    terms, g_d = top.terms, top.frame.g[0]
    half, short = 0.5 * p * t, 0.5 * t
    J = third_kind(half / (1.0 + terms.k1), top)
    if m1 <= 0.0 and abs(half) > MAX_ARGUMENT:
        half, short = math.copysign(MAX_ARGUMENT, half), short * (MAX_ARGUMENT / abs(half))
    sn, cn, dn = climb(half, top.ladder)
    zr, zi = middle_shift(terms, sn, cn, dn)
    _, _, x_d = elliptic_constants.advance_by_role(w, c, p, short, sn, cn, dn)
    bend = math.atan2(zi, g_d * x_d + zr) - math.atan2(zi, terms.a + zr)
    return 0.5 * terms.R * t + terms.Q * J + terms.sigma * bend


@njit(**OPTIONS)
def direction(t, top):
    """Return the direction m of L in the body, by the axes (d, j, k), at t (in the unit of ``top``)."""
    p, _, _, _, c, w, _ = top.motion
    g = top.frame.g
    sn, cn, dn = climb(p * t, top.ladder)
    x_s, x_c, x_d = elliptic_constants.advance_by_role(w, c, p, t, sn, cn, dn)
    x_j, x_k = (x_s, x_c) if top.frame.on_j else (x_c, x_s)
    return g[0] * x_d, g[1] * x_j, g[2] * x_k


@njit(**OPTIONS)
def attitude_at(t, top):
    """Return attitude since the start (unit quaternion) and direction m of L in the body, a time t (s) after it."""
    d, side, begin = top.frame.d, top.frame.side, top.frame.m
    t *= top.motion.unit
    angle = half_turn(t, top)
    m_d, m_j, m_k = direction(t, top)
    q0, qd, qj, qk, _ = complete_attitude((m_d, m_j, m_k), partial_attitude(begin, math.cos(angle), math.sin(angle)))
    return (q0, *by_cyclic_axes(d, side * qd, qj, side * qk)), by_cyclic_axes(d, side * m_d, m_j, side * m_k)


@njit(**OPTIONS)
def fill_attitude(moments, start, times, out):
    """Fill attitudes since the start; constants are computed once.

    Args:
        moments (numpy.ndarray, shape (3,)): Principal moments, kg m2.
        start (numpy.ndarray, shape (3,)): Angular velocity at the start, rad/s.
        times (numpy.ndarray, shape (n,)): Times, s.
        out (numpy.ndarray, shape (n, 4)): Written: unit quaternions, scalar first.
    """
    if elliptic_constants.is_stationary(elliptic_constants.coefficients(moments[0], moments[1], moments[2]), start):
        _fill_steady(start, times, out)
        return
    top = prepare(moments, start)
    for i in range(times.shape[0]):
        q, _ = attitude_at(times[i], top)
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = q


@njit(**INLINE)
def landen_complement(m1):
    """Return ``sqrt(1 - k1^2) = 2 sqrt(k')/(1 + k')`` with ``k' = sqrt(m1)``."""
    complement = math.sqrt(m1)
    return 2.0 * math.sqrt(complement) / (1.0 + complement)


@njit(**INLINE)
def by_cyclic_axes(d, x_d, x_j, x_k):
    """Return the values x_d, x_j, x_k of the axes (d, j, k), cyclic from the axis `d`, in the order 1, 2, 3."""
    x1 = x_d if d == 1 else (x_k if d == 2 else x_j)
    x2 = x_j if d == 1 else (x_d if d == 2 else x_k)
    x3 = x_k if d == 1 else (x_j if d == 2 else x_d)
    return x1, x2, x3


@njit(**INNER)
def _fill_steady(start, times, out):
    """Write the attitude under a constant angular velocity: one turn about it."""
    w1, w2, w3, unit = elliptic_constants.scaled(start[0], start[1], start[2])
    size = math.sqrt(w1 * w1 + w2 * w2 + w3 * w3)
    safe = size if size > 0.0 else 1.0
    for i in range(times.shape[0]):
        angle = 0.5 * size * (times[i] * unit)
        sine = math.sin(angle) / safe
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = math.cos(angle), sine * w1, sine * w2, sine * w3


@njit(**INLINE)
def _rate(u, m, A_d, a, mean):
    """Return the rate of psi at the argument u, at most 0.5 in size; ``mean`` is 2T/L."""
    _, _, dn = jacobi_short(u, m)
    return (A_d * dn + mean) / (1.0 + a * dn)


@njit(**INLINE)
def half_step_psi(delta, m, A_d, a, mean):
    """Return ``Psi/h`` over half a step by Gauss and Legendre's eight nodes, error 1e-17.

    Args:
        delta (float): p h/2, at most 0.5.
        `m` (float): Parameter of the elliptic functions.
        A_d, `a`, mean (float): A_d and a of the module's docstring, and 2T/L.
    """
    return 0.5 * (
        0.05061426814518853 * _rate(0.019855071751231912 * delta, m, A_d, a, mean)
        + 0.11119051722668721 * _rate(0.10166676129318664 * delta, m, A_d, a, mean)
        + 0.15685332293894344 * _rate(0.2372337950418355 * delta, m, A_d, a, mean)
        + 0.18134189168918083 * _rate(0.4082826787521751 * delta, m, A_d, a, mean)
        + 0.18134189168918083 * _rate(0.5917173212478248 * delta, m, A_d, a, mean)
        + 0.15685332293894344 * _rate(0.7627662049581645 * delta, m, A_d, a, mean)
        + 0.11119051722668721 * _rate(0.8983332387068134 * delta, m, A_d, a, mean)
        + 0.05061426814518853 * _rate(0.9801449282487681 * delta, m, A_d, a, mean)
    )


class Steps(NamedTuple):
    """Constants of the exact attitude step of one length.

    ``exp(i psi/2)`` grows by a positive multiple of X + iY a step, with ``X = x0 + (x1 + x2 m_d) m_d + x3 m_j m_k`` of
    the m at its beginning, and Y likewise: ``e [m_d(t + h/2) + zeta] D`` of the module's docstring, with ``m_d(t + h/2)
    D = dn m_d + [(I_j - I_k) L/(I_j I_k)] S cn m_j m_k`` and D that of the half step.
    """

    d: int  #: the axis that the polhode encircles; axes are in the cyclic order (d, j, k)
    side: float  #: -1 if the axes d and k are reversed (w_d is negative), else 1
    g: tuple  #: I/L: m = g w
    x: tuple
    y: tuple


@njit(**INLINE)
def short_step_constants(moments, omega, h):
    """Return the :class:`Steps` for ``p |h| <= 1``, with neither branch nor loop, for loops over lanes.

    Args:
        moments (tuple of 3 floats): Principal moments near one.
        omega (tuple of 3 floats): Angular velocity near one.
        `h` (float): Length of the step.
    """
    p, m, m1, s, c, d = elliptic_constants.constants(*moments, *omega)
    _, _, w_d = elliptic_constants.by_role(s, c, d, *omega)
    terms = attitude_terms(
        elliptic_constants.by_role(s, c, d, *moments), elliptic_constants.by_role(s, c, d, *omega), p, m, m1
    )
    L, a = terms.L, terms.a
    delta = 0.5 * p * h
    sn, cn, dn = jacobi_short(delta, m)
    I_d, I_j, I_k = relabel(*moments, d)
    half = h * half_step_psi(delta, m, a * L / I_d, a, terms.T2 / L)
    side = -1.0 if w_d < 0.0 else 1.0
    S = sn / p if p > 0.0 else 0.5 * h
    across = ((I_j - I_k) / I_j) * (L / I_k) * (S * cn)
    square = abs(((I_d - I_j) / I_k) * ((I_k - I_d) / I_j)) * (S * S) * (L / I_d) * (L / I_d)
    zr, zi = middle_shift(terms, sn, cn, dn)
    zi *= terms.sigma
    x, y = a + zr, -zi
    size = math.sqrt(x * x + y * y)
    cosine, sine = math.cos(half), math.sin(half)
    e_r, e_i = (cosine * x - sine * y) / size, (cosine * y + sine * x) / size
    f_r, f_i = e_r * zr - e_i * zi, e_r * zi + e_i * zr
    real = f_r * (cn * cn), e_r * dn, f_r * square, e_r * across
    imaginary = f_i * (cn * cn), e_i * dn, f_i * square, e_i * across
    return Steps(d, side, (I_d / L, I_j / L, I_k / L), real, imaginary)


@njit(**INLINE)
def direction_coefficients(q, g):
    """Return the coefficients with which :func:`kernels.free.exact.step` advances m = g w, from those (q) for w."""
    q_d, q_j, q_k = q
    g_d, g_j, g_k = g
    return q_d * (g_d / (g_j * g_k)), q_j * (g_j / (g_k * g_d)), q_k * (g_k / (g_d * g_j))


@formula
def step_attitude(m, R, size, x, y):
    """Return one exact step of ``R = P(m(0))* exp(i psi/2)`` from the direction m of L, up to a factor.

    Args:
        `m` (tuple of 3 floats): Direction of L in the body before the step, by axes (d, j, k).
        `R` (tuple of 4 floats): The quaternion before the step.
        size (float): Factor of the last :func:`complete_attitude`: R is normalised a step late, so that no step waits
            for a square root.
        `x`, `y` (tuple of 4 floats): Constants of :class:`Steps`.
    """
    m_d, m_j, m_k = m
    r0, rd, rj, rk = R
    across = m_j * m_k
    X = (x[0] + ((x[1] + x[2] * m_d) * m_d + x[3] * across)) * size
    Y = (y[0] + ((y[1] + y[2] * m_d) * m_d + y[3] * across)) * size
    return r0 * X - rd * Y, r0 * Y + rd * X, rj * X + rk * Y, rk * X - rj * Y


@formula
def _refine_root(guess, x):
    """Return ``1/sqrt(x)`` from a guess, by a step of third order."""
    e = 1.0 - x * (guess * guess)
    return guess + guess * e * (0.5 + 0.375 * e)


@njit(**INLINE)
def _reciprocal_root(x):
    """Return ``1/sqrt(x)`` of an x of moderate size: a guess in single precision, and one step of third order.

    A root and a division of whole vectors of doubles would double the time of an exact step.
    """
    return _refine_root(np.float64(np.float32(1.0) / math.sqrt(np.float32(x))), x)


@formula
def _squared_size(m, R):
    """Return squared size of R P(m)."""
    m_d, m_j, m_k = m
    r0, rd, rj, rk = R
    P = 1.0 + m_d
    return ((r0 * r0 + rd * rd) + (rj * rj + rk * rk)) * (P * P + (m_j * m_j + m_k * m_k))


@formula
def _scale_product(m, R, size):
    """Return ``size`` times R P(m)."""
    m_d, m_j, m_k = m
    r0, rd, rj, rk = R
    P = 1.0 + m_d
    # times (P, 0, m_k, -m_j) from the right
    q0 = r0 * P + (rk * m_j - rj * m_k)
    qd = rd * P - (rj * m_j + rk * m_k)
    qj = rj * P + (r0 * m_k + rd * m_j)
    qk = rk * P + (rd * m_k - r0 * m_j)
    return q0 * size, qd * size, qj * size, qk * size


@njit(**INLINE)
def complete_attitude(m, R):
    """Return the attitude ``R P(m)`` as a unit quaternion (scalar, d, j, k), and the factor that made it one.

    The factor is 1/(|R| |P(m)|); arguments as for :func:`step_attitude`.
    """
    size = _reciprocal_root(_squared_size(m, R))
    return (*_scale_product(m, R, size), size)
