r"""Verdict on a spin about one principal axis: its word, and the smallest change of a moment that changes it.

With the moments I_a about the axis and I_b, I_c about the others, the signs of two differences decide:

.. math:: I_a > I_b, I_c: \text{stable}, \qquad (I_a - I_b)(I_a - I_c) < 0: \text{unstable}, \qquad
    I_a < I_b, I_c: \text{stable without loss}

as a loss of energy at constant angular momentum ends in a spin about the axis of greatest inertia (major-axis rule). If
I_a equals another moment, the spin is marginal. A single moment changes the verdict as soon as I_a crosses another
moment; of these changes, those count that keep a physically possible body.

Source: Landau and Lifshitz, Mechanics, section 37; Hughes, Spacecraft Attitude Dynamics (1986), chapter 5.
"""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from sweeps.systems.bodies import shapes
from sweeps.systems.bodies.inertia import describe_axis
from sweeps.systems.rigid_body.motion import frame_of
from sweeps.systems.rigid_body.system import SpunBody

WORDS = {
    "stable": "stable, also with dissipation",
    "stable_without_loss": "stable without dissipation only (any loss of energy ends in a flat spin)",
    "unstable": "unstable",
    "marginal": "marginal (it equals another moment)",
    "uncertain": "uncertain",
}
CHOICES = {  # reason for an axis → its words behind the axis
    "axis": "",
    "omega": ", nearest to the angular velocity",
    "usual_spin": ", its usual spin",
    "greatest_inertia": ", the axis of greatest inertia",
}


@dataclass(frozen=True)
class SpinVerdict:
    """The verdict on the spin about one axis."""

    axis: int  #: 1, 2 or 3
    chosen_by: str  #: one of `CHOICES`
    direction: tuple[float, float, float] | None  #: the axis in the axes of the body's input; None for moments
    word: str  #: one of `WORDS`
    margin: dict[str, Any] | None  #: moment and its relative change: the smallest one that changes the verdict
    sentence: str  #: the verdict in words

    @property
    def facts(self) -> dict[str, Any]:
        """All values by name."""
        return asdict(self)


def choose_axis(body: SpunBody, axis: int | None, omega: Sequence[float] | None) -> tuple[int, str]:
    """Return the axis that is judged, and why: as requested, nearest to omega, the usual one, of greatest inertia.

    Args:
        body: the body.
        axis: requested axis, or None.
        omega: angular velocity in the axes of the body's input, rad s-1, or None.
    """
    if axis is not None:
        return axis, "axis"
    if omega is not None:
        return int(np.abs(frame_of(body).principal_axes @ np.array(omega)).argmax()) + 1, "omega"
    if body.axis is not None:
        return body.axis, "usual_spin"
    return 3 - int(np.argmax(body.moments[::-1])), "greatest_inertia"


def judge_moments(moments: Sequence[float], axis: int) -> str:
    """Return the word for a spin about an axis from the signs of differences of moments."""
    along, others = moments[axis - 1], np.delete(moments, axis - 1)
    if (others == along).any():
        return "marginal"
    return ("stable_without_loss", "unstable", "stable")[int((others < along).sum())]


def find_margin(moments: Sequence[float], axis: int) -> dict[str, Any] | None:
    """Return moment and signed relative change of the smallest change of one moment that changes the verdict.

    Return None if no change of one moment that keeps a possible body does.
    """
    name, changes = f"I{axis}", []
    for other in {1, 2, 3} - {axis}:
        for changed, target in ((axis, other), (other, axis)):
            crossing = list(moments)
            crossing[changed - 1] = moments[target - 1]
            if not shapes.violation(crossing):
                changes.append((moments[target - 1] / moments[changed - 1] - 1, f"I{changed}"))
    change, name = min(changes, key=lambda each: abs(each[0]), default=(None, name))
    return None if change is None else {"moment": name, "change": change}


def judge_spin(body: SpunBody, axis: int, chosen_by: str, omega: Sequence[float] | None) -> SpinVerdict:
    """Return the verdict on the spin of a body about an axis; `omega` gives the sense of the axis in words."""
    word, margin = judge_moments(body.moments, axis), find_margin(body.moments, axis)
    direction = None
    if body.principal is not None:
        row = np.array(body.principal.axes[axis - 1])
        sign = 1.0 if omega is None or row @ np.array(omega) >= 0 else -1.0
        direction = tuple((sign * row + 0.0).tolist())
    place = "" if direction is None else f" ({body.frame} {describe_axis(direction, '+')})"
    text = f"Spin about axis {axis}{place}{CHOICES[chosen_by]}: {WORDS[word]}"
    if margin is not None:
        text += f"; margin {format_percent(abs(margin['change']))} in {margin['moment']}"
    return SpinVerdict(axis, chosen_by, direction, word, margin, text)


def format_percent(fraction: float, digits: int = 3) -> str:
    """Return a fraction as a percentage in words, "12 %", with as many significant digits."""
    return f"{100 * fraction:.{digits}g} %" if math.isfinite(fraction) else "(none)"
