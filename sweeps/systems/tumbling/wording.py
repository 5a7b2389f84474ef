"""The answers of `polhode tumbler`: what two periods say of a body, or of all bodies."""

from typing import TYPE_CHECKING

import numpy as np

from sweeps.systems.tumbling.look import LOOK

if TYPE_CHECKING:
    import xarray as xr


def shares(ds: "xr.Dataset") -> list[dict]:
    """For each mode, how many bodies of the map have both periods, and between which energies."""
    found = []
    for mode in ds["mode"].values.tolist():
        energy = ds["energy"].sel(mode=mode).values
        known = energy[np.isfinite(energy)]
        ends = {"least_energy": float(known.min()), "greatest_energy": float(known.max())} if known.size else {}
        found.append({"mode": mode, "bodies": int(known.size), "excluded": not known.size, **ends})
    return found


def in_words(row: dict) -> str:
    """One mode's answer: of one body its energy, of all bodies how many there are."""
    return f"{LOOK.words(row['mode'])}: {_answer(row)}"


def _answer(row: dict) -> str:
    if "m" in row:
        error = f" ± {row['energy_error']:.2g}" if row["energy_error"] else ""
        return f"2T I3/L² = {row['energy']:.6g}{error}, m = {row['m']:.6g}, L/I3 = {row['omega0']:.6g} rad s⁻¹"
    if row["excluded"]:
        return "excluded: no body has both periods"
    between = f"from {row['least_energy']:.4g} to {row['greatest_energy']:.4g}"
    return f"{row['bodies']:,} bodies of the map, 2T I3/L² {between}"
