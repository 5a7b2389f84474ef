"""From two observed periods to the energies of a body, in each mode, and to how surely a mode is excluded."""

from collections.abc import Mapping

import numpy as np

from kernels import statuses, triangle, tumbling
from sweeps.systems.observed_periods.variables import EXCLUDED

MODES = {"sam": tumbling.SAM, "lam": tumbling.LAM}
GIVEN_BACK = 1e-6  # of the ratio


def exclusion(least: np.ndarray, P_psi, P_phi, sigma_psi, sigma_phi) -> np.ndarray:
    r"""Return by how many standard errors the observed P_psi/P_phi is below the least ratio of a mode.

    The mode asks for :math:`P_\psi > r P_\phi`. The errors are independent and normal, so :math:`P_\psi - r P_\phi` is
    normal with the variance :math:`\sigma_\psi^2 + r^2\sigma_\phi^2`: nothing is linearised. 0 where the mode has the
    ratio; infinite where there is no such mode (r infinite) and where the periods have no errors.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        below = least * P_phi - P_psi
        sigmas = np.where(below > 0.0, below / np.hypot(sigma_psi, least * sigma_phi), 0.0)
    return np.where(np.isinf(least), np.inf, sigmas)


def columns(points: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the columns of points; see `sweeps.systems.observed_periods.variables`."""
    moments = np.sort([points[name] for name in ("I1", "I2", "I3")], axis=0)
    P_psi, P_phi, sigma_psi, sigma_phi = seen = [points[n] for n in ("P_psi", "P_phi", "sigma_psi", "sigma_phi")]
    ratio = P_psi / P_phi
    spread = ratio * np.hypot(sigma_psi / P_psi, sigma_phi / P_phi)
    solved = tumbling.inverse(*moments, ratio)
    less, more = (tumbling.inverse(*moments, np.maximum(ratio + s, 0.0))["energy"] for s in (-spread, spread))
    result, lost = {}, np.zeros(ratio.shape, dtype=bool)
    for mode, k in MODES.items():
        energy = solved["energy"][k]
        has = np.isfinite(energy)
        result[f"exclusion_{mode}"] = exclusion(solved["least_ratio"][k], *seen)
        result[f"energy_{mode}"] = energy
        apart = np.fmax(np.abs(less[k] - energy), np.abs(more[k] - energy))
        result[f"energy_{mode}_stderr"] = np.where(has, apart, np.nan)
        result[f"parameter_{mode}"] = solved["m"][k]
        given = {"energy": np.where(has, energy, 1.0), "omega0": np.ones_like(energy)}  # in units of I3/L
        back = tumbling.survey(dict(zip(("I1", "I2", "I3"), moments, strict=True)) | given, 1e-10, measured=False)
        result[f"momentum_rate_{mode}"] = np.where(has, back["period_psi_exact"] / P_psi, np.nan)
        again = back["period_psi_exact"] / back["period_phi_long_axis_exact"]
        lost |= has & ~(np.abs(again / ratio - 1.0) <= GIVEN_BACK)
    allowed = [result[f"exclusion_{mode}"] <= EXCLUDED for mode in MODES]
    result["modes"] = (allowed[0] + 2 * allowed[1]).astype(np.int8)
    result["status"] = np.where(lost, statuses.NOT_CONVERGED, statuses.OK).astype(np.int8)
    result["triangle_margin"] = triangle.triangle_margin(*moments)
    return result
