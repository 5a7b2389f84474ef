"""Relative equilibria that ship: spectra against the polynomials of books, measured and by theory."""

import functools
import warnings

import mpmath
import numpy as np
import pytest
import relative
import sympy as sp
from described import flow, model_of, particle, points, points_at
from scipy.sparse import csr_array
from scipy.sparse.csgraph import maximum_bipartite_matching

from sweeps.mechanics import relative as theirs
from sweeps.mechanics.model import Model
from sweeps.systems.relative_equilibrium.system import REGIMES

pytestmark = pytest.mark.slow  # compiling their kernels takes as long as compiling those of all quick tests
SETS = 120
MEASURED = 48


def motions(name, count, seed=1, **fixed):
    m = model_of(name)
    columns = points(m, count, relative.RANGES[name], seed)
    columns |= {k: np.full(len(columns["epsilon"]), v) for k, v in fixed.items()}
    return m, columns


def expected(name, columns, n):
    """The polynomials' coefficients of each motion."""
    rows = range(0, len(columns["epsilon"]), n)
    polynomials = []
    for i in rows:
        point = {k: v[i] for k, v in columns.items()}
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", np.exceptions.ComplexWarning)
            polynomials.append(np.real(relative.polynomial(name, point, int(point["equilibrium"]))))
    return np.array(polynomials)


def coefficients(real, imag, n):
    """Coefficients of the polynomial with these roots, a row a motion."""
    roots = (real + 1j * imag).reshape(-1, n)
    return np.array([np.poly(row).real for row in roots])


@pytest.mark.parametrize("name", relative.RANGES)
def test_theory_has_the_spectrum_of_books(name):
    m, columns = motions(name, SETS)
    first = {k: v[:: m.n] for k, v in columns.items()}
    theory = m.theory(first)
    exists = ~np.isnan(theory["place"]).any(1)
    assert exists.sum() >= SETS * 0.9
    polynomials = coefficients(theory["eigenvalues"].real.ravel(), theory["eigenvalues"].imag.ravel(), m.n)
    powers = theory["scale"][:, None] ** np.arange(m.n + 1)
    deviation = np.abs(polynomials - expected(name, columns, m.n)) / powers
    assert deviation[exists].max() < 1e-12  # doubles, of a bound on every rate


@pytest.mark.parametrize("name", relative.RANGES)
def test_motions_show_the_spectrum_of_books(name):
    m, columns = motions(name, MEASURED, seed=2)
    result = m.survey(columns)
    is_ok = result["status"] == 0
    assert is_ok.mean() > 0.85  # the further statuses name the reason: mostly a mode that no perturbation moved
    S = result["rate_scale"]
    exact = expected(name, columns, m.n)
    polynomials = coefficients(result["eigenvalue_real"], result["eigenvalue_imag"], m.n)
    rows = is_ok[:: m.n]
    deviation = np.abs(polynomials - exact)[rows] / (S[:: m.n, None] ** np.arange(m.n + 1))[rows]
    assert deviation.max() < 1e-10  # coefficients are smooth where roots are not
    relative.check_errors(result, is_ok)
    assert all(np.median((result[f"eigenvalue_{part}_error"] / S)[is_ok]) < 1e-8 for part in ("real", "imag"))
    if m.n == 4:
        for variable, power in (("sum_of_squares", 2), ("product_of_squares", 4), ("discriminant", 4)):
            error = result[f"{variable}_error"] / S**power
            distance = np.abs(result[variable] - result[f"{variable}_theory"]) / S**power
            assert (distance <= error)[is_ok].all()
            assert error[is_ok].max() < 1e-9
    for quantity in m.quantities:
        assert np.nanmax(result[f"{quantity}_drift"][is_ok]) < 1e-10
    assert (result["regime"] == result["regime_theory"])[
        is_ok
    ].mean() > 0.98  # elsewhere one of the two regimes is marginal


@pytest.mark.parametrize("epsilon", [1e-14, 1e-10])
def test_errors_cover_where_a_small_state_feels_large_ones(epsilon):
    """The slug's rate about the axis, a hundredth of those across it: a nudge bends it hundreds of times its size."""
    m = model_of("viscous_slug")
    columns = m.survey(points(m, 100, relative.RANGES["viscous_slug"], 2, epsilon=epsilon))
    relative.check_errors(columns)


def of_matrices(matrices):
    """Return columns of the linear systems x' = A x, with rows of eigenvalues."""
    count, n, _ = matrices.shape
    defaults = {f"a{i}{j}": 1.0 + 2 * i + j * j for i in range(n) for j in range(n)}
    rates = lambda *x: sp.Matrix(n, n, x[n:]) * sp.Matrix(x[:n])  # noqa: E731
    model = Model(flow(rates, [f"x{i}" for i in range(n)], (-1, 1), places={"rest": [0] * n}, **defaults))
    columns = model.survey(points_at(model, **{name: matrices[:, int(name[1]), int(name[2])] for name in defaults}))
    return {name: rows.reshape(count, n) for name, rows in columns.items()}


def check_eigenvalues(columns, matrices, numbers, digits=40):
    """Check that errors cover the distance from exact eigenvalues, in any order, of matrices with these numbers."""
    for k in numbers:
        with mpmath.workdps(digits):
            exact = np.array(mpmath.eig(mpmath.matrix(matrices[k].tolist()), left=False, right=False), dtype=complex)
        covered = np.ones((exact.size, exact.size), dtype=bool)
        for component in ("real", "imag"):
            value, error = (columns[f"eigenvalue_{component}{end}"][k] for end in ("", "_error"))
            covered &= np.abs(value[:, None] - getattr(exact, component)) <= error[:, None]
        assert (maximum_bipartite_matching(csr_array(covered)) >= 0).all()


def test_errors_cover_where_slow_decays_are_barely_moved():
    """Rates over six decades, several too close for a run of the fastest's length to separate them."""
    random = np.random.default_rng(5)
    T = np.eye(4) + 0.2 * random.normal(size=(4000, 4, 4))
    matrices = (T * -(10.0 ** random.uniform(-6, 0, (4000, 1, 4)))) @ np.linalg.inv(T)
    columns = of_matrices(matrices)
    weak = np.flatnonzero(((columns["status"] == 0) & (columns["smallest_singular_value"] < 1e-3))[:, 0])
    assert weak.size > 150
    check_eigenvalues(columns, matrices, weak)


def test_errors_cover_where_eigenvalues_are_one_in_several_blocks():
    """Six states with few couplings, by whole numbers: multiple eigenvalues, 0 among them, with and without chains."""
    random = np.random.default_rng(3)
    matrices = random.integers(-1, 2, (80, 6, 6)) * (random.random((80, 6, 6)) < 0.3) * 1.0
    columns = of_matrices(matrices)
    measured = np.flatnonzero(columns["status"][:, 0] == 0)
    assert measured.size > 30
    check_eigenvalues(columns, matrices, measured, 60)  # a chain of six has a tenth of the digits


def test_errors_of_random_linear_systems_cover_and_are_those_of_rounding():
    """In any units, growing, decaying and turning, some with two eigenvalues close together."""
    random, count, n = np.random.default_rng(5), 300, 3
    matrices = random.normal(size=(count, n, n)) * 10.0 ** random.uniform(-3, 3, (count, 1, 1))
    sizes = 10.0 ** random.uniform(-1, 1, (count, n))
    matrices *= sizes[:, :, None] / sizes[:, None, :]
    columns = of_matrices(matrices)
    assert (columns["status"] == 0).all()
    check_eigenvalues(columns, matrices, range(count))
    errors = np.stack([columns["eigenvalue_real_error"], columns["eigenvalue_imag_error"]])
    # about a hundred roundings, were eigenvalues the sum of so many samples; each of these is 2e-16
    assert np.median(errors / columns["rate_scale"]) < 5e-14


def test_no_measured_column_depends_on_a_theoretical_eigenvalue(monkeypatch):
    m, columns = motions("rotor", 6)
    honest, eigen = m.survey(columns), theirs._eigen_columns

    def nonsense(matrix, S):
        theory = eigen(matrix, S)
        return theory | {"eigenvalues": -3.7 * theory["eigenvalues"] + 1.0, "condition": 0.0 * theory["condition"]}

    monkeypatch.setattr(theirs, "_eigen_columns", nonsense)
    monkeypatch.setattr(theirs, "_quartic_invariants", lambda matrix: 3 * (np.full(len(matrix), -7.0),))
    disturbed = m.survey(columns)
    assert not np.array_equal(honest["growth_rate_theory"], disturbed["growth_rate_theory"], equal_nan=True)
    for name in honest:
        if not name.endswith("_theory") and name != "eigenvalue_condition":
            assert np.array_equal(honest[name], disturbed[name], equal_nan=True), name


def growth(name, **values):
    return relative.theory_at(name, **values)["eigenvalues"].real.max(axis=-1)


def edge(test, low, high):
    """Return the value between low and high at which a condition begins to be true."""
    for _ in range(6):  # each time 100 times as near
        values = np.linspace(low, high, 101)
        first = np.argmax(test(values))
        low, high = values[first - 1], values[first]
    return high


DIAGONAL = (np.sqrt(45) - 7) / 2  # k1 = k3 at the corner of DeBra and Delp's region
CORNER = -0.0505102572  # k1 at the corner on k3 = -1, approached
EDGES = {  # threshold of growth → system, its parameters at x, width of the search, growth by rounding, digits
    4.714045207910317: ("sleeping_top", lambda x: {"spin_rate": x}, 1.0, 1e-6, 1e-6),  # I3² W² = 4 I1 m g l
    DIAGONAL: ("gravity_gradient", lambda x: {"k1": x + 1e-9, "k3": x - 1e-9}, 0.1, 1e-6, 1e-6),
    CORNER: ("gravity_gradient", lambda x: {"k1": x, "k3": -0.99999999 + 0 * x}, 0.04, 1e-6, 1e-6),
    0.0385208965: ("lagrange_points", lambda x: {"mass_ratio": x}, 0.02, 1e-6, 1e-9),  # Routh
    1 + 0.05 / 0.02: ("rotor", lambda x: {"spin_rate": x}, 1.0, 0.0, 1e-9),  # the critical speed
}


@pytest.mark.parametrize("value", EDGES)
def test_growth_begins_at_its_threshold(value):
    """By theory; and the measured growth in a sweep of cells of 1e-7 across the threshold, within a cell of it."""
    name, values, width, rounding, digits = EDGES[value]
    grows = [growth(name, **values(value + side * width)) > rounding for side in (-1, 1)]
    assert grows[0] != grows[1]
    at = edge(lambda x: (growth(name, **values(x)) > rounding) == grows[1], value - width, value + width)
    assert abs(at - value) < digits * max(1.0, abs(value))
    x, m = value + np.linspace(-2e-6, 2e-6, 42), model_of(name)
    result = m.survey(points_at(m, [0], **values(x)))
    is_growing = (result["growth_rate"] > result["growth_rate_error"])[:: m.n]
    (at,) = np.flatnonzero(is_growing[1:] != is_growing[:-1])
    assert x[at] - 1e-7 < value < x[at + 1] + 1e-7


def test_errors_cover_where_the_normal_equations_have_few_digits():
    """Of 36 parameters from a run of 2.6/S the least pivot is 1e-15: deviations were 19 errors."""
    m, columns = motions("gravity_gradient_damped", 1, k1=0.7913281267534632, k3=0.02368196885735252, orbital_rate=1.0)
    columns |= {k: np.full(m.n, v) for k, v in {"slug": 0.04619562923014334, "drag": 0.7525054740885597}.items()}
    columns["epsilon"][:] = 7.04013138264527e-17
    result = m.survey(columns, 0.4192139737991266, 458, 8.704447023205541e-11)
    deviation = np.abs(result["eigenvalue_imag"] - result["eigenvalue_imag_theory"])
    assert (deviation <= result["eigenvalue_imag_error"])[deviation > 1e-13].all()  # theory's own rounding


def test_an_energy_whose_gradient_vanishes_chooses_no_direction():
    """Its gradient's rounding once turned the basis in which motions are measured, and a named place was 8 ulp off."""
    m, columns = motions("gravity_gradient", 20)
    theory = m.theory({k: v[:: m.n] for k, v in columns.items()})
    assert (theory["place"][:, 1] == -columns["orbital_rate"][:: m.n]).all()
    assert (theory["basis"] == np.eye(6)).all()


@pytest.mark.parametrize(
    ("name", "values", "rate", "digits"),
    [
        ("sleeping_top", {}, 1.0908712114635715, 1e-12),
        # damping keeps Lagrange's region and takes DeBra's
        ("gravity_gradient_damped", {"k1": 0.7, "k3": 0.3}, -0.00222, 5e-6),
        ("gravity_gradient_damped", {"k1": -0.03, "k3": -0.6}, 0.00152, 5e-6),
        ("gravity_gradient", {"k1": 0.7, "k3": 0.3}, 0.0, 1e-12),
        ("gravity_gradient", {"k1": -0.03, "k3": -0.6}, 0.0, 1e-12),
        # the major-axis rule
        ("viscous_slug", {}, 0.006743344553792552, 1e-12),
        ("viscous_slug", {"axial_moment": 1.6}, -0.0018299164938047, 1e-13),
        (
            "viscous_slug",
            {"slug_moment": 0.001, "drag": 0.001, "rotor_momentum": 1.5, "spin_rate": 0.2},
            -0.00061782167788,
            1e-13,
        ),
    ],
)
def test_growth_in_numbers(name, values, rate, digits):
    assert abs(growth(name, **values) - rate) < digits


def test_measured_growth_is_the_energy_sinks():
    """-(κ/I_t) λ λ0/((κ/J)² + λ0²), with λ0 = (I_s W + h)/I_t and λ = λ0 - W, of first order in a small slug."""
    m, columns = motions("viscous_slug", 40, seed=7, slug_moment=1e-3)
    result = {k: v[:: m.n] for k, v in m.survey(columns).items()}
    Is, J, kappa, h, W = (
        columns[k][:: m.n] for k in ("axial_moment", "slug_moment", "drag", "rotor_momentum", "spin_rate")
    )
    inertial = Is * W + h
    factor = kappa / ((kappa / J) ** 2 + inertial**2)
    sink, size = -factor * (inertial - W) * inertial, factor * (np.abs(inertial) + W) ** 2
    assert (result["status"] == 0).all()
    deviation = np.abs(result["growth_rate"] - sink) / size
    assert deviation.max() < 0.005  # some J/I_t
    is_resolved = np.abs(sink) > 0.01 * size
    assert is_resolved.sum() > 20
    assert ((result["growth_rate"] > 0) == (sink > 0))[is_resolved].all()


def test_areas_of_the_stable_regions_of_the_gravity_gradient():
    """Lagrange's is 1/8 of the square of (k1, k3), DeBra and Delp's 1.99 %: counted in cells of the measurement."""
    m, side = model_of("gravity_gradient"), 40
    at = (np.arange(side) + 0.5) / side * 2 - 1
    k1, k3 = (x.ravel() for x in np.meshgrid(at, at + 0.25 / side, indexing="ij"))  # no cell's middle on the diagonal
    result = m.survey(points_at(m, k1=k1, k3=k3))
    stable = result["regime"][:: m.n] == REGIMES.index("stable") - 1
    lagrange, debra = stable & (k3 > 0), stable & (k1 < 0)
    assert stable.sum() == lagrange.sum() + debra.sum()
    assert lagrange.mean() == pytest.approx(1 / 8, abs=2 / side**1.5)  # some cells of the some `side` on its edges
    assert debra.mean() == pytest.approx(0.0794653620 / 4, abs=2 / side**1.5)


@functools.cache
def pendulum_on_a_cart():
    """A pendulum on a cart with drag: the equilibria form a family."""
    system = particle(
        lambda x, theta, friction: -sp.cos(theta),
        ("x", "theta"),
        R=lambda v, w, friction: friction * v**2 / 2,
        kinetic=lambda x, theta, v, w, friction: v**2 + sp.cos(theta) * v * w,  # besides v²/2 and w²/2
        **{"places": {"hanging": [0, 0], "upright": [0, sp.pi]}, "friction": 0.2},
    )
    return Model(system)


def test_zero_eigenvalues_of_a_family_are_its_own():
    """A cart with friction stops; without friction it rolls on from the least push, a second zero eigenvalue."""
    m = pendulum_on_a_cart()
    columns = m.survey(points_at(m, friction=[0.2, 0.0], epsilon=1e-6))
    assert (columns["family_dimension"] == 1).all()
    expected = np.repeat(["stable", "unstable", "marginal", "unstable"], 4).tolist()
    assert [REGIMES[k + 1] for k in columns["regime"]] == expected
    assert [REGIMES[k + 1] for k in columns["regime_theory"]] == expected


@pytest.mark.parametrize("gap", [0.0, 1e-6])  # rounding hides the position of a double root; near roots are proved
@pytest.mark.parametrize("place", [0.27392337, 0.62654048, -0.71480855])
def test_errors_cover_how_well_a_place_is_known(place, gap):
    """(x - a) (x - b) multiplied out: the slope at its roots is ± (b - a), and 0 at a double root."""
    a, b = sp.Float(place), sp.Float(place + gap)
    system = flow(lambda x, y: (x**2 - (a + b) * x + a * b + y, -y), "xy", (-2, 2), most=2)
    with mpmath.workdps(40):  # the numbers that the machine has
        half = mpmath.mpf(float(a + b)) / 2
        square = half**2 - mpmath.mpf(float(a * b))
        slope = 2.0 * float(mpmath.sqrt(max(square, 0)))
    m = Model(system)
    columns = m.survey(points_at(m))
    growth, error = (columns[name].reshape(2, 2)[:, 0] for name in ("growth_rate", "growth_rate_error"))
    expected = np.array([-slope, slope])
    exists = np.isfinite(growth)
    assert exists.any()
    assert (np.abs(growth - expected)[exists] <= error[exists]).all()
    assert error[exists].max() < 1e-6  # some roundings' square root
    if not gap:
        assert [REGIMES[k + 1] for k in columns["regime"][:2]] == ["marginal"] * 2


def test_a_free_balls_equilibria_have_four_dimensions():
    """Every spin about the vertical, wherever the body's axes point: three for the vertical, one for the spin."""
    assert relative.theory_at("sleeping_top", I3=1.0, moment_of_weight=0.0)["dimension"] == 4
