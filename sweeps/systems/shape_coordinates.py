"""The two numbers of a body's shape, as coordinates of maps whose grids are of shapes; see `sweeps.systems.shapes`."""

from typing import Annotated

from sweeps.schema.values import number
from sweeps.schema.variables import Variable, table

RATIO = "a number with 0 < I1/I3 ≤ 1"
ROOM = "a number from 0 (flat: I1 + I2 = I3) to 1 (I2 = I3)"
LEAST = 1e-12  # of I1/I3: I2 must tell bodies apart
Ratio = Annotated[float, number(lambda x: LEAST <= x <= 1, RATIO)]
Room = Annotated[float, number(lambda t: 0 <= t <= 1, ROOM)]

VALUES = {"I1_over_I3": Ratio, "room": Room}
OVER = {"I1": ("I1_over_I3", "I3"), "I2": ("I1_over_I3", "room", "I3")}  # what a grid of shapes has the moments over
COORDINATES = table(
    Variable("I1_over_I3", "1", "ratio of moments I1/I3"),
    Variable("room", "1", "share of the way of I2/I3 from 1 - I1/I3, a flat body, to 1"),
)
