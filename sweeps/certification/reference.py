"""The exact motion that a trajectory is compared with, frames that turn, and how far the start is known.

A free body of principal moments I moves by ``I_i w_i' = (I_j - I_k) w_j w_k`` and ``q' = q (0, w)/2``, (i, j, k)
cyclic, with w the angular velocity in its principal axes and q its attitude, Hamilton's unit quaternion from body to
space. Both come in closed form from `kernels.free.exact`, near the separatrix too.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from kernels.free import exact
from sweeps.certification.trajectory import Trajectory
from sweeps.schema.refusals import DefinitionError
from sweeps.systems.motion import multiply

EARTH_RATE = 7.292115e-5  # rad/s, angular velocity of the Earth (WGS 84)
PERTURBED_ROWS = 10_000  # rows at which perturbed motions and fits are compared; of longer files evenly spaced ones
SCALAR_LAST = [1, 2, 3, 0]  # order in which SciPy keeps the parts of a quaternion
BLOCK_ROWS = 2**15  # number of rows for which a function of many rows is evaluated at once, to bound its memory


@dataclass(frozen=True)
class AttitudeFrame:
    """The frame of the attitudes."""

    rate: float | None = None  #: rad/s; None: inertial
    axis: tuple[float, float, float] | None = None  #: in the frame; None: north-east-down at the file's places

    def in_space(self, trajectory: Trajectory, q: Rotation, rows=slice(None)) -> Rotation:
        """Return attitudes q at some rows of a trajectory, in inertial space."""
        if self.rate is None:
            return q
        angles = self.rate * trajectory.times[rows]
        if self.axis is not None:
            return Rotation.from_rotvec(np.outer(angles, self.axis)) * q
        if trajectory.place is None:
            problem = "frame: the file has no longitude and latitude"
            raise DefinitionError(f"{problem}; allowed: --frame-axis, the axis of rotation in the axes of the frame")
        longitude, latitude = trajectory.place[rows].T
        return Rotation.from_euler("ZY", np.column_stack([angles + longitude, -0.5 * np.pi - latitude])) * q


@dataclass(frozen=True)
class BodyMotion:
    """Rows in inertial space and in the body's principal axes."""

    moments: np.ndarray  #: principal, (3,)
    times: np.ndarray  #: s, from the first row, (n,)
    q: Rotation | None  #: attitude, n rotations
    w: np.ndarray | None  #: angular velocity, rad/s, (n, 3)

    @property
    def start(self) -> tuple[Rotation, np.ndarray]:
        """Attitude and angular velocity of the first row."""
        return Rotation.identity() if self.q is None else self.q[0], self.w[0]

    def select(self, rows) -> "BodyMotion":
        """Return some rows, with times from the first of them."""
        times, q, w = (None if x is None else x[rows] for x in (self.times, self.q, self.w))
        return BodyMotion(self.moments, times - times[0], q, w)

    def thin_rows(self, max_rows: int = PERTURBED_ROWS) -> "BodyMotion":
        """Return at most so many rows, evenly spaced, with the first and the last."""
        n = len(self.times)
        return self if n <= max_rows else self.select(np.linspace(0, n - 1, max_rows).astype(int))


def by_blocks(function: Callable, *columns) -> np.ndarray:
    """Return a function of rows, evaluated for blocks of them."""
    n, first = len(columns[0]), function(*(column[:BLOCK_ROWS] for column in columns))
    if n <= BLOCK_ROWS:
        return first
    result = np.empty((n, *first.shape[1:]))
    for k in range(0, n, BLOCK_ROWS):
        result[k : k + BLOCK_ROWS] = function(*(column[k : k + BLOCK_ROWS] for column in columns))
    return result


def exact_motion(motion: BodyMotion, q0: Rotation, w0: np.ndarray, moments=None) -> BodyMotion:
    """Return the exact motion from a start at the times of `motion`, of its body or one of other moments."""
    moments = motion.moments if moments is None else moments
    q = None
    if motion.q is not None:
        first = q0.as_quat(scalar_first=True)
        products = by_blocks(
            lambda times: multiply(first, exact.attitude(moments, w0, times))[:, SCALAR_LAST], motion.times
        )
        q = Rotation.from_quat(products)
    return BodyMotion(moments, motion.times, q, exact.rotation(moments, w0, motion.times))


def errors(motion: BodyMotion, reference: BodyMotion) -> dict[str, np.ndarray]:
    """Return the errors of each row: "attitude", rad, and "rates", relative to the first |w|, as far as both have them.

    The error of an attitude is the angle of rotation, 0 to π, from the exact one.
    """
    result = {}
    if motion.q is not None:
        result["attitude"] = by_blocks(lambda p, q: (p.inv() * q).magnitude(), reference.q, motion.q)
    if motion.w is not None:
        distances = by_blocks(lambda w, exact_w: np.linalg.norm(w - exact_w, axis=1), motion.w, reference.w)
        result["rates"] = distances / np.linalg.norm(reference.w[0])
    return result


def row_errors(motion: BodyMotion, reference: BodyMotion) -> np.ndarray:
    """Return the error of each row, of attitude (rad) or relative rates, whichever is larger."""
    return np.max([*errors(motion, reference).values()], axis=0)


def conditioning(motion: BodyMotion, start, attitude_offset: float, rate_offsets: np.ndarray) -> dict[str, float]:
    """Return the largest distances between the motion from a start and those that begin a resolution off.

    Args:
        motion: the rows, of which at most `PERTURBED_ROWS` are compared.
        start: attitude and angular velocity.
        attitude_offset: the largest angle, rad, by which the resolution of one entry changes the attitude at the start;
            the motion then is off by this angle all the time.
        rate_offsets: resolutions of the rates, rad/s, by the component in the principal axes, (k, 3).

    Returns:
        Distances of "attitude", rad (not without attitudes), and of "rates", relative to |w| at the start.
    """
    motion = motion.thin_rows()
    reference = exact_motion(motion, *start)
    worst = {"attitude": attitude_offset} if motion.q is not None else {}
    for offset in [*rate_offsets, *-rate_offsets]:
        for name, error in errors(exact_motion(motion, start[0], start[1] + offset), reference).items():
            worst[name] = max(worst.get(name, 0.0), float(error.max()))
    return worst


def changes_of_integrals(motion: BodyMotion) -> dict[str, float]:
    """Return the largest changes of 2T and of the size and, with attitudes, the direction of L in space."""
    moments = motion.moments
    twice_energy = by_blocks(lambda w: np.einsum("ij,ij->i", w, w * moments), motion.w)
    size = by_blocks(lambda w: np.linalg.norm(w * moments, axis=1), motion.w)
    changes = {
        "energy_error_relative": float(np.abs(twice_energy / twice_energy[0] - 1).max()),
        "momentum_size_error_relative": float(np.abs(size / size[0] - 1).max()),
    }
    if motion.q is not None:
        first = motion.q[0].apply(motion.w[0] * moments) / size[0]

        def momentum_angle(q: Rotation, w: np.ndarray) -> np.ndarray:
            in_space = q.apply(w * moments)
            return np.arctan2(np.linalg.norm(np.cross(in_space, first), axis=1), in_space @ first)

        changes["momentum_direction_error_rad"] = float(by_blocks(momentum_angle, motion.q, motion.w).max())
    return changes
