"""Mode shapes against closed forms and 40-digit eigenvectors, and modes that are followed along a parameter."""

import mpmath
import numpy as np
import pytest
import sympy as sp

import sweeps
from sweeps import systems
from sweeps.maps.critical_values import sweep_of
from sweeps.mechanics import System
from sweeps.schema.refusals import RefusedError

SPREAD = {"a": (1.0, 3.0), "b": (1.0, 3.0), "coupling": (-0.9, 0.9), "gyro": (-1.0, 1.0), "drag": (0.0, 0.4)}


def two_coordinates(natural):
    """Return two coupled oscillators: masses 1 and 2, stiffnesses a, b; gyroscopic and damped unless natural."""
    system = System("Two coordinates")
    values = {
        name: system.parameter(name, default=sum(SPREAD[name]) / 2) for name in ([*SPREAD][:3] if natural else SPREAD)
    }
    x, y = (system.coordinate(name, bounds=(-1, 1), size=1) for name in "xy")
    vx, vy = system.velocity(x), system.velocity(y)
    system.kinetic_energy((vx**2 + 2 * vy**2) / 2)
    system.potential((values["a"] * x**2 + values["b"] * y**2) / 2 + values["coupling"] * x * y)
    if not natural:
        system.force(x, values["gyro"] * vy - values["drag"] * vx)
        system.force(y, -values["gyro"] * vx)
    system.equilibrium("rest", {x: 0, y: 0})
    system.plane(x, y)
    return system


def exact_shapes(a, b, coupling, gyro=0.0, drag=0.0):
    """Return eigenvalues and shapes of two coordinates, to 40 digits and rounded, x^H M x = 1; rows are modes."""
    with mpmath.workdps(40):
        stiffness = [[a, coupling], [coupling / 2, b / 2]]
        damping = [[drag, -gyro], [gyro / 2, 0]]
        A = mpmath.matrix(4, 4)
        for i in range(2):
            A[i, 2 + i] = 1
            for j in range(2):
                A[2 + i, j], A[2 + i, 2 + j] = -mpmath.mpf(stiffness[i][j]), -mpmath.mpf(damping[i][j])
        values, vectors = mpmath.eig(A)
        shapes = [[vectors[i, k] for i in range(2)] for k in range(4)]
        lengths = [mpmath.sqrt(abs(x) ** 2 + 2 * abs(y) ** 2) for x, y in shapes]
        return np.array(values, complex), np.array(
            [[z / d for z in s] for s, d in zip(shapes, lengths, strict=True)], complex
        )


def deviation(shape, right):
    """Return the distance of a shape from the right one up to a phase, in the norm of the masses 1 and 2."""
    mass = np.array([1.0, 2.0])
    product = (right.conj() * mass * shape).sum()
    return np.sqrt((mass * np.abs(shape - right * product / abs(product)) ** 2).sum())


@pytest.mark.parametrize("natural", [True, False])
def test_shapes_of_random_systems_are_within_their_errors_of_40_digit_eigenvectors(natural):
    ds = sweeps.survey(system=two_coordinates(natural))
    sweep, rng = sweep_of(ds), np.random.default_rng(0)
    names = [*SPREAD][:3] if natural else [*SPREAD]
    arguments = {name: rng.uniform(*SPREAD[name], 40) for name in names}
    arguments |= {"epsilon": np.full(40, 1e-6 if natural else 1e-30), "equilibrium": np.full(40, "rest")}
    predicted, measured, _ = sweep.system.mode_shapes(arguments, sweep.definition.integration)
    for point in range(40):
        values, right = exact_shapes(*(float(arguments[name][point]) for name in names))
        order = np.lexsort((values.real, values.imag))
        order = [k for k in order if values[k].imag > 0.0] if natural else order
        for shapes, limit in ((predicted, 1e-11), (measured, 1e-8)):
            errors = shapes.errors[point]
            deviations = [deviation(*pair) for pair in zip(shapes.vectors[point], right[order], strict=True)]
            assert (np.array(deviations) <= errors).all()
            assert (errors < limit).all()  # of modes whose rates are apart; theory's actual error is 1e-14
            np.testing.assert_allclose(shapes.participation[point].sum(axis=1), 1.0, rtol=1e-12)
            leading = np.abs(shapes.vectors[point]) * np.sqrt([1.0, 2.0])
            first = np.argmax(leading >= 0.99 * leading.max(axis=1, keepdims=True), axis=1)
            chosen = shapes.vectors[point, range(len(first)), first]
            np.testing.assert_allclose(chosen.imag, 0.0, atol=1e-15)
            assert (chosen.real > 0.0).all()


def test_modes_keep_their_curve_at_a_crossing_and_their_order_at_a_veering():
    """Ω² of a + p and b − p cross for no coupling, and are apart by twice the coupling over √2 masses else."""
    coupling = [0.0, 1e-5, 1e-3, 0.1]
    grid = {"a": np.linspace(0.53, 2.53, 24), "b": [2.0, 3.0, 4.0], "coupling": coupling}
    modes = sweeps.modes(sweeps.survey(system=two_coordinates(True), **grid), "a")
    curves = modes.curve.squeeze().transpose("coupling", "b", "mode", "a")
    assert (curves != 0).all()
    for number, strength in enumerate(coupling):
        for b in range(3):
            crossed = grid["a"] > grid["b"][b] / 2.0 if strength == 0.0 else np.zeros(24, bool)
            np.testing.assert_array_equal(curves[number, b, 0], np.where(crossed, 2, 1))
    share = modes.participation.isel(component=0).squeeze().sel(coupling=0.0)
    np.testing.assert_allclose(share.where(modes.curve.squeeze().sel(coupling=0.0) == 1).sum("mode"), 1.0)


def test_orbits_keep_their_radial_mode_where_both_rates_are_equal():
    """The radial rate is √(s + 2) orbital rates: at s = -1 both modes are equal, and their shapes are missing."""
    ds = sweeps.survey(system="central_potential", exponent={"start": -1.75, "stop": 3.25, "num": 21})
    modes = sweeps.modes(ds, "exponent").squeeze()
    exponent = modes.exponent.values
    is_kepler = exponent == -1.0
    assert modes.mode_shape_real.sel(exponent=-1.0).isnull().all()
    assert modes.mode_shape_real.sel(exponent=exponent[~is_kepler]).notnull().all()
    radial = modes.eigenvalue_imag.where(modes.curve == 1).sum("mode").values[~is_kepler]
    tilting = modes.eigenvalue_imag.where(modes.curve == 2).sum("mode").values[~is_kepler]
    np.testing.assert_allclose(radial / tilting, np.sqrt(exponent[~is_kepler] + 2.0), rtol=1e-8)  # error of the rates


def test_whirl_damping_and_refusals():
    modes = sweeps.modes(sweeps.survey(system="rotor", spin_rate=[0.5, 2.0], stiffness_y=1.0)).squeeze()
    assert (np.abs(modes.whirl) == 1.0).all()  # the shaft's material drives forward whirl and damps backward whirl
    by_whirl = {sign: modes.eigenvalue_real.where(modes.whirl == sign).max("eigenvalue") for sign in (1, -1)}
    assert (by_whirl[1] > by_whirl[-1]).all()
    ratio = -modes.eigenvalue_real / np.hypot(modes.eigenvalue_real, modes.eigenvalue_imag)
    np.testing.assert_allclose(modes.damping_ratio, ratio, rtol=1e-15)
    with pytest.raises(RefusedError, match="no mode shapes"):
        sweeps.modes(sweeps.survey(system="mathieu", a=[1.0, 2.0]))
    with pytest.raises(RefusedError, match="along: a is no parameter"):
        sweeps.modes(sweeps.survey(system="pendulum"), "a")
    assert systems.resolve("rotor").description.given_plane == ("x", "y")
    with pytest.raises(ValueError, match="allowed: x, y"):
        two_coordinates(True).plane(sp.Symbol("x"), sp.Symbol("z"))
