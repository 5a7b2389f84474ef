r"""Signed rates, fits of deviations from theory to a power law in ε, and observed periods, for figures and pages."""

import math
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from sweeps.reading.definitions import definition_of
from sweeps.schema.datasets import Dataset
from sweeps.systems.motion import DAY

if TYPE_CHECKING:
    from sweeps.systems.rigid_body.system import Observed

# Smaller deviations are those of rounding and integration, larger deviations have contributions of higher order.
MIN_FIT_DEVIATION, MAX_FIT_DEVIATION = 1e-11, 1e-2
FLOOR_FACTOR = 10.0
FLOOR_SPAN = 3.0
MIN_FIT_POINTS = 4


def signed_rate(omega_squared, omega0):
    r"""Return the signed rate over the spin rate, sign(Ω²)·√|Ω²|/|ω0|: positive oscillates, negative grows."""
    return np.sign(omega_squared) * np.sqrt(np.abs(omega_squared)) / np.abs(omega0)


# -- the power law of the deviation in epsilon


def power_law(x, y, low: float) -> float:
    r"""Return the exponent p of y ∝ x^p by least squares of ln y against ln x, over `low` ≤ y ≤ `MAX_FIT_DEVIATION`.

    The result is NaN below `MIN_FIT_POINTS` points.

    Args:
        x: positive numbers, shape (n,).
        y: positive numbers, shape (n,).
        low: lower bound of y, > 0.
    """
    in_range = (y >= low) & (y <= MAX_FIT_DEVIATION)
    if np.count_nonzero(in_range) < MIN_FIT_POINTS:
        return math.nan
    return float(np.polyfit(np.log(x[in_range]), np.log(y[in_range]), 1)[0])


def deviation_floor(epsilon, deviation, error) -> float:
    """Return the deviation below which a series does not follow the law: ten times its value at the least ε.

    Args:
        epsilon: size of the perturbation, ascending, shape (n,).
        deviation: |Ω²/Ω²_theory − 1|, shape (n,).
        error: relative error of the reduced Ω², shape (n,), without effects of the amplitude.

    Returns:
        The larger of `FLOOR_FACTOR` times the median deviation and the median error, over ε up to `FLOOR_SPAN` times
        the least one; infinite without a finite value.
    """
    epsilon, deviation, error = (np.asarray(values, float) for values in (epsilon, deviation, error))
    finite = np.isfinite(deviation) & np.isfinite(error)
    if not finite.any():
        return math.inf
    first = finite & (epsilon <= FLOOR_SPAN * epsilon[finite][0])
    return max(FLOOR_FACTOR * float(np.median(deviation[first])), float(np.median(error[first])))


def fit_breakdown(ds: Dataset) -> Dataset:
    r"""Fit the exponent p of |Ω²/Ω²_theory − 1| ∝ ε^p for each body and axis.

    The fit uses points with status ok and a deviation between 1e-11 and 1e-2 and above `deviation_floor`.
    Second-order perturbation theory has p = 2 for Ω² ≠ 0 (the leading correction is quadratic by the symmetry of
    Euler's equations under ω_b, ω_c → −ω_b, −ω_c).

    Args:
        ds: a map with the dimension epsilon; its omega_squared and errors are read into memory.

    Returns:
        A Dataset with `deviation` (over all dimensions), `floor` and the exponent `slope` (over all but epsilon), 1.
        The exponent is NaN if the theory is 0 or fewer than `MIN_FIT_POINTS` points remain.
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
    fit: dict[str, Any] = {"input_core_dims": [["epsilon"], []], "vectorize": True}
    slope = xr.apply_ufunc(lambda y, low: power_law(epsilon, y, max(MIN_FIT_DEVIATION, low)), deviation, floor, **fit)
    return xr.Dataset({"deviation": deviation, "floor": floor, "slope": slope})


# -- observed periods


@dataclass(frozen=True)
class Period:
    """Measured and observed period of a body."""

    body: str  #: its name
    axis: int  #: the usual spin axis
    measured_days: float  #: `euler_period` of the rigid body, measured from its motion, days; NaN without one
    observed_days: float  #: observed period, days of 86,400 s
    what: str  #: motion with this period
    note: str  #: remark for the reader


def compare_periods(ds: Dataset) -> list[Period]:
    """Return measured and observed periods of the bodies of a map with an `observed` entry and an axis.

    Dimensions omega0 and phase are cut at their first value, epsilon at its least.
    """
    first = {dim: 0 for dim in ("omega0", "phase") if dim in ds.dims}
    if "epsilon" in ds.dims:
        first["epsilon"] = int(np.argmin(ds["epsilon"].values))
    euler = ds["euler_period"].isel({dim: at for dim, at in first.items() if dim in ds["euler_period"].dims})
    return [
        Period(name, axis, float(euler.sel(body=name, axis=axis)) / DAY, observed.period_days, observed.what, note)
        for name, axis, observed, note in _observations(ds)
        if axis in ds["axis"].values
    ]


def _observations(ds: Dataset) -> Iterator[tuple[str, int, "Observed", str]]:
    """Yield name, usual axis, observation and note by a map's definition, which may have values of any type."""
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
                yield name, axis, observed, note if isinstance(note, str) else ""
