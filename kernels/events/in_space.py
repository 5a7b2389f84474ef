r"""Motion of a perturbed spin in space: the attitude by integration and in closed form, and rates of the spin axis.

Points are those of :mod:`kernels.near_axis.survey`; samples count until the perturbation has grown tenfold. In radians
of spin.

*Certificate.* The direct integrator carries the quaternion with the angular velocity (:mod:`kernels.free.taylor`). The
exact attitude step (:mod:`kernels.free.attitude`) is taken too, on the exact step of the angular velocity; the two
share no code. ``attitude_error`` is the largest angle between them.

*Rate in space.* The attitude is the shortest arc from L to the spin axis and a rotation by psi about it. The axis of a
stable spin revolves about L at the mean rate :math:`\langle\psi'\rangle \pm \Omega`: plus about the axis of greatest
moment, minus about that of least. The mean of psi' is that of the samples, the frequency of the wobble in the body that
of the survey. If a run is shorter than the wobble, :func:`rate_variation` bounds the change over a whole wobble.

*Second check.* ``geometric_phase_residual`` is the distance of psi's growth over one polhode period, by the elliptic
integral, from its value by Montgomery's theorem, from energy, period and a solid angle
(:mod:`kernels.events.tumbling`).
"""

import math

import numpy as np

from kernels.compile import columns
from kernels.compile.blocks import W, cut, scratch
from kernels.compile.jit import INNER, OPTIONS, njit
from kernels.estimator import measure
from kernels.events import tumbling
from kernels.free import attitude, direct, elliptic_constants, exact, rigid_body
from kernels.free.sincos import arctangent
from kernels.free.taylor import turn_12

IN_SPACE = ("attitude_error", "psi_rate", "psi_rate_error", "space_rate_exact", "geometric_phase_residual")
EPSILON = float(np.finfo(np.float64).eps)

_NAMES = (  # rows of the scratch array, W long each
    # the direct state: angular velocity, quaternion, steps
    *("a", "b", "c", "q0", "qa", "qb", "qc", "ka", "kb", "kc", "half_step"),
    # the exact state, by (d, j, k): direction of L, its step, the unfinished quaternion with its factor, and constants
    *("m_d", "m_j", "m_k", "step_d", "step_j", "step_k", "r0", "r_d", "r_j", "r_k", "scale"),
    *("ex_0", "ex_d", "ex_dd", "ex_jk", "ey_0", "ey_d", "ey_dd", "ey_jk", "axis", "side"),
    # moments over L, the direction of L and the squared perturbation at the start, window and results
    *("Ia", "Ib", "Ic", "n_a", "n_b", "n_c", "initial_size", "in_window", "distance", "samples"),
    # psi/2 as a direction, psi's growth in the first interval, and the sum of later growths less the first
    *("heading_x", "heading_y", "first_turn", "psi", "spacing"),
)
row = columns.numbers(_NAMES, width=W)


@njit(**OPTIONS)
def steps_per_sample(x, size, intervals, tolerance):
    """Return the steps of order 12 in a sample interval.

    Args:
        `x` (float): Length of the interval, rad at the largest rate.
        size (float): Largest size of the perturbation in the run, relative to the spin.
        intervals (int): Sample intervals of the run.
        tolerance (float): Error of the attitude allowed, rad; a tenth of it is given to the steps.
    """
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
    S[row.a + lane], S[row.b + lane], S[row.c + lane] = a, b, c
    S[row.q0 + lane], S[row.qa + lane], S[row.qb + lane], S[row.qc + lane] = 1.0, 0.0, 0.0, 0.0
    S[row.ka + lane], S[row.kb + lane], S[row.kc + lane] = ca * step, cb * step, cc * step
    S[row.half_step + lane] = 0.5 * step
    d, side, g, x, y = attitude.short_step_constants(moments, omega, h)
    q = rigid_body.relabel(*exact.short_step_constants(moments, omega, h), d)
    w_d, w_j, w_k = rigid_body.relabel(a, b, c, d)
    m = g[0] * (side * w_d), g[1] * w_j, g[2] * (side * w_k)
    r = attitude.partial_attitude(m, 1.0, 0.0)
    S[row.axis + lane], S[row.side + lane], S[row.scale + lane] = d, side, 0.5
    S[row.step_d + lane], S[row.step_j + lane], S[row.step_k + lane] = attitude.direction_coefficients(q, g)
    S[row.m_d + lane], S[row.m_j + lane], S[row.m_k + lane] = m
    S[row.r0 + lane], S[row.r_d + lane], S[row.r_j + lane], S[row.r_k + lane] = r
    S[row.ex_0 + lane], S[row.ex_d + lane], S[row.ex_dd + lane], S[row.ex_jk + lane] = x
    S[row.ey_0 + lane], S[row.ey_d + lane], S[row.ey_dd + lane], S[row.ey_jk + lane] = y
    L = math.sqrt((Ia * a) ** 2 + (Ib * b) ** 2 + (Ic * c) ** 2)
    # seen from the end of the spin axis on the side of L: for a negative spin, after half a turn about b
    Ia, Ib, Ic = Ia / L * a, Ib / L, Ic / L * a
    S[row.Ia + lane], S[row.Ib + lane], S[row.Ic + lane] = Ia, Ib, Ic
    S[row.n_a + lane], S[row.n_b + lane], S[row.n_c + lane] = Ia * a, Ib * b, Ic * c
    S[row.initial_size + lane], S[row.in_window + lane], S[row.spacing + lane] = b * b + c * c, 1.0, h
    S[row.samples + lane], S[row.distance + lane], S[row.psi + lane] = 0.0, 0.0, 0.0
    S[row.heading_x + lane], S[row.heading_y + lane], S[row.first_turn + lane] = 1.0, 0.0, 0.0


@njit(**OPTIONS)
def _advance(S, steps):
    """Take the direct steps of one sample interval."""
    for _ in range(steps):
        for lane in range(W):
            a, b, c, w, x, y, z = turn_12(
                *(S[row.a + lane], S[row.b + lane], S[row.c + lane]),
                *(S[row.q0 + lane], S[row.qa + lane], S[row.qb + lane], S[row.qc + lane]),
                *(S[row.ka + lane], S[row.kb + lane], S[row.kc + lane], S[row.half_step + lane]),
            )
            S[row.a + lane], S[row.b + lane], S[row.c + lane] = a, b, c
            S[row.q0 + lane], S[row.qa + lane], S[row.qb + lane], S[row.qc + lane] = w, x, y, z


@njit(**OPTIONS)
def _advance_exact(S):
    """Take one exact step of every lane; :func:`_compare` completes it, so that both loops stay short."""
    for lane in range(W):
        m_d, m_j, m_k = S[row.m_d + lane], S[row.m_j + lane], S[row.m_k + lane]
        r0, rd, rj, rk = attitude.step_attitude(
            (m_d, m_j, m_k),
            (S[row.r0 + lane], S[row.r_d + lane], S[row.r_j + lane], S[row.r_k + lane]),
            S[row.scale + lane],
            (S[row.ex_0 + lane], S[row.ex_d + lane], S[row.ex_dd + lane], S[row.ex_jk + lane]),
            (S[row.ey_0 + lane], S[row.ey_d + lane], S[row.ey_dd + lane], S[row.ey_jk + lane]),
        )
        S[row.r0 + lane], S[row.r_d + lane], S[row.r_j + lane], S[row.r_k + lane] = r0, rd, rj, rk
        S[row.m_d + lane], S[row.m_j + lane], S[row.m_k + lane] = exact.step(
            m_d, m_j, m_k, S[row.step_d + lane], S[row.step_j + lane], S[row.step_k + lane]
        )


@njit(**OPTIONS)
def _compare_attitudes(S):
    """Add the angle between both attitudes and the growth of psi of every lane; return True if a window is open."""
    is_open = 0
    for lane in range(W):
        e0, ed, ej, ek, S[row.scale + lane] = attitude.complete_attitude(
            (S[row.m_d + lane], S[row.m_j + lane], S[row.m_k + lane]),
            (S[row.r0 + lane], S[row.r_d + lane], S[row.r_j + lane], S[row.r_k + lane]),
        )
        f, d = S[row.side + lane], S[row.axis + lane]
        ea, eb, ec = attitude.by_cyclic_axes(d, f * ed, ej, f * ek)
        a, b, c = S[row.a + lane], S[row.b + lane], S[row.c + lane]
        q0, qa, qb, qc = S[row.q0 + lane], S[row.qa + lane], S[row.qb + lane], S[row.qc + lane]
        u = q0 * ea - e0 * qa - (qb * ec - qc * eb)
        v = q0 * eb - e0 * qb - (qc * ea - qa * ec)
        w = q0 * ec - e0 * qc - (qa * eb - qb * ea)
        angle2 = u * u + v * v + w * w
        transverse2 = b * b + c * c
        limit = measure.MAX_GROWTH * measure.MAX_GROWTH * S[row.initial_size + lane]
        inside = (S[row.in_window + lane] > 0.0) & (transverse2 <= limit)
        S[row.in_window + lane] = 1.0 if inside else 0.0
        is_first = S[row.samples + lane] == 0.0
        S[row.samples + lane] += 1.0 if inside else 0.0
        S[row.distance + lane] = angle2 if inside & (not (angle2 <= S[row.distance + lane])) else S[row.distance + lane]
        sign = 1.0 if S[row.Ia + lane] > 0.0 else -1.0
        x, y = attitude.heading(
            (q0, qa * sign, qb, qc * sign),
            (S[row.n_a + lane], S[row.n_b + lane], S[row.n_c + lane]),
            (S[row.Ia + lane] * a, S[row.Ib + lane] * b, S[row.Ic + lane] * c),
        )
        x0, y0 = S[row.heading_x + lane], S[row.heading_y + lane]
        sine, cosine = x0 * y - y0 * x, x0 * x + y0 * y
        t = sine / (cosine + math.sqrt(sine * sine + cosine * cosine))
        turn_angle = 4.0 * arctangent(t)
        first = turn_angle if is_first else S[row.first_turn + lane]
        S[row.psi + lane] += turn_angle - first if inside else 0.0
        S[row.first_turn + lane] = first
        S[row.heading_x + lane], S[row.heading_y + lane] = x, y
        is_open |= 1 if inside else 0
    return is_open > 0


@njit(**INNER)
def _moments_and_omega(points, i):
    """Return moments of point i as (a, b, c), in a unit near the greatest, and its angular velocity over its spin."""
    Ia, Ib, Ic = rigid_body.relabel(points.I1[i], points.I2[i], points.I3[i], points.axis[i])
    unit, epsilon, phase = elliptic_constants.unit_of(Ia, Ib, Ic), points.epsilon[i], points.phase[i]
    spin = 1.0 if points.omega0[i] > 0.0 else -1.0
    return (Ia / unit, Ib / unit, Ic / unit), (spin, epsilon * math.cos(phase), epsilon * math.sin(phase))


@njit(nogil=True, **OPTIONS)
def fill_columns(points, run, out):
    """Fill the columns of IN_SPACE.

    Args:
        points (kernels.free.rigid_body.Spins): Points of n spins.
        run (tuple): Radians of spin between samples, number of intervals, and the error allowed, rad.
        out (numpy.ndarray, shape (5, n)): Written: rad, rad s-1 (three), rad; NaN if missing.
    """
    omega0, epsilon = points.omega0, points.epsilon
    spacing, intervals, tolerance = run
    n = omega0.size
    steps, spacings = np.empty(n, dtype=np.int64), np.empty(n)
    for i in range(n):
        moments, _ = _moments_and_omega(points, i)
        ca, cb, cc = rigid_body.euler_coefficients(*moments)
        bound = max(1.0, abs(ca), abs(cb), abs(cc))
        spacings[i] = min(spacing, 0.5 / bound)
        x = bound * spacings[i] * math.sqrt(1.0 + epsilon[i] * epsilon[i])
        size = min(1.0, measure.MAX_GROWTH * epsilon[i] * math.exp(0.5))
        steps[i] = steps_per_sample(x, size, intervals, tolerance)
    order, starts = cut(steps, 1)
    S = scratch(len(_NAMES))
    for block in range(starts.size - 1):
        first, count = starts[block], starts[block + 1] - starts[block]
        number = steps[order[first]]
        for lane in range(W):
            i = order[first + min(lane, count - 1)]
            moments, omega = _moments_and_omega(points, i)
            _load(S, lane, moments, omega, spacings[i], number)
        for _ in range(intervals):
            _advance(S, number)
            _advance_exact(S)
            if not _compare_attitudes(S):
                break
        for lane in range(count):
            i = order[first + lane]
            _unload(S, lane, abs(omega0[i]), out, i)
            moments, omega = _moments_and_omega(points, i)
            period, rate, sigma = tumbling.periods(*moments, *omega)
            if elliptic_constants.constants(*moments, *omega)[5] == 1:  # the mean precession is that of the spin axis
                out[3, i] = (rate + sigma * (2.0 * math.pi / period)) * abs(omega0[i])
            out[4, i] = tumbling.phase_residual(*moments, *omega)


@njit(**INNER)
def _unload(S, lane, spin, out, i):
    """Write one lane's results: the angle between both attitudes, and psi's mean rate with its error."""
    samples, h = S[row.samples + lane], S[row.spacing + lane]
    out[0, i] = 2.0 * math.sqrt(S[row.distance + lane])
    if samples < 2.0:
        out[1, i], out[2, i] = math.nan, math.nan
        return
    out[1, i] = (S[row.first_turn + lane] + S[row.psi + lane] / samples) / h * spin
    out[2, i] = (8.0 * EPSILON + 2.0 * out[0, i] / samples) / h * spin


def rate_variation(Ia, Ib, Ic, b, c):
    r"""Return the changes of psi' and of the spin over a whole wobble, in units of the spin at the start.

    The spin w is least and greatest where one transverse component vanishes: from 2T and L², :math:`w^2 = 1 + b^2
    I_b(I_b - I_c)/[I_a(I_a - I_c)]` if b does, and with b and c exchanged if c does. As :math:`\psi' = (2T/L
    + w)/(1 + m_a)` with :math:`m_a = I_aw/L`, its values at both differ by :math:`(w_1 - w_2)(1 - 2T I_a/L^2)/[(1 +
    m_{a1})(1 + m_{a2})]`, and no mean of psi' by more. The wobble is linear in the clock of w, so that its frequency is
    that of zero amplitude times a mean of w, which lies between w_1 and w_2.

    Args:
        Ia, Ib, `Ic` (numpy.ndarray, shape (n,)): Moments in any unit, the spin axis first.
        `b`, `c` (numpy.ndarray, shape (n,)): Transverse angular velocity at the start, in units of the spin.

    Returns:
        tuple of 2 numpy.ndarray, shape (n,): The difference of the extremes of psi', and the largest distance of w from
            1; NaN if the axis is not encircled.
    """
    with np.errstate(all="ignore"):
        Ib, Ic, gap_b, gap_c, gap = Ib / Ia, Ic / Ia, (Ib - Ia) / Ia, (Ic - Ia) / Ia, (Ib - Ic) / Ia
        excess = np.stack([-b * b * Ib * gap / gap_c, c * c * Ic * gap / gap_b])
        w = np.sqrt(1.0 + excess)
        L2 = 1.0 + (Ib * b) ** 2 + (Ic * c) ** 2
        change = excess / (1.0 + w)
        share = np.abs(Ib * gap_b * b * b + Ic * gap_c * c * c) / L2
        spread = np.abs(change[0] - change[1]) * share / np.prod(1.0 + w / np.sqrt(L2), axis=0)
        return spread, np.where(np.all(w > 0.0, axis=0), np.abs(change).max(axis=0), np.nan)


def survey(points, rotations, samples_per_rotation, tolerance):
    """Return the columns of IN_SPACE, in units.

    Args:
        points, rotations, samples_per_rotation: As in :func:`kernels.near_axis.survey.measure_points`.
        tolerance (float): Error of the attitude allowed, rad.

    Returns:
        dict of str to numpy.ndarray, shape (n,): attitude_error (rad), psi_rate, psi_rate_error, space_rate_exact
            (rad s-1), geometric_phase_residual (rad).
    """
    points = rigid_body.points_of(points)
    out = np.full((len(IN_SPACE), points.I1.size), np.nan)
    if points.I1.size:
        intervals = round(rotations * samples_per_rotation)
        fill_columns(points, (2.0 * np.pi / samples_per_rotation, intervals, tolerance), out)
    return dict(zip(IN_SPACE, out, strict=True))
