"""Conclusions from two observed periods for one body and for all bodies, as numbers and as text."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kernels.events import tumbling
from sweeps.schema.refusals import DefinitionError, display
from sweeps.schema.variables import parse_amount
from sweeps.systems.bodies import shapes
from sweeps.systems.bodies.variables import MOMENTS
from sweeps.systems.observed_periods.system import MAX_EXCLUSION, MAX_PERIOD, MIN_PERIOD, PERIODS, SYSTEM, NoIntegration

UNITS = {"s": 1.0, "h": 3600.0, "d": 86400.0}
SHAPES = {"I1_over_I3": {"start": 0.01, "stop": 0.99, "num": 99}, "thickness": {"start": 0.0, "stop": 1.0, "num": 51}}
MIN_PERIOD_RATIO = {"sam": 1.0, "lam": 0.0}  # least ratio of periods over all bodies, of flat bodies and of needles
MODES = {"sam": tumbling.SAM, "lam": tumbling.LAM}
VERDICTS = ("possible", "within_errors", "excluded")


@dataclass(frozen=True)
class TwoPeriods:
    """Two periods and their standard errors, in one unit."""

    P_psi: float | str  #: period in the body
    P_phi: float | str  #: period about L in the long-axis convention
    sigma_psi: float | str = 0.0  #: standard error of P_psi
    sigma_phi: float | str = 0.0  #: standard error of P_phi
    unit: str = "h"  #: s, h or d

    def __post_init__(self):
        if self.unit not in list(UNITS):
            raise DefinitionError(f"unit: {self.unit!r} is not available; allowed: {', '.join(UNITS)}")
        for name in PERIODS:
            value = parse_amount(name, entry := getattr(self, name), self.unit)
            lower_bound = 0.0 if "sigma" in name else MIN_PERIOD
            if not lower_bound <= value * UNITS[self.unit] <= MAX_PERIOD:
                raise DefinitionError(
                    f"{name}: {display(entry)} is out of range; allowed: {lower_bound:g} to {MAX_PERIOD:g} s"
                )
            object.__setattr__(self, name, value)

    @property
    def seconds(self) -> dict[str, float]:
        """Name → each period and error, s."""
        return {name: getattr(self, name) * UNITS[self.unit] for name in PERIODS}

    @property
    def definition(self) -> dict:
        """The definition of the map over all bodies."""
        period_texts = [
            f"P_{name} = {period:g} {f'± {error:g} ' if error else ''}{self.unit}"
            for name, period, error in (("psi", self.P_psi, self.sigma_psi), ("phi", self.P_phi, self.sigma_phi))
        ]
        grid = {"ratios": SHAPES, **self.seconds}
        return {"title": f"Bodies with {' and '.join(period_texts)}", "system": "observed_periods", "grid": grid}


def periods_of_body(periods: TwoPeriods, ratios: Sequence[float]) -> list[dict]:
    """Return the conclusions from the periods for one body, `ratios` I1/I3 and I2/I3, in each mode.

    Returns:
        For each mode {mode, verdict, sigma, least_ratio}, and unless it is excluded energy, energy_stderr, m, omega0.
    """
    try:
        first, second = (float(ratio) for ratio in ratios)
    except (TypeError, ValueError, OverflowError):
        reason = f"ratios: {display(ratios)} are no two numbers"
        raise DefinitionError(f"{reason}; allowed: I1/I3 and I2/I3, each a number in (0, 1]") from None
    for name, value in (("I1/I3", first), ("I2/I3", second)):
        if not 0 < value <= 1:
            raise DefinitionError(f"ratios: {name} {value!r} is out of range; allowed: a number in (0, 1]")
    moments = (*sorted((first, second)), 1.0)
    shapes.refuse_impossible("ratios", moments)
    point = dict(zip(MOMENTS, moments, strict=True)) | periods.seconds
    columns = SYSTEM.columns({name: np.array([value]) for name, value in point.items()}, NoIntegration())
    values = {name: column.item() for name, column in columns.items()}
    min_ratios = tumbling.inverse(*moments, periods.P_psi / periods.P_phi)["least_ratio"]
    rows = []
    for mode, k in MODES.items():
        sigma, energy = values[f"exclusion_{mode}"], values[f"energy_{mode}"]
        rows.append({"mode": mode, "verdict": verdict(sigma), "sigma": sigma, "least_ratio": float(min_ratios[k, 0])})
        if math.isfinite(energy):
            rows[-1] |= {"energy": energy, "energy_stderr": values[f"energy_{mode}_stderr"]}
            rows[-1] |= {"m": values[f"parameter_{mode}"], "omega0": values[f"momentum_rate_{mode}"]}
    return rows


def verdict(sigma: float) -> str:
    """Return the word of VERDICTS for an exclusion by `sigma` standard errors."""
    return VERDICTS[0] if sigma == 0 else VERDICTS[1] if sigma <= MAX_EXCLUSION else VERDICTS[2]


def periods_of_all_bodies(periods: TwoPeriods, ds) -> list[dict]:
    """Return the conclusions from the periods for all bodies, in each mode.

    The verdict is that for all possible bodies, not only those of the map: the least ratio of periods is 1 in the
    short-axis mode (flat bodies, small wobbles) and 0 in the long-axis mode (needles). Each mode has {mode, verdict,
    sigma, shapes (the fraction of the triangle with both periods), least and greatest energy}.
    """
    x, t = ds["I1_over_I3"].values, ds["thickness"].values
    weights = np.outer(x, np.where((t == 0) | (t == 1), 0.5, 1.0))  # dx dy = x dx dt
    rows = []
    for mode, min_ratio in MIN_PERIOD_RATIO.items():
        energy = ds[f"energy_{mode}"].transpose("I1_over_I3", "thickness", ...).values.reshape(weights.shape)
        shortfall = min_ratio * periods.P_phi - periods.P_psi
        error = math.hypot(periods.sigma_psi, min_ratio * periods.sigma_phi)
        sigma = 0.0 if shortfall < 0 else shortfall / error if error else math.inf
        finite = np.isfinite(energy)
        share = float(weights[finite].sum() / weights.sum())
        rows.append({"mode": mode, "verdict": verdict(sigma), "sigma": sigma, "shapes": share})
        if finite.any():
            rows[-1] |= {"least_energy": float(energy[finite].min())}
            rows[-1]["greatest_energy"] = float(energy[finite].max())
    return rows


def describe_row(row: dict, periods: TwoPeriods) -> str:
    """Return one mode's answer in words."""
    is_one_body, ratio = "least_ratio" in row, periods.P_psi / periods.P_phi
    if row["verdict"] == "excluded":
        min_ratio, which_body = (
            (row["least_ratio"], "this body") if is_one_body else (MIN_PERIOD_RATIO[row["mode"]], "any body")
        )
        if math.isinf(min_ratio):
            return "excluded: a symmetric body has no such mode"
        confidence = "" if math.isinf(row["sigma"]) else f" at {row['sigma']:.2g}σ"
        return (
            f"excluded{confidence}: P_psi/P_phi = {ratio:.6g}, but for {which_body} this ratio exceeds {min_ratio:.6g}"
        )
    if row["verdict"] == "within_errors":
        flat_words = "" if is_one_body else " of a flat body"
        return f"possible within the errors: {row['sigma']:.2g}σ from the limit of small wobbles{flat_words}"
    if is_one_body:
        error = f" ± {row['energy_stderr']:.2g}" if row["energy_stderr"] else ""
        rate = f"L/I3 = {row['omega0']:.6g} rad s⁻¹"
        rate = "too near the separatrix for L/I3" if math.isnan(row["omega0"]) else rate
        return f"2T I3/L² = {row['energy']:.6g}{error}, m = {row['m']:.6g}, {rate}"
    if "least_energy" not in row:
        needles = f"needles only, I1/I3 below {ratio / (1 + ratio):.3g}"
        return f"possible for {needles if row['mode'] == 'lam' else 'nearly flat bodies only'}"
    share = f"{100 * row['shapes']:.2g}".replace("1e+02", "100")
    energy_range = f"from {row['least_energy']:.4g} to {row['greatest_energy']:.4g}"
    return f"possible for {share} % of all shapes, 2T I3/L² {energy_range}"
