"""Fits of the exact motion to rows: its start, and constants that a file may have wrong."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sweeps.certification.reference import BodyMotion, conjugate, errors, exact_motion, largest_error, rotation_vector
from sweeps.systems.motion import multiply

FIRST_ROWS = 8  # rows of the first fit; each further one has twice as many, so that none is half a turn off
FITTED_ROWS = 400  # number of rows in each fit but the last
MIN_ANGLE = 1e-9  # rad about each axis, in place of no rotation at all, from which no fit begins
MAX_CHANGE = 5.0  # largest change of a parameter by one fit
PARAMETERS = {"attitude": 3, "rates": 3, "clock": 1, "delay": 1, "ratios": 2}


@dataclass(frozen=True)
class Fit:
    """An exact motion that was fitted."""

    start: tuple[np.ndarray, np.ndarray]  #: attitude and angular velocity, rad/s, at the first row
    moments: np.ndarray
    clock: float = 1.0  #: the time that passes per second of the file
    delay: float = 0.0  #: s by which the rates are those of a later time than the attitudes

    def motion(self, motion: BodyMotion) -> BodyMotion:
        """Return the fitted motion at the rows of `motion`, as the file would show it."""
        times = self.clock * motion.times
        reference = exact_motion(BodyMotion(self.moments, times, motion.q, motion.w), *self.start)
        w = reference.w
        if self.delay:
            w = exact_motion(BodyMotion(self.moments, times + self.delay, None, motion.w), *self.start).w
        return BodyMotion(self.moments, motion.times, reference.q, w)

    def errors(self, motion: BodyMotion) -> tuple[np.ndarray | None, np.ndarray | None]:
        """Return the errors of rows, as `sweeps.certification.reference.errors`."""
        return errors(motion, self.motion(motion))

    def worst(self, motion: BodyMotion) -> float:
        """Return the largest error of rows, of attitude (rad) or relative rates."""
        return largest_error(motion, self.motion(motion))

    def with_parameters(self, x: np.ndarray, names: Sequence[str]) -> "Fit":
        """Return the fit with its parameters changed by x, in rad, in units of |w|, of 1/|w| and as logarithms."""
        x = np.clip(x, -MAX_CHANGE, MAX_CHANGE)
        values = dict(zip(names, np.split(x, np.cumsum([PARAMETERS[name] for name in names])[:-1]), strict=True))
        q, w = self.start
        speed = float(np.linalg.norm(w))
        if "attitude" in values:
            half = 0.5 * values["attitude"]
            q = multiply(q, np.append(np.sqrt(max(0.0, 1.0 - half @ half)), half))
        w = w + speed * values.get("rates", 0.0)
        moments = self.moments * np.exp(np.append(values.get("ratios", [0.0, 0.0]), 0.0))
        clock = self.clock * float(np.exp(values.get("clock", [0.0])[0]))
        return Fit((q, w), moments, clock, self.delay + float(values.get("delay", [0.0])[0]) / speed)


def fit(motion: BodyMotion, guess: Fit, names: Sequence[str], last_rows: int = FITTED_ROWS) -> Fit:
    """Return the least-squares fit of some parameters (see PARAMETERS) to all rows, of more and more rows in turn."""
    from scipy.optimize import least_squares

    size, best = FIRST_ROWS, guess
    number = sum(PARAMETERS[name] for name in names)
    while True:
        is_last = size >= len(motion.times)
        rows = motion.select(slice(None, size)).thin_rows(last_rows if is_last else FITTED_ROWS)
        begin = best

        def residual(x, rows=rows, begin=begin):
            return np.concatenate(residuals(rows, begin.with_parameters(x, names))).ravel()

        solution = least_squares(residual, np.zeros(number), method="lm", xtol=1e-15, ftol=1e-15, max_nfev=40 * number)
        best = begin.with_parameters(solution.x, names)
        if is_last:
            return best
        size *= 2


def residuals(motion: BodyMotion, fitted: Fit) -> list[np.ndarray]:
    """Return what a fit leaves of attitudes (rotation vectors, rad) and of rates (in |w|), (n, 3) each."""
    reference, parts = fitted.motion(motion), []
    if motion.q is not None:
        parts.append(rotation_vector(multiply(conjugate(reference.q), motion.q)))
    if motion.w is not None:
        parts.append((motion.w - reference.w) / np.linalg.norm(fitted.start[1]))
    return parts


def first_rates(motion: BodyMotion) -> np.ndarray:
    """Return the angular velocity, rad/s, that turns the first attitude into the second."""
    first_rotation = rotation_vector(multiply(conjugate(motion.q[0]), motion.q[1]))
    return (first_rotation if first_rotation.any() else np.full(3, MIN_ANGLE)) / (motion.times[1] - motion.times[0])
