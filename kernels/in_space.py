r"""A nudged spin seen from space: the attitude step by step beside its closed form, and how the spin axis moves.

Points are those of :mod:`kernels.survey`; samples count until the perturbation has grown tenfold. In radians of spin.

*Certificate.* The direct integrator carries the quaternion beside the angular velocity (:mod:`kernels.taylor`). Beside
it runs the exact attitude step (:mod:`kernels.attitude`) on the exact step of the angular velocity; the two share no
code. ``attitude_error`` is the largest angle between them.

*Rate in space.* With psi the turn that is left when the shortest arc from L to the spin axis is taken off the attitude,
the axis of a stable spin goes about L at the mean rate :math:`\langle\psi'\rangle \pm \Omega`: plus about the axis of
greatest moment, minus about that of least. The mean of psi' is that of the samples, the frequency of the wobble in the
body that of the survey. A run may show a piece of the wobble alone; :func:`wandering` bounds what the rest changes.

*Second witness.* ``geometric_phase_residual`` is the distance of psi's growth over one polhode period, by the elliptic
integral, from what Montgomery's theorem makes of energy, period and a solid angle (:mod:`kernels.tumbling`).
"""

import math

import numpy as np

from kernels import attitude, direct, exact, measure, rigid_body, solution, tumbling
from kernels.blocks import W, cut, scratch
from kernels.circular import arctangent
from kernels.jit import INNER, OPTIONS, njit, whole_vectors
from kernels.taylor import turn_12

IN_SPACE = ("attitude_error", "psi_rate", "psi_rate_error", "space_rate_exact", "geometric_phase_residual")
EPSILON = float(np.finfo(np.float64).eps)

# Rows of the scratch array, W long each. The direct state: angular velocity, quaternion, steps.
A, B, C, Q0, QA, QB, QC, KA, KB, KC, HALF = (W * r for r in range(11))
# The exact state, by (d, j, k): direction of L, its step, the unfinished quaternion with its factor, and constants.
MD, MJ, MK, SD, SJ, SK, R0, RD, RJ, RK, SIZE = (W * r for r in range(11, 22))
EX0, EXD, EXDD, EXJK, EY0, EYD, EYDD, EYJK, AXIS, TURNED = (W * r for r in range(22, 32))
# Moments over L, the start's direction of L, window, and what is found.
MA, MB, MC, NA, NB, NC, START, OPEN, APART, USED = (W * r for r in range(32, 42))
# psi's turn in the first interval, and the sum of what those of the others differ from it.
ZR, ZI, FIRST, PSI, SPACING = (W * r for r in range(42, 47))
ROWS = 47


@njit(**OPTIONS)
def steps_of(x, size, intervals, tolerance):
    """Return the steps of order 12 in a sample interval of x (rad at the largest rate), up to size ``size``."""
    total = max(x * intervals, 1.0)
    rate = (total * direct.truncation(size, 12) / (0.1 * tolerance)) ** (1.0 / 12.0)
    return int(max(1.0, math.ceil(x * max(rate, 1.0))))


@njit(**OPTIONS)
def _load(S, lane, moments, omega, h, steps):
    """Set up one lane; moments in a unit near the greatest, angular velocity in that of the spin, +1 or -1."""
    Ia, Ib, Ic = moments
    a, b, c = omega
    ca, cb, cc = rigid_body.euler_coefficients(Ia, Ib, Ic)
    step = h / steps
    S[A + lane], S[B + lane], S[C + lane] = a, b, c
    S[Q0 + lane], S[QA + lane], S[QB + lane], S[QC + lane] = 1.0, 0.0, 0.0, 0.0
    S[KA + lane], S[KB + lane], S[KC + lane], S[HALF + lane] = ca * step, cb * step, cc * step, 0.5 * step
    d, turned, g, x, y = attitude.short_step_constants(moments, omega, h)
    q = rigid_body.relabel(*exact.short_step_constants(moments, omega, h), d)
    S[SD + lane], S[SJ + lane], S[SK + lane] = attitude.of_direction(q, g)
    g_d, g_j, g_k = g
    w_d, w_j, w_k = rigid_body.relabel(a, b, c, d)
    m_d, m_j, m_k = g_d * (turned * w_d), g_j * w_j, g_k * (turned * w_k)
    S[MD + lane], S[MJ + lane], S[MK + lane] = m_d, m_j, m_k
    S[EX0 + lane], S[EXD + lane], S[EXDD + lane], S[EXJK + lane] = x
    S[EY0 + lane], S[EYD + lane], S[EYDD + lane], S[EYJK + lane] = y
    S[AXIS + lane], S[TURNED + lane], S[SIZE + lane] = d, turned, 0.5
    S[R0 + lane], S[RD + lane], S[RJ + lane], S[RK + lane] = attitude.lifted((m_d, m_j, m_k), 1.0, 0.0)
    L = math.sqrt((Ia * a) ** 2 + (Ib * b) ** 2 + (Ic * c) ** 2)
    # seen from the end of the spin axis on the side of L: for a spin the other way, half a turn about b
    S[MA + lane], S[MB + lane], S[MC + lane] = Ia / L * a, Ib / L, Ic / L * a
    S[NA + lane], S[NB + lane], S[NC + lane] = S[MA + lane] * a, S[MB + lane] * b, S[MC + lane] * c
    S[START + lane] = b * b + c * c
    S[OPEN + lane], S[USED + lane], S[APART + lane], S[PSI + lane] = 1.0, 0.0, 0.0, 0.0
    S[ZR + lane], S[ZI + lane], S[FIRST + lane], S[SPACING + lane] = 1.0, 0.0, 0.0, h


@njit(**OPTIONS)
def _advance(S, steps):
    """Take the direct steps of one sample interval."""
    whole_vectors()
    for _ in range(steps):
        for lane in range(W):
            a, b, c, w, x, y, z = turn_12(
                *(S[A + lane], S[B + lane], S[C + lane]),
                *(S[Q0 + lane], S[QA + lane], S[QB + lane], S[QC + lane]),
                *(S[KA + lane], S[KB + lane], S[KC + lane], S[HALF + lane]),
            )
            S[A + lane], S[B + lane], S[C + lane] = a, b, c
            S[Q0 + lane], S[QA + lane], S[QB + lane], S[QC + lane] = w, x, y, z


@njit(**OPTIONS)
def _advance_exact(S):
    """Take one exact step of every lane; :func:`_compare` completes it, so that both loops stay short."""
    whole_vectors()
    for lane in range(W):
        m_d, m_j, m_k = S[MD + lane], S[MJ + lane], S[MK + lane]
        r0, rd, rj, rk = attitude.step(
            (m_d, m_j, m_k),
            (S[R0 + lane], S[RD + lane], S[RJ + lane], S[RK + lane]),
            S[SIZE + lane],
            (S[EX0 + lane], S[EXD + lane], S[EXDD + lane], S[EXJK + lane]),
            (S[EY0 + lane], S[EYD + lane], S[EYDD + lane], S[EYJK + lane]),
        )
        S[R0 + lane], S[RD + lane], S[RJ + lane], S[RK + lane] = r0, rd, rj, rk
        S[MD + lane], S[MJ + lane], S[MK + lane] = exact.step(m_d, m_j, m_k, S[SD + lane], S[SJ + lane], S[SK + lane])


@njit(**OPTIONS)
def _compare(S):
    """Return the angle between every lane's two attitudes, and the heading's turn since the last sample."""
    whole_vectors()
    opened = 0
    for lane in range(W):
        e0, ed, ej, ek, S[SIZE + lane] = attitude.land(
            (S[MD + lane], S[MJ + lane], S[MK + lane]), (S[R0 + lane], S[RD + lane], S[RJ + lane], S[RK + lane])
        )
        f, d = S[TURNED + lane], S[AXIS + lane]
        ea, eb, ec = attitude.by_axis(d, f * ed, ej, f * ek)
        a, b, c = S[A + lane], S[B + lane], S[C + lane]
        q0, qa, qb, qc = S[Q0 + lane], S[QA + lane], S[QB + lane], S[QC + lane]
        u = q0 * ea - e0 * qa - (qb * ec - qc * eb)
        v = q0 * eb - e0 * qb - (qc * ea - qa * ec)
        w = q0 * ec - e0 * qc - (qa * eb - qb * ea)
        apart = u * u + v * v + w * w
        across = b * b + c * c
        inside = (S[OPEN + lane] > 0.0) & (across <= measure.WINDOW * measure.WINDOW * S[START + lane])
        S[OPEN + lane] = 1.0 if inside else 0.0
        fresh = S[USED + lane] == 0.0
        S[USED + lane] += 1.0 if inside else 0.0
        S[APART + lane] = apart if inside & (not (apart <= S[APART + lane])) else S[APART + lane]
        sign = 1.0 if S[MA + lane] > 0.0 else -1.0
        x, y = attitude.heading(
            (q0, qa * sign, qb, qc * sign),
            (S[NA + lane], S[NB + lane], S[NC + lane]),
            (S[MA + lane] * a, S[MB + lane] * b, S[MC + lane] * c),
        )
        x0, y0 = S[ZR + lane], S[ZI + lane]
        sine, cosine = x0 * y - y0 * x, x0 * x + y0 * y
        t = sine / (cosine + math.sqrt(sine * sine + cosine * cosine))
        turned = 4.0 * arctangent(t)
        first = turned if fresh else S[FIRST + lane]
        S[PSI + lane] += turned - first if inside else 0.0
        S[FIRST + lane] = first
        S[ZR + lane], S[ZI + lane] = x, y
        opened |= 1 if inside else 0
    return opened > 0


@njit(**INNER)
def _seen_from_the_axis(points, i):
    """Return moments of point i as (a, b, c), in a unit near the greatest, and its angular velocity over its spin."""
    Ia, Ib, Ic = rigid_body.relabel(points.I1[i], points.I2[i], points.I3[i], points.axis[i])
    unit, epsilon, phase = solution.unit_of(Ia, Ib, Ic), points.epsilon[i], points.phase[i]
    spin = 1.0 if points.omega0[i] > 0.0 else -1.0
    return (Ia / unit, Ib / unit, Ic / unit), (spin, epsilon * math.cos(phase), epsilon * math.sin(phase))


@njit(nogil=True, **OPTIONS)
def fill(points, run, out):
    """Fill the columns of IN_SPACE, (5, n): rad, rad s-1 (three), rad; NaN where missing.

    ``run``: radians of spin between samples, number of intervals, and the error allowed, rad.
    """
    whole_vectors()
    omega0, epsilon = points.omega0, points.epsilon
    spacing, intervals, tolerance = run
    n = omega0.size
    steps, spacings = np.empty(n, dtype=np.int64), np.empty(n)
    for i in range(n):
        moments, _ = _seen_from_the_axis(points, i)
        ca, cb, cc = rigid_body.euler_coefficients(*moments)
        bound = max(1.0, abs(ca), abs(cb), abs(cc))
        spacings[i] = min(spacing, 0.5 / bound)
        x = bound * spacings[i] * math.sqrt(1.0 + epsilon[i] * epsilon[i])
        size = min(1.0, measure.WINDOW * epsilon[i] * math.exp(0.5))
        steps[i] = steps_of(x, size, intervals, tolerance)
    order, starts = cut(steps, 1)
    S = scratch(ROWS)
    for block in range(starts.size - 1):
        first, count = starts[block], starts[block + 1] - starts[block]
        number = steps[order[first]]
        for lane in range(W):
            i = order[first + min(lane, count - 1)]
            moments, omega = _seen_from_the_axis(points, i)
            _load(S, lane, moments, omega, spacings[i], number)
        for _ in range(intervals):
            _advance(S, number)
            _advance_exact(S)
            if not _compare(S):
                break
        for lane in range(count):
            i = order[first + lane]
            _unload(S, lane, abs(omega0[i]), out, i)
            moments, omega = _seen_from_the_axis(points, i)
            period, rate, sigma = tumbling.periods(*moments, *omega)
            if solution.constants(*moments, *omega)[5] == 1:  # of the spin axis about L
                out[3, i] = (rate + sigma * (2.0 * math.pi / period)) * abs(omega0[i])
            out[4, i] = tumbling.phase_residual(*moments, *omega)


@njit(**INNER)
def _unload(S, lane, spin, out, i):
    """Write one lane's results: the angle between both attitudes, and psi's mean rate with its error."""
    used, h = S[USED + lane], S[SPACING + lane]
    out[0, i] = 2.0 * math.sqrt(S[APART + lane])
    if used < 2.0:
        out[1, i], out[2, i] = math.nan, math.nan
        return
    out[1, i] = (S[FIRST + lane] + S[PSI + lane] / used) / h * spin
    out[2, i] = (8.0 * EPSILON + 2.0 * out[0, i] / used) / h * spin


def wandering(Ia, Ib, Ic, b, c):
    r"""Return by how much psi' and the spin change over a whole wobble, in units of the spin at the start.

    The spin w is least and greatest where one transverse component vanishes: from 2T and L², :math:`w^2 = 1 + b^2
    I_b(I_b - I_c)/[I_a(I_a - I_c)]` for the one and that with b and c exchanged for the other. As :math:`\psi' = (2T/L
    + w)/(1 + m_a)` with :math:`m_a = I_aw/L`, its values at both differ by :math:`(w_1 - w_2)(1 - 2T I_a/L^2)/[(1 +
    m_{a1})(1 + m_{a2})]`, and no mean of psi' by more. The wobble is linear in the clock of w, so that its frequency is
    that of zero amplitude times a mean of w, which lies between w_1 and w_2.

    Moments are in any unit, the spin's first; b and c the transverse angular velocity at the start, in units of the
    spin. The difference of the extremes of psi' and the largest distance of w from 1 are NaN where the axis is not
    encircled.
    """
    with np.errstate(all="ignore"):
        Ib, Ic, gap_b, gap_c, gap = Ib / Ia, Ic / Ia, (Ib - Ia) / Ia, (Ic - Ia) / Ia, (Ib - Ic) / Ia
        more = np.stack([-b * b * Ib * gap / gap_c, c * c * Ic * gap / gap_b])
        w = np.sqrt(1.0 + more)
        L2 = 1.0 + (Ib * b) ** 2 + (Ic * c) ** 2
        change = more / (1.0 + w)
        share = np.abs(Ib * gap_b * b * b + Ic * gap_c * c * c) / L2
        spread = np.abs(change[0] - change[1]) * share / np.prod(1.0 + w / np.sqrt(L2), axis=0)
        return spread, np.where(np.all(w > 0.0, axis=0), np.abs(change).max(axis=0), np.nan)


def survey(points, rotations, samples_per_rotation, tolerance):
    """Return the columns of IN_SPACE of points, in units; arguments as for :func:`kernels.survey.measured`.

    The tolerance is of the attitude, rad. Columns, shape (n,): attitude_error (rad), psi_rate, psi_rate_error,
    space_rate_exact (rad s-1), geometric_phase_residual (rad).
    """
    points = rigid_body.points_of(points)
    out = np.full((len(IN_SPACE), points.I1.size), np.nan)
    if points.I1.size:
        intervals = round(rotations * samples_per_rotation)
        fill(points, (2.0 * np.pi / samples_per_rotation, intervals, tolerance), out)
    return dict(zip(IN_SPACE, out, strict=True))
