"""Bodies on orbits, against published charts, closed forms, and equations of their own in 30 digits and DOP853.

POLHODE_ALL_CASES=1 has 60 bodies of each motion in place of 2 or 12, and follows 100 orbits in place of 4.
"""

import itertools
import math
import os

import mpmath
import numpy as np
import precise
import pytest
import sympy as sp
from scipy.integrate import solve_bvp
from scipy.spatial.transform import Rotation

import sweeps
from kernels.flow.codes import REGIMES
from sweeps import systems
from sweeps.systems.orbit import equations, motion, presentation
from sweeps.systems.orbit.scipy_trace import trace_by_scipy

DIMORPHOS = {"a_over_b": 1.3, "b_over_c": 16 / 13}
HYPERION = {"a_over_b": 190 / 145, "b_over_c": 145 / 114}
ALL_CASES = bool(os.environ.get("POLHODE_ALL_CASES"))


def survey(motion, planes=None, **grid):
    """Return the map of a sweep, without the dimensions of a single value."""
    planes = {"planes": planes} if planes else {}
    return sweeps.survey({"system": "orbit", "motion": motion, **planes, "grid": grid}).squeeze()


def agrees(ds, name, expected, digits=0.0):
    """Return True if measured and expected values agree within their errors and printed digits."""
    return np.all(np.abs(ds[name].values - expected) <= ds[f"{name}_error"].values + digits)


THOMSON = [  # K, spin, eccentricity, growth per orbit (Kane and Barba's problem; two independent codes)
    (0.5, 1.0, 0.0, 1.5 * math.pi),
    (0.5, 2.0, 0.0, math.sqrt(2) * math.pi),
    *((0.5, 2.0, 0.1, 4.240785493), (0.5, 2.0, 0.3, 3.967559061), (0.5, 3.0, 0.1, 5.701898912)),
    *((0.5, 3.0, 0.3, 5.079104624), (1.5, 1.0, 0.1, 0.056318570), (1.5, 1.0, 0.0, 0.0), (1.5, 1.0, 0.3, 0.0)),
    *((1.8, -0.5, 0.0, 2.291402725), (1.8, -0.5, 0.1, 2.308097368), (1.8, -0.5, 0.3, 2.445358772)),
]


@pytest.mark.parametrize(("K", "spin", "eccentricity", "growth"), THOMSON)
def test_a_spinning_satellite_grows_as_published(K, spin, eccentricity, growth):
    ds = survey("spin_normal", K=K, spin=spin, eccentricity=eccentricity)
    assert agrees(ds, "growth_per_orbit", growth, 5e-10)  # half of the last printed digit
    assert ds.reciprocity_residual < 1e-12  # the equations are Hamilton's


def trace_of_quartic(linear, constant):
    """Return the trace over an orbit of a motion with the exponents x⁴ + linear x² + constant = 0."""
    squares = (-linear + np.array([1, -1])[:, None, None] * np.sqrt(linear**2 - 4 * constant + 0j)) / 2
    return 2 * np.cosh(2 * np.pi * np.sqrt(squares)).sum(axis=0).real


def test_on_a_circle_the_multipliers_are_thomsons():
    """The roots of Thomson's quartic, over the plane of K and spin; the trace to 1e-10 of its size."""
    ds = survey("spin_normal", K=np.linspace(0.15, 1.95, 7).tolist(), spin=[-1.7, -0.4, 0.8, 1.6, 2.9])
    K, G = ds.K.values[:, None], ds.K.values[:, None] * ds.spin.values
    trace = trace_of_quartic((2 - G) ** 2 + 2 * (G - 1) + 3 * (K - 1), (G - 1) * (G - 1 + 3 * (K - 1)))
    np.testing.assert_allclose(ds.trace.values, trace, rtol=1e-10, atol=1e-10)


def test_on_a_circle_the_frequencies_are_those_of_the_gravity_gradient():
    """Pitch √(3(k1 - k3)/(1 - k1 k3)), and the roll-yaw quartic, in DeBra and Delp's region and elsewhere."""
    ds = survey("synchronous", k1=[-0.6, -0.05, 0.3, 0.7], k3=[-0.9, -0.3, 0.2, 0.5], eccentricity=0.0)
    k1, k3 = np.meshgrid(ds.k1, ds.k3, indexing="ij")
    pitch = 2 * np.cos(2 * np.pi * np.sqrt(3 * (k1 - k3) / (1 - k1 * k3) + 0j)).real
    np.testing.assert_allclose(ds.sel(plane="in_plane").trace, pitch, rtol=1e-10, atol=1e-10)
    trace = trace_of_quartic(1 + 3 * k1 + k1 * k3, 4 * k1 * k3)
    np.testing.assert_allclose(ds.sel(plane="out_of_plane").trace, trace, rtol=1e-10, atol=1e-10)


LIBRATIONS = {  # (a/b, b/c) → growth per orbit at amplitudes of 5, 10, 20, 30, 40, 50 degrees (two independent codes)
    (1.4, 1.3): (0.115248, 0.357881, 0.690944, 0.881276, 0.883827, 0.499019),
    (1.3, 1.2): (0, 0, 0.545475, 0.803124, 0.893939, 0.761832),
    (1.2, 1.1): (0, 0, 0, 0.335517, 0.639931, 0.739911),
    (1.2, 1.5): (0, 0, 0.027093, 0, 0, 0.675607),
    (1.1, 1.2): (0, 0, 0, 0, 0, 0.026381),
}


@pytest.mark.parametrize("shape", LIBRATIONS)
def test_librations_grow_out_of_the_plane_as_published(shape):
    amplitudes = np.radians([5, 10, 20, 30, 40, 50]).tolist()
    ds = survey("libration", a_over_b=shape[0], b_over_c=shape[1], amplitude=amplitudes)
    assert agrees(ds, "growth_per_orbit", LIBRATIONS[shape], 5e-7)  # half of the last printed digit
    assert ds.reciprocity_residual.max() < 1e-12  # the equations are Hamilton's
    k = 3 * (shape[0] ** 2 - 1) / (shape[0] ** 2 + 1)
    period = [4 * mpmath.ellipk(math.sin(x) ** 2) / mpmath.sqrt(k) for x in amplitudes]
    np.testing.assert_allclose(ds.period, np.array(period, dtype=float), rtol=1e-14)  # some roundings


@pytest.mark.parametrize(
    ("motion", "name", "values", "onset", "digits"),
    [
        ("libration", "amplitude", [0.05, 0.1, 0.15, 0.2], math.radians(6.6079), math.radians(5e-5)),
        ("synchronous", "eccentricity", [0.0, 0.01, 0.02, 0.03], 0.0177697, 1e-6),  # ill-conditioned, as published
    ],
)
def test_dimorphos_becomes_unstable_at_the_published_amplitude_and_eccentricity(motion, name, values, onset, digits):
    changes = sweeps.critical(survey(motion, ["out_of_plane"], **DIMORPHOS, **{name: values}), name)
    assert changes.kind.values.tolist() == ["period_doubling"]
    assert agrees(changes, "critical_value", onset, digits)
    assert agrees(changes, "critical_value", changes.critical_value_theory)


@pytest.mark.slow
def test_on_a_circle_the_critical_shapes_are_those_of_the_quartic():
    """k1 = k3 (pitch), the double root of the roll-yaw quartic, and k1 = 0 (roll), to a rounding or the error."""
    ds = survey("synchronous", k1=[-0.6, -0.3, -0.06, -0.03, 0.1], k3=-0.4, eccentricity=0.0)
    changes = sweeps.critical(ds, "k1")
    k1 = sp.Symbol("k1")
    double = [float(r) for r in sp.Poly((1 + 3 * k1 - 0.4 * k1) ** 2 + 6.4 * k1, k1).nroots() if -0.3 < r < 0]
    assert changes.plane.values.tolist() == ["in_plane", "out_of_plane", "out_of_plane"]
    assert changes.kind.values.tolist() == ["restabilised", "restabilised", "positive_multiplier"]
    assert agrees(changes, "critical_value", [-0.4, *double, 0.0], 1e-15)


def test_the_forced_libration_of_dimorphos_grows_as_published():
    ds = survey("synchronous", ["out_of_plane"], **DIMORPHOS, eccentricity=[0.024, 0.028, 0.05])
    assert agrees(ds, "growth_per_orbit", [0.013263231, 0.019250639, 0.163505621], 5e-10)


SPIN_ORBIT = [  # p, radial axis, δ'(0), regime in the plane, largest |μ| out of it
    (1.0, 1, -0.550663902795, "stable", 1.966081977),
    (0.5, 2, -0.2908296217, "stable", 6.332927),
    (1.5, 1, 0.6047034274, "period_doubling", 1.0),
    (1.5, 2, 0.0536459617, "unstable", 1.0),
    (2.0, 1, 0.890263200227, "stable", 1.007845442859),
    (2.5, 1, 1.2155145817, "stable", 1.0),
]


@pytest.mark.parametrize(("p", "axis", "rate", "regime", "modulus"), SPIN_ORBIT)
def test_hyperions_states_are_as_published(p, axis, rate, regime, modulus):
    ds = survey("spin_orbit", **HYPERION, eccentricity=0.1, p=p, radial_axis=axis)
    assert abs(ds.rate_start[0] - rate) < 1e-10  # digits printed
    assert REGIMES[1 + int(ds.sel(plane="in_plane").regime)] == regime
    tilts = ds.sel(plane="out_of_plane")
    assert abs(np.exp(tilts.growth_per_orbit) - modulus) < 5e-7 + tilts.growth_per_orbit_error
    if p == 0.5:  # tilts in the orbit's axes: the sign is that after half a turn of the body
        assert tilts.multiplier_real[0] > 0


@pytest.mark.parametrize(
    ("p", "asymmetry", "eccentricity", "trace", "years", "orbit"),
    [(1.5, 2.18e-4, 0.20563, 1.983121893, 11.6400, 87.9691), (1.0, 2.277e-4, 0.0549, 1.973295131, 2.8729, 27.321661)],
)
def test_mercury_and_the_moon_librate_as_published(p, asymmetry, eccentricity, trace, years, orbit):
    ds = survey("spin_orbit", ["in_plane"], asymmetry=asymmetry, eccentricity=eccentricity, p=p)
    assert agrees(ds, "trace", trace, 5e-10)
    assert 2 * math.pi / abs(ds.exponent_imag[0]) / (2 * math.pi) * orbit / 365.25 == pytest.approx(years, abs=1e-4)


def exact_traces(motion, arguments, rate, steps):
    """Return the traces in the plane and out of it in long doubles, of librations and of odd motions near a rate."""
    parameters = [arguments[name] for name in ("I1_over_I3", "asymmetry", "eccentricity")]
    if motion == "libration":  # period and rate in 25 digits, from doubles
        with mpmath.workdps(30):
            pairs = [
                map(mpmath.mpf, map(float, pair)) for pair in zip(arguments["amplitude"], parameters[1], strict=True)
            ]
            values = [(mpmath.ellipk(mpmath.sin(x) ** 2), mpmath.sin(x), mpmath.sqrt(3 * d)) for x, d in pairs]
            numbers = [[mpmath.nstr(y, 25) for y in (4 * K / w, s * w)] for K, s, w in values]
        span, rate = np.array([[np.longdouble(x) for x in row] for row in numbers]).T
    else:
        span, rate = np.full(rate.size, 8 * np.arctan(np.longdouble(1))), rate.astype(np.longdouble)
        for _ in range(2):
            planar, _, end = precise.orbit_monodromy(parameters, rate, span / 2, steps // 2)
            rate -= end[0] / planar[0, 1]
    planar, tilts, _ = precise.orbit_monodromy(parameters, rate, span, steps)
    return np.einsum("iin->n", planar), np.einsum("iin->n", tilts)


@pytest.mark.parametrize(
    ("motion", "most", "count", "steps"),
    [
        ("synchronous", 0.3, 12, 30),
        pytest.param("synchronous", 0.85, 60 if ALL_CASES else 12, 100, marks=pytest.mark.slow),
        pytest.param("libration", 1.57, 60 if ALL_CASES else 2, 100, marks=pytest.mark.slow),
    ],
)
def test_errors_contain_the_deviation_from_long_doubles(motion, most, count, steps):
    """Amplitudes up to a quarter turn but 8e-4 rad, eccentricities up to 0.85; half of the bodies near the end.

    The axes of a body that does not librate have any order.
    """
    rng, ones, shortest = np.random.default_rng(3), np.ones(count), 1.02 if motion == "libration" else 0.7
    points = {"a_over_b": rng.uniform(shortest, 1.6, count), "b_over_c": rng.uniform(0.7, 1.6, count)}
    name = "amplitude" if motion == "libration" else "eccentricity"
    points[name] = np.where(
        np.arange(count) % 2, rng.uniform(1e-3, most, count), most - 10 ** rng.uniform(-4, -1, count)
    )
    points |= {"semi_major_axis": ones, "mu": ones, "epsilon": 1e-8 * ones}
    names = ("status", "trace", "trace_error", "rate_start")
    planes = ["out_of_plane"] if motion == "libration" else ["in_plane", "out_of_plane"]
    columns = {p: equations.survey(points | {"plane": np.full(count, p)}, motion, 1e-12, names) for p in planes}
    rate = columns["out_of_plane"]["rate_start"]
    arguments = equations.arguments_of(points, motion) | points
    traces = dict(zip(["in_plane", "out_of_plane"], exact_traces(motion, arguments, rate, steps), strict=True))
    for plane, column in columns.items():
        is_known = column["status"] == 0
        assert is_known.mean() > 0.95
        deviation, error = np.abs(column["trace"] - traces[plane])[is_known], column["trace_error"][is_known]
        assert (deviation <= error).all()
        assert np.median(error) < 1e-8  # no error is a bound of everything


def test_growth_is_per_second_with_an_orbits_size():
    """The mean motion multiplies all rates, and nothing else."""
    grid = {**HYPERION, "eccentricity": 0.1}
    one, other = survey("synchronous", **grid), survey("synchronous", **grid, semi_major_axis=4.0, mu=9.0)
    np.testing.assert_allclose(other.growth_rate, one.growth_rate * 3 / 8, rtol=1e-14)  # a rounding
    np.testing.assert_array_equal(other.growth_per_orbit, one.growth_per_orbit)
    np.testing.assert_allclose(other.period, one.period * 8 / 3, rtol=1e-14)


def ellipsoid(a, b, c):
    """Return moments of a homogeneous ellipsoid of these semi-axes, times five over its mass."""
    return {"I1": b * b + c * c, "I2": c * c + a * a, "I3": a * a + b * b}


def ratios(I1, I2, I3):
    """Return k1 and k3 of moments."""
    return {"k1": (I3 - I1) / I2, "k3": (I3 - I2) / I1}


BODY = ellipsoid(1.2, 1.0, 0.8)
WAYS = [  # motion, parameters of the motion, ways to give the same body
    ("synchronous", {"eccentricity": 0.05}, [{"a_over_b": 1.2, "b_over_c": 1.25}, BODY, ratios(**BODY)]),
    (  # Kane and Barba's body K = 1/2
        *("spin_normal", {"spin": 2.0, "eccentricity": 0.1}),
        [{"K": 0.5}, {"I1": 2.0, "I2": 2.0, "I3": 1.0}, {"k1": -0.5, "k3": -0.5}],
    ),
    (
        *("spin_orbit", {"p": 0.5, "eccentricity": 0.05}),
        [{"I1": 0.8, "I2": 0.7, "I3": 1.0}, {"I1": 0.7, "I2": 0.8, "I3": 1.0, "radial_axis": 2}],
    ),
]


@pytest.mark.parametrize(("motion", "values", "ways"), WAYS)
def test_ways_to_give_a_body_agree(motion, values, ways):
    first, *traces = (survey(motion, **way, **values).trace.values for way in ways)
    np.testing.assert_allclose(traces, [first] * len(traces), rtol=1e-12)  # some roundings of the ratios, amplified


@pytest.mark.parametrize(
    ("motion", "grid"),
    [
        ("spin_normal", {"K": 1.3, "spin": 0.37, "eccentricity": 0.4}),
        ("spin_orbit", {"k1": 0.5, "k3": 0.1, "eccentricity": 0.15, "p": 0.5}),
        ("libration", {"a_over_b": 1.2, "b_over_c": 0.9, "amplitude": 1.0}),
    ],
)
def test_verify_compares_every_motion_with_scipy(motion, grid):
    ds = survey(motion, ["out_of_plane"], **grid)
    expected = trace_by_scipy(grid | {"plane": "out_of_plane"})
    assert abs(ds.trace - expected) < 1e-9 * max(1, abs(expected)) + ds.trace_error  # SciPy's tolerance


def beletsky(anomaly, state, p, asymmetry, eccentricity):
    """Return x' and x'' of Beletsky's equation for δ = (p - 1) f + x; arrays or numbers."""
    x, rate = state
    angle, push = (p - 1.0) * anomaly + x, 2.0 * eccentricity * np.sin(anomaly)
    radius = 1.0 + eccentricity * np.cos(anomaly)
    return np.array([rate, (push * (p + rate) - 1.5 * asymmetry * np.sin(2.0 * angle)) / radius])


@pytest.mark.parametrize(
    ("p", "asymmetry", "eccentricity", "count"),
    [
        *((1, 0.4, 0.005, 3), (1, 0.4, 0.2, 1), (1, 0.3, 0.1, 1), (1, -0.6, 0.3, 1), (1, 0.97, 0.3, 3)),
        *((0.5, 0.5, 0.3, 1), (2.5, 0.4, 0.4, 1)),
    ],
)
def test_the_forced_motion_is_the_smallest_of_all_odd_ones(p, asymmetry, eccentricity, count):
    """Against boundary-value problems by SciPy's collocation, from sine waves of many sizes: number, place and choice.

    Beyond the fold (asymmetry 0.4, eccentricity 0.2) the motion against the phase of the forcing is left.
    """
    arguments, nodes, rates = (p, asymmetry, eccentricity), np.linspace(0.0, np.pi, 41), set()
    for size in np.linspace(-3.0, 3.0, 13):
        solution = solve_bvp(
            lambda f, y: beletsky(f, y, *arguments),
            lambda start, end: np.array([start[0], end[0]]),
            nodes,
            size * np.array([np.sin(nodes), np.cos(nodes)]),
            tol=1e-9,
            max_nodes=2000,
        )
        if solution.success:
            rates.add(round(float(solution.y[1, 0]), 7))  # digits that the tolerance leaves
    ds = survey("spin_orbit", ["in_plane"], asymmetry=asymmetry, eccentricity=eccentricity, p=p)
    assert len(rates) == count
    expected = min(rates, key=abs)
    assert float(ds.rate_start) - (p - 1.0) == pytest.approx(expected, abs=2e-7)  # of the rounded digits
    assert int(ds.branch) == 1 + sorted(rates).index(expected)


def test_a_motion_beyond_its_fold_closes_in_long_doubles():
    """x(π) = 0 to the error of the reported start times its growth."""
    asymmetry, eccentricity = np.array([[0.36, 0.1], [0.4, 0.2], [0.9, 0.6]]).T
    maps = [
        survey("synchronous", ["in_plane"], asymmetry=D, eccentricity=e)
        for D, e in zip(asymmetry, eccentricity, strict=True)
    ]
    rates, span = np.array([float(ds.rate_start) for ds in maps]), np.full(3, 4 * np.arctan(np.longdouble(1)))
    planar, _, end = precise.orbit_monodromy([np.ones(3), asymmetry, eccentricity], rates, span, 60)
    assert (np.abs(end[0]) < 4e-16 * np.abs(planar[0, 1]) + 1e-15).all()  # a rounding or two of the initial rate


def rates_in_long_doubles(anomaly, state, moments, eccentricity):
    """Return the derivatives of quaternions and body rates, over the mean motion, by the eccentric anomaly."""
    (a, b, c, d), w, radius = state[:4], state[4:], 1 - eccentricity * np.cos(anomaly)
    x, y = np.cos(anomaly) - eccentricity, np.sqrt(1 - eccentricity**2) * np.sin(anomaly)
    rows = [[a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)]]
    rows += [[2 * (b * c + a * d), a * a - b * b + c * c - d * d, 2 * (c * d - a * b)]]
    u = [(first * x + second * y) / radius for first, second in zip(*rows, strict=True)]
    turn = [-b * w[0] - c * w[1] - d * w[2], a * w[0] + c * w[2] - d * w[1]]
    turn += [a * w[1] + d * w[0] - b * w[2], a * w[2] + b * w[1] - c * w[0]]
    torques = [w[(k + 1) % 3] * w[k - 1] - 3 * u[(k + 1) % 3] * u[k - 1] / radius**3 for k in range(3)]
    spin = [(moments[(k + 1) % 3] - moments[k - 1]) * torques[k] / moments[k] for k in range(3)]
    return np.array([*(q / 2 for q in turn), *spin]) * radius


@pytest.mark.parametrize("orbits", [1, pytest.param(100 if ALL_CASES else 4, marks=pytest.mark.slow)])
def test_motions_are_those_of_long_doubles(orbits):
    """Eccentricities of 0.1, 0.5 and 0.95, 3.7 to 10.3 turns an orbit, by Euler's law for quaternions and body rates.

    The deviation is within the reported error, and that is below 1e-9 rad. With two thirds of the steps the reference
    changes by less than a fifth of it.
    """
    eccentricity, asymmetry = np.array([0.1, 0.5, 0.95]), np.array([0.02, 0.02, 0.0005])
    ratio, spin, states = np.array([0.93, 0.93, 0.99]), np.array([3.7, 5.3, 10.3]), np.zeros((3, 6))
    unit, anomalies = (1.0 - eccentricity**2) ** 1.5, np.linspace(0.0, 2.0 * np.pi * orbits, orbits + 1)
    states[:, :3] = [0.1, 0.05, -0.03]
    states[:, 3], states[:, 4], states[:, 5] = spin * unit - (1.0 + eccentricity) ** 2, 0.01 * unit, 0.02 * unit
    ends, errors, starts = [], [], []
    for k in range(3):
        parameters = {"eccentricity": eccentricity[k], "asymmetry": asymmetry[k], "I1_over_I3": ratio[k]}
        followed, error = motion.follow(parameters, states[k], anomalies, 1e-13)
        rates, attitude = motion.rates_and_attitude(followed, anomalies, parameters)
        starts.append([*attitude[0], *rates[0]])
        ends.append([*attitude[-1], *rates[-1]])
        errors.append(error[-1].max())
    e, D, A = (values.astype(np.longdouble) for values in (eccentricity, asymmetry, ratio))
    moments, span = [A, A + D, 0 * A + 1], np.full(3, 8 * orbits * np.arctan(np.longdouble(1)))
    exact = precise.extrapolate(
        lambda E, y: rates_in_long_doubles(E, y, moments, e), np.transpose(starts), span, 60 * orbits
    )
    for end, error, right in zip(ends, errors, exact.T.astype(float), strict=True):
        sign = np.sign(end[:4] @ right[:4])  # both quaternions of an attitude are right
        assert 2.0 * np.abs(end[:4] - sign * right[:4]).max() <= error < 1e-9
        assert np.abs(end[4:] - right[4:]).max() <= 4.0 * error


def test_jacobis_constant_is_kept_on_a_circle():
    """ω·Iω/2 - n·Iω + 3 u·Iu/2 in orbits of rate 1, n the normal: some roundings over 50 orbits of a librating body."""
    parameters, moments = {"eccentricity": 0.0, "asymmetry": 0.05, "I1_over_I3": 0.85}, np.array([0.85, 0.9, 1.0])
    anomalies = np.linspace(0.0, 100.0 * np.pi, 101)
    states, _ = motion.follow(parameters, np.array([0.1, 0.05, -0.03, 0.02, 0.01, 0.02]), anomalies, 1e-13)
    rates, attitude = motion.rates_and_attitude(states, anomalies, parameters)
    turned = Rotation.from_quat(np.roll(attitude, -1, axis=1)).inv()
    u = turned.apply(np.column_stack([np.cos(anomalies), np.sin(anomalies), 0.0 * anomalies]))
    n = turned.apply([0.0, 0.0, 1.0])
    constant = ((rates**2 / 2 - n * rates + 1.5 * u**2) * moments).sum(axis=1)
    assert np.ptp(constant) < 1e-13


@pytest.mark.parametrize("eccentricity", [0.0, 0.4, 0.95])
def test_true_anomalies_solve_keplers_equation(eccentricity):
    mean = np.linspace(-7.0, 20.0, 301)
    anomaly = motion.true_anomaly(mean, eccentricity)
    half = np.arctan(math.sqrt((1 - eccentricity) / (1 + eccentricity)) * np.tan(anomaly / 2))
    back = 2 * half - eccentricity * np.sin(2 * half)
    turns = (mean - back) / (2 * np.pi)
    np.testing.assert_allclose(turns, np.round(turns), atol=1e-13)  # rounding, which 1/(1 - e) magnifies
    assert (np.diff(anomaly) > 0).all()


def test_a_point_of_a_map_has_a_motion():
    """Dimorphos librates by 20 degrees, and a tilt of 0.01 rad grows by 0.6 e-folds an orbit, far out of the plane."""
    ds = sweeps.survey({"system": "orbit", "motion": "libration", "grid": {**DIMORPHOS, "amplitude": 0.35}})
    point = {name: ds[name].values[0] for name in ds.dims if name != "multiplier"}
    moved = systems.of_map(ds).motion(point, None, None, 1e-12)
    normal = Rotation.from_quat(np.column_stack([moved[f"q{k}"] for k in (1, 2, 3, 0)])).apply([0, 0, 1])
    tilt = np.arccos(normal[:, 2])
    assert tilt[moved.time.values < 2 * np.pi].max() < 0.2 < tilt.max()
    assert moved.angle_error.max() < 1e-6


def test_the_chance_of_an_uncertain_shape_and_its_film():
    """Weights of a normal distribution over the map's shapes, summed here in a loop; a film with a moving body."""
    ratios = {"a_over_b": [1.2, 1.3, 1.4], "b_over_c": [1.1, 1.2, 1.3]}
    definition = {"system": "orbit", "motion": "libration", "grid": {**ratios, "amplitude": [0.2, 0.4]}}
    definition |= {"start_at": {"a_over_b": 1.3, "b_over_c": 1.2}, "shape_uncertainty": 0.05}
    ds = sweeps.survey(definition)
    shares, name = presentation.unstable_probability(ds, {"plane": "out_of_plane"})
    assert name == "amplitude"
    for share, amplitude in zip(shares, ds.amplitude, strict=True):
        total = unstable = 0.0
        for a, b in itertools.product(ds.a_over_b.values, ds.b_over_c.values):
            weight = math.exp(-(((a - 1.3) / 0.05) ** 2 + ((b - 1.2) / 0.05) ** 2) / 2)
            total += weight
            point = ds.squeeze().sel(a_over_b=a, b_over_c=b, amplitude=amplitude)
            unstable += weight * (float(point.growth_per_orbit_theory) > 1e-9)
        assert share == pytest.approx(unstable / total, rel=1e-12)  # roundings of a sum
    assert 0.0 < shares[0] < 1.0
    frames = itertools.islice(presentation.PRESENTATION(systems.of_map(ds)).animations(ds)["tumble"](), 60)
    first, *_, last = frames
    assert first.shape == last.shape
    assert (first != last).mean() > 0.01  # a part of the picture has moved
