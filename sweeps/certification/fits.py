"""Fits of the exact motion to rows: its start, and constants that a file may have wrong."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from sweeps.certification.reference import BodyMotion, exact_motion, row_errors

FIRST_ROWS = 8  # rows of the first fit; each further one has twice as many, so that none is half a turn off
FITTED_ROWS = 400  # number of rows in each fit but the last
GUESS_ACCURACY = 1e-6  # relative accuracy of each fit but the last, which the next fit begins from
MIN_ANGLE = 1e-9  # rad about each axis, in place of no rotation at all, from which no fit begins
MAX_CHANGE = 5.0  # largest change of a parameter by one fit
PARAMETERS = {"attitude": 3, "rates": 3, "clock": 1, "delay": 1, "ratios": 2}  # name → number of components


@dataclass(frozen=True)
class Fit:
    """An exact motion that was fitted."""

    start: tuple[Rotation, np.ndarray]  #: attitude and angular velocity, rad/s, at the first row
    moments: np.ndarray
    clock: float = 1.0  #: the time that passes per second of the file
    delay: float = 0.0  #: s by which the rates are those of a later time than the attitudes

    @property
    def ratios(self) -> str:
        """I1:I2:I3 in text."""
        return ":".join(f"{ratio:.6g}" for ratio in self.moments / self.moments[2])

    def motion(self, motion: BodyMotion) -> BodyMotion:
        """Return the fitted motion at the rows of `motion`, as the file would show it."""
        times = self.clock * motion.times
        reference = exact_motion(BodyMotion(self.moments, times, motion.q, None), *self.start)
        w = reference.w
        if self.delay:
            w = exact_motion(BodyMotion(self.moments, times + self.delay, None, None), *self.start).w
        return BodyMotion(self.moments, motion.times, reference.q, w)

    def errors(self, motion: BodyMotion) -> np.ndarray:
        """Return the error of each row, as `sweeps.certification.reference.row_errors`."""
        return row_errors(motion, self.motion(motion))

    def residuals(self, motion: BodyMotion) -> list[np.ndarray]:
        """Return the residuals of attitudes (rotation vectors, rad) and of rates (in |w|), (n, 3) each."""
        reference, parts = self.motion(motion), []
        if motion.q is not None:
            parts.append((reference.q.inv() * motion.q).as_rotvec())
        if motion.w is not None:
            parts.append((motion.w - reference.w) / np.linalg.norm(self.start[1]))
        return parts

    def with_parameters(self, x: np.ndarray, names: Sequence[str]) -> "Fit":
        """Return the fit with its parameters changed by x, in rad, in units of |w|, of 1/|w| and as logarithms."""
        ends = np.cumsum([PARAMETERS[name] for name in names])
        values = dict(zip(names, np.split(np.clip(x, -MAX_CHANGE, MAX_CHANGE), ends[:-1]), strict=True))
        (q, w), speed = self.start, float(np.linalg.norm(self.start[1]))
        q = q * Rotation.from_rotvec(values["attitude"]) if "attitude" in values else q
        return Fit(
            (q, w + speed * values.get("rates", 0.0)),
            self.moments * np.exp(np.append(values.get("ratios", np.zeros(2)), 0.0)),
            self.clock * float(np.exp(values.get("clock", [0.0])[0])),
            self.delay + float(values.get("delay", [0.0])[0]) / speed,
        )


def fit(motion: BodyMotion, guess: Fit, names: Sequence[str], last_rows: int = FITTED_ROWS) -> Fit:
    """Return the least-squares fit of some parameters (see PARAMETERS) to all rows, of more and more rows in turn."""
    from scipy.optimize import least_squares

    n, best = len(motion.times), guess
    number = sum(PARAMETERS[name] for name in names)
    size = FIRST_ROWS
    while True:
        is_last = size >= n
        rows = motion.select(slice(size)).thin_rows(last_rows if is_last else FITTED_ROWS)
        accuracy = 1e-15 if is_last else GUESS_ACCURACY
        solution = least_squares(
            lambda x, rows=rows, begin=best: np.concatenate(begin.with_parameters(x, names).residuals(rows)).ravel(),
            np.zeros(number), method="lm", xtol=accuracy, ftol=accuracy, max_nfev=40 * number,
        )  # fmt: skip
        best = best.with_parameters(solution.x, names)
        if is_last:
            return best
        size *= 2


def guess_start(motion: BodyMotion) -> Fit:
    """Return the first row, with the angular velocity that turns its attitude into the second where there are no rates.

    Without any rotation the angular velocity is `MIN_ANGLE` about each axis, so that a fit can begin.
    """
    if motion.w is not None:
        return Fit(motion.start, motion.moments)
    rotation = (motion.q[0].inv() * motion.q[1]).as_rotvec()
    rotation = rotation if rotation.any() else np.full(3, MIN_ANGLE)
    return Fit((motion.q[0], rotation / (motion.times[1] - motion.times[0])), motion.moments)
