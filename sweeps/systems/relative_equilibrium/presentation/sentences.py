"""Sentences of maps of relative equilibria, with numbers from measured eigenvalues."""

import numpy as np

from sweeps.schema.datasets import Dataset
from sweeps.systems.presentation.sentences import Threshold, section, squared_rate, zeros
from sweeps.systems.relative_equilibrium.system import REGIMES

PARIS = 48.85  # degrees north, latitude of the Panthéon
SIDEREAL_DAY = 23.9345  # h, one rotation of the Earth


def gyrostat(dataset: Dataset) -> str:
    """Return the least momentum of a rotor that stabilises the intermediate axis."""
    line = section(dataset, I2=0.5 * (dataset["I1"].item() + dataset["I3"].item()))
    limit = zeros(line["rotor_momentum"], squared_rate(line))[-1] / (line["I2"] * line["spin_rate"]).item()
    return f"A rotor of h/(I₂W) > {limit:.2f} holds the intermediate axis"


def steady_precession(dataset: Dataset) -> str:
    """Return the least spin of a steady precession: the difference of both rates, squared, is linear in its square."""
    line = section(dataset, tilt=0.5)
    rates = line["precession_equilibrium"].dropna("spin_rate").sortby("spin_rate")
    squares = rates["spin_rate"].values[:2] ** 2
    gaps = np.subtract(*(rates.sel(equilibrium=name).values[:2] for name in ("fast", "slow"))) ** 2
    limit = np.sqrt(squares[0] - gaps[0] * np.diff(squares)[0] / np.diff(gaps)[0])
    return f"Slower than {limit:.3g} rad/s, a top tilted by {line['tilt'].item():.2g} rad has no steady precession"


def turn_ratio(dataset: Dataset) -> Dataset:
    """Return the rate at which the plane of swing of the shortest pendulum turns, over that of the ground, by W.

    It is half the difference of both frequencies, without drag, as long as the ground turns slower than the bob swings.
    """
    line = dataset.sel(drag=0.0).isel(length=0, epsilon=0).squeeze()
    frequencies = np.sort(np.abs(line["eigenvalue_imag"].transpose("eigenvalue", "spin_rate").values), axis=0)
    is_slow = frequencies.mean(axis=0) > 1.001 * line["spin_rate"].values
    ratio = 0.5 * (frequencies[-1] - frequencies[0]) / line["spin_rate"]
    return ratio[is_slow]


def foucault(dataset: Dataset) -> str:
    """Return how fast a pendulum's plane turns, and how long it takes in Paris."""
    ratio = turn_ratio(dataset).median().item()
    hours = SIDEREAL_DAY / (ratio * np.sin(np.radians(PARIS)))
    return f"The plane of swing turns at {ratio:.3f} times Ω sin(latitude): once in {hours:.1f} h in Paris"


def gravity_gradient(dataset: Dataset) -> str:
    """Return the shares of stable shapes in Lagrange's region, k1 > 0, and in DeBra and Delp's."""
    regime = section(dataset)["regime"]
    stable = regime.isin([REGIMES.index(name) - 1 for name in ("stable", "asymptotically_stable")])
    above, below = (100 * (stable & side).mean().item() for side in (regime["k1"] > 0.0, regime["k1"] < 0.0))
    return f"{above:.1f} % of all shapes keep their attitude in Lagrange's region, {below:.1f} % in DeBra and Delp's"


SENTENCES = {
    "foucault": foucault,
    "gravity_gradient": gravity_gradient,
    "gravity_gradient_damped": gravity_gradient,
    "gyrostat": gyrostat,
    "steady_precession": steady_precession,
    "lagrange_points": Threshold(
        "L4 and L5 are stable up to a mass ratio of {first:.4g}", "mass_ratio", "discriminant", {"equilibrium": "L4"}
    ),
    "sleeping_top": Threshold(
        "With m g l = {moment_of_weight:.3g} N m, a top with I₃ = I₁ sleeps above {last:.2f} rad/s",
        "spin_rate",
        "discriminant",
        {"moment_of_weight": 2.0, "I3": 1.0},
    ),
    "rotating_saddle": Threshold(
        "A saddle that turns faster than {last:.2f} rad/s holds a particle, without drag",
        "spin_rate",
        "product_of_squares",
        {"stiffness_y": -1.0, "drag": 0.0},
    ),
    "rotor": Threshold(
        "Internal damping of {internal_damping:.3g} kg/s drives the whirl above {first:.2f} rad/s",
        "spin_rate",
        "growth_rate",
        {"stiffness_y": 1.0, "internal_damping": 0.05},
    ),
    "viscous_slug": Threshold(
        "With a viscous slug, only spins with I₃/I₁ > {last:.2f} last: the major-axis rule",
        "axial_moment",
        "growth_rate",
        {"drag": 0.01},
    ),
}
