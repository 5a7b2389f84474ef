"""Parameters, coordinates and layouts that the maps of all systems of rigid bodies share."""

from collections.abc import Iterable, Mapping
from typing import Annotated, NamedTuple

from sweeps.schema.values import MAX_SPIN_RATE, MIN_SPIN_RATE, Axis, Moment, Phase, list_of_different, number, spin_rate
from sweeps.schema.variables import Layout, Parameter, Quantity, Variable, coordinates_of, table
from sweeps.systems.shared_variables import make_epsilon, parse_rows

MOMENTS = ("I1", "I2", "I3")
Axes = list_of_different(Axis, lambda axes: tuple(sorted(axes)))

Spin = Annotated[
    float, number(lambda x: MIN_SPIN_RATE <= x <= MAX_SPIN_RATE, "a number with 1e-150 ≤ omega0 ≤ 1e150 in rad s-1")
]
SignedSpin = spin_rate("omega0")
MOMENT = Quantity("moment", "kg m2", "finite, > 0", Moment)
SPIN = Quantity("spin rate", "rad s-1", "1e-150 ≤ omega0 ≤ 1e150", Spin)
SIGNED_SPIN = Quantity("spin rate", "rad s-1", "1e-150 ≤ |omega0| ≤ 1e150", SignedSpin, least=MIN_SPIN_RATE)
EPSILON = make_epsilon(1e-6, "the spin rate", "relative to omega0")
_PLANE = "direction of the perturbation in the transverse (b, c) plane"
_PHASE = Quantity("direction", "rad", "finite", Phase)
PHASE = Parameter("phase", _PHASE, _PLANE, 0.6, f"{_PLANE}, rad, from b towards c")
_ABOUT = [(f"I{i}", f"moment of inertia about axis {i}") for i in (1, 2, 3)]
PRINCIPAL = tuple(Parameter(n, MOMENT, f"principal {of}", description=f"{of}, kg m2, > 0") for n, of in _ABOUT)

AXIS, BODY, SHAPE, MOMENTS_ARE_RATIOS, TRIANGLE_MARGIN = parse_rows(
    """
    axis   1  i1  spin axis (1, 2 or 3)
    body   -  str  body
    shape  -  symmetry class
        flags: 0 asymmetric oblate prolate sphere
    moments_are_ratios  -  whether the moments are known as ratios only
        flags: 0 kilogram_square_metres ratios
        comment: where 1, I1, I2 and I3 of the body are in a unit of their own
    triangle_margin     1  f4  least of (Ib + Ic - Ia)/(I1 + I2 + I3) over the axes; negative where physically
        impossible [existence]
    """
).values()
TWO_RUNS = "three times the difference of two runs with different steps, and the effect of rounding"


class Verdict(NamedTuple):
    """The regime of a spin about a principal axis in words, for the command, `show`, figures and the page."""

    words: str  #: the regime
    more: str = ""  #: explanation


VERDICTS = {  # regime → its verdict
    "stable_minor": Verdict(
        "stable, least inertia", "with any loss of energy it ends in a flat spin (major-axis rule)"
    ),
    "stable_major": Verdict("stable, greatest inertia"),
    "unstable": Verdict("unstable"),
    "marginal": Verdict(
        "marginal", "two moments are equal, and the axis drifts away in proportion to time, not exponentially"
    ),
    "sphere": Verdict("sphere", "all moments are equal, and perturbations neither grow nor oscillate"),
}

# Parameters of a grid of shapes; see `sweeps.systems.bodies.shapes`.
OF_I2 = "I2/I3 = 1 - (I1/I3)(1 - thickness)"
RATIO = "a number with 0 < I1/I3 ≤ 1"
THICKNESS = "a number from 0 (flat: I1 + I2 = I3) to 1 (I2 = I3)"
MIN_RATIO = 1e-12  # least I1/I3, below which I2 does not distinguish bodies
Ratio = Annotated[float, number(lambda x: MIN_RATIO <= x <= 1, RATIO)]
Thickness = Annotated[float, number(lambda t: 0 <= t <= 1, THICKNESS)]

SHAPE_VALUES = {"I1_over_I3": Ratio, "thickness": Thickness}
# moment → the coordinates on which it depends in a grid of shapes
SHAPE_OVER = {"I1": ("I1_over_I3", "I3"), "I2": ("I1_over_I3", "thickness", "I3")}
SHAPE_COORDINATES = table(
    Variable("I1_over_I3", "1", "ratio of moments I1/I3"),
    Variable("thickness", "1", "relative thickness: 0 flat (I1 + I2 = I3), 1 where I2 = I3", comment=OF_I2),
)


def spin(long_name: str) -> Parameter:
    """Return the parameter `omega0`, positive and 1 by default, with a long name."""
    return Parameter("omega0", SPIN, long_name, 1.0)


def layout(
    parameters: Iterable[Parameter],
    variables: Mapping[str, Variable],
    required: Iterable[str],
    has_axis: bool = False,
    has_bodies: bool = True,
) -> Layout:
    """Return the layout of maps of bodies, from a grid of moments or shapes, or from a list.

    Args:
        parameters: parameters of the grid.
        variables: name → variable of a map.
        required: names of the variables that every map has.
        has_axis: True if the spin axis is a dimension.
        has_bodies: True if a definition may list bodies.
    """
    parameters = tuple(parameters)
    grid_coordinates = SHAPE_COORDINATES | coordinates_of(parameters)
    coordinates = (
        table(*[BODY] * has_bodies, *[AXIS] * has_axis) | grid_coordinates | table(*[MOMENTS_ARE_RATIOS] * has_bodies)
    )
    axis = {"axis": Axis} if has_axis else {}
    return Layout(
        coordinates,
        variables,
        tuple(required),
        axis | SHAPE_VALUES | {parameter.name: parameter.quantity.item for parameter in parameters},
        along="body" if has_bodies else "",
        beside=("moments_are_ratios",) if has_bodies else (),
        spare=tuple(SHAPE_COORDINATES),
        over=SHAPE_OVER,
    )
