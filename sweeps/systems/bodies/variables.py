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
    """What is said of a spin about a principal axis, by the command, `show`, figures and the page."""

    words: str  #: the regime
    more: str = ""  #: what a reader of the words alone would miss


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

# Of a grid of shapes; see `sweeps.systems.bodies.shapes`.
OF_I2 = "I2/I3 = 1 - (I1/I3)(1 - thickness)"
RATIO = "a number with 0 < I1/I3 ≤ 1"
THICKNESS = "a number from 0 (flat: I1 + I2 = I3) to 1 (I2 = I3)"
LEAST = 1e-12  # of I1/I3: below it I2 does not distinguish bodies
Ratio = Annotated[float, number(lambda x: LEAST <= x <= 1, RATIO)]
Thickness = Annotated[float, number(lambda t: 0 <= t <= 1, THICKNESS)]

SHAPE_VALUES = {"I1_over_I3": Ratio, "thickness": Thickness}
# what a grid of shapes has the moments over
SHAPE_OVER = {"I1": ("I1_over_I3", "I3"), "I2": ("I1_over_I3", "thickness", "I3")}
SHAPE_COORDINATES = table(
    Variable("I1_over_I3", "1", "ratio of moments I1/I3"),
    Variable("thickness", "1", "relative thickness: 0 flat (I1 + I2 = I3), 1 where I2 = I3", comment=OF_I2),
)


def spin(long_name: str) -> Parameter:
    """Return the parameter `omega0`, positive and 1 by default, of that meaning."""
    return Parameter("omega0", SPIN, long_name, 1.0)


def layout(
    parameters: Iterable[Parameter],
    variables: Mapping[str, Variable],
    needed: Iterable[str],
    spun: bool = False,
    listed: bool = True,
) -> Layout:
    """Return the layout of maps whose points are bodies, from a grid of moments or shapes, or from a list.

    With `spun` the spin axis is a dimension; `listed` says whether a definition may list bodies. `needed` are the names
    of the variables that every map has.
    """
    parameters = tuple(parameters)
    grid_coordinates = SHAPE_COORDINATES | coordinates_of(parameters)
    coordinates = table(*[BODY] * listed, *[AXIS] * spun) | grid_coordinates | table(*[MOMENTS_ARE_RATIOS] * listed)
    axis = {"axis": Axis} if spun else {}
    return Layout(
        coordinates,
        variables,
        tuple(needed),
        axis | SHAPE_VALUES | {parameter.name: parameter.quantity.item for parameter in parameters},
        along="body" if listed else "",
        beside=("moments_are_ratios",) if listed else (),
        spare=tuple(SHAPE_COORDINATES),
        over=SHAPE_OVER,
    )
