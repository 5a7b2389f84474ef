"""Sentences of maps of multipliers, with numbers from measured traces and exponents."""

import numpy as np

from sweeps.schema.datasets import DataArray, Dataset
from sweeps.systems.presentation.sentences import Threshold, squared_rate


def resonances(panel: Dataset, strength: str, drive: str) -> dict[float, str]:
    """Return frequency of the drive → name of its resonance with one mode or two of the motion without the drive.

    These are 2ω, ω₁ + ω₂ and their halves, from the measured exponents at the highest frequency; {} unless a map over
    the drive's frequency has the strength 0, at which the exponents do not depend on the frequency, and two modes.
    """
    if drive != "frequency" or not (panel[strength] == 0.0).any() or panel.sizes["multiplier"] < 4:
        return {}
    rates = panel["exponent_imag"].sel({strength: 0.0}).sortby(drive).transpose(drive, "multiplier").values
    modes = np.unique(np.abs(rates[-1]).round(6))
    if modes.size != 2 or not np.allclose(np.sort(rates[-1]), np.sort(rates[-2]), rtol=1e-3):
        return {}  # exponents above half of the highest frequency are known but for its multiples
    first, second = modes.tolist()
    names = {2.0 * first: "2ω₁", first + second: "ω₁+ω₂", 2.0 * second: "2ω₂", second: "ω₂"}
    names[0.5 * (first + second)] = "(ω₁+ω₂)/2"
    low, high = panel[drive].values[[0, -1]]
    return {place: name for place, name in sorted(names.items()) if low < place < high}


def parametric_double_pendulum(dataset: Dataset) -> str:
    """Return the sum of both frequencies, at which both modes grow together."""
    names = resonances(dataset.squeeze(drop=True), "amplitude", "frequency")
    (place,) = (place for place, name in names.items() if name == "ω₁+ω₂")
    return f"Shaken at {place:.2f} rad/s, the sum of both frequencies, both modes grow together"


def _damped_doubling(line: Dataset) -> DataArray:
    """Return the characteristic polynomial at the multiplier -1, with the determinant exp(-c T) by Liouville."""
    return line["trace"] + 1.0 + np.exp(-line["damping"] * 2.0 * np.pi / line["frequency"])


SENTENCES = {
    "parametric_double_pendulum": parametric_double_pendulum,
    "mathieu": Threshold(
        "At q = {q:.2f} the first tongue spans a = {first:.2f} to {last:.2f}",
        "a",
        lambda line: (line["trace"] + 2.0).where(line["a"] < 3.0),
        {"q": 1.0},
    ),
    "kapitza_pendulum": Threshold(
        "Shaken by {amplitude:.2f} m, a pendulum of {length:g} m stands on its head above {first:.1f} rad/s",
        "frequency",
        squared_rate,
        {"equilibrium": "inverted", "amplitude": 0.2},
    ),
    "paul_trap": Threshold(
        "Without a constant field (a = 0) ions stay up to q = {last:.3f}",
        "q",
        lambda line: line["trace"] + 4.0,
        {"a": 0.0},
    ),
    "swing": Threshold(
        "Pumped at {frequency:.2f} rad/s, a swing with friction grows beyond a depth of {first:.3f}",
        "depth",
        _damped_doubling,
        {"damping": 0.1, "frequency": 3.96},
    ),
    "asymmetric_shaft": Threshold(
        "With an asymmetry of {asymmetry:.2f} the whirl grows from {first:.2f} to {last:.2f} rad/s",
        "spin_rate",
        lambda line: line["det_plus_identity"].where(line["spin_rate"] > 0.6),
        {"asymmetry": 0.4},
    ),
}
