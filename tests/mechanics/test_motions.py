"""The tangent flow over a period: Mathieu's published traces, symplectic matrices, and differences of motions."""

import numpy as np
import pytest
import sympy as sp

from kernels import floquet
from sweeps.mechanics import DescriptionError, System, motions
from sweeps.mechanics.model import Model

# traces over t = π, computed by two codes of 30 and 40 digits
TRACES = {
    (1, 0.1): -2.024666915416,
    (1, 0.5): -2.612418906625,
    (1, 1): -4.396667734799,
    (4, 1): 2.021314397417,
    (2, 1): -1.554649354177,
    (0, 0.9): -1.930617777201,
    (0, 0.92): -2.104134363645,
}


def mathieu(period=sp.pi, damping=0):
    system = System("Mathieu")
    a, q = system.parameter("a", default=1.0), system.parameter("q", default=0.1)
    y = system.coordinate("y", bounds=(-1, 1))
    system.kinetic_energy(system.velocity(y) ** 2 / 2)
    system.potential((a - 2 * q * sp.cos(2 * system.time)) * y**2 / 2)
    system.dissipation(sp.Float(damping) * system.velocity(y) ** 2)
    system.period(period)
    return system


def test_traces_of_mathieus_equation_are_the_published_ones():
    a, q = np.array(list(TRACES), dtype=float).T
    model = Model(mathieu())
    found = motions.monodromy(model, [a, q], np.zeros((a.size, 2)), 1e-13)
    columns = floquet.columns(found["matrix"], found["error"], found["period"])
    assert np.abs(columns["trace"] - list(TRACES.values())).max() < 1e-12  # their printed digits
    assert np.abs(np.linalg.det(found["matrix"]) - 1).max() < 1e-13
    assert (np.abs(columns["trace"] - list(TRACES.values())) <= columns["trace_error"] + 6e-13).all()
    assert columns["trace_error"].max() < 1e-11
    assert model.equations.hamiltonian


def test_damping_shrinks_areas_as_liouville_says():
    found = motions.monodromy(Model(mathieu(damping=0.05)), [np.ones(1), 0.4 * np.ones(1)], np.zeros((1, 2)), 1e-13)
    assert np.linalg.det(found["matrix"][0]) == pytest.approx(np.exp(-0.1 * np.pi), rel=1e-13)


def test_the_tangent_flow_is_the_difference_of_motions():
    """Of a driven double pendulum far from rest, with a mass matrix and quotients: central differences."""
    system = System("Driven double pendulum")
    w = system.parameter("drive", "rad s-1", default=2.0, positive=True)
    q = [system.coordinate(f"q{i}", "rad", bounds=(-4, 4), periodic=True) for i in (1, 2)]
    x, y, place = 0, sp.sin(w * system.time) / 5, []
    for angle in q:
        x, y = x + sp.sin(angle), y - sp.cos(angle)
        system.particle(1, (x, y))
        place.append(y)
    system.potential(3 * sum(place))
    system.dissipation(system.velocity(q[0]) ** 2 / 10)
    system.period(2 * sp.pi / w)
    model, start, step = Model(system), np.array([0.7, -0.4, 0.3, 0.2]), 1e-5
    found = motions.monodromy(model, [np.full(1, 2.0)], start[None], 1e-13)
    starts = np.concatenate([start + step * np.eye(4), start - step * np.eye(4)])
    times = np.tile([0.0, np.pi], (8, 1))
    ends = motions.solved(model.moving, [np.full(8, 2.0)], starts, times, 1e-13)[0][:, 1]
    differences = ((ends[:4] - ends[4:]) / (2 * step)).T
    assert found["matrix"][0] == pytest.approx(differences, abs=1e-7 * np.abs(differences).max())  # step squared
    assert found["residual"].max() > 0.1  # it does not come back, and says so


def test_a_period_that_is_none_is_refused():
    with pytest.raises(DescriptionError, match=r"period: force y_dot is .* a period later"):
        Model(mathieu(period=3))
    with pytest.raises(DescriptionError, match="period: -1; allowed"):
        mathieu(period=-1)
