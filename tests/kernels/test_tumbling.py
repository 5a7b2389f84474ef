"""Tumbling periods: measured against the closed form, that against Legendre's integrals in 40 digits and papers."""

import mpmath as mp
import numpy as np
import precise
import pytest

from kernels.events import tumbling
from kernels.free import exact


def legendre(I, energy):  # noqa: E741
    """P_psi, P_phi of the long axis and of the encircled one, at L/I3 = 1."""
    moments = [mp.mpf(float(x)) for x in I]
    return precise.legendre(moments, mp.mpf(float(energy)) * moments[2], moments[2])[:3]


def bodies(count, seed):
    """Random bodies that can exist, and an energy each; some near the separatrix, some near an axis."""
    rng = np.random.default_rng(seed)
    rows = []
    while len(rows) < count:
        I = np.sort(rng.uniform(0.05, 1.0, 3))  # noqa: E741
        I /= I[2]  # noqa: E741
        if I[0] + I[1] < 1.0:
            continue
        energy = rng.uniform(1.0, 1.0 / I[0])
        if len(rows) % 4 == 0:
            energy = (1.0 + rng.choice([-1, 1]) * 10.0 ** rng.uniform(-9, -2)) / I[1]
        if len(rows) % 7 == 0:
            energy = 1.0 + 10.0 ** rng.uniform(-12, -2) * (1.0 / I[0] - 1.0)
        rows.append((*I, np.clip(energy, 1.0, 1.0 / I[0])))
    return np.array(rows).T


def columns(points):
    return tumbling.survey(dict(zip(("I1", "I2", "I3", "energy"), points, strict=True)) | {"omega0": 1.0}, 1e-10)


@pytest.fixture(scope="module")
def tumblers():
    points = bodies(400, 2)
    return points, columns(points)


def test_closed_form_is_legendres(tumblers):
    points, periods = tumblers
    with mp.workdps(40):
        for i in range(0, 400, 9):
            # the start is rounded, and near the separatrix periods move by 1/N as much
            N = abs(1.0 - points[3, i] * points[1, i])
            expected = legendre(points[:3, i], points[3, i])
            for name, value in zip(tumbling.PERIODS, expected, strict=True):
                assert periods[f"{name}_exact"][i] == pytest.approx(float(value), rel=3e-15 + 4e-16 / N)


def test_measured_periods_agree_within_their_errors(tumblers):
    points, periods = tumblers
    assert (periods["mode"] == periods["mode_exact"]).all()
    is_far = np.abs(1.0 - points[3] * points[1]) > 1e-5  # from the separatrix
    for name in tumbling.PERIODS:
        deviation = np.abs(periods[name] - periods[f"{name}_exact"])
        assert (deviation <= periods[f"{name}_error"]).all()
        assert np.median(periods[f"{name}_error"] / periods[name]) < 1e-12
        assert (periods[f"{name}_error"][is_far] <= 1e-9 * np.abs(periods[name][is_far])).all()


def test_near_symmetric_bodies_in_any_unit_agree_with_legendre():
    """Two moments, or all three, equal to up to 13 digits; energies down to 1e-6 of the range from the separatrix."""
    rng, n = np.random.default_rng(8), 30
    gap = 10.0 ** rng.uniform(-13, -2, n)
    kind = np.arange(n) % 3
    low = np.select([kind == 0, kind == 1], [rng.uniform(0.05, 0.9, n), 0.8 * (1.0 - gap)], 1.0 - gap * rng.random(n))
    middle = np.select([kind == 0, kind == 1], [1.0 - gap, np.full(n, 0.8)], 1.0)
    I = np.stack([low, middle, np.where(kind == 2, 1.0 + gap, 1.0)]) * 10.0 ** rng.uniform(-90, 90, n) * 1.7  # noqa: E741
    on = I[2] / I[1]
    side = np.where(np.arange(n) % 2, I[2] / I[0] - on, 1.0 - on)
    energy = on + side * 10.0 ** rng.uniform(-6, 0, n) * 0.999
    periods = columns(np.array([*I, energy]))
    assert (periods["mode"] == periods["mode_exact"])[np.isfinite(periods["period_psi"])].all()
    measured = np.isfinite(periods["period_psi"])
    assert measured.mean() > 0.3  # the further points take more steps than are made
    with mp.workdps(40):
        expected = np.array([[float(x) for x in legendre(I[:, i], energy[i])] for i in range(n)]).T
    for name, value in zip(tumbling.PERIODS, expected, strict=True):
        deviation = np.abs(periods[name] - value)[measured]
        assert (deviation <= periods[f"{name}_error"][measured]).all(), name


def test_the_distance_of_the_energy_from_its_end_keeps_its_digits():
    """Nearly symmetric bodies near the separatrix, I3 - E I1 some thousandths of I3: deviations reached 4.8 errors."""
    rng, n = np.random.default_rng(1), 60
    gap = 10.0 ** rng.uniform(-2.8, -2, n)
    low = rng.uniform(0.3, 0.98, n) * (1.0 - gap)
    middle = low * (1.0 + gap * (1.0 - 10.0 ** rng.uniform(-3, -1, n)))
    points = np.array([low, middle, np.ones(n), (1.0 - gap) / low])
    periods = tumbling.survey(dict(zip(("I1", "I2", "I3", "energy"), points, strict=True)) | {"omega0": 1.0}, 1e-3)
    with mp.workdps(40):
        expected = np.array([float(legendre(points[:3, i], points[3, i])[0]) for i in range(n)])
    assert (np.abs(periods["period_psi"] - expected) <= periods["period_psi_error"]).all()


def test_the_spin_rate_scales_every_period_and_error_exactly(tumblers):
    points, slow = tumblers
    fast = tumbling.survey(dict(zip(("I1", "I2", "I3", "energy"), points, strict=True)) | {"omega0": 4.0}, 1e-10)
    for name in tumbling.PERIODS:
        for column in (name, f"{name}_error", f"{name}_exact"):
            np.testing.assert_array_equal(4.0 * fast[column], slow[column])


def test_tilts_are_those_of_the_polhode():
    """Extremes at the planes of the axes; the mean, of the angle to the axis 3, over the motion itself."""
    I = np.array([0.3, 0.8, 1.0])  # noqa: E741
    energy = 1.1
    tilts = tumbling.tilts(dict(zip(("I1", "I2", "I3"), I, strict=True)) | {"energy": energy})
    # m1² + m2² + m3² = 1 and m1²/I1 + m2²/I2 + m3²/I3 = 2T, with m1 or m2 nought
    ends = [np.arccos(np.sqrt((1 / i - energy) / (1 / i - 1.0))) for i in I[:2]]
    assert tilts["tilt_least"][0] == pytest.approx(min(ends), rel=1e-14)
    assert tilts["tilt_greatest"][0] == pytest.approx(max(ends), rel=1e-14)
    m1 = np.sin(ends[0])
    start = np.array([m1, 0.0, np.cos(ends[0])]) / I
    period = exact.period(exact.set_up(*I, *start))
    omega = exact.rotation(I, start, np.arange(400) * (period / 400))
    assert tilts["tilt_mean"][0] == pytest.approx(np.arccos(omega[:, 2]).mean(), rel=1e-8)  # a single


def test_small_wobbles_tend_to_the_square_roots():
    I1, I2, I3 = 0.4, 0.7, 1.0
    periods = columns(np.array([[I1, I2, I3, 1.0 + 1e-13], [I1, I2, I3, (1.0 - 1e-13) / I1]]).T)
    ratio = periods["period_psi_exact"] / periods["period_phi_long_axis_exact"]
    assert ratio[0] == pytest.approx(np.sqrt(I1 * I2 / ((I3 - I1) * (I3 - I2))), rel=1e-12)
    assert ratio[1] == pytest.approx(np.sqrt(I2 * I3 / ((I3 - I1) * (I2 - I1))) - 1.0, rel=1e-11)


def test_modes_and_what_has_no_period():
    I1, I2 = 0.5, 0.8
    energies = [1.0, 1.1, 1.25, 1.4, 2.0]
    periods = columns(np.array([[I1, I2, 1.0, e] for e in energies]).T)
    assert periods["mode"].tolist() == [
        tumbling.PRINCIPAL,
        tumbling.SAM,
        tumbling.SEPARATRIX,
        tumbling.LAM,
        tumbling.PRINCIPAL,
    ]
    assert np.isnan(periods["period_psi"][[0, 2, 4]]).all()
    assert np.isnan(periods["period_psi_exact"][[0, 2, 4]]).all()


@pytest.mark.slow  # its kernel takes seconds to compile
def test_krylov_from_its_two_periods():
    """(5247) Krylov: 368.7 h and 67.27 h with 0.36 : 0.96 : 1 (Lee et al., A&A 635 (2020) A137)."""
    periods = tumbling.inverse(0.36, 0.96, 1.0, 368.7 / 67.27)
    assert periods["energy"][tumbling.SAM] == pytest.approx(1.0338, abs=5e-5)
    assert periods["m"][tumbling.SAM] == pytest.approx(0.807, abs=5e-4)
    corners = tumbling.inverse([0.365, 0.355, 0.365, 0.355], [0.955, 0.965, 0.965, 0.955], 1.0, 368.7 / 67.27)
    box = corners["energy"][tumbling.SAM]
    assert [box.max(), box.min()] == pytest.approx([1.041, 1.026], abs=6e-4)  # the uncertainty by ratios of two digits
    assert tumbling.inverse(0.36, 0.97, 1.0, 368.7 / 67.27)["energy"][tumbling.SAM] == pytest.approx(1.02, abs=5e-4)


@pytest.mark.slow  # its kernel takes seconds to compile
def test_a_ratio_below_one_excludes_the_short_axis_mode():
    """1I/'Oumuamua: 6.58 h with 8.67 h is long-axis only, 13.15 h and 54.48 h are both (Belton et al. 2018)."""
    I1, I2, I3, _ = bodies(300, 4)
    for P_psi, has_both_modes in ((6.58, False), (13.15, True), (54.48, True)):
        periods = tumbling.inverse(I1, I2, I3, P_psi / 8.67)
        assert np.isfinite(periods["energy"][tumbling.SAM]).any() == has_both_modes
        assert np.isfinite(periods["energy"][tumbling.LAM]).any()


@pytest.mark.slow  # its kernel takes seconds to compile
def test_the_inverse_undoes_the_periods(tumblers):
    points, periods = tumblers
    ratio = periods["period_psi_exact"] / periods["period_phi_long_axis_exact"]
    undone = tumbling.inverse(*points[:3], ratio)["energy"]
    energies = np.where(periods["mode"] == tumbling.SAM, undone[tumbling.SAM], undone[tumbling.LAM])
    has_period = np.isfinite(ratio)
    # near an axis the ratio does not depend on the energy to first order in E - 1: 1e-16 of it is 1e-16 of E
    np.testing.assert_allclose(energies[has_period], points[3][has_period], rtol=3e-13)
