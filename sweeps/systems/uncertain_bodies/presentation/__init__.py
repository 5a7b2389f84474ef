"""Presentation of uncertain bodies."""

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


class UncertainBodiesPresentation(Presentation):
    """Figure and table of probabilities and quantiles."""

    appearance = Appearance({**OF_RIGID_BODIES.marks, **MARKS}, OF_RIGID_BODIES.symbols)
    figure_paths = (("outlook", "figure_outlook.draw"),)

    def page(self, ds: Dataset) -> Page:
        """Return bodies and axes in a table."""
        from sweeps.systems.uncertain_bodies.presentation.page import page

        return page(ds)


PRESENTATION = UncertainBodiesPresentation
