"""Sentences of maps of small oscillations, with numbers from measured squares of rates."""

import numpy as np

from sweeps.schema.datasets import Dataset
from sweeps.systems.presentation.sentences import Threshold, section


def _mode_ratio(line: Dataset, numbers: tuple[int, int]) -> float:
    """Return the frequency of one mode, by its number, over that of another one."""
    return np.divide(*(line["frequency"].sel(mode=number).item() for number in numbers))


def double_pendulum(dataset: Dataset) -> str:
    """Return how much faster the rods swing in opposition than together."""
    ratio = _mode_ratio(section(dataset, equilibrium="hanging", mass2=1.0, length2=1.0), (2, 1))
    return f"In opposition the two rods swing {ratio:.2f} times as fast as together"


def linear_triatomic(dataset: Dataset) -> str:
    """Return the ratio of the frequencies of both stretches of carbon dioxide."""
    ratio = _mode_ratio(section(dataset, inner_mass=1.993e-26, stiffness=1600.0), (3, 2))
    return f"The odd stretch of carbon dioxide is {ratio:.2f} times as fast as the even one"


SENTENCES = {
    "double_pendulum": double_pendulum,
    "linear_triatomic": linear_triatomic,
    "bead_on_hoop": Threshold(
        "On a hoop of {radius:.2f} m a bead leaves the bottom above {last:.2f} rad/s",
        "spin_rate",
        "omega_squared",
        {"equilibrium": "bottom", "radius": 0.5},
    ),
}
