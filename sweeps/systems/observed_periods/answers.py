"""Conclusions from two observed periods for one body and for all bodies, as numbers and as text."""

import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kernels.events import tumbling
from sweeps.schema.refusals import DefinitionError, display
from sweeps.schema.variables import parse_amount
from sweeps.systems.bodies import shapes
from sweeps.systems.observed_periods import system
from sweeps.systems.observed_periods.system import MAX_EXCLUSION, MAX_PERIOD, MIN_PERIOD, PERIODS, NoIntegration

UNITS = {"s": 1.0, "min": 60.0, "h": 3600.0, "d": 86400.0}
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
    unit: str = "h"  #: s, min, h or d

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
    def ratio(self) -> float:
        """P_psi/P_phi."""
        return self.seconds["P_psi"] / self.seconds["P_phi"]

    @property
    def definition(self) -> dict:
        """The definition of the map over all bodies."""
        period_texts = [
            f"P_{name} = {period:g} {f'± {error:g} ' if error else ''}{self.unit}"
            for name, period, error in (("psi", self.P_psi, self.sigma_psi), ("phi", self.P_phi, self.sigma_phi))
        ]
        grid = {"ratios": SHAPES, **self.seconds}
        return {"title": f"Bodies with {' and '.join(period_texts)}", "system": "observed_periods", "grid": grid}


def periods_of_body(
    periods: TwoPeriods, ratios: Sequence[float], sigma_ratios: Sequence[float] = (0.0, 0.0)
) -> list[dict]:
    """Return the conclusions from the periods for one body in each mode.

    Args:
        periods: the periods.
        ratios: I1/I3 and I2/I3.
        sigma_ratios: their standard errors, independent of each other and of the periods.

    Returns:
        For each mode {mode, verdict, sigma, least_ratio}, and unless it is excluded energy, energy_stderr, m, omega0
        (L/I3, rad s-1), nutation (least and greatest angle of the long axis from L, rad), and P_phi_short_axis, the
        period of the axis of greatest inertia about L, s.
    """
    numbers = _check_pair("ratios", ratios, sys.float_info.min, "(0, 1]")
    order = np.argsort(numbers, kind="stable")
    low, middle = np.array(numbers)[order].tolist()
    errors = np.array(_check_pair("sigma_ratios", sigma_ratios, 0.0, "[0, 1]"))[order]
    shapes.refuse_impossible("ratios", (low, middle, 1.0))
    body = _solve_body(periods, low, middle)
    squares = {"energy": np.zeros(2), "least_ratio": np.zeros(2)}  # squared deviations by one standard error
    for step in filter(np.any, np.diag(errors)):
        pairs = [np.sort([low, middle] + sign * step) for sign in (-1, 1)]
        shifted = [_solve_body(periods, *pair) for pair in pairs if 0 < pair[0] <= pair[1] <= 1 <= pair.sum()]
        for name in squares if shifted else ():
            with np.errstate(invalid="ignore"):
                deviations = np.fmax.reduce([np.abs(each[name] - body[name]) for each in shifted])
            squares[name] += np.nan_to_num(deviations, posinf=0.0) ** 2
    sigma_psi = np.hypot(periods.sigma_psi, periods.P_phi * np.sqrt(squares["least_ratio"]))
    sigmas = system.exclusion(body["least_ratio"], periods.P_psi, periods.P_phi, sigma_psi, periods.sigma_phi)
    body["energy_stderr"] = np.hypot(body["energy_stderr"], np.sqrt(squares["energy"]))
    rows = []
    for number, (mode, sigma) in enumerate(zip(MODES, sigmas.tolist(), strict=True)):
        values = {name: float(column[number]) for name, column in body.items()}
        energy, least_ratio = values["energy"], values.pop("least_ratio")
        rows.append({"mode": mode, "verdict": verdict(sigma), "sigma": sigma, "least_ratio": least_ratio})
        if math.isfinite(energy):
            period = 1 / (1 / periods.seconds["P_phi"] + 1 / periods.seconds["P_psi"])
            rows[-1] |= values | {"nutation": nutation((low, middle), energy, mode), "P_phi_short_axis": period}
    return rows


def _check_pair(name: str, values: Sequence[float], minimum: float, interval: str) -> list[float]:
    """Return two numbers from `minimum` to 1, of I1/I3 and I2/I3; a refusal has their name and the interval."""
    try:
        first, second = numbers = [float(value) for value in values]
    except (TypeError, ValueError, OverflowError):
        reason = f"{name}: {display(values)} are no two numbers"
        raise DefinitionError(f"{reason}; allowed: of I1/I3 and I2/I3, each a number in {interval}") from None
    for label, value in (("I1/I3", first), ("I2/I3", second)):
        if not minimum <= value <= 1:
            raise DefinitionError(f"{name}: {label} {value!r} is out of range; allowed: a number in {interval}")
    return numbers


def _solve_body(periods: TwoPeriods, low: float, middle: float) -> dict[str, np.ndarray]:
    """Return the columns of a body of ratios `low` and `middle` by name, each in both modes, shape (2,)."""
    point = {"I1": float(low), "I2": float(middle), "I3": 1.0} | periods.seconds
    columns = system.SYSTEM.columns({name: np.array([value]) for name, value in point.items()}, NoIntegration())
    names = {
        "energy": "energy_{}",
        "energy_stderr": "energy_{}_stderr",
        "m": "parameter_{}",
        "omega0": "momentum_rate_{}",
    }
    body = {name: np.array([columns[form.format(mode)].item() for mode in MODES]) for name, form in names.items()}
    return body | {"least_ratio": tumbling.inverse(low, middle, 1.0, periods.ratio)["least_ratio"][:, 0]}


def nutation(ratios: tuple[float, float], energy: float, mode: str) -> list[float]:
    r"""Return the least and the greatest angle of the axis of least inertia from L, rad.

    With I3 = 1 and the components m of the unit vector along L, the energy is :math:`E = \sum m_i^2/I_i`. The square of
    m_1 has its extremes where m_2 = 0 and, in the long-axis mode, where m_3 = 0; in the short-axis mode m_1 changes
    sign.

    Args:
        ratios: I1/I3 and I2/I3, ascending.
        energy: 2T I3/L^2.
        mode: sam or lam.
    """
    low, middle = ratios
    squares = [(energy - 1) / (1 / low - 1)] if low < 1 else [0.0]
    squares += [(energy - 1 / middle) / (1 / low - 1 / middle)] if mode == "lam" else []
    angles = sorted(math.acos(math.sqrt(min(max(square, 0.0), 1.0))) for square in squares)
    return [angles[0], math.pi - angles[0] if mode == "sam" else angles[-1]]


def periods_of_any_body(periods: TwoPeriods) -> list[dict]:
    """Return {mode, verdict, sigma} of each mode for all possible bodies.

    The least ratio of periods is 1 in the short-axis mode (flat bodies, small wobbles) and 0 in the long-axis mode
    (needles).
    """
    values = [getattr(periods, name) for name in PERIODS]
    sigmas = {mode: float(system.exclusion(np.array(ratio), *values)) for mode, ratio in MIN_PERIOD_RATIO.items()}
    return [{"mode": mode, "verdict": verdict(sigma), "sigma": sigma} for mode, sigma in sigmas.items()]


def verdict(sigma: float) -> str:
    """Return the word of VERDICTS for an exclusion by `sigma` standard errors."""
    return VERDICTS[0] if sigma == 0 else VERDICTS[1] if sigma <= MAX_EXCLUSION else VERDICTS[2]


def periods_of_all_bodies(periods: TwoPeriods, ds) -> list[dict]:
    """Return the conclusions from the periods for all bodies, in each mode.

    The verdict is that for all possible bodies, not only those of the map. Each mode has {mode, verdict, sigma, shapes
    (the fraction of the triangle with both periods), least and greatest energy}.
    """
    x, t = ds["I1_over_I3"].values, ds["thickness"].values
    weights = np.outer(x, np.where((t == 0) | (t == 1), 0.5, 1.0))  # dx dy = x dx dt
    rows = periods_of_any_body(periods)
    for row in rows:
        energy = ds[f"energy_{row['mode']}"].transpose("I1_over_I3", "thickness", ...).values.reshape(weights.shape)
        finite = np.isfinite(energy)
        row["shapes"] = float(weights[finite].sum() / weights.sum())
        if finite.any():
            row |= {"least_energy": float(energy[finite].min()), "greatest_energy": float(energy[finite].max())}
    return rows


def describe_row(row: dict, periods: TwoPeriods) -> str:
    """Return one mode's answer in words."""
    is_one_body, ratio = "least_ratio" in row, periods.ratio
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
        angles = " to ".join(f"{math.degrees(angle):.4g}°" for angle in row["nutation"])
        return f"2T I3/L² = {row['energy']:.6g}{error}, m = {row['m']:.6g}, {rate}, long axis {angles} from L"
    if "shapes" not in row:
        return "possible"
    if "least_energy" not in row:
        needles = f"needles only, I1/I3 below {ratio / (1 + ratio):.3g}"
        return f"possible for {needles if row['mode'] == 'lam' else 'nearly flat bodies only'}"
    share = f"{100 * row['shapes']:.2g}".replace("1e+02", "100")
    energy_range = f"from {row['least_energy']:.4g} to {row['greatest_energy']:.4g}"
    return f"possible for {share} % of all shapes, 2T I3/L² {energy_range}"
