"""Small described systems, and points of described systems at random places of their parameters."""

import numpy as np
import sympy as sp

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


def particle(V, names="x", bounds=(-3, 4), R=None, period=None, periodic=False, places=(), size=None, **parameters):
    """Return unit masses along coordinates in a potential V(x, …, parameters), with places by name.

    Rayleigh's function is R(velocities, parameters) and the period a number or a function of the parameters, if given.
    `most` and `follow` are those of the System.
    """
    system = System("Particle", **{name: parameters.pop(name) for name in ("most", "follow") if name in parameters})
    symbols = [system.parameter(name, default=value) for name, value in parameters.items()]
    ends = bounds if isinstance(bounds, list) else [bounds] * len(names)
    q = [system.coordinate(x, "m", bounds=b, size=size, periodic=periodic) for x, b in zip(names, ends, strict=True)]
    velocities = [system.velocity(x) for x in q]
    system.kinetic_energy(sum(v**2 for v in velocities) / 2)
    system.potential(V(*q, *symbols))
    if R:
        system.dissipation(R(*velocities, *symbols))
    if period:
        system.period(period(*symbols) if callable(period) else period)
    _add_places(system, places, q, symbols)
    return system


def _add_places(system, places, unknowns, parameters):
    """Name equilibria of a system at numbers or functions of the parameters."""
    for name, place in dict(places).items():
        values = place(*parameters) if callable(place) else place
        system.equilibrium(name, dict(zip(unknowns, values, strict=True)))


def points(system, last, each, count, varied, seed, **beside):
    """Every equilibrium, and each of the numbers 1 to `each` of the coordinate `last`, at ``count`` random places."""
    rng = np.random.default_rng(seed)
    random_values = {name: rng.uniform(*ends, count) for name, ends in varied.items()}
    return _repeated(system, range(system.most), last, each, count, random_values | beside)


def points_at(model, slots=None, **values):
    """Every equilibrium, or those of these numbers, and each mode or eigenvalue of a model at values of its parameters.

    Parameters without a value have their defaults.
    """
    last, each = ("mode", model.equations.m) if model.equations.natural else ("eigenvalue", model.n)
    count, slots = (
        np.broadcast(*map(np.atleast_1d, values.values()), 0).size,
        range(model.system.most) if slots is None else slots,
    )
    usual = {"epsilon": 1e-6, "phase": 0.6} if model.equations.natural else {"epsilon": 1e-30}
    return _repeated(model.system, slots, last, each, count, usual | values)


def _repeated(system, slots, last, each, count, values):
    """Return columns of points: each combination of the slots and of the numbers of `last` at each value."""
    defaults, rows = {name: p.default for name, p in system.parameters.items()}, len(slots) * each
    columns = {name: np.repeat(np.broadcast_to(value, count), rows) for name, value in (defaults | values).items()}
    columns["equilibrium"] = np.tile(np.repeat(slots, each), count)
    columns[last] = np.tile(np.arange(1, each + 1), count * len(slots))
    return columns
