"""Sentences of maps of tumbling bodies, and observed ratios of their periods."""

import numpy as np

from kernels.events import tumbling
from sweeps.schema.datasets import Dataset
from sweeps.systems.tumbling.system import MODES

STEPS = 200  # points of a curve on each side of the separatrix
KRYLOV = "(5247) Krylov"
OBSERVED = {  # body of the sweep `tumblers`, with its source → P_psi/P_phi and its standard error, 0 if not published
    KRYLOV: [(368.7 / 67.27, 0.0)],
    "1I/'Oumuamua as an ellipsoid 6 to 1 to 1 (illustration)": [
        (period / 8.67, period / 8.67 * 0.34 / 8.67) for period in (6.58, 13.15, 54.48)
    ],
    "2008 TC3 (illustration)": [(99.173 / 96.988, 0.0)],
}


def period_ratio_curve(body: Dataset) -> tuple[np.ndarray, np.ndarray, int]:
    """Return energies, P_psi/P_phi (long-axis convention) at each in closed form, and the index of the separatrix.

    The energies span those of the body's map and are dense near the separatrix, E = I3/I2, at which the ratio diverges.
    """
    energies = body["energy"].values
    low, high, separatrix = energies.min(), energies.max(), float(body["I3"] / body["I2"])
    distance = np.geomspace(1e-6, 1.0, STEPS)
    dense_energies = np.concatenate(
        [separatrix - (separatrix - low) * distance[::-1], [separatrix], separatrix + (high - separatrix) * distance]
    )
    points = {name: np.full(dense_energies.size, float(body[name])) for name in ("I1", "I2", "I3", "omega0")}
    columns = tumbling.survey(points | {"energy": dense_energies}, 1e-9, measured=False)
    return dense_energies, columns["period_psi_exact"] / columns["period_phi_long_axis_exact"], STEPS


def energies_of_ratio(body: Dataset, ratio: float) -> list[float]:
    """Return the energies at which a body has a ratio of periods: in the short-axis mode, then in the long-axis one."""
    energies, ratios, separatrix = period_ratio_curve(body)
    found = []
    for side in (slice(0, separatrix), slice(separatrix + 1, None)):
        order = np.argsort(ratios[side])
        found.append(float(np.interp(ratio, ratios[side][order], energies[side][order], np.nan, np.nan)))
    return found


def sentence(dataset: Dataset) -> str:
    """Return the energy of Krylov's observed periods, or the share of motions in the long-axis mode."""
    if "body" in dataset.dims:
        energy = energies_of_ratio(dataset.sel(body=KRYLOV).squeeze().load(), OBSERVED[KRYLOV][0][0])[0]
        return f"Krylov's periods need {100 * (energy - 1.0):.1f} % more energy than a pure spin"
    mode = dataset["mode"].where(dataset["triangle_margin"] >= 0.0)
    short, long = ((mode == MODES.index(name) - 1).sum().item() for name in ("sam", "lam"))
    return f"{100 * long / (short + long):.0f} % of these tumbling motions are in the long-axis mode"


SENTENCES = {"tumbling": sentence}
