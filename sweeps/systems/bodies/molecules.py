r"""Moments of inertia of molecules from rotational constants, and the inertial defect of flat molecules.

A rotational constant is :math:`B = h/(8\pi^2 I)` as a frequency, or B/c as a wavenumber, so that I in amu Å² is
505379.0/(B in MHz) = 16.8576/(B in cm⁻¹). Measured constants are averages over vibrations: the inertial defect
:math:`\Delta = I_c - I_a - I_b`, 0 for a rigid flat body, comes out positive, 0.05 amu Å² for water.

Source: Gordy and Cook, Microwave Molecular Spectra (1984), chapter 13; constants of CODATA 2022.
"""

import math
from collections.abc import Sequence

from sweeps.schema import units

PLANCK, LIGHT_SPEED = 6.62607015e-34, 299_792_458.0  # J s and m s-1, exact in the SI
AMU_SQUARE_ANGSTROM = 1.66053906892e-47  # kg m2
MAX_MOLECULE_MOMENT = 1e-40  # kg m2, greatest moment of what counts as a molecule; 6e6 amu Å², C60 has 6e3
MAX_DEFECT = 0.03  # largest inertial defect relative to I_c that vibrations explain; water has 0.028
ALLOWED = "a rotational constant > 0 in MHz, or text in GHz, MHz or cm-1"


def moment_of_constant(value: object) -> float | None:
    """Return the moment of inertia, kg m2, of a rotational constant in MHz or as text with a unit; None if invalid."""
    frequencies = {"rad s-1": 1 / (2 * math.pi), "m-1": LIGHT_SPEED}  # unit → frequency of 1, Hz
    if isinstance(value, int | float):
        frequency = 0.0 if isinstance(value, bool) else 1e6 * value
    else:
        amounts = [(units.read_number(value, unit), factor) for unit, factor in frequencies.items()]
        frequency = next((amount * factor for amount, factor in amounts if isinstance(amount, float)), 0.0)
    return PLANCK / (8 * math.pi**2 * frequency) if 0 < frequency < math.inf else None


def inertial_defect(moments: Sequence[float]) -> float:
    """Return I_c − I_a − I_b of a molecule, kg m2, if it is positive and explained by vibrations; otherwise 0."""
    low, middle, high = sorted(moments)
    defect = high - middle - low
    return defect if high < MAX_MOLECULE_MOMENT and 0 < defect <= MAX_DEFECT * high else 0.0
