"""Symmetries that are proved of a system's equations and used by the measurement: `check` prints them."""

from typing import TYPE_CHECKING

import numpy as np

from sweeps.mechanics import relative

if TYPE_CHECKING:
    from sweeps.mechanics.model import Model


def proofs(model: "Model", parameters: list[np.ndarray]) -> tuple[str, ...]:
    """Return a line for each symmetry that is used at some of the points, with how many they are.

    Args:
        model: of the system.
        parameters: one array (points,) for each parameter.
    """
    uses = _of_a_period if model.system.given_period is not None else _of_equilibria
    return tuple(_line(words, holds) for words, holds in uses(model, parameters) if holds.any())


def _line(words, holds):
    return words if holds.all() else f"{words} (at {holds.sum():,} of {holds.size:,} looked at)"


def _of_equilibria(model, parameters):
    always = np.ones(1, dtype=bool)
    if model.equations.natural:
        yield "forces are those of a potential: each mode has one real rate², which oscillates or grows", always
    else:
        point, slot = np.nonzero(~np.isnan(model.equilibria(parameters).places).any(axis=-1))
        at = [p[point] for p in parameters]
        there = model.located(at, slot)
        slopes = model.landscape.slopes(at, list(there["place"].T))
        yield "time reversal: eigenvalues come in pairs ±μ", relative.paired(model, *slopes)
        proved = relative.definite(model, at, there["place"], there["hidden"])
        yield "stable by a definite conserved quantity", proved
    if model.quantities:
        zeros = model.equations.n - model.n
        left_out = f"; {zeros} of {model.equations.n} eigenvalues, which are zero, are left out" if zeros else ""
        yield f"conserved: {', '.join(model.quantities)}, whose drift is watched{left_out}", always


def _of_a_period(model, parameters):
    variation = model.variation
    linear, odd = (np.array([flags]) for flags in (model.perturbed_code(True).linear, variation.odd))
    yield "linear about an equilibrium at all times: followed with one size and from one side", linear
    yield "odd about the origin: followed from one side where it is an equilibrium", odd & ~linear
    _, reciprocal, even = variation.proved(parameters)
    yield "Hamilton's equations, or no divergence: multipliers come in pairs μ, 1/μ", reciprocal
    yield "even in the time: about an equilibrium half a period gives the whole", even
