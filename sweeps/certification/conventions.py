"""Other readings of a file: conventions of attitude and of angular velocity, to be compared with the exact motion."""

from collections.abc import Iterator
from itertools import permutations, product
from typing import NamedTuple

import numpy as np

from sweeps.certification.reference import conjugate
from sweeps.systems.motion import rotate_vectors

DEGREES = 180.0 / np.pi


class Reading(NamedTuple):
    """A file read by another convention."""

    word: str
    text: str  #: what is read otherwise
    q: np.ndarray | None  #: attitudes of the file, (n, 4)
    w: np.ndarray | None  #: angular velocity, rad/s, (n, 3)


def readings(q: np.ndarray | None, w: np.ndarray | None, q_inertial: np.ndarray | None) -> Iterator[Reading]:
    """Yield the readings of attitudes (in the file's frame and in inertial space) and angular velocities."""
    if q is not None:
        yield Reading("inverse_quaternion", "attitudes are from space to the body", conjugate(q), w)
        yield Reading("scalar_last", "the fourth component is the scalar", np.roll(q, 1, axis=1), w)
        yield Reading("scalar_last", "the first component is the scalar", np.roll(q, -1, axis=1), w)
        for p in (q, make_continuous(q), -make_continuous(q)):
            yield Reading("full_angle", "quaternions are of the whole angle in place of half of it", root(p), w)
    if w is not None:
        yield Reading("negated_rates", "rates have the opposite sign", q, -w)
        yield Reading("degrees", "rates are in deg/s", q, w / DEGREES)
        yield Reading("degrees", "rates were divided by 57.2958", q, w * DEGREES)
    if q is not None and w is not None:
        yield Reading("space_rates", "rates are along the axes of space", q, rotate_vectors(conjugate(q_inertial), w))
        yield Reading("space_rates", "rates are along the axes of the file's frame", q, rotate_vectors(conjugate(q), w))
    yield from _axes(q, w)


def _axes(q: np.ndarray | None, w: np.ndarray | None) -> Iterator[Reading]:
    """Yield readings with the axes of attitudes, of rates, or of both in another order or direction."""
    for order, signs in product(permutations(range(3)), product((1.0, -1.0), repeat=3)):
        is_plain, is_inverse = order == (0, 1, 2), all(sign < 0 for sign in signs)
        if is_plain and (is_inverse or all(sign > 0 for sign in signs)):
            continue  # as it is, or the opposite rotation
        if (q is None or w is None) and len(set(signs)) > 1:
            continue  # with two signs changed, attitudes or rates alone are those of another motion of the same body
        is_odd = order in ((0, 2, 1), (2, 1, 0), (1, 0, 2))
        word = "left_handed" if is_plain or (is_inverse and is_odd) else "axes_swapped"
        text = ", ".join(f"{'−' if sign < 0 else ''}{axis + 1}" for axis, sign in zip(order, signs, strict=True))
        new_q = None if q is None else np.hstack([q[:, :1], q[:, 1:][:, order] * signs])
        new_w = None if w is None else w[:, order] * signs
        if q is not None:
            yield Reading(word, f"axes 1, 2, 3 of the attitudes are {text}", new_q, w)
        if w is not None:
            yield Reading(word, f"axes 1, 2, 3 of the rates are {text}", q, new_w)
        if q is not None and w is not None and not is_plain:
            yield Reading(word, f"axes 1, 2, 3 of the file are {text}", new_q, new_w)


def make_continuous(q: np.ndarray) -> np.ndarray:
    """Return attitudes with signs such that each is near the one before."""
    steps = np.einsum("ij,ij->i", q[1:], q[:-1])
    return q * np.append(1.0, np.cumprod(np.where(steps < 0.0, -1.0, 1.0)))[:, None]


def root(q: np.ndarray) -> np.ndarray:
    """Return quaternions of half the angle: (1 + q)/|1 + q|."""
    half = q + np.array([1.0, 0.0, 0.0, 0.0])
    size = np.linalg.norm(half, axis=1, keepdims=True)
    return np.where(size > 1e-9, half / np.where(size > 1e-9, size, 1.0), [0.0, 1.0, 0.0, 0.0])
