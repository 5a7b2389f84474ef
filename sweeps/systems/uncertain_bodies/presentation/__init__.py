"""Presentation of uncertain bodies."""

import numpy as np

from sweeps.figure import colors
from sweeps.schema.datasets import Dataset
from sweeps.systems.presentation import Page, Presentation
from sweeps.systems.presentation.appearance import COMMON, Appearance, Mark
from sweeps.systems.rigid_body.presentation.appearance import APPEARANCE as OF_RIGID_BODIES
from sweeps.systems.uncertain_bodies.system import MINOR_AXIS_REMARK

MARKS = {
    "stable": Mark(*COMMON["stable"][:3], MINOR_AXIS_REMARK),
    "uncertain": Mark("uncertain", "?", colors.GREY),
    "undecided": Mark("many draws undecided", "u", ""),
}


def sentence(dataset: Dataset) -> str:
    """Return how certain spins about the axes of greatest inertia are, which alone outlast a loss of energy."""
    rows = dataset.sel(axis=3).isel({name: 0 for name in ("omega0", "epsilon", "phase")}, missing_dims="ignore").load()
    coin = rows["probability_unstable"][np.isclose(rows["I2"], rows["I3"], rtol=1e-6)].median().item()
    names = [str(name).partition(" at ")[0] for name in rows["body"][rows["probability_unstable"] < 0.01].values]
    safe_names = ", ".join(dict.fromkeys(names)) or "none"
    words = f"Two equal moments: a toss of a coin ({100 * coin:.0f} %); only {safe_names} is safe about axis 3"
    return words if np.isfinite(coin) else ""


SENTENCES = {"uncertain_bodies": sentence}


class UncertainBodiesPresentation(Presentation):
    """Figure and table of probabilities and quantiles."""

    appearance = Appearance({**OF_RIGID_BODIES.marks, **MARKS}, OF_RIGID_BODIES.symbols)
    sentences = SENTENCES
    figure_paths = (("outlook", "figure_outlook.draw"),)

    def page(self, ds: Dataset) -> Page:
        """Return bodies and axes in a table."""
        from sweeps.systems.uncertain_bodies.presentation.page import page

        return page(ds)


PRESENTATION = UncertainBodiesPresentation
