"""Whether the moments of a pumped body satisfy the triangle inequality during the whole period."""

from collections.abc import Mapping

import numpy as np

from kernels.triangle import triangle_margin

PHASES = 32
REFINED = 5  # parabolas through three phases, each an eighth as far apart


def least_margin(points: Mapping[str, np.ndarray], inverse: bool) -> np.ndarray:
    """Return the least triangle margin over the period.

    The margin is the least of three smooth functions of the phase: where it is least, it is smooth.

    Args:
        points: I1 … I3, depth1 … depth3, lag1 … lag3, which broadcast together.
        inverse: whether the inverses of the moments are modulated.
    """

    def margin(u):
        factors = [1.0 + points[f"depth{i}"] * np.cos(u + points[f"lag{i}"]) for i in (1, 2, 3)]
        return triangle_margin(*(points[f"I{i}"] * (1.0 / f if inverse else f) for i, f in enumerate(factors, 1)))

    least, at = margin(0.0), 0.0
    for u in 2.0 * np.pi / PHASES * np.arange(1, PHASES):
        here = margin(u)
        least, at = np.minimum(least, here), np.where(here < least, u, at)
    apart = 2.0 * np.pi / PHASES
    for _ in range(REFINED):
        before, after = margin(at - apart), margin(at + apart)
        bent = before - 2.0 * least + after
        with np.errstate(divide="ignore", invalid="ignore"):
            moved = np.where(bent > 0.0, 0.5 * apart * (before - after) / bent, 0.0)
        here = margin(at + moved)
        least, at = np.minimum(least, here), np.where(here < least, at + moved, at)
        apart /= 8.0
    return least
