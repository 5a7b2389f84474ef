"""Appearance of the rigid body: words, characters, colours and symbols; and kinds and dimensions of its maps."""

from collections.abc import Mapping

from sweeps.figure import colors
from sweeps.schema.datasets import Dataset, dimensions
from sweeps.systems.bodies.presentation import SYMBOLS
from sweeps.systems.bodies.variables import MOMENTS, SHAPE_COORDINATES
from sweeps.systems.presentation.appearance import COMMON, Appearance, Mark, Symbol
from sweeps.systems.rigid_body.system import LAYOUT, VERDICTS

SHAPE = tuple(SHAPE_COORDINATES)
LINES = {1: "-", 2: (0, (5, 1.6)), 3: (0, (1.2, 1.2))}  # line styles of the spin axes
_MARKS = {
    "stable_minor": ("-", colors.LIGHT_BLUE),
    "stable_major": ("+", colors.STABLE),
    "unstable": COMMON["unstable"][1:3],
    "marginal": COMMON["marginal"][1:3],
    "sphere": ("o", colors.LIGHT_GREY),
}
APPEARANCE = Appearance(
    marks={regime: Mark(words, *_MARKS[regime], more) for regime, (words, more) in VERDICTS.items()},
    symbols=SYMBOLS | {"I1_over_I3": Symbol("$I_1/I_3$", "I₁/I₃"), "thickness": Symbol("thickness $t$", "thickness t")},
)


def axis_label(name: str) -> str:
    """Return the symbol of a parameter with its unit, for an axis of a plot."""
    from sweeps.figure import wording

    return wording.with_unit(APPEARANCE.symbol(name), LAYOUT.coordinates[name].units, "  ({})")


def settings(values: Mapping[str, float]) -> str:
    """Return fixed parameters in one line, with units: "I3 = 0.01748 kg m², ω0 = 10 rad s⁻¹"."""
    from sweeps.figure import wording

    return ",  ".join(
        wording.with_unit(
            f"{APPEARANCE.symbol(name)} = {wording.format_number(float(value))}", LAYOUT.coordinates[name].units
        )
        for name, value in values.items()
    )


def cut_at(ds: Dataset) -> dict[str, int]:
    """Return the indices at which figures cut spin and perturbation: the middle values, and that of the least ε."""
    middle = {dim: (ds.sizes[dim] - 1) // 2 for dim in ("omega0", "epsilon", "phase") if dim in ds.dims}
    return middle | ({"epsilon": int(ds["epsilon"].values.argmin())} if "epsilon" in middle else {})


def is_of_shapes(ds: Dataset) -> bool:
    """Return True if a map is a grid of shapes."""
    return {*SHAPE} <= {*ds.dims}


def is_grid(ds: Dataset) -> bool:
    """Return True if a map is a grid of moments or of shapes."""
    return {*MOMENTS} <= {*ds.dims} or is_of_shapes(ds)


def moments_over(ds: Dataset) -> tuple[str, ...]:
    """Return the dimensions along which the moments of a map vary."""
    along = {dim for name in MOMENTS for dim in ds[name].dims}
    return tuple(dim for dim in dimensions(ds) if dim in along)
