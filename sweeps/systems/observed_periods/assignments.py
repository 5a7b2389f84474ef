r"""Two periods of a light curve whose meaning is unknown, or follows another convention, as P_psi and P_phi.

A tumbling body's light curve has lines at integer combinations of the frequencies :math:`f_\phi = 1/P_\phi` (long axis)
and :math:`f_\psi = 1/P_\psi`. With two lines

.. math:: f_1 = n_1 f_\phi + k_1 f_\psi, \qquad f_2 = n_2 f_\phi + k_2 f_\psi

both frequencies follow. In the short-axis convention, the mean precession frequency is that of the axis of greatest
inertia, :math:`f_\phi + f_\psi` in either mode (see `kernels.events.tumbling`).

Source: Kaasalainen, Astronomy and Astrophysics 376 (2001) 302; Samarasinha and A'Hearn, Icarus 93 (1991) 194.
"""

import math
from collections.abc import Sequence
from itertools import permutations
from typing import Any

import numpy as np

from sweeps.schema.refusals import DefinitionError
from sweeps.systems.observed_periods.answers import TwoPeriods, periods_of_any_body, periods_of_body

LINES = {  # line → its numbers of f_phi and f_psi, the simplest first
    "f_psi": (0, 1), "f_phi": (1, 0), "2 f_phi": (2, 0), "f_phi + f_psi": (1, 1), "f_phi - f_psi": (1, -1),
    "f_psi - f_phi": (-1, 1), "2 f_psi": (0, 2), "2 f_phi + f_psi": (2, 1), "2 f_phi - f_psi": (2, -1),
    "f_psi - 2 f_phi": (-2, 1),
}  # fmt: skip
CONVENTIONS = {"long": ("f_psi", "f_phi"), "short": ("f_psi", "f_phi + f_psi")}  # lines of P_psi and P_phi


def convert_periods(periods: TwoPeriods, lines: Sequence[str]) -> TwoPeriods | None:
    """Return P_psi and P_phi (long axis) if the two periods are those of two `LINES`; None if no such motion has them.

    The standard errors, to first order, give the error of the ratio of periods exactly, which decides modes and energy.
    """
    matrix = np.array([LINES[name] for name in lines], dtype=float)
    given, errors = np.array([periods.P_psi, periods.P_phi]), np.array([periods.sigma_psi, periods.sigma_phi])
    if np.linalg.det(matrix) == 0:
        return None
    frequencies = np.linalg.solve(matrix, 1 / given)
    if not frequencies.min() > 1e-12 / given.min():  # rounding of a difference of equal frequencies
        return None
    share = np.linalg.inv(matrix) * (errors / given**2) / frequencies[:, None]  # relative, of f_phi and f_psi
    psi_error, ratio_error = math.hypot(*share[1]), math.hypot(*(share[0] - share[1]))
    phi_error = math.sqrt(max(ratio_error**2 - psi_error**2, 0.0))
    psi_error = min(psi_error, ratio_error)
    P_phi, P_psi = (1 / frequencies).tolist()
    return TwoPeriods(P_psi, P_phi, psi_error * P_psi, phi_error * P_phi, periods.unit)


def known_periods(periods: TwoPeriods, convention: str) -> TwoPeriods:
    """Return the periods in the long-axis convention, from a convention other than "unknown"."""
    if convention not in CONVENTIONS:
        raise DefinitionError(
            f"convention: {convention!r} is not available; allowed: {', '.join(CONVENTIONS)}, unknown"
        )
    if (converted := convert_periods(periods, CONVENTIONS[convention])) is None:
        raise DefinitionError("P_phi: is not shorter than P_psi; allowed: a shorter one in the short-axis convention")
    return periods if convention == "long" else converted


def list_assignments(periods: TwoPeriods, ratios=None, sigma_ratios=(0.0, 0.0)) -> list[dict[str, Any]]:
    """Return {lines, P_psi, P_phi, modes} of every pair that two periods in any order can mean, simple lines first.

    Args:
        periods: the two periods.
        ratios: I1/I3 and I2/I3 of one body; None for any body.
        sigma_ratios: their standard errors.
    """
    assignments: dict[str, dict[str, Any]] = {}
    for lines in sorted(permutations(LINES, 2), key=lambda pair: sum(map(list(LINES).index, pair))):
        if (pair := convert_periods(periods, lines)) is None:
            continue
        rows = periods_of_body(pair, ratios, sigma_ratios) if ratios else periods_of_any_body(pair)
        if modes := [row for row in rows if row["verdict"] != "excluded"]:
            key = f"{pair.P_psi:.9g} {pair.P_phi:.9g}"
            assignments.setdefault(key, {"lines": lines, "P_psi": pair.P_psi, "P_phi": pair.P_phi, "modes": modes})
    return list(assignments.values())
