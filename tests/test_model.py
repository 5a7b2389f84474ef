import numpy as np
import pytest
from oscillators import LIBRARY, points, shipped

from kernels import oscillations as kernel
from sweeps.mechanics import modes
from sweeps.mechanics.model import FLAT, Model

PROMISED, LEAST = 1e-6, 1e-3  # relative error of ω², where |ω²| is at least so much of the scale's square


@pytest.fixture(scope="module")
def models():
    return {name: Model(shipped(name)) for name in LIBRARY}


@pytest.mark.parametrize("name", LIBRARY)
def test_measured_rates_are_the_theorys(models, name):
    model = models[name]
    columns = model.survey(points(model.system, model.n, 60, LIBRARY[name]))
    here = columns["status"] != kernel.NO_EQUILIBRIUM
    assert (columns["status"][here] == kernel.OK).all()
    sized = np.abs(columns["omega_squared_theory"]) >= LEAST * columns["rate_scale"] ** 2
    deviation = np.abs(columns["omega_squared"] / columns["omega_squared_theory"] - 1)[sized]
    assert deviation.max() <= PROMISED
    assert np.nanmax(columns["energy_drift"]) <= 1e-10
    assert np.array_equal(columns["regime"], columns["regime_theory"])


def test_both_signs_are_measured(models):
    for name, both in {"pendulum": True, "double_pendulum": True, "spherical_pendulum": False}.items():
        model = models[name]
        squares = model.survey(points(model.system, model.n, 5, LIBRARY[name]))["omega_squared"]
        assert ((squares < 0).any(), (squares > 0).any()) == (both, True)


def test_harmonic_well_gives_twice_the_orbital_rate_and_keplers_once(models):
    model = models["central_potential"]
    for exponent, ratio in ((2.0, 2.0), (-1.0, 1.0), (1.0, 3**0.5)):
        columns = points(model.system, 2, 1, {}) | {"exponent": np.full(2, exponent)}
        found = model.survey(columns)
        rate = columns["angular_momentum"] / columns["mass"] / found["r_equilibrium"] ** 2
        # the tilt of the orbit always goes at the orbital rate; 1e-9 is what ω² is good for here
        assert np.sort(found["frequency"] / rate) == pytest.approx(sorted([1.0, ratio]), rel=1e-9)


def test_cone_of_the_spherical_pendulum_is_the_lectures(models):
    model = models["spherical_pendulum"]
    columns = points(model.system, 1, 20, LIBRARY["spherical_pendulum"])
    found = model.survey(columns)
    cosine = np.cos(found["theta_equilibrium"])
    lecture = columns["gravity"] / columns["length"] * (1 + 3 * cosine**2) / cosine
    assert found["omega_squared"] == pytest.approx(lecture, rel=1e-9)


def test_molecule_of_landau_and_lifshitz_with_its_flat_mode(models):
    model = models["linear_triatomic"]
    columns = points(model.system, 3, 8, LIBRARY["linear_triatomic"])
    found = model.survey(columns)
    k, A, B = (columns[name] for name in ("stiffness", "outer_mass", "inner_mass"))
    textbook = np.sort(np.stack([0 * k, k / A, k * (2 * A + B) / (A * B)])[:, ::3], axis=0).T.ravel()
    bound = found["rate_scale"] ** 2
    assert np.abs(found["omega_squared"] - textbook).max() <= 1e-9 * bound.max()
    assert (found["regime"] == np.where(textbook == 0, kernel.MARGINAL, kernel.STABLE)).all()


def test_a_large_swing_is_slower_by_its_amplitude_squared(models):
    """−θ0²/16 in the frequency, over whole periods: S is the rate itself, so 4 cycles are 4 periods."""
    model = models["pendulum"]
    sizes = np.geomspace(2e-3, 5e-2, 9)
    columns = points(model.system, 1, 9, {}, phase=0.0)
    columns["epsilon"] = np.repeat(sizes, 2)
    found = model.survey(columns)
    hanging = columns["equilibrium"] == 0
    deviation = 1 - found["frequency"][hanging] / found["frequency_theory"][hanging]
    assert np.polyfit(np.log(sizes), np.log(deviation), 1)[0] == pytest.approx(2.0, abs=0.1)
    assert deviation / sizes**2 == pytest.approx(1 / 16, rel=0.02)


def test_two_nudges_take_away_the_error_of_first_order(models):
    """The Morse bonds have V‴ ≠ 0: ω² from half the difference is off by ε², from one run by ε."""
    model = models["linear_triatomic"]
    deviations = []
    for epsilon in (1e-3, 1e-4):
        columns = points(model.system, 3, 1, {}, epsilon=epsilon, phase=0.0)
        pair = model.survey(columns)
        theory = model.theory(columns)
        assert theory["twice"].all()
        alone = model._columns(
            columns, theory, model.measured(columns, theory | {"twice": 0 * columns["mode"]}, 4, 16, 1e-10)
        )
        deviations.append([np.abs(c["omega_squared"] / c["omega_squared_theory"] - 1)[1] for c in (pair, alone)])
    assert np.log10(deviations[0][0] / deviations[1][0]) == pytest.approx(2.0, abs=0.2)
    assert np.log10(deviations[0][1] / deviations[1][1]) < 1.5


@pytest.mark.parametrize("name", ["bead_on_hoop", "double_pendulum"])
def test_no_measured_column_depends_on_a_theoretical_rate(models, name, monkeypatch):
    model = models[name]
    columns = points(model.system, model.n, 10, LIBRARY[name])
    told = model.survey(columns)
    honest = modes.normal_modes

    def nonsense(hessian, a):
        squares, vectors = honest(hessian, a)
        return np.flip(squares, axis=1) * -3.7 + 1.0, vectors

    monkeypatch.setattr(modes, "normal_modes", nonsense)
    misled = model.survey(columns)
    for column in told:
        same = np.array_equal(told[column], misled[column], equal_nan=True)
        assert same != column.endswith("_theory"), column


def test_hoops_measured_boundary_is_the_line(models):
    model = models["bead_on_hoop"]
    radius, spin = np.geomspace(0.1, 10, 31), np.geomspace(0.5, 20, 41)
    R, W = (x.ravel() for x in np.meshgrid(radius, spin, indexing="ij"))
    columns = points(model.system, 1, R.size, {})
    columns["radius"], columns["spin_rate"] = np.repeat(R, 4), np.repeat(W, 4)
    chosen = columns["equilibrium"] == 0
    columns = {name: values[chosen] for name, values in columns.items()}
    regime = model.survey(columns)["regime"].reshape(radius.size, spin.size)
    for r, row in zip(radius, regime, strict=True):
        first = np.argmax(row == kernel.UNSTABLE)
        assert spin[first - 1] <= np.sqrt(9.80665 / r) <= spin[first]
        assert (row[:first] == kernel.STABLE).all()
        assert (row[first:] == kernel.UNSTABLE).all()


def test_a_point_on_the_pitchfork_is_marginal(models):
    model = models["bead_on_hoop"]
    columns = points(model.system, 1, 25, {"radius": (0.1, 10.0)})
    columns["spin_rate"] = np.sqrt(columns["gravity"] / columns["radius"])
    bottom = columns["equilibrium"] == 0
    assert (model.survey(columns)["regime"][bottom] == kernel.MARGINAL).all()


def test_a_flat_line_is_a_status(models):
    model = models["bead_on_wire"]
    columns = points(model.system, 1, 1, {}) | {"gravity": np.array([4.0]), "spin_rate": np.array([2.0])}
    found = model.survey(columns)
    assert found["status"].tolist() == [FLAT]
    assert np.isnan(found["omega_squared"]).all()


def test_amplitude_and_phase_are_those_of_the_motion(models):
    """a cos(ωt + α) with what is said of a, ω and α, against the closed form of a linear oscillator."""
    model = models["double_well"]
    columns = points(model.system, 1, 4, LIBRARY["double_well"], phase=0.4)
    found = model.survey(columns)
    wells = found["frequency"] > 0
    S, w = found["rate_scale"][wells], found["frequency_theory"][wells]
    start, speed = 1e-6 * np.cos(0.4), -1e-6 * S * np.sin(0.4)
    a, alpha = found["amplitude"][wells], found["initial_phase"][wells]
    assert a * np.cos(alpha) == pytest.approx(np.full(a.size, start), rel=1e-9)
    assert -a * w * np.sin(alpha) == pytest.approx(speed, rel=1e-9)
    assert np.isnan(found["amplitude"][~wells]).all()


@pytest.mark.parametrize("count", [1, 7, 40])
def test_a_points_bits_depend_on_the_point_alone(models, count):
    model = models["double_pendulum"]
    columns = points(model.system, 2, 40, LIBRARY["double_pendulum"])
    whole = model.survey(columns)
    part = model.survey({name: values[: 8 * count] for name, values in columns.items()})
    for name in whole:
        assert np.array_equal(part[name], whole[name][: 8 * count], equal_nan=True), name


def test_a_step_that_is_too_long_is_halved_until_it_holds(models):
    """A nudge of 0.3 at the loosest plan: the halving test sees it, and the points are run again."""
    model = models["pendulum"]
    columns = points(model.system, 1, 3, LIBRARY["pendulum"], epsilon=0.9)
    loose = model.survey(columns, tolerance=1e-3)
    tight = model.survey(columns, tolerance=1e-12)
    assert (tight["status"] == kernel.OK).all()
    assert (tight["steps_per_sample"] > loose["steps_per_sample"]).all()
    assert loose["omega_squared"] == pytest.approx(tight["omega_squared"], rel=1e-2)
