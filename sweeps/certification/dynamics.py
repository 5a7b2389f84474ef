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

from sweeps.certification.reference import BodyMotion, conjugate, rotation_vector
from sweeps.systems.motion import multiply, rotate_vectors

SEGMENTS = 300  # number of pairs of rows
ANGLES = (0.03, 0.5, 3.0)  # rad from row to row: the first for which the defect exceeds rounding
CLEAR = 30.0  # defect over the resolution of the file that is clear
STEP = 1e-6  # relative step of finite differences in the parameters
ITERATIONS = 3


class Segments(NamedTuple):
    """Pairs of rows: states (w and q, in units of |w| of the first row), (n, 7), and time between them, (n,)."""

    first: np.ndarray
    last: np.ndarray
    spans: np.ndarray
    moments: np.ndarray


class Explanation(NamedTuple):
    """Other equations of motion with fitted parameters."""

    word: str
    text: str
    parameters: np.ndarray
    score: float  #: root mean square of the defect that is left, relative to that of the free motion


def _torque_body(w, q, f, moments, p):
    return f + p / moments, w


def _torque_space(w, q, f, moments, p):
    return f + rotate_vectors(conjugate(q), np.broadcast_to(p, w.shape)) / moments, w


def _dissipation(w, q, f, moments, p):
    L = moments * w
    return f + p[0] * np.cross(L, np.cross(L, w)) / moments, w


def _damping(w, q, f, moments, p):
    return f + p[0] * w, w


def _momentum_only(w, q, f, moments, p):
    g, h = moments**2 * w, moments * w
    along = np.einsum("ij,ij->i", g, h) / np.einsum("ij,ij->i", h, h)
    return f + p[0] * (g - along[:, None] * h), w


def _first_order(w, q, f, moments, p):
    return f + p[0] * (_euler(w, f, moments) + _euler(f, w, moments)), w + p[1] * f


def _kinematics(w, q, f, moments, p):
    return f, (1.0 + p[0]) * w


ALTERNATIVES = (  # word, equations in words, right-hand side, number of parameters
    ("first_order", "an error of first order of the step", _first_order, 2),
    ("energy_drift", "energy changes while |L| is kept", _dissipation, 1),
    ("momentum_drift", "the rates grow or decay evenly", _damping, 1),
    ("momentum_drift", "|L| changes while the energy is kept", _momentum_only, 1),
    ("torque", "a constant torque in the body's axes", _torque_body, 3),
    ("torque", "a constant torque in space", _torque_space, 3),
    ("kinematics", "attitudes turn by a multiple of the rates", _kinematics, 1),
)


def _euler(a, b, moments):
    """Return (I_j - I_k) a_j b_k/I_i."""
    j, k = [1, 2, 0], [2, 0, 1]
    return (moments[j] - moments[k]) / moments * a[:, j] * b[:, k]


def segments(motion: BodyMotion, resolution: float) -> Segments:
    """Return pairs of rows of a motion with attitudes or rates, whose defect exceeds the resolution where it can."""
    n, speed = len(motion.times), motion.speed
    times, moments = motion.times * speed, motion.moments / motion.moments.max()

    def states(rows: np.ndarray) -> np.ndarray:
        q = np.tile([1.0, 0.0, 0.0, 0.0], (len(rows), 1)) if motion.q is None else motion.q[rows]
        return np.hstack([motion.w[rows] / speed, q])

    first = np.unique(np.linspace(0, n - 2, min(n - 1, SEGMENTS)).astype(int))
    for angle in ANGLES:
        last = np.clip(np.searchsorted(times, times[first] + angle), first + 1, n - 1)
        pairs = Segments(states(first), states(last), times[last] - times[first], moments)
        if _size(_defect(pairs, motion, _damping, np.zeros(1))) > CLEAR * resolution:
            break
    return pairs


def _integrate(pairs: Segments, rhs, p: np.ndarray) -> np.ndarray:
    """Return the states to which some equations lead from the first states, (n, 7)."""
    from scipy.integrate import solve_ivp

    shape, spans = pairs.first.shape, pairs.spans[:, None]

    def derivative(_, y):
        y = y.reshape(shape)
        w, q = y[:, :3], y[:, 3:]
        change, q_change = rhs(w, q, _euler(w, w, pairs.moments), pairs.moments, p)
        rates = np.hstack([np.zeros((shape[0], 1)), q_change])
        return (spans * np.hstack([change, 0.5 * multiply(q, rates)])).ravel()

    solution = solve_ivp(derivative, (0.0, 1.0), pairs.first.ravel(), method="DOP853", rtol=1e-12, atol=1e-14)
    return solution.y[:, -1].reshape(shape)


def _defect(pairs: Segments, motion: BodyMotion, rhs, p: np.ndarray) -> np.ndarray:
    """Return rates (in |w|) and attitudes (rad) of the last states less those that the equations give, (n, 3 or 6)."""
    end = _integrate(pairs, rhs, p)
    q = end[:, 3:] / np.linalg.norm(end[:, 3:], axis=1, keepdims=True)
    rotations = rotation_vector(multiply(conjugate(q), pairs.last[:, 3:]))
    rates = pairs.last[:, :3] - end[:, :3]
    return rates if motion.q is None else np.hstack([rates, rotations])


def _size(defect: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(defect))))


def explanations(motion: BodyMotion, resolution: float) -> list[Explanation]:
    """Return the alternatives with parameters fitted to a motion, the best first."""
    pairs = segments(motion, resolution)
    alternatives = []
    for word, text, rhs, number in ALTERNATIVES:
        if motion.q is None and (rhs is _torque_space or rhs is _kinematics):
            continue
        p = np.zeros(number)
        begin = best = _defect(pairs, motion, rhs, p)
        for _ in range(ITERATIONS):
            steps = [_defect(pairs, motion, rhs, p + STEP * unit) - best for unit in np.eye(number)]
            jacobian = np.stack([step.ravel() / STEP for step in steps], axis=1)
            trial = p - np.linalg.lstsq(jacobian, best.ravel(), rcond=None)[0]
            if not np.abs(trial).max() < 10.0:
                break
            defect = _defect(pairs, motion, rhs, trial)
            if not _size(defect) < 0.99 * _size(best):
                break
            p, best = trial, defect
        alternatives.append(Explanation(word, text, p, _size(best) / max(_size(begin), np.finfo(float).tiny)))
    return sorted(alternatives, key=lambda alternative: alternative.score)
