r"""Linear systems given by matrices: :math:`M\ddot q + (C + G)\dot q + (K + N)q = 0`.

The symmetric part of K makes a potential, so that undamped systems are natural; all else are forces. Systems of more
than MAX_TERMWISE coordinates stay matrices (`sweeps.mechanics.linear_model`).
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import sympy as sp

from sweeps.schema.refusals import DescriptionError

MAX_TERMWISE = 10  # coordinates up to which the equations are generated term by term; more are measured as matrices


def add_matrices(
    system: Any, masses: Any, stiffnesses: Sequence[Any], dampings: Sequence[Any], names: Sequence[str] | None
) -> tuple[sp.Symbol, ...]:
    """Add the coordinates, forces and equilibrium of a linear system; see `System.matrices`.

    Args:
        system: the `System` to which they are added.
        masses: M.
        stiffnesses: K and N.
        dampings: C and G.
        names: of the coordinates.
    """
    mass = read_matrix("M", masses)
    if mass.rows != mass.cols or mass != mass.T:
        raise DescriptionError(f"M: is no symmetric matrix ({mass.rows} × {mass.cols}); allowed: a symmetric matrix")
    names = [f"q{number + 1}" for number in range(mass.rows)] if names is None else list(names)
    if len(names) != mass.rows:
        raise DescriptionError(f"names: there are {len(names)}; allowed: {mass.rows}, one for each row of M")
    stiffness = sum_matrices(zip("KN", stiffnesses, strict=True), mass.shape)
    damping = sum_matrices(zip("CG", dampings, strict=True), mass.shape)
    if mass.rows > MAX_TERMWISE and not system.coordinates:
        system.linear_matrices = mass, stiffness, damping
    places = sp.Matrix([system.coordinate(name, bounds=(-1, 1), size=1) for name in names])
    velocities = sp.Matrix([system.velocity(place) for place in places])
    system.equilibrium("rest", dict.fromkeys(places, 0))
    if system.linear_matrices:
        return tuple(places)
    system.kinetic_energy((velocities.T * mass * velocities)[0] / 2)
    symmetric = (stiffness + stiffness.T) / 2
    system.potential((places.T * symmetric * places)[0] / 2)
    for place, force in zip(places, -damping * velocities - (stiffness - symmetric) * places, strict=True):
        if force != 0:
            system.force(place, force)
    return tuple(places)


def sum_matrices(pairs, shape: tuple[int, int]) -> sp.Matrix:
    """Return the sum of matrices of a shape, from (name, matrix) each; None for a matrix of zeros."""
    total = sp.zeros(*shape)
    for name, values in pairs:
        matrix = total * 0 if values is None else read_matrix(name, values)
        if matrix.shape != shape:
            raise DescriptionError(f"{name}: is {matrix.rows} × {matrix.cols}; allowed: {shape[0]} × {shape[1]}, as M")
        total += matrix
    return total


def read_matrix(name: str, values: Any) -> sp.Matrix:
    """Return a matrix of expressions, from nested lists, an array, a SymPy matrix, or the path of a CSV file."""
    try:
        if isinstance(values, str | Path):
            values = np.loadtxt(values, delimiter=",", ndmin=2)
        return sp.Matrix(values.tolist() if isinstance(values, np.ndarray) else values)
    except (OSError, ValueError, TypeError) as error:
        allowed = "a square list of lists, array or SymPy matrix, or the path of a CSV file"
        raise DescriptionError(f"{name}: {error}; allowed: {allowed}") from None
