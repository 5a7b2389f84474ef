"""From two observed periods to the energy of a tumbling body, for every body or for one."""

import math
from dataclasses import dataclass

import numpy as np
import xarray as xr

from kernels import triangle, tumbling
from sweeps.schema.refusals import DefinitionError
from sweeps.systems.tumbling.variables import MODES

UNITS = {"s": 1.0, "h": 3600.0, "d": 86400.0}
STEPS = 99  # bodies along each side of the triangle's map
MODE_NUMBERS = {"sam": tumbling.SAM, "lam": tumbling.LAM}


@dataclass(frozen=True)
class SeenPeriods:
    """Two periods and their standard errors, in one unit.

    Attributes:
        P_psi, P_phi: period in the body, and about L in the long-axis convention.
        sigma_psi, sigma_phi: their standard errors.
        unit: s, h or d.
    """

    P_psi: float
    P_phi: float
    sigma_psi: float = 0.0
    sigma_phi: float = 0.0
    unit: str = "h"

    def __post_init__(self):
        for name, value in (("P-psi", self.P_psi), ("P-phi", self.P_phi)):
            if not (math.isfinite(value) and value > 0):
                raise DefinitionError(f"--{name}: {value!r} is out of range; allowed: a finite number > 0")
        for name, value in (("sigma-psi", self.sigma_psi), ("sigma-phi", self.sigma_phi)):
            if not (math.isfinite(value) and value >= 0):
                raise DefinitionError(f"--{name}: {value!r} is out of range; allowed: a finite number, 0 or more")
        if self.unit not in UNITS:
            raise DefinitionError(f"--unit: {self.unit!r} is not available; allowed: {', '.join(UNITS)}")

    @property
    def ratio(self) -> float:
        """P_psi/P_phi."""
        return self.P_psi / self.P_phi

    @property
    def ratio_error(self) -> float:
        """Its standard error, to first order, the periods' errors independent."""
        return self.ratio * math.hypot(self.sigma_psi / self.P_psi, self.sigma_phi / self.P_phi)


def of_body(seen: SeenPeriods, ratio1: float, ratio2: float) -> list[dict]:
    """The motions of one body that have both periods: mode, energy, energy_error, m and the angular momentum's rate.

    Args:
        seen: the periods.
        ratio1: I1/I3, the least moment over the greatest, in (0, 1].
        ratio2: I2/I3, in (0, 1].

    Raises:
        DefinitionError: for ratios that are none, and periods that the body has in no mode.
    """
    for name, value in (("I1/I3", ratio1), ("I2/I3", ratio2)):
        if not (math.isfinite(value) and 0 < value <= 1):
            raise DefinitionError(f"--ratios: {name} {value!r} is out of range; allowed: a number in (0, 1]")
    low, middle = sorted((ratio1, ratio2))
    solved = _solved(seen, np.array([low]), np.array([middle]))
    found = []
    for mode, number in MODE_NUMBERS.items():
        if np.isfinite(solved["energy"][number, 0]):
            columns = {name: float(solved[name][number, 0]) for name in ("energy", "energy_error", "m")}
            found.append({"mode": mode, **columns, "omega0": _rate(seen, low, middle, columns["energy"])})
    if not found:
        short, long = limits(low, middle)
        allowed = f"above {short:.6g} (short-axis mode) or above {long:.6g} (long-axis mode)"
        raise DefinitionError(
            f"--P-psi, --P-phi: their ratio {seen.ratio:.6g} is no motion's of the body {low:g} : {middle:g} : 1; "
            f"allowed: a ratio {allowed}"
        )
    return found


def limits(low: float, middle: float) -> tuple[float, float]:
    """Least P_psi/P_phi of a body in each mode, where the wobble vanishes: short axis, long axis."""
    short = math.sqrt(low * middle / ((1 - low) * (1 - middle))) if middle < 1 else math.inf
    long = math.sqrt(middle / ((1 - low) * (middle - low))) - 1 if low < middle else math.inf
    return short, long


def _rate(seen: SeenPeriods, low: float, middle: float, energy: float) -> float:
    """L/I3, rad s-1, that gives P_psi."""
    columns = tumbling.survey({"I1": low, "I2": middle, "I3": 1.0, "energy": energy, "omega0": 1.0}, 1e-10, False)
    return float(columns["period_psi_exact"][0]) / (seen.P_psi * UNITS[seen.unit])


def _solved(seen: SeenPeriods, low: np.ndarray, middle: np.ndarray) -> dict[str, np.ndarray]:
    """Energy, its error and m of bodies, rows by mode; the error by the ratio's own, up and down."""
    one = np.ones_like(low)
    solved = tumbling.inverse(low, middle, one, seen.ratio)
    ends = [tumbling.inverse(low, middle, one, seen.ratio + side * seen.ratio_error)["energy"] for side in (-1.0, 1.0)]
    with np.errstate(invalid="ignore"):
        away = np.abs(np.stack(ends) - solved["energy"])
    # below the mode's least ratio there is no energy: then the error is what lies above
    error = np.where(np.isfinite(away[0]), np.fmax(away[0], away[1]), away[1])
    return solved | {"energy_error": np.where(np.isfinite(solved["energy"]), error, np.nan)}


def over_the_triangle(seen: SeenPeriods, steps: int = STEPS) -> xr.Dataset:
    """The energy of every body that gives both periods, in each mode, over I1/I3 and I2/I3.

    Raises:
        DefinitionError: where no body of the triangle has these periods.
    """
    along = np.arange(1, steps + 1) / (steps + 1)
    low, middle = np.meshgrid(along, along, indexing="ij")
    body = (low <= middle) & (triangle.triangle_margin(low, middle, np.ones_like(low)) >= 0)
    solved = {name: np.full((2, *low.shape), np.nan) for name in ("energy", "energy_error", "m")}
    for name, values in _solved(seen, low[body], middle[body]).items():
        solved[name][:, body] = values
    if not np.isfinite(solved["energy"]).any():
        raise DefinitionError(f"--P-psi, --P-phi: their ratio {seen.ratio:.6g} is no body's; allowed: a larger ratio")
    dims = ("mode", "I1_over_I3", "I2_over_I3")
    told = {
        "energy": "energy that gives both periods, 2T I3/L^2",
        "energy_error": "standard error of that energy, from those of the periods",
        "m": "parameter of the elliptic functions, 0 for the least wobble and 1 on the separatrix",
    }
    coordinates = {
        "mode": ("mode", np.array(MODES[1:3]), {"long_name": "mode of the motion"}),
        "I1_over_I3": ("I1_over_I3", along, {"units": "1", "long_name": "least moment over the greatest"}),
        "I2_over_I3": ("I2_over_I3", along, {"units": "1", "long_name": "middle moment over the greatest"}),
    }
    attributes = {
        "title": f"Bodies with P_psi = {seen.P_psi:g} {seen.unit} and P_phi = {seen.P_phi:g} {seen.unit}",
        "comment": "P_phi in the long-axis convention; missing where the body has no such motion in that mode",
        "Conventions": "CF-1.11",
    }
    variables = {name: (dims, solved[name], {"units": "1", "long_name": text}) for name, text in told.items()}
    return xr.Dataset(variables, coordinates, attributes)
