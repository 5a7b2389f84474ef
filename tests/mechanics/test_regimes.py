"""Regimes that theorems decide: systems of each kind, for which a single regime is right; and marginal systems."""

import numpy as np
import pytest
import relative
import repeated
import sympy as sp
import verdicts
from described import T, flow, model_of

from sweeps.mechanics.model import Model
from sweeps.mechanics.symmetries import sign_changes
from sweeps.points import catalogue
from sweeps.points.columns import measure_points
from sweeps.points.loading import read_sweep

QUICK = {"growth twice", "trap", "Ziegler", "rotor", "two pairs", "bearing, states"}
QUICK_MARGINAL = {"a mode without drag", "free particle", "the same modes as states", "Ziegler's threshold", "Hopf"}


@pytest.mark.parametrize("name", repeated.but(QUICK, verdicts.USER_SYSTEMS))
def test_what_a_theorem_decides_is_not_marginal(name):
    model, points, right = verdicts.user_system(name)
    for words in verdicts.columns(model, **points)[:2]:
        assert [word if word in accepted else accepted for word, accepted in zip(words, right, strict=True)] == words


@pytest.mark.parametrize("name", repeated.but(QUICK_MARGINAL, verdicts.MARGINAL))
def test_what_linear_theory_leaves_open_stays_marginal(name):
    make, point = verdicts.MARGINAL[name]
    theory, measured, status, _ = verdicts.columns(make(), **point)
    assert theory == ["marginal"]
    assert (measured, status) in ((["marginal"], ["ok"]), (["undetermined"], ["no_time_scale"]))


SHIPPED = [*relative.RANGES, *("asymmetric_shaft", "kapitza_pendulum", "mathieu", "parametric_double_pendulum")]


@pytest.mark.parametrize("pulse", [0.0, 1e-3])
def test_a_pulse_too_short_for_samples_of_a_period_joins_blocks(pulse):
    """Two equal oscillators that are coupled for a thousandth of a period, in which exp(-10^6 …) is not 0."""

    def potential(q, depth):
        short = depth * sp.exp(sp.Integer(10) ** 6 * (sp.cos(2 * T) - 1))
        return sp.Rational(1, 3) * (q[0] ** 2 + q[1] ** 2) + short * q[0] * q[1]

    model = verdicts.of_coordinates(2, potential, period=sp.pi, depth=pulse or 1.0)
    parameters = [np.full(1, pulse)]
    terms = model.variation.term_bounds(parameters, np.zeros((4, 1, 1)), (np.arange(32) + 0.5) / 32)[1]
    assert not terms[:, 2, 1].any()
    assert model.variation.coupling(parameters, terms)[0, 2, 1] == (pulse > 0.0)


@pytest.mark.slow
@pytest.mark.parametrize("name", [*SHIPPED, "paul_trap", "swing"])
def test_no_verdict_is_withheld_on_shipped_maps(name):
    """If growth exceeds ten of its errors, or theory proves stability: at most one point in a hundred."""
    sweep = read_sweep(catalogue.shipped_files()[name])
    numbers = np.random.default_rng(1).choice(sweep.grid.size, 200, replace=False)
    points = [sweep.grid.points(int(number), int(number) + 1) for number in numbers]
    columns = measure_points(
        {key: np.concatenate([point[key] for point in points]) for key in sweep.grid.arguments}, sweep
    )
    flags = np.array(sweep.variables["regime"].flags)
    theory, measured = (flags[1 + columns[name]] for name in ("regime_theory", "regime"))
    is_decidable = columns["growth_rate_theory"] > 10.0 * columns["growth_rate_error"]
    is_decidable |= np.isin(theory, ("stable", "asymptotically_stable"))
    assert is_decidable.sum() > 100
    for words in (theory, measured):
        assert np.isin(words, ("marginal", "undetermined"))[is_decidable].mean() <= 0.01


def nilpotent(n, links):
    """Return a model of states that act on each other by single links, in no circle."""
    return verdicts.of_states(n, lambda x: [sum((x[j] for i, j in links if i == k), sp.Integer(0)) for k in range(n)])


CHAINS = [
    *((n, [(k, k + 1) for k in range(n - 1)]) for n in (1, 5)),  # one chain, a defective 0
    (4, []),  # nothing moves
    (4, [(0, 2), (1, 3)]),  # a body on a plane: places and velocities
    (4, [(0, 1), (0, 2), (0, 3)]),
    (3, [(2, 0), (2, 1)]),
    (4, [(0, 1), (2, 1), (3, 1)]),
    (6, [(0, 3), (1, 4), (2, 5)]),  # bodies on lines
    *((5, links) for links in ([(0, 1), (2, 3)], [(0, 1), (1, 2), (0, 2)], [(4, 0), (4, 1), (0, 1)])),
    (6, [(k, k + 2) for k in range(4)]),
]


@pytest.mark.parametrize(("n", "links"), CHAINS)
def test_where_nothing_has_a_rate_theory_is_there_and_the_status_says_what_is_missing(n, links):
    theory, measured, status, columns = verdicts.columns(nilpotent(n, links))
    assert status == ["no_time_scale"]
    assert measured == ["undetermined"]
    assert theory == ["stable" if not links else "marginal"]  # all places are equilibria, and nothing moves
    assert columns["growth_rate_theory"][0] == columns["eigenvalue_imag_theory"][0] == 0.0


def test_a_disc_that_stands_has_the_eigenvalues_of_linear_theory():
    """Rolling upright: it falls unless it is fast, 12/5 spin² > g; at rest and without weight nothing has a rate."""

    def rates(lean, fall, yaw, roll, g, spin):
        return fall, g * sp.sin(lean) - sp.Rational(6, 5) * roll * yaw, 2 * roll * fall, 0

    names, places = ("lean", "fall", "yaw", "roll"), {"upright": lambda g, spin: (0, 0, 0, spin)}
    system = flow(rates, names, (-3, 3), places=places, gravity=1.0, spin=1.0)
    gravity, spin = np.array([[1.0, 0.0], [1.0, 0.5], [1.0, 1.0], [0.0, 0.0]]).T
    theory, measured, status, columns = verdicts.columns(Model(system), gravity=gravity, spin=spin)
    assert theory == ["unstable", "unstable", "marginal", "marginal"]
    assert measured == ["unstable", "unstable", "marginal", "undetermined"]
    assert status == ["ok", "ok", "ok", "no_time_scale"]
    growth = np.sqrt(np.maximum(gravity - 2.4 * spin**2, 0.0))
    np.testing.assert_allclose(columns["growth_rate_theory"], growth, atol=1e-12)  # rounding


@pytest.mark.parametrize("has_integral", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_the_triangular_points_have_one_regime_as_coordinates_and_as_states(has_integral):
    """Gyroscopic, with slopes that leave no state to reverse: the Jacobi integral, no extremum there, proves pairs."""

    def potential(x, y, mu):
        first, second = sp.sqrt((x + mu) ** 2 + y**2), sp.sqrt((x + mu - 1) ** 2 + y**2)
        return (x**2 + y**2) / 2 + (1 - mu) / first + mu / second

    def rates(x, y, u, w, mu):
        return u, w, 2 * w + potential(x, y, mu).diff(x), -2 * u + potential(x, y, mu).diff(y)

    jacobi = {"jacobi": lambda x, y, u, w, mu: (u**2 + w**2) / 2 - potential(x, y, mu)} if has_integral else ()
    places = {"L4": lambda mu: (sp.Rational(1, 2) - mu, sp.sqrt(3) / 2, 0, 0)}
    system = flow(rates, "xyuw", (-2, 2), places=places, conserved=jacobi, mass_ratio=0.01)
    ratios = np.array([0.001, 0.01, 0.03, 0.038, 0.0386, 0.05, 0.3])  # Routh: 0.0385209
    theory, measured, _, _ = verdicts.columns(Model(system), mass_ratio=ratios)
    right = ["stable" if has_integral else "marginal"] * 4 + ["flutter"] * 3
    assert theory == measured == right
    lagrange_points = model_of("lagrange_points")
    if has_integral:
        assert verdicts.columns(lagrange_points, mass_ratio=ratios, epsilon=1e-12)[0] == right


@pytest.mark.parametrize("coupling", [1e-12, 1e-9, 1e-6, 1e-3, 0.1])
def test_no_amplitude_is_too_large_for_linear_equations(coupling):
    """Four equal oscillators: an error of rounding was taken for the amplitude's at some amplitudes."""
    model = verdicts.oscillators(4, coupling)
    epsilon = 10.0 ** np.linspace(-12, -0.5, 12)
    *_, status, columns = verdicts.columns(model, epsilon=epsilon)
    assert status == ["ok"] * epsilon.size
    assert (np.abs(columns["growth_rate"]) <= columns["growth_rate_error"]).all()


@pytest.mark.parametrize(
    ("interactions", "count"),
    [
        ([[0, 1], [1, 0]], 2),  # one pair: either state may change its sign
        ([[1, 1], [1, 0]], 0),  # one acts on itself
        ([[0, 1, 1], [1, 0, 1], [1, 1, 0]], 0),  # three in a circle
        ([[0, 1, 1], [1, 0, 0], [1, 0, 0]], 2),
        ([[0, 1, 0, 0], [1, 0, 0, 0], [0, 0, 0, 1], [0, 0, 1, 0]], 4),  # two pairs
        (np.zeros((7, 7)), 128),
    ],
)
def test_sign_changes_are_those_of_two_classes(interactions, count):
    interactions = np.array(interactions) > 0
    changes = sign_changes(interactions)
    assert len(changes) == len({*changes}) == count
    assert all(signs[i] == -signs[j] for signs in changes for i, j in np.argwhere(interactions))
