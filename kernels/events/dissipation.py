r"""Free bodies that lose energy at constant angular momentum, followed from near the least to near the greatest axis.

The double bracket :math:`\dot{\mathbf L} = \mathbf L\times\omega + \alpha\,\mathbf L\times(\mathbf L\times\omega)`
keeps |L|; the energy falls. With :math:`(x, y, z) = \mathbf L/|L|` along the axes of ascending moments, the loss
:math:`q = \alpha|L|`, :math:`\tau = |L|(1/I_1 - 1/I_3)\,t` and :math:`N = x^2 + y^2 + z^2 = 1`,

.. math:: \dot x = q(e - N)x - r\,yz,\quad \dot y = q(e - rN)y + zx,\quad \dot z = q\,e\,z - s\,xy,
          \qquad e = x^2 + r y^2,\quad r = \frac{1/I_2 - 1/I_3}{1/I_1 - 1/I_3},\quad s = 1 - r

e is the energy above that of a spin about axis 3. On the separatrix e = r; below it z keeps its sign, the final sense
of spin. The motion settles where :math:`e = r\sin^2\theta`: from then on L stays within theta of axis 3.

*Steps* are Taylor steps of order 12. A first run has longer steps than the second: each error is three times the
difference of both, and the effect of rounding, which grows near a spin about axis 2 with one over the speed there. A
sense is determined if z on the separatrix exceeds its error: starts displaced by the error to either side end alike.

Source: Bloch, Krishnaprasad, Marsden and Ratiu, Communications in Mathematical Physics 175 (1996) 1, for the bracket.
"""

import math

import numpy as np

from kernels.compile import columns
from kernels.compile.jit import INNER, OPTIONS, njit
from kernels.compile.llvm_formulas import formula, parse_formula
from kernels.events import follower
from kernels.free.taylor import convolution, sum_terms

EPSILON = float(np.finfo(np.float64).eps)
MAX_STEPS = 5_000_000  # A run that takes more steps ends without a result; it has taken a second or two.
STEPS_TO_SETTLE = 1000.0  # The steps' error stays below the tolerance over so many of them, a typical number.
ORDER = 12
NAMES = ("crossing_time", "settling_time", "z_crossing")


def _step_lines() -> str:
    """Return the text of a step: the terms of e, x, y and z in turn, then the return of the new state."""
    lines = ["N = x0 * x0 + y0 * y0 + z0 * z0"]
    for n in range(ORDER):

        def product(u, v, n=n):
            return f"({convolution((('+', u, v),), n).removeprefix(' + ')})"

        lines += [
            f"e{n} = {product('x', 'x')} + r * {product('y', 'y')}",
            f"x{n + 1} = h * R{n + 1} * (q * ({product('e', 'x')} - N * x{n}) - r * {product('y', 'z')})",
            f"y{n + 1} = h * R{n + 1} * (q * ({product('e', 'y')} - N * r * y{n}) + {product('z', 'x')})",
            f"z{n + 1} = h * R{n + 1} * (q * {product('e', 'z')} - s * {product('x', 'y')})",
        ]
    sums = (sum_terms([f"{x}{n}" for n in range(ORDER + 1)]) for x in "xyz")
    return "\n".join([*lines, f"return {', '.join(sums)}"])


_INVERSES = {f"R{n}": 1.0 / n for n in range(1, ORDER + 1)}
step_12 = parse_formula("step_12", ("x0", "y0", "z0", "r", "s", "q", "h"), _step_lines(), _INVERSES)


@formula
def energies(x, y, z, r, s, end):
    """Return the energy above that on the separatrix, and above that of the settled motion, ``end`` = sin^2 theta."""
    return s * x * x - r * z * z, x * x + r * (y * y - end * (x * x + y * y + z * z))


@formula
def speed(x, y, z, r, s):
    """Return the speed of the direction of L without dissipation, |L x omega|; its square times -2 q is de/dtau."""
    return math.sqrt((r * y * z) * (r * y * z) + (z * x) * (z * x) + (s * x * y) * (s * x * y))


@njit(**INNER)
def _locate(state, body, h, event):
    """Return the time, up to h, at which a step from ``state`` reaches the energy ``event``, and the state there."""
    r, s, q, end = body
    low, high = 0.0, h
    t, place = h, state
    for _ in range(60):
        t = 0.5 * (low + high)
        place = step_12(*state, r, s, q, t)
        low, high = (t, high) if energies(*place, r, s, end)[event] > 0.0 else (low, t)
    return t, place


@njit(**INNER)
def _follow(state, body, step):
    """Return NAMES of a motion from (x, y, z), and its rounding, by steps of ``step`` over the largest rate."""
    x, y, z = state
    r, s, q, end = body
    over_separatrix, over_end = energies(x, y, z, r, s, end)
    crossing_time, z_crossing = math.nan if over_separatrix > 0.0 else 0.0, z
    settling_time = math.nan if over_end > 0.0 else 0.0
    t, steps, slowest = 0.0, 0, 1.0
    while over_end > 0.0 and steps < MAX_STEPS and r > 0.0:
        h = step / (math.sqrt(max(x * x + r * y * y, r)) + q)
        state = x, y, z
        x, y, z = step_12(*state, r, s, q, h)
        over_separatrix, over_end = energies(x, y, z, r, s, end)
        if over_separatrix <= 0.0 and math.isnan(crossing_time):
            share, place = _locate(state, body, h, 0)
            crossing_time, z_crossing, slowest = t + share, place[2], speed(*place, r, s)
        if over_end <= 0.0:
            settling_time = t + _locate(state, body, h, 1)[0]
        t += h
        steps += 1
    rounding = 4.0 * EPSILON * (4.0 + math.sqrt(steps)) / slowest
    z_crossing = z_crossing if crossing_time >= 0.0 else math.nan
    return (crossing_time, settling_time, z_crossing), rounding if steps > 0 else 0.0


@njit(nogil=True, **OPTIONS)
def fill_measured(motions, tolerance, out):
    """Fill (6, n) with NAMES (tau, tau, 1) and their errors; NaN if the energy is not reached.

    Args:
        motions (tuple of 6 arrays, shape (n,)): r, s, q, from_angle, phase and to_angle (rad).
        tolerance (float): Error of the steps allowed until the motion settles, relative.
        out (numpy.ndarray, shape (6, n)): Written.
    """
    step = follower.largest_step(STEPS_TO_SETTLE, tolerance)
    r, s, q, from_angle, phase, to_angle = motions
    for i in range(r.size):
        across, end = math.sin(from_angle[i]), math.sin(to_angle[i]) ** 2
        body = r[i], s[i], q[i], end
        start = math.cos(from_angle[i]), across * math.cos(phase[i]), across * math.sin(phase[i])
        coarse, _ = _follow(start, body, step)
        fine, rounding = _follow(start, body, follower.FINER * step)
        for k in range(3):
            # a relative error of the state moves times by 1/q, and each of them by its rounding
            change = rounding * (1.0 + 1.0 / q[i] + abs(fine[k]))
            out[k, i], out[k + 3, i] = fine[k], 3.0 * abs(fine[k] - coarse[k]) + change


def reduce_moments(moments):
    """Return r, s and the rate of tau over L/I1 of ascending moments, shape (3, n); 0, 0, 0 for a sphere."""
    low, middle, high = moments
    gap = np.where(high > low, high - low, 1.0)
    return (high - middle) / middle * (low / gap), (middle - low) / middle * (high / gap), (high - low) / high


def survey(points, tolerance):
    """Return the measured columns of points, in units.

    Args:
        points (mapping of str to array_like, shape (n,)): I1, I2, I3 (common unit, > 0, in any order: the axes are
            those of ascending moments), loss (1), from_angle, phase, to_angle (rad), omega0 (rad s-1).
        tolerance (float): Error of the steps allowed until the motion settles, relative.

    Returns:
        dict of str to numpy.ndarray, shape (n,): crossing_time, settling_time (s), z_crossing (1), those with
            ``_error``, NaN where the energy is not reached, and final_sense (int8: -1 undetermined, 0, 1).
    """
    names = ("I1", "I2", "I3", "loss", "from_angle", "phase", "to_angle", "omega0")
    *moments, q, from_angle, phase, to_angle, omega0 = columns.arrays(*(points[name] for name in names))
    r, s, rate = reduce_moments(np.sort(moments, axis=0))
    out = np.full((6, omega0.size), np.nan)
    fill_measured(columns.arrays(r, s, q, from_angle, phase, to_angle), tolerance, out)
    with np.errstate(divide="ignore", invalid="ignore"):
        out[[0, 1, 3, 4]] /= rate * omega0
    sense = np.where((np.abs(out[2]) > out[5]) & (rate > 0.0), out[2] > 0.0, -1).astype(np.int8)
    return dict(zip((*NAMES, *(f"{name}_error" for name in NAMES)), out, strict=True)) | {"final_sense": sense}
