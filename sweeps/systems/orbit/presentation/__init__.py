"""Presentation of bodies on orbits."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from kernels.flow.codes import INVARIANTS, REGIMES
from sweeps.figure import wording
from sweeps.reading.definitions import definition_of
from sweeps.schema.datasets import Dataset
from sweeps.systems.bodies.presentation import turning
from sweeps.systems.orbit.system import CAVEATS
from sweeps.systems.periodic.presentation import COMPARED, MARKS
from sweeps.systems.presentation import Animations, Drawings, Page, Presentation, moving
from sweeps.systems.presentation.appearance import Appearance, Symbol

APPEARANCE = Appearance(
    marks=MARKS,
    symbols={
        "a_over_b": Symbol("$a/b$", "a/b"),
        "b_over_c": Symbol("$b/c$", "b/c"),
        "k1": Symbol("$k_1$", "k₁"),
        "k3": Symbol("$k_3$", "k₃"),
        "asymmetry": Symbol("$(I_2 - I_1)/I_3$", "(I₂ − I₁)/I₃"),
        "eccentricity": Symbol("$e$", "e"),
        "epsilon": Symbol(r"$\varepsilon$", "ε"),
    },
)
_PAGE = Path(__file__).parent / "page"
CENTRE_KEYS = ("a_over_b", "b_over_c")  # shape parameters with a probability
GROWING = [REGIMES.index(name) - 1 for name in ("unstable", "period_doubling", "flutter")]


class OrbitPresentation(Presentation):
    """Figures of the regimes, for each plane."""

    appearance = APPEARANCE
    compared = COMPARED
    plane_variable = ("regime", ())
    base_page = Page(
        (_PAGE / "motion.html", *turning.SOLID_FILES, moving.INTEGRATION, _PAGE / "part.js"),
        "Does a body on its orbit keep its attitude, and if not, how fast does it lose it?",
        facts=turning.FACTS,
    )

    def figures(self, ds: Dataset) -> Drawings:
        """Return the regimes over two parameters, for each plane and radial axis, with the boundary by theory."""
        from functools import partial

        from sweeps.systems.periodic.presentation import figure_tongues

        drawings = {}
        if "amplitude" in ds.dims:
            degrees = np.degrees(ds["amplitude"].values)
            ds = ds.assign_coords(amplitude=("amplitude", degrees, ds["amplitude"].attrs | {"units": "°"}))
        for plane, at, name in self._cuts(ds):
            invariants = [f"{name}{end}" for name in INVARIANTS for end in ("", "_theory", "_error")]
            cut = ds.drop_vars(invariants) if plane == "in_plane" else ds
            words = f"perturbations {plane.replace('_', ' ')}{_probability_words(ds, at)}\n{CAVEATS}"
            drawings[name] = partial(figure_tongues.draw, cut, at, words, APPEARANCE)
        return drawings | self.agreement_figure(ds)

    def animations(self, ds: Dataset) -> Animations:
        """Return the animation of a body that leaves its attitude."""
        return {"tumble": self.drawing("figure_tumble.frames", ds, str(ds.attrs.get("title", "")), APPEARANCE.symbols)}

    def _cuts(self, ds: Dataset) -> Iterator[tuple[str, dict, str]]:
        """Yield (plane, values at which the map is cut, name of the figure)."""
        for plane in ds["plane"].values.tolist():
            for axis in ds["radial_axis"].values.tolist() if ds.sizes.get("radial_axis", 1) > 1 else [None]:
                at = {"plane": plane} | ({} if axis is None else {"radial_axis": axis})
                yield plane, at, plane if axis is None else f"{plane}_axis_{axis:g}"


def unstable_probability(ds: Dataset, at: dict) -> tuple[np.ndarray, str]:
    """Return P(unstable) of a body with an uncertain shape for each value of the third parameter, and its name.

    The shape is normal about `start_at` of the definition, with its `shape_uncertainty` in each ratio of semi-axes.
    """
    definition = definition_of(ds.attrs)
    centre, width = definition.get("start_at") or {}, float(definition.get("shape_uncertainty", 0.03))
    if not {*CENTRE_KEYS} <= {*centre} or any(ds.sizes.get(name, 1) < 2 for name in CENTRE_KEYS):
        return np.empty(0), ""
    subset = ds[["regime"]].sel(at).squeeze(drop=True)
    third = [str(name) for name in subset["regime"].dims if name not in CENTRE_KEYS]
    if len(third) != 1:
        return np.empty(0), ""
    weights = np.exp(-0.5 * sum(((subset[name] - float(centre[name])) / width) ** 2 for name in CENTRE_KEYS))
    share = (subset["regime"].isin(GROWING) * weights).sum(CENTRE_KEYS) / weights.sum()
    return share.values, third[0]


def _probability_words(ds, at):
    """Return P(unstable) in words, a clause for each value of the third parameter; "" if the map has none."""
    shares, name = unstable_probability(ds, at)
    if not name or at["plane"] != "out_of_plane":
        return ""
    values = [
        f"{s:.0%} at {wording.format_coordinate(ds, name, v)}" for s, v in zip(shares, ds[name].values, strict=True)
    ]
    definition = definition_of(ds.attrs)
    centre = ", ".join(f"{key.replace('_over_', '/')} = {definition['start_at'][key]:.4g}" for key in CENTRE_KEYS)
    width = float(definition.get("shape_uncertainty", 0.03))
    return f"; P(unstable) of {centre}, each ± {width:g}: {', '.join(values)}"


PRESENTATION = OrbitPresentation
