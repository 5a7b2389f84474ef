"""The two coordinates of a grid of shapes, I1/I3 and the relative thickness; see `sweeps.systems.bodies.shapes`."""

from typing import Annotated

from sweeps.schema.values import number
from sweeps.schema.variables import Variable, table

OF_I2 = "I2/I3 = 1 - (I1/I3)(1 - thickness)"
RATIO = "a number with 0 < I1/I3 ≤ 1"
THICKNESS = "a number from 0 (flat: I1 + I2 = I3) to 1 (I2 = I3)"
LEAST = 1e-12  # of I1/I3: below it I2 does not distinguish bodies
Ratio = Annotated[float, number(lambda x: LEAST <= x <= 1, RATIO)]
Thickness = Annotated[float, number(lambda t: 0 <= t <= 1, THICKNESS)]

VALUES = {"I1_over_I3": Ratio, "thickness": Thickness}
OVER = {
    "I1": ("I1_over_I3", "I3"),
    "I2": ("I1_over_I3", "thickness", "I3"),
}  # what a grid of shapes has the moments over
COORDINATES = table(
    Variable("I1_over_I3", "1", "ratio of moments I1/I3"),
    Variable("thickness", "1", "relative thickness: 0 flat (I1 + I2 = I3), 1 where I2 = I3", comment=OF_I2),
)
