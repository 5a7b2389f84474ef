"""Small described systems, and points of described systems at random places of their parameters."""

import numpy as np
import sympy as sp

from sweeps import systems
from sweeps.mechanics import System

T = sp.Symbol("t", real=True)  # the time of all systems


def flow(rates, names="xyz", bounds=(-9, 9), most=None, places=(), conserved=(), **parameters):
    """Return x' = rates(x, …, parameters), states of size 1, with places and conserved quantities by name."""
    system = System("Flow", most=most)
    symbols = [system.parameter(name, default=value) for name, value in parameters.items()]
    states = [system.state(name, bounds=bounds, size=1) for name in names]
    for state, rate in zip(states, rates(*states, *symbols), strict=True):
        system.rate(state, sp.sympify(rate))
    for name, quantity in dict(conserved).items():
        system.conserved(quantity(*states, *symbols), name)
    _add_places(system, places, states, symbols)
    return system


def particle(V, names="x", bounds=(-3, 4), R=None, period=None, periodic=False, places=(), size=None,
             forces=None, kinetic=None, **parameters):  # fmt: skip
    """Return unit masses along coordinates in a potential V(x, …, parameters), with places by name.

    Rayleigh's function is R(velocities, parameters) and the period a number or a function of the parameters, if given.
    `forces` returns one for each coordinate and `kinetic` the kinetic energy without v²/2, both from coordinates,
    velocities and parameters. `most` and `follow` are those of the System.
    """
    system = System("Particle", **{name: parameters.pop(name) for name in ("most", "follow") if name in parameters})
    symbols = [system.parameter(name, default=value) for name, value in parameters.items()]
    ends = bounds if isinstance(bounds, list) else [bounds] * len(names)
    q = [system.coordinate(x, "m", bounds=b, size=size, periodic=periodic) for x, b in zip(names, ends, strict=True)]
    velocities = [system.velocity(x) for x in q]
    system.kinetic_energy(sum(v**2 for v in velocities) / 2 + (kinetic(*q, *velocities, *symbols) if kinetic else 0))
    system.potential(V(*q, *symbols))
    for coordinate, force in zip(q, forces(*q, *velocities, *symbols), strict=True) if forces else ():
        system.force(coordinate, sp.sympify(force))
    if R:
        system.dissipation(R(*velocities, *symbols))
    if period:
        system.period(period(*symbols) if callable(period) else period)
    _add_places(system, places, q, symbols)
    return system


def rods(n):
    """Return a chain of rods with masses at their ends."""
    system = System(f"{n} rods", most=2**n)
    m, length, g = (system.parameter(name, default=1.0, positive=True) for name in ("mass", "length", "gravity"))
    x = y = sp.Integer(0)
    for k in range(n):
        angle = system.coordinate(f"theta{k}", "rad", bounds=(-sp.pi, sp.pi), periodic=True)
        x, y = x + length * sp.sin(angle), y - length * sp.cos(angle)
        system.particle(m, (x, y))
        system.potential(m * g * y)
    return system


def _add_places(system, places, unknowns, parameters):
    """Name equilibria of a system at numbers or functions of the parameters."""
    for name, place in dict(places).items():
        values = place(*parameters) if callable(place) else place
        system.equilibrium(name, dict(zip(unknowns, values, strict=True)))


def model_of(name):
    """Return the model of a shipped system."""
    return systems.resolve(name).mechanism


def points(model, count, varied, seed=1, **values):
    """Every equilibrium and each mode or eigenvalue of a model at ``count`` random places of its parameters."""
    rng = np.random.default_rng(seed)
    return _repeated(model, None, count, {name: rng.uniform(*ends, count) for name, ends in varied.items()} | values)


def points_at(model, slots=None, **values):
    """Every equilibrium, or those of these numbers, and each mode or eigenvalue of a model at values of its parameters.

    Parameters without a value have their defaults.
    """
    return _repeated(model, slots, np.broadcast(*map(np.atleast_1d, values.values()), 0).size, values)


def _repeated(model, slots, count, values):
    """Return columns of points: each combination of the slots and of the modes or eigenvalues at each value."""
    natural, slots = model.equations.natural, range(model.system.most) if slots is None else slots
    last, each = ("mode", model.equations.m) if natural else ("eigenvalue", model.n)
    usual = {name: p.default for name, p in model.system.parameters.items()}
    usual |= {"epsilon": 1e-6, "phase": 0.6} if natural else {"epsilon": 1e-30}
    rows = len(slots) * each
    columns = {name: np.repeat(np.broadcast_to(value, count), rows) for name, value in (usual | values).items()}
    columns["equilibrium"] = np.tile(np.repeat(slots, each), count)
    columns[last] = np.tile(np.arange(1, each + 1), count * len(slots))
    return columns
