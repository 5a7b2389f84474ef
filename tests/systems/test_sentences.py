"""Sentences of maps, the titles of their figures: each number against theory in closed form, at the map's grid."""

import re

import numpy as np
import pytest
import repeated
from scipy import integrate, linalg, optimize, special

import sweeps
from sweeps import systems
from sweeps.handbook import gallery
from sweeps.points import catalogue
from sweeps.reading.definitions import file_text, plain, read_text
from sweeps.views import figures


def nearest(values, target):
    """Return the value of a grid that is nearest to a target."""
    return min(values.values.tolist(), key=lambda value: abs(value - target))


def regions(ds):
    """Return the share of points in Lagrange's region and in DeBra and Delp's, by their inequalities, in percent."""
    k1, k3 = np.meshgrid(ds["k1"], ds["k3"])
    with np.errstate(invalid="ignore"):
        roll_yaw = (k1 * k3 > 0) & (1 + 3 * k1 + k1 * k3 > 4 * np.sqrt(k1 * k3))
    shares = [100 * np.mean((k1 > k3) & roll_yaw & side) for side in (k1 > 0, k1 < 0)]
    return shares if ds.attrs["system"] == "gravity_gradient" else [shares[0], 0.0]


def gyrostat(ds):
    """Ω² of the module's docstring has its zero at h = (I3 - I2) W."""
    return [3.0 / nearest(ds["I2"], 2.0) - 1.0]


def steady_precession(ds):
    """I1 cos θ φ'² - I3 w3 φ' + P = 0 has a double root."""
    tilt = nearest(ds["tilt"], 0.5)
    return [2.0 * np.sqrt(2.0 * np.cos(tilt)) / 0.6, tilt]


def sleeping_top(ds):
    """I3² W² = 4 I1 m g l."""
    moment = nearest(ds["moment_of_weight"], 2.0)
    return [moment, 2.0 * np.sqrt(moment)]


def rotor(ds):
    """√(k/m) (1 + c_e/c_i), with 0.05 kg/s in the bearings."""
    damping = nearest(ds["internal_damping"], 0.05)
    return [damping, 1.0 + 0.05 / damping]


def mathieu(ds):
    """The tongue from b_1 to a_1 of SciPy's characteristic values."""
    q = nearest(ds["q"], 1.0)
    return [q, special.mathieu_b(1, q), special.mathieu_a(1, q)]


def kapitza_pendulum(ds):
    """Mathieu's equation with a = -4 g/(l ω²) and q = 2 A/l has its edge at a_0."""
    amplitude = nearest(ds["amplitude"], 0.2)
    return [amplitude, 1.0, np.sqrt(-4.0 * 9.80665 / special.mathieu_a(0, 2.0 * amplitude))]


def swing(ds):
    """θ'' + (2 L'/L + c) θ' + g θ/L = 0 over a period by SciPy: the multiplier -1."""
    frequency = nearest(ds["frequency"], 3.96)

    def excess(depth):
        def rates(t, y):
            length, speed = (
                2.5 * (1.0 + depth * np.cos(frequency * t)),
                -2.5 * depth * frequency * np.sin(frequency * t),
            )
            return [y[1], -(2.0 * speed / length + 0.1) * y[1] - 9.80665 * y[0] / length]

        runs = [integrate.solve_ivp(rates, (0.0, 2.0 * np.pi / frequency), y, rtol=1e-9).y[:, -1] for y in np.eye(2)]
        return 1.0 + np.trace(runs) + np.linalg.det(runs)

    return [frequency, optimize.brentq(excess, 0.02, 0.1)]


def asymmetric_shaft(ds):
    """√(k (1 ∓ d)/m)."""
    asymmetry = nearest(ds["asymmetry"], 0.4)
    return [asymmetry, np.sqrt(1.0 - asymmetry), np.sqrt(1.0 + asymmetry)]


def parametric_double_pendulum(_):
    """The sum of the frequencies of two rods of 1 m with 1 kg at their ends and 10 N m/rad in the joint."""
    stiffness = [[2.0 * 9.80665 + 10.0, -10.0], [-10.0, 9.80665 + 10.0]]
    return [np.sqrt(linalg.eigh(stiffness, [[2.0, 1.0], [1.0, 1.0]])[0]).sum()]


def tumbling(ds):
    """The long-axis mode has more energy than the intermediate axis, and at most that of the least one."""
    I1, I2, energy = np.meshgrid(ds["I1"], ds["I2"], ds["energy"])
    low, middle = np.minimum(I1, I2), np.maximum(I1, I2)
    is_possible = (low + middle >= 1.0) & (energy * low <= 1.0)
    return [100 * np.mean((energy * middle > 1.0)[is_possible])]


def tumblers(_):
    """The inverse of the closed form, for the short-axis mode."""
    return [100 * (sweeps.tumbler(368.7, 67.27, ratios=(0.36, 0.96))[0]["energy"] - 1.0)]


def rackets(ds):
    """The exact twist of the racket's throws."""
    twist = np.abs(ds["twist_exact"].isel(body=0).squeeze())
    return [np.degrees(twist.max().item()), np.degrees(ds["chi"].values[twist.argmax("chi").item()])]


def bead_on_hoop(ds):
    """ω² = g/R."""
    radius = nearest(ds["radius"], 0.5)
    return [radius, np.sqrt(9.80665 / radius)]


def double_pendulum(ds):
    """The ratio of the frequencies of a double pendulum with 1 kg and 1 m above."""
    mass, length = nearest(ds["mass2"], 1.0), nearest(ds["length2"], 1.0)
    kinetic = [[1.0 + mass, mass * length], [mass * length, mass * length**2]]
    squares = linalg.eigh(np.diag([1.0 + mass, mass * length]), kinetic)[0]
    return [np.sqrt(squares[1] / squares[0])]


def linear_triatomic(ds):
    """√(1 + 2 m_A/m_B); Landau and Lifshitz, Mechanics, section 24."""
    return [np.sqrt(1.0 + 2.0 * ds["outer_mass"].item() / nearest(ds["inner_mass"], 1.993e-26))]


def tennis_racket(_):
    """√((I2 - I1)(I3 - I2)/(I1 I3)) over the spin rate, of Brody's racket."""
    growth = 10.0 * np.sqrt((0.01638 - 0.00121) * (0.01748 - 0.01638) / (0.00121 * 0.01748))
    return [10.0, np.log(10.0) / growth]


NUMBERS = {  # sweep → function of its map that returns the numbers of its sentence
    "asymmetric_shaft": asymmetric_shaft,
    "bead_on_hoop": bead_on_hoop,
    "bodies": lambda _: [303.74, 433],  # days; the note of the Earth in the definition `bodies`
    "cubesats": lambda _: [50.0],  # of two equal moments either may be the greater, by symmetry
    "double_pendulum": double_pendulum,
    "foucault": lambda _: [1.0, 23.9345 / np.sin(np.radians(48.85))],  # the sidereal day by the sine of the latitude
    "gravity_gradient": regions,
    "gravity_gradient_damped": regions,
    "gyrostat": gyrostat,
    "kapitza_pendulum": kapitza_pendulum,
    "lagrange_points": lambda _: [(1.0 - np.sqrt(23.0 / 27.0)) / 2.0],  # Routh
    "linear_triatomic": linear_triatomic,
    "mathieu": mathieu,
    "parametric_double_pendulum": parametric_double_pendulum,
    "paul_trap": lambda _: [0.0, 0.908046],  # Mathieu's first tongue at a = 0; March, J. Mass Spectrom. 32 (1997) 351
    "rackets": rackets,
    "rotating_saddle": lambda _: [1.0],  # (W² - 1)(W² - 1.0…) > 0 beyond both resonances
    "rotor": rotor,
    "sleeping_top": sleeping_top,
    "steady_precession": steady_precession,
    "swing": swing,
    "tennis_racket": tennis_racket,
    "tumblers": tumblers,
    "tumbling": tumbling,
    "viscous_slug": lambda _: [1.0],  # the major-axis rule
}
ROUNDING = 0.51  # deviation in units of the last printed digit; the spline adds a hundredth to the half of rounding
WORDS = re.compile(r"L4 and L5|only 6U is safe about axis 3|about axis 2")  # numerals that are names


QUICK = ("bodies", "cubesats", "gyrostat", "mathieu", "rackets", "tennis_racket")  # a sweep of each kind


@pytest.mark.parametrize("name", repeated.but(QUICK, NUMBERS))
def test_numbers_of_the_sentence_are_those_of_theory(name):
    ds = sweeps.survey(gallery.reduce_points(plain(read_text(file_text(catalogue.shipped_files()[name])))))
    sentence = systems.presentation_of(ds).sentence(ds)
    printed = re.findall(r"-?\d+(?:\.\d+)?", WORDS.sub("", sentence))
    for text, number in zip(printed, NUMBERS[name](ds), strict=True):
        digit = 10.0 ** -len(text.partition(".")[2])
        assert abs(number - float(text)) <= ROUNDING * digit, sentence
    picture = gallery.names()[name].get("figure") or next(iter(figures.pictures(ds)))
    figure = figures.pictures(ds)[picture]()
    assert figure.texts[0].get_text().replace("\n", " ").replace("\u00a0", " ") == sentence


def test_a_map_without_the_points_of_its_sentence_has_its_title():
    ds = sweeps.survey(title="Two momenta", system="gyrostat", rotor_momentum=[0.0, 2.0], I2=[1.5, 2.0])
    assert systems.presentation_of(ds).sentence(ds) == ""
    assert figures.pictures(ds)["stability"]().texts[0].get_text() == "Two momenta"


def test_shares_of_two_observed_periods_are_those_of_the_exclusions():
    ds = sweeps.tumbler(368.7, "67.27 h", sigma_psi=5.0, sigma_phi=0.3)
    allows = [ds[f"exclusion_{mode}"].values <= 3.0 for mode in ("sam", "lam")]
    both, none = (100 * np.mean(which) for which in (allows[0] & allows[1], ~allows[0] & ~allows[1]))
    assert systems.presentation_of(ds).sentence(ds) == (
        f"Both modes are possible for {both:.0f} % of shapes, none for {none:.0f} %"
    )
