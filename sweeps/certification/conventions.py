"""Other readings of a file: conventions of attitude and of angular velocity, to be compared with the exact motion."""

from collections.abc import Iterator
from itertools import permutations, product
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

DEGREES = 180.0 / np.pi
PLAIN, MINUS_ONE = (0, 1, 2), [1.0, 1e-15, 0.0, 0.0]  # order of axes; 1, with a direction for half the angle of −1


class Reading(NamedTuple):
    """A file read by another convention."""

    word: str
    text: str  #: what is read otherwise
    q: Rotation | None  #: attitudes of the file, n rotations
    w: np.ndarray | None  #: angular velocity, rad/s, (n, 3)


def readings(q: Rotation | None, w: np.ndarray | None, q_inertial: Rotation | None) -> Iterator[Reading]:
    """Yield the readings of attitudes (in the file's frame and in inertial space) and angular velocities."""
    if q is not None:
        parts = q.as_quat(scalar_first=True)
        yield Reading("inverse_quaternion", "attitudes are from space to the body", q.inv(), w)
        yield Reading("scalar_last", "the fourth component is the scalar", _rotation(np.roll(parts, 1, axis=1)), w)
        yield Reading("scalar_last", "the first component is the scalar", _rotation(np.roll(parts, -1, axis=1)), w)
        for sides in (parts, make_continuous(parts), -make_continuous(parts)):  # (1 + q)/|1 + q| is half the rotation
            text = "quaternions are of the whole angle in place of half of it"
            yield Reading("full_angle", text, _rotation(sides + MINUS_ONE), w)
    if w is not None:
        yield Reading("negated_rates", "rates have the opposite sign", q, -w)
        yield Reading("degrees", "rates are in deg/s", q, w / DEGREES)
        yield Reading("degrees", "rates were divided by 57.2958", q, w * DEGREES)
    if q is not None and w is not None:
        yield Reading("space_rates", "rates are along the axes of space", q, q_inertial.inv().apply(w))
        yield Reading("space_rates", "rates are along the axes of the file's frame", q, q.inv().apply(w))
    yield from _axes(q, w)


def _axes(q: Rotation | None, w: np.ndarray | None) -> Iterator[Reading]:
    """Yield readings with the axes of attitudes, of rates, or of both in another order or direction."""
    for order, signs in product(permutations(PLAIN), product((1.0, -1.0), repeat=3)):
        is_plain, is_inverse = order == PLAIN, all(sign < 0 for sign in signs)
        if is_plain and len(set(signs)) == 1:
            continue  # as it is, or the opposite rotation
        if (q is None or w is None) and len(set(signs)) > 1:
            continue  # with two signs changed, attitudes or rates alone are those of another motion of the same body
        is_odd = order in ((0, 2, 1), (2, 1, 0), (1, 0, 2))
        word = "left_handed" if is_plain or (is_inverse and is_odd) else "axes_swapped"
        text = ", ".join(f"{'−' if sign < 0 else ''}{axis + 1}" for axis, sign in zip(order, signs, strict=True))
        new_w = None if w is None else w[:, order] * signs
        if q is not None:
            parts = q.as_quat(scalar_first=True)
            new_q = _rotation(np.hstack([parts[:, :1], parts[:, 1:][:, order] * signs]))
            yield Reading(word, f"axes 1, 2, 3 of the attitudes are {text}", new_q, w)
        if w is not None:
            yield Reading(word, f"axes 1, 2, 3 of the rates are {text}", q, new_w)
        if q is not None and w is not None and not is_plain:
            yield Reading(word, f"axes 1, 2, 3 of the file are {text}", new_q, new_w)


def _rotation(parts: np.ndarray) -> Rotation:
    return Rotation.from_quat(parts, scalar_first=True)


def make_continuous(parts: np.ndarray) -> np.ndarray:
    """Return quaternions, (n, 4), with signs such that each is near the one before."""
    steps = np.einsum("ij,ij->i", parts[1:], parts[:-1])
    return parts * np.append(1.0, np.cumprod(np.where(steps < 0.0, -1.0, 1.0)))[:, None]
