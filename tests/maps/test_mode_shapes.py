"""Mode shapes against closed forms and 40-digit eigenvectors, and modes that are followed along a parameter.

POLHODE_ALL_CASES=1 has more random matrices, points and families of oscillators.
"""

import json

import described
import mpmath
import numpy as np
import oscillators
import pytest
import relative as relative_systems
import repeated
import sympy as sp
from described import particle
from multipliers import monodromy_matrix
from PIL import Image

import sweeps
from sweeps import systems
from sweeps.__main__ import main
from sweeps.maps.modes import select_points
from sweeps.mechanics import System, mode_shapes, periodic, relative
from sweeps.mechanics.linear_model import LinearModel
from sweeps.schema.refusals import RefusedError
from sweeps.systems import mode_curves

SPREAD = {"a": (1.0, 3.0), "b": (1.0, 3.0), "coupling": (-0.9, 0.9), "gyro": (-1.0, 1.0), "drag": (0.0, 0.4)}


def two_coordinates(natural):
    """Return two coupled oscillators: masses 1 and 2, stiffnesses a, b; gyroscopic and damped unless natural."""
    values = {name: sum(SPREAD[name]) / 2 for name in ([*SPREAD][:3] if natural else SPREAD)}
    system = particle(
        lambda x, y, a, b, coupling, *_: (a * x**2 + b * y**2) / 2 + coupling * x * y,
        "xy",
        (-1, 1),
        size=1,
        forces=None if natural else lambda x, y, u, v, a, b, coupling, gyro, drag: (gyro * v - drag * u, -gyro * u),
        kinetic=lambda x, y, u, v, *_: v**2 / 2,  # a mass of 2
        **{"places": {"rest": [0, 0]}} | values,
    )
    system.plane(*(x.symbol for x in system.coordinates.values()))
    return system


def resolved(system):
    """Return the system of maps of a description, without a map."""
    return systems.resolve(systems.register_system(system))


def exact_modes(mass, damping, stiffness):
    """Return eigenvalues and shapes of M q″ + C q′ + K q = 0, to 40 digits and rounded, x^H M x = 1; rows are modes."""
    count = len(mass)
    with mpmath.workdps(40):
        M, C, K = (mpmath.matrix(values.tolist()) for values in (mass, damping, stiffness))
        A = mpmath.zeros(2 * count)
        A[:count, count:] = mpmath.eye(count)
        A[count:, :count], A[count:, count:] = -mpmath.inverse(M) * K, -mpmath.inverse(M) * C
        values, vectors = mpmath.eig(A)
        shapes = [vectors[:count, k] for k in range(2 * count)]
        lengths = [mpmath.sqrt(mpmath.re((shape.H * M * shape)[0])) for shape in shapes]
        rows = [[x / length for x in shape] for shape, length in zip(shapes, lengths, strict=True)]
        return np.array(values, complex), np.array(rows, complex)


def deviation(shape, right, mass):
    """Return the distance of a shape from the right one up to a phase, in the norm of the masses."""
    product = right.conj() @ mass @ shape
    difference = shape - right * product / abs(product)
    return np.sqrt((difference.conj() @ mass @ difference).real)


def random_matrices(rng, count):
    """Return masses, damping with a gyroscopic part, and stiffness."""
    mass, damping, stiffness = (part @ part.T for part in rng.uniform(-1.0, 1.0, (3, count, count)))
    turn = np.triu(rng.uniform(-1.0, 1.0, (count, count)), 1)
    return mass + np.eye(count), 0.1 * damping + turn - turn.T, stiffness + 0.1 * np.eye(count)


@pytest.mark.parametrize("number", [1, pytest.param(repeated.number(4, 8), marks=pytest.mark.slow)])
@pytest.mark.parametrize("count", [2, 4, 6])
def test_shapes_of_matrices_are_within_their_errors_of_40_digit_eigenvectors(number, count):
    rng, apart = np.random.default_rng(count), []
    for _ in range(number):
        mass, damping, stiffness = random_matrices(rng, count)
        system = System("Random matrices")
        system.matrices(mass, stiffness, C=damping)
        system.linear_matrices = tuple(map(sp.Matrix, (mass, stiffness, damping)))  # measured as large systems are
        model = LinearModel(system)
        theory = relative.theory(model, {"equilibrium": np.zeros(1, dtype=int)})
        predicted, measured = mode_shapes.predict_shapes(model, theory), model.mode_shapes(theory)
        values, right = exact_modes(mass, damping, stiffness)
        for mode, value in enumerate(theory["eigenvalues"][0]):
            nearest = np.abs(values - value).argmin()
            gap = np.partition(np.abs(values - values[nearest]), 1)[1]
            for shapes in (predicted, measured):
                distance = deviation(shapes.vectors[0, mode], right[nearest], mass)
                assert distance <= shapes.errors[0, mode] or np.isnan(shapes.errors[0, mode])
            if gap > 1e-3:
                apart.append(deviation(predicted.vectors[0, mode], right[nearest], mass))
    assert max(apart) < 1e-11


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


def exact_modes_at(equations, parameters, place):
    """Return eigenvalues (of natural systems Ω²), shapes in rows and the kinetic matrix, of 40 digits and rounded."""
    with mpmath.workdps(40):
        slopes, *further = linear_matrices(equations, [mpmath.mpf(float(p)) for p in parameters], place)
        drag, masses = further or (None, None)
        if further and not equations.natural:
            values, shapes = exact_modes(masses, -drag, -slopes)
        else:
            values, vectors = mpmath.eig(-(masses**-1) * slopes if further else slopes)
            values, shapes = np.array(values, complex), np.array(vectors.T.tolist(), complex)
        return values, shapes, np.array(masses.tolist(), float) if further else None


RANGES = oscillators.LIBRARY | relative_systems.RANGES
QUICK = ("rotor",)  # a system that other quick tests compile


@pytest.mark.parametrize(
    "name", [name if name in QUICK else pytest.param(name, marks=pytest.mark.slow) for name in RANGES]
)
def test_shapes_and_shares_of_shipped_systems_are_within_their_errors_of_40_digit_eigenvectors(name):
    system = systems.resolve(name)
    model, natural = system.mechanism, system.mechanism.equations.natural
    points = described.points(model, repeated.number(5, 10), RANGES[name], 11)
    first = points["mode" if natural else "eigenvalue"] == 1
    points = {key: values[first] for key, values in points.items()}
    slots = np.array(model.system.names)
    arguments = points | {"equilibrium": slots[points["equilibrium"]]}
    theory = relative.theory(model, points)
    predicted, measured, _ = system.mode_shapes(arguments, system.base_model.model_fields["integration"].annotation())
    excess, theory_distances = [], []
    for point in np.flatnonzero(np.isfinite(theory["place"]).all(axis=1)):
        parameters = [points[key][point] for key in model.names] or [0.0]
        values, shapes, masses = exact_modes_at(model.equations, parameters, theory["place"][point])
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
                distance = deviation(shape, right, metric)
                excess.append(not distance <= error)  # a missing shape counts, too: all rates here are apart
                size = np.abs(shape) * np.sqrt(np.diag(metric))
                leading = shape[(size >= 0.99 * size.max()).argmax()]
                assert np.isnan(leading) or leading.real > 1e15 * abs(leading.imag)  # the first large one is positive
                # a share is the product of a component and of an image, each off by the error at most
                is_off = np.abs(answer.participation[point, mode] - share) > 4.0 * error
                excess.append(is_off.any() or np.isnan(answer.participation[point, mode]).any() != (masses is None))
                if answer is predicted and gap > 1e-3 * scale:
                    theory_distances.append(distance)
    assert len(excess) >= 8
    assert np.mean(excess) <= 1e-3
    assert max(theory_distances) <= 1e-11  # the bar; the actual distance is below 1e-13


FAMILIES = {  # natural?, the further parameters of each family of two coordinates; b has five values in each
    "natural": (True, [{"coupling": c} for c in (0.0, 1e-6, -1e-5, 1e-4, -1e-3, 0.01, -0.1, 0.5)]),
    "damped": (False, [{"coupling": 0.0, "gyro": 0.0, "drag": drag} for drag in (0.0, 0.01, 0.3)]),
    "gyroscopic": (False, [{"coupling": c, "gyro": g, "drag": 0.0} for c, g in [(0.3, 0.0), (0.0, 0.1), (0.2, 0.5)]]),
}


@pytest.mark.parametrize(
    "kind", [pytest.param(k, marks=() if k == "gyroscopic" else pytest.mark.slow) for k in FAMILIES]
)
def test_modes_keep_their_curve_at_a_crossing_and_their_order_at_a_veering(kind):
    """Over a, modes of two coordinates cross at a = b/2 without coupling (each moves one of them), and veer with it."""
    natural, families = FAMILIES[kind]
    families = families[:: repeated.number(2, 1)]
    system = resolved(two_coordinates(natural))
    values, unknown = np.linspace(0.53, 2.53, 24), []
    for family in families:
        for b in np.linspace(1.3, 4.1, 5):
            arguments = {name: np.full(24, value) for name, value in (family | {"b": b}).items()}
            arguments |= {"equilibrium": np.full(24, "rest"), "a": values}
            curves = mode_curves.follow_modes(system, arguments)
            predicted = system.mode_shapes(arguments)[0]
            unknown.append(curves == 0)
            if family["coupling"] == family.get("gyro", 0.0) == 0.0:
                moves_x = predicted.participation[..., 0] > 0.5
                for number in range(1, curves.shape[1] + 1):
                    assert np.unique(moves_x[curves == number]).size == 1  # no curve passes to the other coordinate
            else:
                is_known = curves != 0
                assert (curves == np.arange(1, curves.shape[1] + 1))[is_known].all()
    assert np.mean(unknown) <= 0.01


def test_curves_end_where_pairs_of_eigenvalues_meet_and_further_ones_begin():
    """L4: two pairs on the axis up to Routh's mass ratio 0.0385, four eigenvalues off both axes beyond."""
    ratios = np.linspace(0.03, 0.05, 9)
    curves = mode_curves.follow_modes(
        systems.resolve("lagrange_points"),
        {"equilibrium": np.full(9, "L4"), "orbital_rate": np.ones(9), "mass_ratio": ratios},
    )
    np.testing.assert_array_equal(np.sort(curves[ratios < 0.0385]), [[1, 2, 3, 4]] * (ratios < 0.0385).sum())
    np.testing.assert_array_equal(np.sort(curves[ratios > 0.0386]), [[5, 6, 7, 8]] * (ratios > 0.0386).sum())


def exceptional_point(b, coupling):
    """Return a and drag at which two modes of x″ + drag x′ + a x + k y = 0, 2 y″ + b y + k x = 0 coincide."""
    with mpmath.workdps(30):

        def double_root(a, drag, frequency):
            rate = mpmath.mpc(-drag / 4, frequency)
            first, second = rate**2 + drag * rate + a, 2 * rate**2 + b
            value, slope = first * second - coupling**2, (2 * rate + drag) * second + 4 * rate * first
            return [value.real, value.imag, slope.real, slope.imag][:3]

        return [float(x) for x in mpmath.findroot(double_root, (b / 2, coupling, mpmath.sqrt(b / 2)))][:2]


@pytest.mark.slow
def test_modes_are_exchanged_around_an_exceptional_point_and_the_cut_ends_there():
    b, coupling = 3.0, 0.2
    a, drag = exceptional_point(b, coupling)
    system = System("Loop around an exceptional point")
    angle, centre = system.parameter("angle", default=0.0), system.parameter("centre", default=drag)
    stiffness, loss = a + 0.1 * sp.cos(angle), centre + 0.1 * sp.sin(angle)
    system.matrices([[1, 0], [0, 2]], [[stiffness, coupling], [coupling, b]], C=[[loss, 0], [0, 0]])
    grid = {"angle": np.linspace(0.0, 2.0 * np.pi, 25), "centre": np.repeat([drag, drag + 0.3], 25)}
    arguments = {"equilibrium": np.full(50, "rest"), "centre": grid["centre"], "angle": np.tile(grid["angle"], 2)}
    loops = mode_curves.follow_modes(resolved(system), arguments).reshape(2, 25, 4)
    assert loops[:, -1].tolist() == [[2, 1, 4, 3], [1, 2, 3, 4]]  # a loop around the point, and a loop outside it
    grid = {"a": np.linspace(a - 0.4, a + 0.4, 17), "drag": np.linspace(drag - 0.15, drag + 0.16, 14)}
    ds = sweeps.survey(system=two_coordinates(False), b=b, coupling=coupling, gyro=0.0, **grid)
    cuts = mode_curves_of(ds).cut_drag
    is_beyond = (grid["a"] > a + 0.01) & (np.searchsorted(grid["drag"], drag) - 1 == np.arange(14)[:, None])
    np.testing.assert_array_equal(cuts, is_beyond)  # the cut runs from the cell of the point to the end of a
    panel = sweeps.plot.mode_surface(ds, "a", "drag", 3)
    (line,) = [artist for artist in panel.collections if artist.get_gid() == "cut"]
    ends = np.array(line.get_segments())
    assert (np.abs(ends[..., 1] - drag) < np.diff(grid["drag"])[0]).all()
    assert abs(ends[..., 0].min() - a) < np.diff(grid["a"])[0]


def mode_curves_of(ds):
    """Return the modes of a map along a, without measured shapes."""
    return select_points(ds, "a", {}, None).modes(measured=False).squeeze()


@pytest.mark.parametrize(("a", "q"), [(1.7, 0.4), (1.0, 0.5), (4.2, 2.5), (7.0, 0.1)])
def test_floquet_modes_are_eigenvectors_of_the_monodromy_matrix(a, q):
    """Inside and outside of tongues; the ion in a trap has one such mode in each plane, with a and q of both signs."""
    modes = sweeps.modes(sweeps.survey(system="mathieu", a=a, q=q)).squeeze()
    model = systems.resolve("mathieu").mechanism
    parameters = [np.array([value]) for value in ({"a": a, "q": q, "damping": 0.0}[name] for name in model.names)]
    metric = np.diag(periodic.BaseMotions(model, parameters, np.zeros(1, int)).sizes[0] ** -2.0)
    values, vectors = mpmath.eig(mpmath.matrix(monodromy_matrix(a, q).tolist()))
    values, vectors = np.array(values, complex), np.array(vectors.T.tolist(), complex)
    exponents = (modes.eigenvalue_real + 1j * modes.eigenvalue_imag).values
    for number, multiplier in enumerate(np.exp(np.pi * exponents)):
        right = vectors[np.abs(values - multiplier).argmin()]
        for suffix in ("", "_theory"):
            mode = modes.isel(multiplier=number)
            shape = (mode[f"mode_shape_real{suffix}"] + 1j * mode[f"mode_shape_imag{suffix}"]).values
            right = right / np.sqrt((right.conj() @ metric @ right).real)
            assert deviation(shape, right, metric) <= mode[f"mode_shape_error{suffix}"] < 1e-11
    assert modes.participation.isnull().all()


def test_whirl_damping_and_refusals():
    modes = sweeps.modes(sweeps.survey(system="rotor", spin_rate=[0.5, 2.0], stiffness_y=1.0)).squeeze()
    assert (np.abs(modes.whirl) == 1.0).all()  # the shaft's material drives forward whirl and damps backward whirl
    by_whirl = {sign: modes.eigenvalue_real.where(modes.whirl == sign).max("eigenvalue") for sign in (1, -1)}
    assert (by_whirl[1] > by_whirl[-1]).all()
    ratio = -modes.eigenvalue_real / np.hypot(modes.eigenvalue_real, modes.eigenvalue_imag)
    np.testing.assert_allclose(modes.damping_ratio, ratio, rtol=1e-15)
    with pytest.raises(RefusedError, match="has none along a grid"):
        sweeps.modes(sweeps.tumbler(368.7, 67.27))
    with pytest.raises(RefusedError, match="along: a is no parameter"):
        sweeps.modes(sweeps.survey(system="pendulum"), "a")
    assert systems.resolve("rotor").description.given_plane == ("x", "y")
    with pytest.raises(ValueError, match="allowed: x, y"):
        two_coordinates(True).plane(sp.Symbol("x"), sp.Symbol("z"))


def test_the_command_prints_modes_and_writes_tables_and_pictures(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    spread = {"start": 0.5, "stop": 2.0, "num": 4}
    sweeps.survey(system="rotor", stiffness_y=[1.0, 1.3], spin_rate=spread).to_netcdf("shaft.nc")

    def output(*words):
        assert main(["modes", "shaft.nc", "--stiffness_y", "1", *words]) == 0
        return capsys.readouterr().out

    point = sweeps.modes("shaft.nc", stiffness_y=1.0, spin_rate=1.0).squeeze()
    lines = output("--spin_rate", "1.1").splitlines()
    rows = [line.split() for line in lines if "ward" in line]
    for row, number in zip(rows, (3, 4), strict=True):  # of conjugate modes one is printed
        mode = point.sel(eigenvalue=number)
        values = [mode[name].item() for name in ("eigenvalue_imag", "eigenvalue_real")]
        np.testing.assert_allclose([float(word) for word in row[1:3]], values, rtol=1e-8)
    assert [row[-1] for row in rows] == ["backward", "forward"]
    assert sum(line.split()[1:3] == ["y", "0.707107"] for line in lines) == 2
    assert "spin_rate = 1 rad s-1 (nearest to 1.1)" in lines
    facts = json.loads(output("--spin_rate", "1", "--json"))["data_vars"]
    assert facts["damping_ratio"]["data"] == point.damping_ratio.values.tolist()
    curves = [line.split()[1] for line in output("--along", "spin_rate").splitlines() if "ward" in line]
    assert curves == ["3"] * 4 + ["4"] * 4
    assert "modes.csv" in output("--along", "spin_rate", "-o", "modes.csv").splitlines()
    assert len((tmp_path / "modes.csv").read_text().splitlines()) == 1 + 4 * 4 * 2  # speeds, eigenvalues, components
    widths = []
    for words in ([], ["--root-locus"]):
        output("--along", "spin_rate", "-o", "picture.png", *words)
        widths.append(Image.open("picture.png").width)
    assert widths[0] > 1.5 * widths[1]  # two panels and one
    for words, message in [
        (["shaft.nc", "--spin_rate", "1"], "1 dimension has no value (stiffness_y)"),
        (["shaft.nc", "--along", "spn_rate"], "--along: spn_rate is no parameter (did you mean spin_rate?)"),
        (["shaft.nc", "--along", "spin_rate", "-o", "a.gif"], "unknown format"),
    ]:
        assert main(["modes", *words]) == 2
        assert message in capsys.readouterr().err
