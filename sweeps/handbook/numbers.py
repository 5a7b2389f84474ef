"""Numbers of the pages, and how they are read from maps.

A page contains 1.9<!--name .2g-->: the number as it was measured, and a comment, which Markdown hides, with a name of
`numbers.toml` and a format. That file has, for each map, the meaning of each number, which HTML shows to the pointer,
and its formula: of the map's variables, of the map itself, `ds`, and of the functions below.
"""

import tomllib
from pathlib import Path

import numpy as np
import xarray as xr

DAY = 86_400.0  # s
#: map → name → (meaning of the number, formula)
NUMBERS = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))


def format_number(value: float, form: str = ".3g") -> str:
    """Return a number as the pages write it: 1e-13 becomes 1 × 10⁻¹³; with the form "e" its order of magnitude."""
    if form == "e":
        return "10" + _superscript(round(float(np.log10(abs(value)))))
    text = f"{round(value):{form}}" if form.endswith("d") else f"{value:{form}}"
    mantissa, e, exponent = text.replace("-", "−", text.startswith("-")).partition("e")
    return f"{mantissa}\u202f×\u202f10{_superscript(int(exponent))}" if e else mantissa


def _superscript(exponent: int) -> str:
    return str(exponent).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))


def _earth(ds: xr.Dataset) -> xr.Dataset:
    return ds.sel(ratio=306 / 305, omega3=7.292115e-5, method="nearest").isel(half_angle=0)


def _racket(ds: xr.Dataset, axis: int) -> xr.Dataset:
    return ds.sel(I1=0.00121, I2=0.01638, axis=axis, method="nearest")


def _word(flags: xr.DataArray, word: str) -> xr.DataArray:
    """Return True at points with a flag of the meaning `word`, False everywhere if no flag has it."""
    codes = dict(zip(flags.attrs["flag_meanings"].split(), flags.attrs["flag_values"], strict=True))
    return (flags == codes[word]) if word in codes else xr.zeros_like(flags, bool)


def _otherwise(ds: xr.Dataset) -> xr.DataArray:
    """Return True at points with a measured regime that differs from theory's."""
    has_verdict = ~(_word(ds.regime, "undetermined") | _word(ds.regime, "marginal"))
    agreements = [
        _word(ds.regime, word) & _word(ds.regime_theory, word) for word in ds.regime.attrs["flag_meanings"].split()
    ]
    return has_verdict & ~xr.concat(agreements, "word").any("word")


def _brick(ds: xr.Dataset) -> xr.Dataset:
    return ds.sel(body="Brick", axis=2).sel(epsilon=1e-2, method="nearest")


def _orbit_ratio(ds: xr.Dataset) -> xr.DataArray:
    """Return the radial mode's rate over the tilting one's: modes are sorted, and which is which depends on s."""
    ratio = ds.frequency.max("mode") / ds.frequency.min("mode")
    return xr.where(ds.exponent < -1.0, 1.0 / ratio, ratio)


def _motions(ds: xr.Dataset) -> xr.Dataset:
    """Return each motion's variables at its first eigenvalue; they are repeated along its eigenvalues."""
    return ds.isel(eigenvalue=0)


def _slug(ds: xr.Dataset, about: str) -> xr.Dataset:
    """Return bodies that spin about the axis of the lesser, or of the greater, moment; equal moments are excluded."""
    motions = _motions(ds)
    return motions.where(
        (motions.axial_moment < 0.99) if about == "lesser" else (motions.axial_moment > 1.01), drop=True
    )


def value(formula: str, ds: xr.Dataset) -> float:
    """Return the number that a formula of NUMBERS makes of its map."""
    return float(eval(formula, {**globals(), "ds": ds, **{str(name): ds[name] for name in ds.variables}}))
