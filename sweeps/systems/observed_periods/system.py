"""Two observed periods of a tumbling body: the energy with both periods in each mode, or the exclusion of the mode."""

import math
from collections.abc import Mapping
from typing import Annotated, ClassVar

import numpy as np

from kernels.estimator import statuses
from sweeps.schema.parameters import Strict, grid_model, key, mapping
from sweeps.schema.values import number
from sweeps.schema.variables import Parameter, Quantity
from sweeps.systems.bodies import variables as bodies
from sweeps.systems.bodies.body import BodiesDefinition
from sweeps.systems.bodies.free_body import FreeBody
from sweeps.systems.bodies.shapes import RATIOS
from sweeps.systems.bodies.variables import MOMENTS
from sweeps.systems.shared_variables import make_status, parse_rows
from sweeps.systems.system import Example, Reference
from sweeps.systems.tumbling.system import A_POINT

PERIODS = ("P_psi", "P_phi", "sigma_psi", "sigma_phi")
ARGUMENTS = (*MOMENTS, *PERIODS)
MAX_EXCLUSION = 3.0  # standard errors, beyond which a mode counts as excluded
MAX_RATIO_DEVIATION = 1e-6  # relative deviation of the ratio of periods at the found energy; beyond: not_converged

WORDS = {"sam": "short-axis mode", "lam": "long-axis mode"}


def _mode_rows(mode: str) -> str:
    """Return the rows of `parse_rows` for the variables of one mode, sam or lam."""
    words = WORDS[mode]
    return f"""
    exclusion_{mode}      1  standard errors by which the observed ratio of periods is below the minimum of the {words}
        comment: 0 where not below; infinite where the body has no such mode, or the periods have no errors
    energy_{mode}         1  energy that gives both periods in the {words}, 2T I3/L^2
        comment: missing where no motion of that mode has the observed ratio of periods
    energy_{mode}_stderr  1  standard error of energy_{mode}, from those of the periods
        comment: the larger deviation of the energies at one standard error of the ratio either way; of one alone where
        the other ratio is below the minimum of the mode
    parameter_{mode}      1  parameter m of the elliptic functions of that motion in the {words}
        comment: 0 in the limit of small wobbles and for symmetric bodies, 1 on the separatrix
    momentum_rate_{mode}  rad s-1  L/I3 that gives P_psi in the {words}
        comment: missing also where the separatrix is so near that the energy, a double, does not fix it to 1e-6
    """


VARIABLES = parse_rows(
    f"""
    modes  -  modes that allow both observed periods [headline]
        flags: 0 none sam lam both
        comment: a mode is listed unless it is excluded by more than {MAX_EXCLUSION:g} standard errors; sam: short-axis
        mode; lam: long-axis mode
    """,
    make_status(
        statuses.NOT_CONVERGED,
        "whether the closed form reproduces the observed ratio from each energy",
        "not_converged: so near the separatrix that the energy, a double, fixes the ratio only to 1e-6 or worse",
    ),
    _mode_rows("sam"),
    _mode_rows("lam"),
    bodies.TRIANGLE_MARGIN,
)

MIN_PERIOD, MAX_PERIOD = 1e-150, 1e150  # s, bounds on observed periods: their squares are doubles
_PERIOD, _ERROR = f"{MIN_PERIOD:g} to {MAX_PERIOD:g}", f"0 to {MAX_PERIOD:g}"
PERIOD = Quantity(
    "period", "s", _PERIOD, Annotated[float, number(lambda x: MIN_PERIOD <= x <= MAX_PERIOD, f"{_PERIOD}, in s")]
)
ERROR = Quantity("error", "s", _ERROR, Annotated[float, number(lambda x: 0.0 <= x <= MAX_PERIOD, f"{_ERROR}, in s")])

PARAMETERS = (
    *bodies.PRINCIPAL,
    Parameter("P_psi", PERIOD, "observed period of the angular velocity in the body", required=True),
    Parameter(
        "P_phi",
        PERIOD,
        "observed mean precession period of the axis of least inertia about L (long-axis convention)",
        required=True,
    ),
    Parameter("sigma_psi", ERROR, "standard error of P_psi", 0.0),
    Parameter("sigma_phi", ERROR, "standard error of P_phi", 0.0),
)

LAYOUT = bodies.layout(PARAMETERS, VARIABLES, VARIABLES)


PeriodsGrid = grid_model("PeriodsGrid", PARAMETERS, __name__, RATIOS)


class NoIntegration(Strict):
    """An empty mapping, as no motion is integrated."""

    samples: ClassVar = 1  # length of a run in the estimate of time, for closed forms


class ObservedPeriodsDefinition(BodiesDefinition):
    """A sweep of bodies with two observed periods."""

    grid: PeriodsGrid = mapping("what is varied", PeriodsGrid, required=True)
    integration: NoIntegration = key("an empty mapping: energies are computed in closed form", NoIntegration())


class ObservedPeriods(FreeBody):
    """The inverse problem of tumbling: in each mode the energy of a body with both periods, or the mode's exclusion."""

    name = "observed_periods"
    samples_per_second = 5_000
    model = ObservedPeriodsDefinition
    kernels = ("events.tumbling", "estimator.statuses", "free.triangle")
    compiled = (
        Example("events.tumbling", "inverse", (1.0, 2.0, 3.0, 3.0)),
        Example("events.tumbling", "survey", (A_POINT, 1e-10, False)),
    )
    compile_seconds = 3.0
    method_text = "closed form of the energies from tumbling periods"
    references = "Kaasalainen, Astronomy and Astrophysics 376 (2001) 302; Landau and Lifshitz, Mechanics, section 37"
    caption = "energies of tumbling bodies that give two observed periods"

    def columns(self, points: Mapping[str, np.ndarray], integration: NoIntegration) -> dict[str, np.ndarray]:
        """Return exclusion, energy and angular momentum of each body in each mode; see `VARIABLES`."""
        from kernels.events import tumbling
        from kernels.free import triangle

        modes = {"sam": tumbling.SAM, "lam": tumbling.LAM}
        moments = np.sort([points[name] for name in MOMENTS], axis=0)
        P_psi, P_phi, sigma_psi, sigma_phi = periods = [points[name] for name in PERIODS]
        ratio = P_psi / P_phi
        spread = ratio * np.hypot(sigma_psi / P_psi, sigma_phi / P_phi)
        inverse = tumbling.inverse(*moments, ratio)
        lower, upper = (tumbling.inverse(*moments, np.maximum(ratio + s, 0.0))["energy"] for s in (-spread, spread))
        result, is_unconverged = {}, np.zeros(ratio.shape, dtype=bool)
        for mode, k in modes.items():
            energy = inverse["energy"][k]
            has_energy = np.isfinite(energy)
            result[f"exclusion_{mode}"] = exclusion(inverse["least_ratio"][k], *periods)
            result[f"energy_{mode}"] = energy
            energy_error = np.fmax(np.abs(lower[k] - energy), np.abs(upper[k] - energy))
            result[f"energy_{mode}_stderr"] = np.where(has_energy, energy_error, np.nan)
            result[f"parameter_{mode}"] = inverse["m"][k]
            point = {"energy": np.where(has_energy, energy, 1.0), "omega0": np.ones_like(energy)}  # in units of I3/L
            tumbling_columns = tumbling.survey(dict(zip(MOMENTS, moments, strict=True)) | point, 1e-10, measured=False)
            ratio_again = tumbling_columns["period_psi_exact"] / tumbling_columns["period_phi_long_axis_exact"]
            is_reproduced = has_energy & (np.abs(ratio_again / ratio - 1.0) <= MAX_RATIO_DEVIATION)
            result[f"momentum_rate_{mode}"] = np.where(
                is_reproduced, tumbling_columns["period_psi_exact"] / P_psi, np.nan
            )
            is_unconverged |= has_energy & ~is_reproduced
        allowed = [result[f"exclusion_{mode}"] <= MAX_EXCLUSION for mode in modes]
        result["modes"] = (allowed[0] + 2 * allowed[1]).astype(np.int8)
        result["status"] = np.where(is_unconverged, statuses.NOT_CONVERGED, statuses.OK).astype(np.int8)
        result["triangle_margin"] = triangle.triangle_margin(*moments)
        return result

    def reference(self) -> Reference:
        """Return the energy in each mode by SciPy."""
        return _energy_reference("lam", "long-axis mode", _energy_reference("sam", "short-axis mode"))


def exclusion(min_ratio: np.ndarray, P_psi, P_phi, sigma_psi, sigma_phi) -> np.ndarray:
    r"""Return the number of standard errors by which the observed P_psi/P_phi is below the least ratio r of a mode.

    The mode requires :math:`P_\psi > r P_\phi`. The errors are independent and normal, so :math:`P_\psi - r P_\phi` is
    normal with the variance :math:`\sigma_\psi^2 + r^2\sigma_\phi^2`, without linearisation. The result is 0 if the
    mode has the ratio, and infinite if there is no such mode (r infinite) or the periods have no errors.

    Args:
        min_ratio: r, shape (n,).
        P_psi: period in the body, s, shape (n,).
        P_phi: period about L, s, shape (n,).
        sigma_psi: standard error of P_psi, s, shape (n,).
        sigma_phi: standard error of P_phi, s, shape (n,).
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        shortfall = min_ratio * P_phi - P_psi
        sigmas = np.where(shortfall > 0.0, shortfall / np.hypot(sigma_psi, min_ratio * sigma_phi), 0.0)
    return np.where(np.isinf(min_ratio), np.inf, sigmas)


MIN_SEPARATRIX_DISTANCE = 1e-6  # relative to the range of energies; nearer, quadrature of the ratio is inaccurate
MAX_DEVIATION = 1e-8  # relative deviation of an energy from the reference, for a sphere; times the ratio of moments


def period_ratio(moments: np.ndarray, energy: float) -> float:
    r"""Return P_psi/P_phi (long axis) of a body of ascending moments at the energy 2T I3/L^2, in either mode.

    With L = 1 and moments I1 < I2 < I3 the components of the angular momentum along the body are those of Landau and
    Lifshitz, section 37, and the axis of least moment precesses about L at the rate
    :math:`\dot\phi = L\,(L_2\omega_2 + L_3\omega_3)/(L_2^2 + L_3^2)`. Its mean over the period of the angular
    velocity is the mean over a quarter of it.
    """
    from scipy.integrate import quad
    from scipy.special import ellipj, ellipk

    I1, I2, I3 = moments
    T2 = energy / I3  # at L = 1
    long = energy * I2 > I3  # the polhode encircles axis 1, and axes 1 and 3 exchange their roles
    Ia, Ic = (I3, I1) if long else (I1, I3)
    p = math.sqrt((Ic - I2) * (1.0 - T2 * Ia) / (I1 * I2 * I3))
    m = (I2 - Ia) * (T2 * Ic - 1.0) / ((Ic - I2) * (1.0 - T2 * Ia))
    a = math.sqrt(Ia * (T2 * Ic - 1.0) / (Ic - Ia))
    b = math.sqrt(I2 * (T2 * Ic - 1.0) / (Ic - I2))
    c = math.sqrt(Ic * (1.0 - T2 * Ia) / (Ic - Ia))
    K = float(ellipk(m))

    def rate(u):
        """Return the rotation rate of the axis of least inertia about L, over L, at the elliptic argument u."""
        sn, cn, dn, _ = ellipj(u, m)
        along, second, encircled = a * cn, b * sn, c * dn
        third = along if long else encircled
        across = second * second + third * third
        return (second * second / I2 + third * third / I3) / across

    mean = quad(rate, 0.0, K, epsabs=0.0, epsrel=1e-12, limit=400)[0] / K
    return mean * 4.0 * K / p / (2.0 * math.pi)


def energy_of(point: Mapping[str, float], mode: str) -> float:
    """Return the energy of a mode that gives the point's ratio of periods; NaN if none does."""
    from scipy.optimize import brentq

    moments = np.sort([float(point[f"I{i}"]) for i in (1, 2, 3)])
    moments = moments / moments[2]
    observed_ratio = float(point["P_psi"]) / float(point["P_phi"])
    separatrix = moments[2] / moments[1]
    end = 1.0 if mode == "sam" else moments[2] / moments[0]
    gap = separatrix - end
    if abs(gap) < 1e-3 or moments[0] == moments[1]:
        return math.nan
    low, high = end + 1e-9 * gap, separatrix - MIN_SEPARATRIX_DISTANCE * gap
    if not period_ratio(moments, low) < observed_ratio < period_ratio(moments, high):
        return math.nan
    return float(
        brentq(lambda energy: period_ratio(moments, energy) - observed_ratio, low, high, xtol=1e-13, rtol=1e-14)
    )


def _energy_reference(mode: str, words: str, *more: Reference) -> Reference:
    """Return the reference for the energy of a mode: SciPy's root for the observed ratio of periods, and `more`."""

    def allowed(point: Mapping[str, float], integration) -> float:
        return MAX_DEVIATION * max(point["I1"], point["I2"], point["I3"]) / min(point["I1"], point["I2"], point["I3"])

    return Reference(f"energy_{mode}", {f"SciPy, {words}": lambda point, _: energy_of(point, mode)}, allowed, more)


SYSTEM = ObservedPeriods()
