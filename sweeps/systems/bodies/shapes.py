r"""Shapes of bodies in place of moments: a unit square in which every point is a physically possible body.

A free body's motion depends on its moments by their ratios alone. With I3 the greatest, :math:`x = I_1/I_3` and
:math:`y = I_2/I_3`, a body is possible if no second moment :math:`J_i = (I_j + I_k - I_i)/2` is negative, that is,
in the triangle

.. math:: 0 < x \le 1, \qquad 1 - x \le y \le 1

of flat bodies (:math:`x + y = 1`), :math:`I_1 = I_3` and :math:`I_2 = I_3`. At a given x the interval of y
is x wide, so with the relative `thickness` t

.. math:: y = 1 - x\,(1 - t), \qquad dx\,dy = x\,dx\,dt

maps the unit square of (x, t) onto the triangle, one to one except at x = 0. *Sampled* points fill the triangle evenly:
x² is uniform, then t.
"""

import sys
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from kernels.free.triangle import triangle_margin
from sweeps.schema import units
from sweeps.schema.parameters import Quantity, Range, Strict, entry_type, key, range_model
from sweeps.schema.refusals import DefinitionError, UnreadableError, display
from sweeps.systems.bodies.molecules import inertial_defect
from sweeps.systems.bodies.variables import MIN_RATIO, OF_I2, RATIO, SHAPE_OVER, THICKNESS, Ratio, Thickness

POSSIBLE = "moments each at most the sum of the other two"


def violation(moments: Sequence[float]) -> str:
    """Return how three moments violate the triangle inequality, "I3 = 5 > I1 + I2 = 3"; "" for possible ones.

    The inertial defect of a flat molecule, which its vibrations cause, is no violation.
    """
    if not triangle_margin(*moments) < 0 or inertial_defect(moments):
        return ""
    k = int(np.argmax(moments))
    i, j = sorted({0, 1, 2} - {k})
    return f"I{k + 1} = {moments[k]:.10g} > I{i + 1} + I{j + 1} = {moments[i] + moments[j]:.10g}"


def refuse_impossible(where: str, moments: Sequence[float]) -> None:
    """Refuse three moments that are physically impossible; `where` begins the message."""
    if reason := violation(moments):
        problem = f"{', '.join(f'{moment:.6g}' for moment in moments)} are not the moments of any rigid body: {reason}"
        raise DefinitionError(f"{where}: {problem}; allowed: {POSSIBLE}")


class Shapes(Strict):
    """Shapes of physically possible bodies with the greatest moment I3."""

    I1_over_I3: entry_type(Ratio, range_model(Quantity("ratio", "1", RATIO, Ratio))) = key(
        f"I1/I3: {RATIO}, a list, or a range", ...
    )
    thickness: entry_type(Thickness, range_model(Quantity("thickness", "1", THICKNESS, Thickness))) = key(
        f"relative thickness, {OF_I2}: {THICKNESS}, a list, or a range", ...
    )


class _Ratios:
    """The key `ratios` of a grid: I1 and I2 by two numbers, every pair of which is a possible body (and I3)."""

    key = "ratios"  # key of the grid with the two numbers
    description = (
        "shapes of physically possible bodies in place of I1 and I2: a mapping with I1_over_I3 and thickness, where "
        f"{OF_I2}"
    )
    model = Shapes  # model of its value
    names, over = tuple(SHAPE_OVER), SHAPE_OVER  # the resulting parameters, and the numbers that determine each

    def complete_values(self, values: Mapping) -> dict:
        """Return the grid with I3, and with I1 and I2 as ranges between their least and greatest values."""
        grid = values["grid"]
        where, ratios = ("grid", "ratios"), grid["ratios"]
        allowed = "ratios (and I3), or moments, or bodies"
        for conflict in [*(name for name in self.names if name in grid), *(["bodies"] if "bodies" in values else [])]:
            raise UnreadableError(where, display(ratios), f"is given beside {conflict}", allowed)
        grid = {"I3": 1.0} | grid
        (low_ratio, high_ratio), (low_thickness, high_thickness) = (
            _ends(ratios.get(name), 1.0, (0.5, 0.5)) for name in Shapes.model_fields
        )
        if 1 - high_ratio * (1 - low_thickness) < MIN_RATIO:
            allowed = "thickness above 0 where I1_over_I3 reaches 1: that needle has no I2"
            raise UnreadableError((*where, "thickness"), display(ratios.get("thickness")), "reaches 0", allowed)
        for key_path, entry in (
            *(((*where, name), entry) for name, entry in ratios.items()),
            (("grid", "I3"), grid["I3"]),
        ):
            if "sample" in values and isinstance(entry, tuple) and len(entry) > 1:
                allowed = "a number, or a range, over which points are drawn"
                raise UnreadableError(key_path, display(entry), "is a list beside sample", allowed)
        low_I3, high_I3 = _ends(grid["I3"], sys.float_info.max, (1.0, 1.0), "kg m2")
        ends = {
            "I1": (max(low_ratio, MIN_RATIO), high_ratio),
            "I2": (1 - high_ratio * (1 - low_thickness), 1 - low_ratio * (1 - high_thickness)),
        }
        scaled = {name: (low * low_I3, high * high_I3) for name, (low, high) in ends.items()}
        return grid | {
            n: {"start": low, "stop": high, "num": 2} if low < high else low for n, (low, high) in scaled.items()
        }

    def at_shares(self, name: str, spaced: Range, share: np.ndarray) -> np.ndarray:
        """Sample the square of I1/I3 uniformly, so that points fill the triangle evenly.

        Args:
            name: name of the parameter.
            spaced: its range.
            share: numbers in [0, 1].
        """
        if name != "I1_over_I3" or spaced.spacing == "log":
            return spaced.at_shares(share)
        return np.sqrt(spaced.start**2 + share * (spaced.stop**2 - spaced.start**2))

    def compute_values(self, name: str, values: Mapping[str, Any]) -> np.ndarray:
        """Return I1 or I2, in the unit of I3."""
        ratio, greatest = values["I1_over_I3"], values["I3"]
        return ratio * greatest if name == "I1" else (1.0 - ratio * (1.0 - values["thickness"])) * greatest


def _ends(entry: object, limit: float, default: tuple[float, float], unit: str = "1") -> tuple[float, float]:
    """Return the least and greatest value of an entry from 0 to `limit`; `default` for an invalid entry."""
    if isinstance(entry, dict):
        entry = (entry.get("start"), entry.get("stop"))
    entry = entry if isinstance(entry, tuple) else (entry,)
    entry = [units.read_number(value, unit) for value in entry]
    allowed = [v for v in entry if isinstance(v, int | float) and not isinstance(v, bool) and 0 <= v <= limit]
    return (float(min(allowed)), float(max(allowed))) if allowed else default


RATIOS = _Ratios()
