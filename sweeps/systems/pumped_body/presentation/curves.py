"""Mathieu's curves in the maps of pumped bodies."""

import numpy as np
import xarray as xr
from scipy.interpolate import CubicSpline

from sweeps.reading.definitions import mapping_of
from sweeps.systems.periodic.presentation.figure_tongues import EXACT, Curves, characteristic, ends


def mathieu(ds: xr.Dataset, one: xr.Dataset, axis: int, depth: str) -> tuple[str, Curves] | None:
    """Return a label and (frequency, depth) along Mathieu's characteristic curves; None where the equation is another.

    With the inverse of one transverse moment I_j modulated, ``y'' + (a - 2 q cos 2 tau) y = 0`` in tau = nu t/2, where
    ``a = 4 L^2 c (1/I_j - 1/I_k)/nu^2``, ``q = 2 L^2 c d_j/(I_j nu^2)`` and ``c = 1/I_i - 1/I_k``.
    """
    others = [i for i in (1, 2, 3) if i != axis]
    modulated = {f"depth{i}" for i in (1, 2, 3) if one[f"depth{i}"].values.any()}
    inverse = mapping_of(ds.attrs["definition"]).get("modulation") == "inverse"
    if not inverse or modulated != {depth} or depth == f"depth{axis}":
        return None
    j = int(depth[-1])
    (i,) = set(others) - {j}
    if any(one[name].size > 1 for name in ("I1", "I2", "I3", "omega0")):
        return None
    Ii, Ij, Ik, spin = (float(one[name]) for name in (f"I{i}", f"I{j}", f"I{axis}", "omega0"))
    scale, mean = 4.0 * (spin * Ik) ** 2 * (1.0 / Ii - 1.0 / Ik), 1.0 / Ij - 1.0 / Ik
    curves = []
    for sign in (1.0, -1.0):
        few, many = np.geomspace(1e-3, 1e3, 300), np.geomspace(1e-3, 1e3, 20_000)
        q = sign * many
        for a in CubicSpline(np.log(few), characteristic(few), axis=1)(np.log(many)):
            with np.errstate(invalid="ignore", divide="ignore"):
                square = scale * mean / a
                frequency, at = np.sqrt(square), 2.0 * q * square * Ij / scale
            curves.append((np.where(square > 0.0, frequency, np.nan), at))
    low, high = ends(one, depth)
    inside = [(f, d, (d >= low) & (d <= high)) for f, d in curves]
    return EXACT, [(f, np.where(here, d, np.nan)) for f, d, here in inside if here.any()]
