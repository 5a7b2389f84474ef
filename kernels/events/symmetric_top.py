r"""The free symmetric top (I1 = I2): precession of omega and L about the figure axis, measured and in closed form.

*Equations.* With the figure axis as axis 3, :math:`r = I_3/I_1` and :math:`\Omega = \omega_3 (I_3 - I_1)/I_1 =
(r - 1)\,\omega_3`, Euler's equations become linear,

.. math:: \dot\omega_3 = 0, \qquad \dot\omega_1 = -\Omega\,\omega_2, \qquad \dot\omega_2 = \Omega\,\omega_1

so the transverse part turns uniformly about the figure axis, from axis 1 towards axis 2 where Omega > 0, with the
period :math:`T = 2\pi/|\Omega|`, whatever its size. As L1 = I1 omega1, L2 = I1 omega2 and L3 = I3 omega3, L turns with
it: L, omega and the figure axis remain in one plane. With theta and gamma the angles of omega and L to the figure axis,

.. math:: \tan\gamma = \frac{I_1\omega_\perp}{I_3\omega_3} = \frac{\tan\theta}{r}, \qquad
          \tan|\theta - \gamma| = \frac{|r - 1|\tan\theta}{r + \tan^2\theta}.

omega lies on two fixed cones: the body cone about the figure axis, of half-angle theta, and the space cone about L
(which is fixed in space), of half-angle |theta - gamma|. Seen from the body, L lies on a cone of half-angle gamma.

*Measuring.* Two motions are integrated, each by the direct integrator (:func:`kernels.free.taylor.step_10`): omega by
Euler's equations, and L by its own, :math:`\dot L_a = (1/I_c - 1/I_b) L_b L_c` and cyclic. The integrator knows
nothing of the above. In units of |omega3| and of I1 |omega3|, time in radians of spin, every spin rate takes the same
work and gives the same bits. From sample to sample the transverse part turns by :math:`\delta_k`, with
:math:`\tan(\delta_k/2) = (x_{k-1}\times x_k)/(x_{k-1}\cdot x_k + |x_{k-1}||x_k|)`; the rate is the least-squares
slope of the angle :math:`\theta_k = \sum\delta` against time, its standard error the scatter about the line. Sums are
taken of :math:`\theta_k - k\delta_1`, which keeps the digits of slow precession, and the spacing obeys :math:`\max(1,
|r - 1|)\,h \le 1/2`, so no turn exceeds half a radian. Neither looks at Omega.

*Resolution.* Each step rounds the state by half a unit in the last place, so turning below
:math:`2\epsilon/h_\text{step}` radians per radian of spin can be rounding alone: it is reported as none.

*Certificate.* ``propagation_error`` is the largest distance of the integrated omega from the uniform rotation
:math:`x_k = x_0 - (1 - \cos k\Omega h)\,x_0 + \sin k\Omega h\,\hat e_3\times x_0`, relative to the transverse size.
Both factors go from sample to sample by their addition theorems, from sines made here, and share nothing with the
integrator. They stay as small as the turn is: a slow rotation is right to one rounding however many samples it has.

Source: Landau and Lifshitz, Mechanics, section 36 (problem 1 and equation 36.7) and section 33 for the cones; signs
derived above. Not validated: I3/I1 beyond 1e-150 to 1e150, half-angles below 1e-100 degrees.
"""

import math
from typing import NamedTuple

import numpy as np

from kernels.compile.blocks import W, cut
from kernels.compile.columns import arrays, numbers
from kernels.compile.jit import INLINE, INNER, OPTIONS, njit
from kernels.estimator.statuses import NON_FINITE, NOT_CONVERGED, OK
from kernels.free import rigid_body, taylor, triangle
from kernels.free.sincos import arctangent

UNDETERMINED, NONE, WITH_SPIN, AGAINST_SPIN = range(-1, 3)

VARIABLES = ("ratio", "omega3", "half_angle")  # The coordinates of a point: I3/I1, rad s-1, degrees.
EPSILON = float(np.finfo(np.float64).eps)
PHASE = 0.6  # rad from axis 1 to the transverse part at the start; by symmetry no result depends on it
ORDER = 10  # order of the integrator's step, taylor.step_10
FACTORIAL = float(math.factorial(ORDER + 1))
MAX_STEPS = 10_000  # A sample interval is cut into no more steps.

_MOTION = (  # rows of one motion, each W long
    # state, coefficients times the step, the sample before
    *("a", "b", "c", "ka", "kb", "kc", "previous_b", "previous_c"),
    # the first turn, the sum of the differences of turns from it, and that sum's sums
    *("first_turn", "y", "sum_y", "sum_xy", "sum_yy"),
    # sums of the angles by which the motion is ahead of the exact rotation, and of their squares
    *("sum_ahead", "sum_ahead2"),
)
_JOINT = (  # rows of both motions together
    # the transverse part at the start, and 1 - cos and sin of the turn of one sample and of all so far
    *("initial_b", "initial_c", "versine", "sine", "total_versine", "total_sine"),
    # largest distance, invariants at the start and their largest changes, coplanarity
    *("distance", "energy", "energy_drift", "momentum2", "momentum2_drift", "out_of_plane"),
    # extremes of the squared tangents of the three angles
    *("min_body", "max_body", "min_momentum", "max_momentum", "min_space", "max_space"),
)
MOMENTUM_ROWS = W * len(_MOTION)  # index of the first row of L; the rows of omega precede it
row = numbers((*_MOTION, *(f"momentum_{name}" for name in _MOTION), *_JOINT), width=W)

# Columns of the raw result, one row a point, dimensionless or rad.
RAW = numbers(
    (
        *("rate", "stderr", "momentum_rate", "momentum_stderr", "floor", "distance", "energy_drift", "momentum_drift"),
        *("coplanarity", "body", "body_spread", "momentum", "space", "steps", "ahead", "momentum_ahead"),
    )
)


def precession_rate(ratio, omega3):
    """Return Omega = (I3/I1 - 1) omega3, at which omega and L turn about the figure axis in the body frame.

    In rad s-1, as omega3 is: positive from axis 1 towards axis 2 (Landau and Lifshitz, Mechanics, equation 36.7). The
    ratio is I3/I1; both are broadcast.
    """
    return (np.asarray(ratio) - 1.0) * np.asarray(omega3)


def cones(ratio, half_angle):
    """Return the half-angles of the cone of L about the figure axis and of the space cone (omega about L), rad.

    arctan(tan(theta)/r) and arctan(|r - 1| tan(theta)/(r + tan(theta)^2)), of r = I3/I1 > 0 and of theta, that of the
    body cone, between 0 and pi/2; both are broadcast.
    """
    ratio, tangent = np.asarray(ratio), np.tan(half_angle)
    space = np.abs(ratio - 1.0) * (tangent / (ratio + tangent * tangent))
    return np.arctan(tangent / ratio), np.arctan(space)


@njit(**INLINE)
def angle_between(b1, c1, b, c):
    """Return the angle from (b1, c1) to (b, c), rad, at most 1/2, in plain arithmetic so that lanes stay packed.

    With t = tan(delta/2), delta = 2 arctan t. The cross product is formed from the difference of both vectors, so the
    angle between equal vectors is exactly 0.

    Args:
        `b1`, `c1`, `b`, `c` (float): Components of both vectors in a common unit.
    """
    cross = b1 * (c - c1) - c1 * (b - b1)
    sizes = math.sqrt(b1 * b1 + c1 * c1) * math.sqrt(b * b + c * c)
    t = cross / (b1 * b + c1 * c + sizes)
    return 2.0 * arctangent(t)


@njit(**OPTIONS)
def steps_per_sample(x, samples, tolerance):
    """Return the number of steps in a sample interval, at most MAX_STEPS.

    The equations are linear (c_3 = 0), so the first omitted term is x^11/11! of the transverse part at any amplitude.

    Args:
        `x` (float): |r - 1| times the spacing in radians of spin.
        samples (int): Sample intervals of the run.
        tolerance (float): Relative error allowed over the run.
    """
    excess = 1.05 * samples * x ** (ORDER + 1) / FACTORIAL / tolerance
    return 1 if not excess > 1.0 else int(min(math.ceil(excess ** (1.0 / ORDER)), MAX_STEPS))


class Tops(NamedTuple):
    """Points of a run, one array each."""

    ratio: np.ndarray  #: I3/I1
    spin: np.ndarray  #: omega3; only its sign is used
    tangent: np.ndarray  #: tangent of the half-angle
    spacing: np.ndarray  #: spacing of samples, radians of spin
    steps: np.ndarray  #: steps per sample interval


@njit(**OPTIONS)
def _plan(tops, spacing, intervals, tolerance):
    """Set sample spacing and steps per sample of each point, from a bound on every possible rate."""
    for i in range(tops.ratio.size):
        bound = abs(tops.ratio[i] - 1.0)
        tops.spacing[i] = min(spacing, 0.5 / max(1.0, bound))
        tops.steps[i] = steps_per_sample(bound * tops.spacing[i], intervals, tolerance)


@njit(**INNER)
def _load_lane(S, lane, tops, i, steps):
    """Set up one lane at the start of point i: omega in units of |omega3|, L in units of I1 |omega3|."""
    ratio, tangent, spacing = tops.ratio[i], tops.tangent[i], tops.spacing[i]
    spin_sign = 1.0 if tops.spin[i] > 0.0 else -1.0
    h = spacing / steps
    ca, cb, cc = rigid_body.euler_coefficients(ratio, 1.0, 1.0)
    across_b, across_c = tangent * math.cos(PHASE), tangent * math.sin(PHASE)
    S[row.a + lane], S[row.b + lane], S[row.c + lane] = spin_sign, across_b, across_c
    S[row.ka + lane], S[row.kb + lane], S[row.kc + lane] = ca * h, cb * h, cc * h
    L = S[MOMENTUM_ROWS:]
    L[row.a + lane], L[row.b + lane], L[row.c + lane] = ratio * spin_sign, S[row.b + lane], S[row.c + lane]
    # 1/I_c - 1/I_b = -(I_c - I_b)/(I_b I_c), the difference before the ratio
    L[row.ka + lane], L[row.kb + lane], L[row.kc + lane] = 0.0, (1.0 - ratio) / ratio * h, (ratio - 1.0) / ratio * h
    angle = (ratio - 1.0) * spin_sign * spacing
    half = math.sin(0.5 * angle)
    S[row.versine + lane], S[row.sine + lane] = 2.0 * half * half, math.sin(angle)
    S[row.initial_b + lane], S[row.initial_c + lane] = S[row.b + lane], S[row.c + lane]


@njit(**INNER)
def _start_sums(S):
    """Take sample 0: clear the sums, note invariants and angles at the start."""
    S[row.total_versine : row.min_body] = 0.0
    for motion in (0, MOMENTUM_ROWS):
        M = S[motion:]
        M[row.first_turn : MOMENTUM_ROWS] = 0.0
        for lane in range(W):
            M[row.previous_b + lane], M[row.previous_c + lane] = M[row.b + lane], M[row.c + lane]
    for lane in range(W):
        a, b, c = S[row.a + lane], S[row.b + lane], S[row.c + lane]
        p, q, r = S[row.momentum_a + lane], S[row.momentum_b + lane], S[row.momentum_c + lane]
        S[row.energy + lane] = p * a + (q * b + r * c)
        S[row.momentum2 + lane] = p * p + (q * q + r * r)
        body, momentum, space = _tangents(a, b, c, p, q, r)
        S[row.min_body + lane], S[row.max_body + lane] = body, body
        S[row.min_momentum + lane], S[row.max_momentum + lane] = momentum, momentum
        S[row.min_space + lane], S[row.max_space + lane] = space, space


@njit(**INLINE)
def _tangents(a, b, c, p, q, r):
    """Return squared tangents of the angles of omega and L to the figure axis, and of that between them."""
    along = p * a + (q * b + r * c)
    x, y, z = (q * c - r * b) / along, (r * a - p * c) / along, (p * b - q * a) / along
    return (b * b + c * c) / (a * a), (q / p) * (q / p) + (r / p) * (r / p), x * x + (y * y + z * z)


@njit(**INNER)
def _advance(M, steps):
    """Take steps of a motion in every lane, over one sample interval."""
    for _ in range(steps):
        for lane in range(W):
            M[row.a + lane], M[row.b + lane], M[row.c + lane] = taylor.step_10(
                M[row.a + lane], M[row.b + lane], M[row.c + lane], M[row.ka + lane], M[row.kb + lane], M[row.kc + lane]
            )


@njit(**OPTIONS)
def _sample_angle(M, k, intervals):
    """Add sample k (1 to intervals) of a motion to the sums of its angle, by its number from the middle of the run."""
    x, first = k - 0.5 * intervals, k == 1
    for lane in range(W):
        b, c = M[row.b + lane], M[row.c + lane]
        delta = angle_between(M[row.previous_b + lane], M[row.previous_c + lane], b, c)
        M[row.first_turn + lane] = delta if first else M[row.first_turn + lane]
        y = M[row.y + lane] + (delta - M[row.first_turn + lane])
        M[row.y + lane] = y
        M[row.sum_y + lane] += y
        M[row.sum_xy + lane] += x * y
        M[row.sum_yy + lane] += y * y
        M[row.previous_b + lane], M[row.previous_c + lane] = b, c


@njit(**INNER)
def _sample_state(S):
    """Compare one sample of every lane with the exact rotation, with the invariants and with the cones."""
    for lane in range(W):
        a, b, c = S[row.a + lane], S[row.b + lane], S[row.c + lane]
        p, q, r = S[row.momentum_a + lane], S[row.momentum_b + lane], S[row.momentum_c + lane]
        v, s, xb, xc = S[row.versine + lane], S[row.sine + lane], S[row.initial_b + lane], S[row.initial_c + lane]
        versine, sine = S[row.total_versine + lane], S[row.total_sine + lane]
        versine, sine = versine + (v + (sine * s - versine * v)), sine + (s - (sine * v + versine * s))
        S[row.total_versine + lane], S[row.total_sine + lane] = versine, sine
        eb, ec = xb - (versine * xb + sine * xc), xc + (sine * xb - versine * xc)
        size = xb * xb + xc * xc
        db, dc = b - eb, c - ec
        distance2 = (db * db + dc * dc) / size
        S[row.distance + lane] = distance2 if not distance2 <= S[row.distance + lane] else S[row.distance + lane]
        # in units of I1 the transverse part of L is that of omega
        ahead, momentum_ahead = (eb * dc - ec * db) / size, (eb * (r - ec) - ec * (q - eb)) / size
        S[row.sum_ahead + lane] += ahead
        S[row.sum_ahead2 + lane] += ahead * ahead
        S[row.momentum_sum_ahead + lane] += momentum_ahead
        S[row.momentum_sum_ahead2 + lane] += momentum_ahead * momentum_ahead
        momentum2 = p * p + (q * q + r * r)
        E, L = abs(p * a + (q * b + r * c) - S[row.energy + lane]), abs(momentum2 - S[row.momentum2 + lane])
        S[row.energy_drift + lane] = E if not S[row.energy_drift + lane] >= E else S[row.energy_drift + lane]
        S[row.momentum2_drift + lane] = L if not S[row.momentum2_drift + lane] >= L else S[row.momentum2_drift + lane]
        triple = q * c - r * b
        out = triple * triple / momentum2 / (a * a + (b * b + c * c))
        S[row.out_of_plane + lane] = out if out > S[row.out_of_plane + lane] else S[row.out_of_plane + lane]
        body, momentum, space = _tangents(a, b, c, p, q, r)
        S[row.min_body + lane] = min(S[row.min_body + lane], body)
        S[row.max_body + lane] = max(S[row.max_body + lane], body)
        S[row.min_momentum + lane] = min(S[row.min_momentum + lane], momentum)
        S[row.max_momentum + lane] = max(S[row.max_momentum + lane], momentum)
        S[row.min_space + lane] = min(S[row.min_space + lane], space)
        S[row.max_space + lane] = max(S[row.max_space + lane], space)


@njit(**OPTIONS)
def _rate(M, lane, intervals):
    """Return a motion's rate in rad a sample, its standard error, and the spread of its lead over the exact rotation.

    The rate is the least-squares slope of first k + y_k against k = 0 … intervals, from the lane's sums. The spread,
    in rad, has sums of its own: it is the standard deviation of the angle by which a sample is ahead of the exact one.
    """
    n = intervals + 1.0
    sum_xx = n * (n * n - 1.0) / 12.0
    slope = M[row.sum_xy + lane] / sum_xx
    sum_y = M[row.sum_y + lane]
    scatter = max(M[row.sum_yy + lane] - sum_y * sum_y / n - slope * M[row.sum_xy + lane], 0.0)
    mean = M[row.sum_ahead + lane] / n
    ahead = math.sqrt(max(M[row.sum_ahead2 + lane] / n - mean * mean, 0.0))
    return M[row.first_turn + lane] + slope, math.sqrt(scatter / ((n - 2.0) * sum_xx)), ahead


@njit(**INLINE)
def _mean_angle(low, high):
    """Return mean and difference of two angles, rad, from their squared tangents."""
    smallest, greatest = math.atan(math.sqrt(low)), math.atan(math.sqrt(high))
    return 0.5 * (smallest + greatest), greatest - smallest


@njit(**INNER)
def _write_lane(S, lane, intervals, spacing, steps, result):
    """Write one lane's raw result from its sums."""
    rate, stderr, result[RAW.ahead] = _rate(S, lane, intervals)
    result[RAW.rate], result[RAW.stderr] = rate / spacing, stderr / spacing
    rate, stderr, result[RAW.momentum_ahead] = _rate(S[MOMENTUM_ROWS:], lane, intervals)
    result[RAW.momentum_rate], result[RAW.momentum_stderr] = rate / spacing, stderr / spacing
    result[RAW.floor] = 2.0 * EPSILON * steps / spacing
    result[RAW.distance] = math.sqrt(S[row.distance + lane])
    result[RAW.energy_drift] = S[row.energy_drift + lane] / S[row.energy + lane]
    result[RAW.momentum_drift] = S[row.momentum2_drift + lane] / S[row.momentum2 + lane]
    result[RAW.coplanarity] = math.sqrt(S[row.out_of_plane + lane])
    result[RAW.body], result[RAW.body_spread] = _mean_angle(S[row.min_body + lane], S[row.max_body + lane])
    result[RAW.momentum], _ = _mean_angle(S[row.min_momentum + lane], S[row.max_momentum + lane])
    result[RAW.space], _ = _mean_angle(S[row.min_space + lane], S[row.max_space + lane])
    result[RAW.steps] = steps


@njit(nogil=True, **OPTIONS)
def _run_blocks(tops, order, starts, intervals, raw):
    """Integrate and measure block after block: order[starts[j]:starts[j + 1]] are the points of block j."""
    S = np.empty(len(row) * W)
    for j in range(starts.size - 1):
        first, count = starts[j], starts[j + 1] - starts[j]
        n = tops.steps[order[first]]
        for lane in range(W):
            _load_lane(S, lane, tops, order[first + min(lane, count - 1)], n)
        _start_sums(S)
        for k in range(1, intervals + 1):
            for motion in (0, MOMENTUM_ROWS):
                _advance(S[motion:], n)
                _sample_angle(S[motion:], k, intervals)
            _sample_state(S)
        for lane, i in enumerate(order[first : first + count]):
            _write_lane(S, lane, intervals, tops.spacing[i], n, raw[i])


def run(points, rotations, samples_per_rotation, tolerance):
    """Return the raw result of points, integrated and measured: shape (n, len(RAW)), columns RAW, dimensionless or rad.

    Args:
        points (mapping of str to array_like, shape (n,)): ratio (I3/I1 > 0), omega3 (rad s-1, not 0), half_angle
            (degrees, between 0 and 90); nothing is checked and nothing raised.
        rotations (float): Length of the run, in 2 pi/|omega3|.
        samples_per_rotation (int): Samples in 2 pi/|omega3|; the spacing shrinks where max(1, |r - 1|) h would exceed
            1/2.
        tolerance (float): Error of the transverse part allowed over the run, relative to its size.
    """
    ratio, omega3, half_angle = arrays(*(points[name] for name in VARIABLES))
    intervals = round(rotations * samples_per_rotation)
    spacings, steps = np.empty(ratio.size), np.empty(ratio.size, dtype=np.int64)
    tops = Tops(ratio, omega3, np.tan(np.radians(half_angle)), spacings, steps)
    raw = np.empty((ratio.size, len(RAW)))
    if ratio.size:
        _plan(tops, 2.0 * np.pi / samples_per_rotation, intervals, tolerance)
        order, starts = cut(steps, 1)
        _run_blocks(tops, order, starts, intervals, raw)
    return raw


def _status(raw, tolerance, intervals):
    """Return the status of each row: the certificate must hold, but for the steps' rounding."""
    certified = raw[:, RAW.distance] <= tolerance + 4.0 * EPSILON * intervals * raw[:, RAW.steps]
    cases = [~np.isfinite(raw[:, RAW.rate]), ~certified]
    return np.select(cases, [NON_FINITE, NOT_CONVERGED], OK).astype(np.int8)


def _error(raw, ahead, rate, reported_rate, stderr, intervals):
    r"""Return the error of a measured rate, in units of the spin: a sum of four terms.

    Scatter, :math:`\sigma\sqrt{n/(n - 2)}` of n samples; the rounding of coefficients, :math:`4u|\Omega|` with the unit
    :math:`u = 2^{-53}`; and the effect of the certified deviation over the run's length T. If angles are ahead of the
    exact motion by :math:`e_k`, the fitted slope is off by :math:`\sum x_ke_k/\sum x_k^2`, x counted from the middle,
    and by Cauchy and Schwarz by no more than :math:`\sqrt{12}\,s/T`, s the standard deviation of e: a common angle
    changes no slope. The exact motion is itself rounded, by 0.41 u in the root mean square of an angle at most (0.6 u
    are taken), and its total rotation Φ by :math:`u\sqrt n\min(\Phi, 4)`. No estimate of the steps' rounding can
    replace e: in a slow precession many successive steps are rounded equally.

    The fourth term is the measured rate if it is reported as 0. The motion is linear at any amplitude, so a finite
    amplitude adds no error.
    """
    n, unit = intervals + 1.0, 0.5 * EPSILON
    per_sample = raw[:, RAW.floor] / (2.0 * EPSILON * raw[:, RAW.steps])
    angle = np.abs(rate) / per_sample * intervals
    exact = unit * (0.6 + math.sqrt(n) * np.minimum(angle, 4.0))
    certified = math.sqrt(12.0) * (ahead + exact) / intervals * per_sample
    scatter = stderr * math.sqrt(n / max(n - 2.0, 1.0))
    return scatter + 4.0 * unit * np.abs(rate) + certified + np.abs(rate - reported_rate)


def _period(rate):
    """Return 2 pi/|rate|; NaN where the rate is 0."""
    rate = np.abs(rate)
    return np.divide(2.0 * np.pi, rate, out=np.full_like(rate, np.nan), where=rate > 0.0)


def measured(points, rotations, samples_per_rotation, tolerance):
    """Return the measured columns of points, in units.

    Args:
        points, rotations, samples_per_rotation, tolerance: As for :func:`run`.

    Returns:
        dict of str to numpy.ndarray, shape (n,): precession_rate, momentum_precession_rate, their _stderr and _error
            (rad s-1); period (s); body_cone, momentum_cone, space_cone, half_angle_drift (degrees); coplanarity,
            energy_drift, momentum_drift, propagation_error (1); steps_per_sample (int32); sense, status (int8). NaN
            where missing.
    """
    raw = run(points, rotations, samples_per_rotation, tolerance)
    _, omega3, _ = arrays(*(points[name] for name in VARIABLES))
    spin = np.abs(omega3)
    intervals = round(rotations * samples_per_rotation)
    rates, columns = {}, {}
    for prefix, rate, stderr, ahead in (
        ("", RAW.rate, RAW.stderr, RAW.ahead),
        ("momentum_", RAW.momentum_rate, RAW.momentum_stderr, RAW.momentum_ahead),
    ):
        name, rate, stderr = f"{prefix}precession_rate", raw[:, rate], raw[:, stderr]
        is_rounding = np.abs(rate) <= np.fmax(5.0 * stderr, raw[:, RAW.floor])  # a rate below scatter and rounding is 0
        rates[prefix] = np.where(is_rounding, 0.0, rate)
        error = _error(raw, raw[:, ahead], rate, rates[prefix], stderr, intervals)
        columns |= {name: rates[prefix] * spin, f"{name}_stderr": stderr * spin, f"{name}_error": error * spin}
    rate = rates[""]
    senses = [~np.isfinite(rate), rate == 0.0, rate * np.sign(omega3) > 0.0]
    return columns | {
        "period": _period(rate) / spin,
        "sense": np.select(senses, [UNDETERMINED, NONE, WITH_SPIN], AGAINST_SPIN).astype(np.int8),
        "body_cone": np.degrees(raw[:, RAW.body]),
        "momentum_cone": np.degrees(raw[:, RAW.momentum]),
        "space_cone": np.degrees(raw[:, RAW.space]),
        "half_angle_drift": np.degrees(raw[:, RAW.body_spread]),
        **{name: raw[:, getattr(RAW, name)] for name in ("coplanarity", "energy_drift", "momentum_drift")},
        "propagation_error": raw[:, RAW.distance],
        "steps_per_sample": raw[:, RAW.steps].astype(np.int32),
        "status": _status(raw, tolerance, intervals),
    }


def theory(points):
    """Return the columns of the closed form and of the body's shape, in units, of points as for :func:`run`.

    precession_rate_theory (rad s-1), period_theory (s), momentum_cone_theory, space_cone_theory (degrees),
    triangle_margin (1), shape (int8).
    """
    ratio, omega3, half_angle = arrays(*(points[name] for name in VARIABLES))
    momentum, space = cones(ratio, np.radians(half_angle))
    equal = np.ones_like(ratio)
    return {
        "precession_rate_theory": precession_rate(ratio, omega3),
        "period_theory": _period(ratio - 1.0) / np.abs(omega3),
        "momentum_cone_theory": np.degrees(momentum),
        "space_cone_theory": np.degrees(space),
        "triangle_margin": triangle.triangle_margin(equal, equal, ratio),
        "shape": rigid_body.shape(equal, equal, ratio),
    }


def survey(points, rotations, samples_per_rotation, tolerance):
    """Return the columns of :func:`theory` and of :func:`measured`, which are independent, of points.

    Args:
        points, rotations, samples_per_rotation, tolerance: As for :func:`run`.
    """
    return theory(points) | measured(points, rotations, samples_per_rotation, tolerance)
