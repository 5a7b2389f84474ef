"""The exact motion that a trajectory is compared with, frames that turn, and how far the start is known.

A free body of principal moments I moves by ``I_i w_i' = (I_j - I_k) w_j w_k`` and ``q' = q (0, w)/2``, (i, j, k)
cyclic, with w the angular velocity in its principal axes and q its attitude, Hamilton's unit quaternion from body to
space, scalar first. Both come in closed form from `kernels.free.exact`, near the separatrix too.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation

from kernels.free import exact
from sweeps.certification.trajectory import Trajectory, by_blocks
from sweeps.schema.refusals import DefinitionError
from sweeps.systems.motion import UNROTATED, multiply

EARTH_RATE = 7.292115e-5  # rad/s, angular velocity of the Earth (WGS 84)
PERTURBED_ROWS = 10_000  # rows at which perturbed motions and fits are compared; of longer files evenly spaced ones


def conjugate(q: np.ndarray) -> np.ndarray:
    """Return the conjugates of quaternions, the opposite rotations of unit quaternions."""
    return q * [1.0, -1.0, -1.0, -1.0]


def rotation_vector(q: np.ndarray) -> np.ndarray:
    """Return the rotation vectors, rad, of at most half a turn, of unit quaternions; (…, 3)."""
    q = np.where(q[..., :1] < 0.0, -q, q)
    size = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    return q[..., 1:] * np.where(size > 0.0, 2.0 * np.arctan2(size, q[..., :1]) / np.where(size > 0.0, size, 1.0), 2.0)


def distance(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Return the angle between attitudes, rad, 0 to π; q and −q are one attitude."""
    product = multiply(conjugate(p), q)
    return 2.0 * np.arctan2(
        np.sqrt(np.einsum("...i,...i->...", product[..., 1:], product[..., 1:])), np.abs(product[..., 0])
    )


@dataclass(frozen=True)
class AttitudeFrame:
    """The frame of the attitudes."""

    rate: float | None = None  #: rad/s; None: inertial
    axis: tuple[float, float, float] | None = None  #: in the frame; None: north-east-down at the file's places

    def in_space(self, trajectory: Trajectory, q: np.ndarray, rows=slice(None)) -> np.ndarray:
        """Return attitudes q, (n, 4), at some rows of a trajectory, in inertial space."""
        return q if self.rate is None else multiply(self.attitudes(trajectory, rows), q)

    def attitudes(self, trajectory: Trajectory, rows=slice(None)) -> np.ndarray:
        """Return the attitudes of the frame in inertial space, (n, 4)."""
        times = trajectory.times[rows]
        if self.axis is not None:
            half = 0.5 * self.rate * times[:, None]
            return np.hstack([np.cos(half), np.sin(half) * self.axis])
        if trajectory.place is None:
            problem = "frame: the file has no longitude and latitude"
            raise DefinitionError(f"{problem}; allowed: --frame-axis, the axis of rotation in the axes of the frame")
        longitude, latitude = trajectory.place[rows].T
        angles = np.column_stack([self.rate * times + longitude, -0.5 * np.pi - latitude])
        return Rotation.from_euler("ZY", angles).as_quat(scalar_first=True)


@dataclass(frozen=True)
class BodyMotion:
    """Rows in inertial space and in the body's principal axes."""

    moments: np.ndarray  #: principal, (3,)
    times: np.ndarray  #: s, (n,)
    q: np.ndarray | None  #: attitude, (n, 4)
    w: np.ndarray | None  #: angular velocity, rad/s, (n, 3)

    @property
    def start(self) -> tuple[np.ndarray, np.ndarray]:
        """Attitude and angular velocity of the first row."""
        return np.array(UNROTATED) if self.q is None else self.q[0], self.w[0]

    @cached_property
    def speed(self) -> float:
        """|w| of the first row, rad/s."""
        return float(np.linalg.norm(self.w[0]))

    def select(self, rows) -> "BodyMotion":
        """Return some rows."""
        q, w = (None if x is None else x[rows] for x in (self.q, self.w))
        return BodyMotion(self.moments, self.times[rows], q, w)

    def thin_rows(self, max_rows: int = PERTURBED_ROWS) -> "BodyMotion":
        """Return at most so many rows, evenly spaced, with the first and the last."""
        n = len(self.times)
        return self if n <= max_rows else self.select(np.unique(np.linspace(0, n - 1, max_rows).astype(int)))


def in_principal_axes(q, w, times, moments, axes) -> BodyMotion:
    """Return rows whose body axes are others than the principal ones, the rows of `axes`."""
    moments = np.asarray(moments, dtype=np.float64)
    if axes is None or np.array_equal(axes, np.eye(3)):
        return BodyMotion(moments, times, q, w)
    to_body = Rotation.from_matrix(np.asarray(axes).T).as_quat(scalar_first=True)
    return BodyMotion(
        moments, times, None if q is None else multiply(q, to_body), None if w is None else w @ np.asarray(axes).T
    )


def exact_motion(motion: BodyMotion, q0: np.ndarray, w0: np.ndarray, moments=None) -> BodyMotion:
    """Return the exact motion from a start at the times of `motion`, of its body or one of other moments."""
    moments = motion.moments if moments is None else moments
    q = None
    if motion.q is not None:
        q = by_blocks(lambda times: multiply(q0, exact.attitude(moments, w0, times)), motion.times)
    return BodyMotion(moments, motion.times, q, exact.rotation(moments, w0, motion.times))


def errors(motion: BodyMotion, reference: BodyMotion) -> tuple[np.ndarray | None, np.ndarray | None]:
    """Return errors of attitudes, rad, and of rates, relative to the first |w|, (n,); None for a column not there."""
    attitude = None if motion.q is None else by_blocks(distance, reference.q, motion.q)
    if motion.w is None:
        return attitude, None
    speed = np.linalg.norm(reference.w[0])
    return attitude, by_blocks(lambda w, exact_w: np.linalg.norm(w - exact_w, axis=1) / speed, motion.w, reference.w)


def largest_error(motion: BodyMotion, reference: BodyMotion) -> float:
    """Return the largest error of rows, of attitude (rad) or relative rates."""
    return max(float(error.max()) for error in errors(motion, reference) if error is not None)


def conditioning(motion: BodyMotion, start, attitude_offset: float, rate_offsets) -> tuple[float | None, float]:
    """Return the largest distances between the motion from a start and those that begin a resolution off.

    Args:
        motion: the rows, of which at most `PERTURBED_ROWS` are compared.
        start: attitude and angular velocity.
        attitude_offset: the largest angle, rad, by which the resolution of one entry changes the attitude at the start;
            the motion then is off by this angle all the time.
        rate_offsets: resolutions of the rates, rad/s, by the component in the principal axes, (k, 3).

    Returns:
        Distances of attitudes, rad (None without attitudes), and of rates, relative to |w| at the start.
    """
    motion = motion.thin_rows()
    w = np.zeros((len(motion.times), 3))
    motion = BodyMotion(motion.moments, motion.times, motion.q, w)
    reference = exact_motion(motion, *start)
    worst = [attitude_offset, 0.0]
    for offset in (sign * offset for offset in rate_offsets for sign in (1.0, -1.0)):
        deviations = errors(exact_motion(motion, start[0], start[1] + offset), reference)
        sizes = [0.0 if deviation is None else float(deviation.max()) for deviation in deviations]
        worst = [max(pair) for pair in zip(worst, sizes, strict=True)]
    return (None if motion.q is None else worst[0]), worst[1]
