"""Mode shapes of every shipped system at random points against eigenvectors of its equations in 40 digits."""

import described
import mpmath
import numpy as np
import oscillators
import pytest
import relative as relative_systems
import sympy as sp

from sweeps import systems
from sweeps.mechanics import relative

DIGITS = 40
QUICK = ("double_pendulum", "rotor")  # systems that other quick tests compile
RANGES = oscillators.LIBRARY | relative_systems.RANGES


def linear_matrices(equations, parameters, place):
    """Return the slopes of the forces by places and velocities, and the masses (None of states), in mpmath's digits.

    The place is refined by Newton's steps: the shortest, where conserved quantities leave a family of equilibria.
    """
    places, velocities, forces = sp.Matrix(equations.q), sp.Matrix(equations.v), sp.Matrix(equations.forces)
    parts = [forces, forces.jacobian(places)]
    parts += [forces.jacobian(velocities), equations.a] if equations.v else []
    functions = [sp.lambdify((*equations.parameters, *equations.states), part.tolist(), "mpmath") for part in parts]
    x, rest = mpmath.matrix(place.tolist()), [mpmath.mpf(0)] * len(velocities)
    for _newton in range(6):
        force, slopes = (mpmath.matrix(function(*parameters, *x, *rest)) for function in functions[:2])
        u, s, v = mpmath.svd_r(slopes)
        inverse = mpmath.diag([1 / value if value > 1e-9 * s[0] else 0 for value in s])
        x -= v.T * inverse * (u.T * force)
    return [mpmath.matrix(function(*parameters, *x, *rest)) for function in functions[1:]]


def exact_modes(equations, parameters, place):
    """Return eigenvalues (of natural systems Ω²), shapes in rows and the kinetic matrix, of 40 digits and rounded."""
    count = len(equations.q)
    with mpmath.workdps(DIGITS):
        slopes, *further = linear_matrices(equations, [mpmath.mpf(float(p)) for p in parameters], place)
        if not further:
            values, vectors = mpmath.eig(slopes)
            return np.array(values, complex), np.array(vectors.T.tolist(), complex), None
        drag, masses = further
        if equations.natural:
            values, vectors = mpmath.eig(-(masses**-1) * slopes)
        else:
            matrix = mpmath.zeros(2 * count)
            matrix[:count, count:] = mpmath.eye(count)
            matrix[count:, :count], matrix[count:, count:] = masses**-1 * slopes, masses**-1 * drag
            values, vectors = mpmath.eig(matrix)
        shapes = np.array(vectors.T.tolist(), complex)[:, :count]
        return np.array(values, complex), shapes, np.array(masses.tolist(), float)


@pytest.mark.parametrize(
    "name", [name if name in QUICK else pytest.param(name, marks=pytest.mark.slow) for name in RANGES]
)
def test_shapes_and_shares_are_within_their_errors_of_40_digit_eigenvectors(name):
    system = systems.resolve(name)
    model, natural = system.mechanism, system.mechanism.equations.natural
    points = described.points(model.system, "mode", 1, 10, RANGES[name], 11, epsilon=1e-6 if natural else 1e-30)
    slots = np.array(model.system.names)
    arguments = points | {"equilibrium": slots[points["equilibrium"]]}
    theory = relative.theory(model, points)
    predicted, measured, _ = system.mode_shapes(arguments, system.base_model.model_fields["integration"].annotation())
    excess, theory_distances = [], []
    for point in np.flatnonzero(np.isfinite(theory["place"]).all(axis=1)):
        parameters = [points[key][point] for key in model.names] or [0.0]
        values, shapes, masses = exact_modes(model.equations, parameters, theory["place"][point])
        metric = np.diag(theory["sizes"][point, : shapes.shape[1]] ** -2.0) if masses is None else masses
        scale = theory["scale"][point] ** (2 if natural else 1)
        for mode, rate in enumerate(np.sort(values.real) if natural else theory["eigenvalues"][point]):
            order = np.argsort(np.abs(values - rate))
            gap = np.abs(values[order[1:]] - values[order[0]]).min(initial=np.inf)
            right = shapes[order[0]]
            right = right / np.sqrt((right.conj() @ metric @ right).real)
            share = np.full(right.shape, np.nan) if masses is None else (right.conj() * (masses @ right)).real
            for answer in (predicted, measured):
                shape, error = answer.vectors[point, mode], answer.errors[point, mode]
                product = right.conj() @ metric @ shape
                difference = shape - right * product / abs(product)
                distance = np.sqrt((difference.conj() @ metric @ difference).real)
                excess.append(not distance <= error)  # a missing shape counts, too: all rates here are apart
                # a share is the product of a component and of an image, each off by the error at most
                is_off = np.abs(answer.participation[point, mode] - share) > 4.0 * error
                excess.append(is_off.any() or np.isnan(answer.participation[point, mode]).any() != (masses is None))
                if answer is predicted and gap > 1e-3 * scale:
                    theory_distances.append(distance)
    assert len(excess) >= 20
    assert np.mean(excess) <= 1e-3
    assert max(theory_distances) <= 1e-11  # the bar; the actual distance is below 1e-13
