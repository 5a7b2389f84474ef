r"""Numbers behind the pictures: signed rates, the power law of deviations in ε, and periods in days."""

import math
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sweeps.reading.definitions import definition_of
from sweeps.schema.datasets import Dataset
from sweeps.systems.motion import DAY

# Below, rounding and the tolerance of the integration stand in for the law; above, its next term does.
MIN_FIT_DEVIATION, MAX_FIT_DEVIATION = 1e-11, 1e-2
FLOOR_FACTOR = 10.0
FLOOR_SPAN = 3.0
MIN_FIT_POINTS = 4


def signed_rate(omega_squared, omega0):
    r"""Return the signed rate over the spin rate, sign(Ω²)·√|Ω²|/|ω0|: positive oscillates, negative grows."""
    return np.sign(omega_squared) * np.sqrt(np.abs(omega_squared)) / np.abs(omega0)


# -- the power law of the deviation in epsilon


def power_law(x, y, low: float = MIN_FIT_DEVIATION, high: float = MAX_FIT_DEVIATION) -> tuple[float, float, int]:
    r"""Fit the exponent of y ∝ x^p by least squares of ln y against ln x, over the points with low ≤ y ≤ high.

    Returns:
        (p, its standard error, number of points fitted); p and its error are NaN below `MIN_FIT_POINTS` points.
    """
    x, y = np.asarray(x, float), np.asarray(y, float)
    in_range = (y >= low) & (y <= high) & (y > 0) & (x > 0)
    n = int(np.count_nonzero(in_range))
    if n < MIN_FIT_POINTS:
        return math.nan, math.nan, n
    (slope, _), covariance = np.polyfit(np.log(x[in_range]), np.log(y[in_range]), 1, cov=True)
    return float(slope), math.sqrt(covariance[0, 0]), n


def deviation_floor(epsilon, deviation, error) -> float:
    """Return the deviation below which a series shows no law: ten times its value at the least ε.

    Args:
        epsilon: size of the perturbation, ascending, shape (n,).
        deviation: |Ω²/Ω²_theory − 1| there, shape (n,).
        error: the relative error of the reduced Ω², shape (n,): what no amplitude makes.

    Returns:
        The larger of `FLOOR_FACTOR` times the one's median and the other's, from the least ε with values up to
        `FLOOR_SPAN` times that; infinite where there is no value.
    """
    epsilon, deviation, error = (np.asarray(values, float) for values in (epsilon, deviation, error))
    finite = np.isfinite(deviation) & np.isfinite(error)
    if not finite.any():
        return math.inf
    first = finite & (epsilon <= FLOOR_SPAN * epsilon[finite][0])
    return max(FLOOR_FACTOR * float(np.median(deviation[first])), float(np.median(error[first])))


def fit_breakdown(ds: Dataset) -> Dataset:
    r"""Fit the exponent p of |Ω²/Ω²_theory − 1| ∝ ε^p for each body and axis.

    The fit uses points with status ok whose deviation lies between 1e-11 and 1e-2 and above `deviation_floor`.
    Second-order perturbation theory has p = 2 wherever Ω² ≠ 0 (the leading correction is quadratic by the symmetry of
    Euler's equations under ω_b, ω_c → −ω_b, −ω_c).

    Args:
        ds: a map with the dimension epsilon; what it holds of omega_squared is read whole, so select first.

    Returns:
        A Dataset with `deviation` and `floor` (1; over all dimensions, and over all but epsilon), and `slope`,
        `slope_stderr`, `fitted` (1; over all but epsilon): p, its standard error and the number of points fitted.
        NaN where the theory is 0 or fewer than `MIN_FIT_POINTS` points remain.
    """
    import xarray as xr

    names = ["omega_squared", "omega_squared_theory", "omega_squared_reduced_error", "status"]
    ds = ds[names].load().sortby("epsilon")
    theory = ds["omega_squared_theory"].where(ds["omega_squared_theory"] != 0)
    deviation = abs(ds["omega_squared"] / theory - 1.0).where(ds["status"] == 0)
    error = abs(ds["omega_squared_reduced_error"] / theory).where(ds["status"] == 0)
    epsilon = ds["epsilon"].values
    along: dict[str, Any] = {"input_core_dims": [["epsilon"], ["epsilon"]], "vectorize": True}
    floor = xr.apply_ufunc(lambda y, off: deviation_floor(epsilon, y, off), deviation, error, **along)
    fit: dict[str, Any] = {"input_core_dims": [["epsilon"], []], "output_core_dims": [[], [], []], "vectorize": True}
    law = xr.apply_ufunc(lambda y, low: power_law(epsilon, y, max(MIN_FIT_DEVIATION, low)), deviation, floor, **fit)
    slope, error, fitted = law
    return xr.Dataset({"deviation": deviation, "floor": floor, "slope": slope, "slope_stderr": error, "fitted": fitted})


# -- periods of bodies that people have observed


@dataclass(frozen=True)
class Period:
    """One body's period, measured and observed."""

    body: str  #: its name
    axis: int  #: the axis it spins about in nature
    measured_days: float  #: `euler_period` of the rigid body, as measured from its motion, days; NaN without one
    observed_days: float  #: what people measured, days of 86,400 s
    what: str  #: what has the observed period
    note: str  #: what a reader should know


def compare_periods(ds: Dataset) -> list[Period]:
    """Return measured and observed periods of the bodies of a map with an `observed` entry and an axis.

    Of several omega0, epsilon and phase, the least epsilon and else the first is taken.
    """
    first = {dim: 0 for dim in ("omega0", "phase") if dim in ds.dims}
    if "epsilon" in ds.dims:
        first["epsilon"] = int(np.argmin(ds["epsilon"].values))
    euler = ds["euler_period"].isel({dim: at for dim, at in first.items() if dim in ds["euler_period"].dims})
    observations = [observation for observation in _observations(ds) if observation.axis in ds["axis"].values]
    return [replace(o, measured_days=float(euler.sel(body=o.body, axis=o.axis)) / DAY) for o in observations]


def _observations(ds: Dataset) -> Iterator[Period]:
    """Yield the observations in a map's definition: plain values, of which any may be of any type."""
    from pydantic import ValidationError

    from sweeps.systems.rigid_body.system import Observed

    bodies = definition_of(ds.attrs).get("bodies")
    names = set(ds["body"].values.tolist()) if "body" in ds.dims else set()
    for body in bodies if isinstance(bodies, tuple) else ():
        entry = body if isinstance(body, dict) else {}
        name, axis, note = entry.get("name"), entry.get("axis"), entry.get("note")
        if isinstance(name, str) and name in names and isinstance(axis, int):
            with suppress(ValidationError):
                observed = Observed.model_validate(entry.get("observed"))
                yield Period(
                    name, axis, math.nan, observed.period_days, observed.what, note if isinstance(note, str) else ""
                )
