"""Other equations of motion: which of them leads from each row of a trajectory to a later one.

From each of some rows the equations below are integrated up to a later row, at most a few radians on. With the free
motion (p = 0) what is left is the defect of the trajectory; parameters p that make it vanish are fitted to all rows at
once. In units of |w| and of the greatest moment, with L = I w and f_i = (I_j - I_k) w_j w_k/I_i::

    torque in the body      w' = f + I^-1 p                       3 parameters
    torque in space         w' = f + I^-1 R(q)^T p                3
    energy_drift            L' = L x w + p L x (L x w)            1: |L| is kept
    momentum_drift          w' = f + p w; or p times the part of I^2 w that keeps 2T                  1
    first_order             w' = f + p1 (df/dw) f, q' = q (w + p2 f)/2     2: an error of first order of the step
    kinematics              q' = (1 + p) q w/2                    1
"""

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from sweeps.certification.reference import BodyMotion
from sweeps.systems.motion import UNROTATED, multiply

SEGMENTS = 300  # number of pairs of rows
ANGLES = (0.03, 0.5, 3.0)  # rad from row to row: the first for which the defect exceeds rounding
CLEAR = 30.0  # defect over the resolution of the file that is clear
SCALE = 64.0  # unit of the fitted parameters, so that the finite differences of SciPy change p by 1e-6
MAX_PARAMETER = 10.0  # bound on each p, beyond which the equations are far from free rotation
ITERATIONS = 5  # number of evaluations of the Jacobian, of equations that are nearly linear in p


class Explanation(NamedTuple):
    """Other equations of motion with fitted parameters."""

    word: str
    text: str
    parameters: np.ndarray
    score: float  #: root mean square of the defect that is left, relative to that of the free motion


class Segments(NamedTuple):
    """Pairs of rows of a motion, in units of |w| of the first row and of the greatest moment."""

    first: np.ndarray  #: states w and q, (n, 7)
    last: np.ndarray
    spans: np.ndarray  #: time between them, (n,)
    moments: np.ndarray
    has_attitude: bool  #: False if q is that of no rotation, which does not count


def _euler(a, b, moments):
    """Return (I_j - I_k) a_j b_k/I_i."""
    j, k = [1, 2, 0], [2, 0, 1]
    return (moments[j] - moments[k]) / moments * a[:, j] * b[:, k]


def _normal_part(a, b):
    """Return the part of vectors a that is normal to b."""
    return a - (np.einsum("ij,ij->i", a, b) / np.einsum("ij,ij->i", b, b))[:, None] * b


def _in_body(p, q):
    """Return a vector of space in the axes of bodies of attitudes q."""
    return Rotation.from_quat(q, scalar_first=True).inv().apply(p)


def _free_motion(w, q, f, inertia, p):
    """Return w' and the rates by which attitudes turn, of free rotation: all of ALTERNATIVES with p = 0."""
    return f, w


IN_SPACE = "a constant torque in space"
ALTERNATIVES = (  # word, equations in words, number of parameters p, (w', rates by which attitudes turn)
    ("first_order", "an error of first order of the step", 2,
     lambda w, q, f, inertia, p: (f + p[0] * (_euler(w, f, inertia) + _euler(f, w, inertia)), w + p[1] * f)),
    ("energy_drift", "energy changes while |L| is kept", 1,
     lambda w, q, f, inertia, p: (f + p[0] * np.cross(inertia * w, np.cross(inertia * w, w)) / inertia, w)),
    ("momentum_drift", "the rates grow or decay evenly", 1, lambda w, q, f, inertia, p: (f + p[0] * w, w)),
    ("momentum_drift", "|L| changes while the energy is kept", 1,
     lambda w, q, f, inertia, p: (f + p[0] * _normal_part(inertia**2 * w, inertia * w), w)),
    ("torque", "a constant torque in the body's axes", 3, lambda w, q, f, inertia, p: (f + p / inertia, w)),
    ("torque", IN_SPACE, 3, lambda w, q, f, inertia, p: (f + _in_body(p, q) / inertia, w)),
    ("kinematics", "attitudes turn by a multiple of the rates", 1, lambda w, q, f, inertia, p: (f, (1.0 + p[0]) * w)),
)  # fmt: skip


def segments(motion: BodyMotion, resolution: float) -> Segments:
    """Return pairs of rows of a motion with attitudes or rates, whose defect exceeds the resolution where it can."""
    n, speed, has_attitude = len(motion.times), np.linalg.norm(motion.w[0]), motion.q is not None
    times, moments = motion.times * speed, motion.moments / motion.moments.max()
    q = motion.q.as_quat(scalar_first=True) if has_attitude else np.tile(UNROTATED, (n, 1))
    states = np.hstack([motion.w / speed, q])
    first = np.linspace(0, n - 2, min(n - 1, SEGMENTS)).astype(int)
    for angle in ANGLES:
        last = np.clip(np.searchsorted(times, times[first] + angle), first + 1, n - 1)
        pairs = Segments(states[first], states[last], times[last] - times[first], moments, has_attitude)
        if root_mean_square(_defect(pairs, _free_motion, np.zeros(1))) > CLEAR * resolution:
            break
    return pairs


def root_mean_square(values: np.ndarray) -> float:
    """Return the root of the mean square of values."""
    return float(np.sqrt(np.mean(np.square(values))))


def _defect(pairs: Segments, rhs, p: np.ndarray) -> np.ndarray:
    """Return rates (in |w|) and attitudes (rad) of the last states less those that some equations give, one array."""
    from scipy.integrate import solve_ivp

    shape, spans = pairs.first.shape, pairs.spans[:, None]

    def derivative(_, y):
        w, q = np.split(y.reshape(shape), [3], axis=1)
        change, v = rhs(w, q, _euler(w, w, pairs.moments), pairs.moments, p)
        return (spans * np.hstack([change, 0.5 * multiply(q, np.pad(v, ((0, 0), (1, 0))))])).ravel()

    solution = solve_ivp(derivative, (0.0, 1.0), pairs.first.ravel(), method="DOP853", rtol=1e-12, atol=1e-14)
    (w, q), (last_w, last_q) = (np.split(y, [3], axis=1) for y in (solution.y[:, -1].reshape(shape), pairs.last))
    first, last = (Rotation.from_quat(each, scalar_first=True) for each in (q, last_q))
    rotations = (first.inv() * last).as_rotvec() if pairs.has_attitude else np.empty(0)
    return np.append(last_w - w, rotations)


def explanations(motion: BodyMotion, resolution: float) -> list[Explanation]:
    """Return the alternatives with parameters fitted to a motion, the best first."""
    from scipy.optimize import least_squares

    pairs, alternatives = segments(motion, resolution), []
    free = root_mean_square(_defect(pairs, _free_motion, np.zeros(1)))
    for word, text, number, rhs in ALTERNATIVES:
        if motion.q is None and (text == IN_SPACE or word == "kinematics"):
            continue
        solution = least_squares(
            lambda x, rhs=rhs: _defect(pairs, rhs, SCALE * x), np.zeros(number), max_nfev=ITERATIONS,
            bounds=(-MAX_PARAMETER / SCALE, MAX_PARAMETER / SCALE),
        )  # fmt: skip
        score = root_mean_square(solution.fun) / max(free, np.finfo(float).tiny)
        alternatives.append(Explanation(word, text, SCALE * solution.x, score))
    return sorted(alternatives, key=lambda alternative: alternative.score)
