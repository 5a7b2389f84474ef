"""The task of the race: the bodies, the estimate of rates from samples, and exact samples for comparison.

Bodies that can exist, spun about a principal axis and nudged by a millionth, sampled 64 times up to omega0 t = 20.
Bodies with a perturbation that grows tenfold in that time are omitted: there Polhode would stop early, and the race is
over equal work. Each contender integrates the components scaled as Polhode does (transverse components in units of the
perturbation), so that every tolerance acts on the perturbation. The bodies are sorted by the bound on their rates, so
that bodies of a batch are similar.
"""

import math
import sys
from dataclasses import dataclass
from pathlib import Path

import mpmath as mp
import numpy as np
from numba import njit

sys.path.insert(1, str(Path(__file__).parents[2]))  # the sources first: tests/kernels is no package of that name
sys.path.append(str(Path(__file__).parents[1]))
from precise import Textbook

from kernels.estimator import measure
from kernels.free import linear, rigid_body

END, SAMPLES, EPSILON = 20.0, 64, 1e-6
SPACING = END / SAMPLES
TIMES = np.linspace(0.0, END, SAMPLES + 1)
DIGITS = 30


@dataclass(frozen=True)
class Bodies:
    """Points in Polhode's form, and k (n, 3) and start (n, 3) of w_a' = k_a w_b w_c and cyclic for its peers."""

    points: dict
    k: np.ndarray
    start: np.ndarray

    def __len__(self):
        return len(self.k)

    def __getitem__(self, indices):
        return Bodies({name: x[indices] for name, x in self.points.items()}, self.k[indices], self.start[indices])


def draw(count, seed=4):
    """So many bodies, of masses at random distances from the principal planes, about random axes."""
    random = np.random.default_rng(seed)
    accepted_points, num_accepted = [], 0
    while num_accepted < count:
        candidates = scale_bodies(_candidates(random, 2 * count + 64))
        candidates = candidates[np.flatnonzero(_growth(candidates) < 0.99 * measure.MAX_GROWTH)]
        accepted_points.append(candidates.points)
        num_accepted += len(candidates)
    bodies = scale_bodies(
        {name: np.concatenate([points[name] for points in accepted_points])[:count] for name in accepted_points[0]}
    )
    return bodies[np.argsort(np.abs(bodies.k).max(axis=1), kind="stable")]


def _candidates(random, count):
    x2, y2, z2 = random.uniform(0.05, 1.0, (3, count))  # sums of m x^2, m y^2, m z^2: any three make a body
    return {
        "I1": y2 + z2,
        "I2": z2 + x2,
        "I3": x2 + y2,
        "axis": random.integers(1, 4, count),
        "omega0": np.ones(count),
        "epsilon": np.full(count, EPSILON),
        "phase": random.uniform(0.0, 2.0 * np.pi, count),
    }


def scale_bodies(points):
    """Bodies of points: the coefficients and the start of the scaled equations."""
    a, b, c = rigid_body.cyclic(points["axis"])
    moments = np.stack([points["I1"], points["I2"], points["I3"]], axis=1)
    by_role = (np.take_along_axis(moments, i[:, None], axis=1)[:, 0] for i in (a, b, c))
    k = np.stack(rigid_body.euler_coefficients(*by_role), axis=1)
    k[:, 0] *= points["epsilon"] * points["epsilon"]
    phase = points["phase"]
    return Bodies(points, k, np.stack([np.ones_like(phase), np.cos(phase), np.sin(phase)], axis=1))


def _growth(bodies):
    """Largest size of the perturbation over its start, by linear theory, at the samples."""
    points = bodies.points
    omega2 = linear.omega_squared(points["I1"], points["I2"], points["I3"], 1.0, points["axis"])
    rate = np.sqrt(omega2.astype(complex))[:, None] + 1e-12
    cosine, sine = np.cos(rate * TIMES).real, (np.sin(rate * TIMES) / rate).real
    _, b, c = bodies.start.T[:, :, None]
    _, kb, kc = bodies.k.T[:, :, None]
    return np.hypot(b * cosine + kb * c * sine, c * cosine + kc * b * sine).max(axis=1)


@njit(nogil=True, error_model="numpy", fastmath={"contract"})
def rate_of(b, c):
    """Signed rate² (in spin²) and its standard error from the samples of one body, by the workspace's recurrence."""
    guess = measure.first_guess((b[2], c[2]), (b[1], c[1]), (b[0], c[0]))
    rx, rr, xx = 0.0, 0.0, 0.0
    for i in range(2, b.size):
        x, r, s = measure.residual_sums((b[i], c[i]), (b[i - 1], c[i - 1]), (b[i - 2], c[i - 2]), guess)
        rx, rr, xx = rx + x, rr + r, xx + s
    value, slope = measure.rate_squared(guess - 0.5 * rx / xx, SPACING)
    return value, slope * math.sqrt(max(rr - rx * rx / xx, 0.0) / ((2.0 * b.size - 5.0) * 4.0 * xx))


@njit(nogil=True, error_model="numpy")
def rates_of(b, c, out):
    """Rates of many bodies, from samples (n, times) of any strides, into out (n, 2)."""
    for i in range(out.shape[0]):
        out[i] = rate_of(b[i], c[i])


def truth(bodies):
    """Transverse components (n, times, 2) in units of the nudge, from the closed form in mpmath."""
    with mp.workdps(DIGITS):
        return np.array([_closed_form(bodies[i : i + 1]) for i in range(len(bodies))])


def _closed_form(body):
    """Samples of one body: the textbook's solution."""
    moments = [float(body.points[name][0]) for name in ("I1", "I2", "I3")]
    axes = [int(i[0]) for i in rigid_body.cyclic(body.points["axis"])]
    nudge = mp.mpf(float(body.points["epsilon"][0]))
    start = [None] * 3
    for i, x, unit in zip(axes, body.start[0], (1, nudge, nudge), strict=True):
        start[i] = mp.mpf(float(x)) * unit
    motion = Textbook(moments, start)
    return np.array([[float(w[i] / nudge) for i in axes[1:]] for w in map(motion, TIMES.tolist())])


def errors(samples, expected):
    """Largest distance of each body's samples from the truth, relative to its largest transverse size so far."""
    distance = np.hypot(*np.moveaxis(samples - expected, -1, 0))
    size = np.maximum.accumulate(np.hypot(*np.moveaxis(expected, -1, 0)), axis=1)
    return (distance / size).max(axis=1)
