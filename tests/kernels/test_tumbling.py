"""Tumbling periods: measured against the closed form, that against Legendre's integrals in 40 digits and papers."""

import mpmath as mp
import numpy as np
import pytest

from kernels.events import tumbling
from kernels.free import exact


def legendre(I, energy):  # noqa: E741
    """P_psi, P_phi of the long axis and of the encircled one by complete integrals of the third kind, at L/I3 = 1."""
    I1, I2, I3 = (mp.mpf(float(x)) for x in I)
    L, T2 = I3, mp.mpf(float(energy)) * I3
    short = L**2 > T2 * I2
    d, c = (I3, I1) if short else (I1, I3)
    both = (d - I2) * (L**2 - T2 * c)
    p, m, n = mp.sqrt(both / (I1 * I2 * I3)), (I2 - c) * (T2 * d - L**2) / both, -d * (I2 - c) / (c * (d - I2))
    P = 4 * mp.ellipk(m) / p
    f = L / (2 * mp.pi * d) * (1 + (d / c - 1) * mp.ellippi(n, m) / mp.ellipk(m))
    return P, (1 / (f - 1 / P) if short else 1 / f), 1 / f


def bodies(count, seed):
    """Random bodies that can exist, and an energy each; some near the separatrix, some near an axis."""
    rng = np.random.default_rng(seed)
    found = []
    while len(found) < count:
        I = np.sort(rng.uniform(0.05, 1.0, 3))  # noqa: E741
        I /= I[2]  # noqa: E741
        if I[0] + I[1] < 1.0:
            continue
        energy = rng.uniform(1.0, 1.0 / I[0])
        if len(found) % 4 == 0:
            energy = (1.0 + rng.choice([-1, 1]) * 10.0 ** rng.uniform(-9, -2)) / I[1]
        if len(found) % 7 == 0:
            energy = 1.0 + 10.0 ** rng.uniform(-12, -2) * (1.0 / I[0] - 1.0)
        found.append((*I, np.clip(energy, 1.0, 1.0 / I[0])))
    return np.array(found).T


def columns(points):
    return tumbling.survey(dict(zip(("I1", "I2", "I3", "energy"), points, strict=True)) | {"omega0": 1.0}, 1e-10)


@pytest.fixture(scope="module")
def tumblers():
    points = bodies(400, 2)
    return points, columns(points)


def test_closed_form_is_legendres(tumblers):
    points, found = tumblers
    with mp.workdps(40):
        for i in range(0, 400, 9):
            # the start is rounded, and near the separatrix periods move by 1/N as much
            N = abs(1.0 - points[3, i] * points[1, i])
            wanted = legendre(points[:3, i], points[3, i])
            for name, value in zip(tumbling.PERIODS, wanted, strict=True):
                assert found[f"{name}_exact"][i] == pytest.approx(float(value), rel=3e-15 + 4e-16 / N)


def test_measured_periods_agree_within_their_errors(tumblers):
    points, found = tumblers
    assert (found["mode"] == found["mode_exact"]).all()
    away = np.abs(1.0 - points[3] * points[1]) > 1e-5  # from the separatrix
    for name in tumbling.PERIODS:
        off = np.abs(found[name] - found[f"{name}_exact"])
        assert (off <= found[f"{name}_error"]).all()
        assert np.median(found[f"{name}_error"] / found[name]) < 1e-12
        assert (found[f"{name}_error"][away] <= 1e-9 * np.abs(found[name][away])).all()


def test_near_symmetric_bodies_in_any_unit_agree_with_legendre():
    """Two moments, or all three, equal to up to 13 digits; energies down to 1e-6 of the range from the separatrix."""
    rng, n = np.random.default_rng(8), 60
    gap = 10.0 ** rng.uniform(-13, -2, n)
    kind = np.arange(n) % 3
    low = np.select([kind == 0, kind == 1], [rng.uniform(0.05, 0.9, n), 0.8 * (1.0 - gap)], 1.0 - gap * rng.random(n))
    middle = np.select([kind == 0, kind == 1], [1.0 - gap, np.full(n, 0.8)], 1.0)
    I = np.stack([low, middle, np.where(kind == 2, 1.0 + gap, 1.0)]) * 10.0 ** rng.uniform(-90, 90, n) * 1.7  # noqa: E741
    on = I[2] / I[1]
    side = np.where(np.arange(n) % 2, I[2] / I[0] - on, 1.0 - on)
    energy = on + side * 10.0 ** rng.uniform(-6, 0, n) * 0.999
    found = columns(np.array([*I, energy]))
    assert (found["mode"] == found["mode_exact"])[np.isfinite(found["period_psi"])].all()
    measured = np.isfinite(found["period_psi"])
    assert measured.mean() > 0.3  # the others take more steps than are made
    with mp.workdps(40):
        wanted = np.array([[float(x) for x in legendre(I[:, i], energy[i])] for i in range(n)]).T
    for name, value in zip(tumbling.PERIODS, wanted, strict=True):
        off = np.abs(found[name] - value)[measured]
        assert (off <= found[f"{name}_error"][measured]).all(), name


def test_the_distance_of_the_energy_from_its_end_keeps_its_digits():
    """Nearly symmetric bodies near the separatrix, I3 - E I1 some thousandths of I3: up to 4.8 errors were seen."""
    rng, n = np.random.default_rng(1), 60
    left = 10.0 ** rng.uniform(-2.8, -2, n)
    low = rng.uniform(0.3, 0.98, n) * (1.0 - left)
    middle = low * (1.0 + left * (1.0 - 10.0 ** rng.uniform(-3, -1, n)))
    points = np.array([low, middle, np.ones(n), (1.0 - left) / low])
    found = tumbling.survey(dict(zip(("I1", "I2", "I3", "energy"), points, strict=True)) | {"omega0": 1.0}, 1e-3)
    with mp.workdps(40):
        wanted = np.array([float(legendre(points[:3, i], points[3, i])[0]) for i in range(n)])
    assert (np.abs(found["period_psi"] - wanted) <= found["period_psi_error"]).all()


def test_the_spin_rate_scales_every_period_and_error_exactly(tumblers):
    points, slow = tumblers
    fast = tumbling.survey(dict(zip(("I1", "I2", "I3", "energy"), points, strict=True)) | {"omega0": 4.0}, 1e-10)
    for name in tumbling.PERIODS:
        for column in (name, f"{name}_error", f"{name}_exact"):
            np.testing.assert_array_equal(4.0 * fast[column], slow[column])


def test_tilts_are_those_of_the_polhode():
    """Where it crosses the planes of the axes; the mean, of the angle to the axis 3, over the motion itself."""
    I = np.array([0.3, 0.8, 1.0])  # noqa: E741
    energy = 1.1
    told = tumbling.tilts(dict(zip(("I1", "I2", "I3"), I, strict=True)) | {"energy": energy})
    # m1² + m2² + m3² = 1 and m1²/I1 + m2²/I2 + m3²/I3 = 2T, with one of m1 and m2 nought
    ends = [np.arccos(np.sqrt((1 / i - energy) / (1 / i - 1.0))) for i in I[:2]]
    assert told["tilt_least"][0] == pytest.approx(min(ends), rel=1e-14)
    assert told["tilt_greatest"][0] == pytest.approx(max(ends), rel=1e-14)
    m1 = np.sin(ends[0])
    start = np.array([m1, 0.0, np.cos(ends[0])]) / I
    period = exact.period(exact.set_up(*I, *start))
    omega = exact.rotation(I, start, np.arange(400) * (period / 400))
    assert told["tilt_mean"][0] == pytest.approx(np.arccos(omega[:, 2]).mean(), rel=1e-8)  # a single


def test_no_measured_bit_depends_on_the_closed_form(monkeypatch):
    points = bodies(40, 3)
    honest = columns(points)
    monkeypatch.setattr(tumbling, "fill_exact", lambda *a: (a[-2].fill(1), a[-1].fill(7.0)))
    misled = columns(points)
    for name in honest:
        assert (honest[name].tobytes() == misled[name].tobytes()) != name.endswith("_exact"), name


def test_small_wobbles_tend_to_the_square_roots():
    I1, I2, I3 = 0.4, 0.7, 1.0
    found = columns(np.array([[I1, I2, I3, 1.0 + 1e-13], [I1, I2, I3, (1.0 - 1e-13) / I1]]).T)
    ratio = found["period_psi_exact"] / found["period_phi_long_axis_exact"]
    assert ratio[0] == pytest.approx(np.sqrt(I1 * I2 / ((I3 - I1) * (I3 - I2))), rel=1e-12)
    assert ratio[1] == pytest.approx(np.sqrt(I2 * I3 / ((I3 - I1) * (I2 - I1))) - 1.0, rel=1e-11)


def test_modes_and_what_has_no_period():
    I1, I2 = 0.5, 0.8
    energies = [1.0, 1.1, 1.25, 1.4, 2.0]
    found = columns(np.array([[I1, I2, 1.0, e] for e in energies]).T)
    assert found["mode"].tolist() == [
        tumbling.PRINCIPAL,
        tumbling.SAM,
        tumbling.SEPARATRIX,
        tumbling.LAM,
        tumbling.PRINCIPAL,
    ]
    assert np.isnan(found["period_psi"][[0, 2, 4]]).all()
    assert np.isnan(found["period_psi_exact"][[0, 2, 4]]).all()


@pytest.mark.slow  # its kernel takes seconds to compile
def test_krylov_from_its_two_periods():
    """(5247) Krylov: 368.7 h and 67.27 h with 0.36 : 0.96 : 1 (Lee et al., A&A 635 (2020) A137)."""
    found = tumbling.inverse(0.36, 0.96, 1.0, 368.7 / 67.27)
    assert found["energy"][tumbling.SAM] == pytest.approx(1.0338, abs=5e-5)
    assert found["m"][tumbling.SAM] == pytest.approx(0.807, abs=5e-4)
    corners = tumbling.inverse([0.365, 0.355, 0.365, 0.355], [0.955, 0.965, 0.965, 0.955], 1.0, 368.7 / 67.27)
    box = corners["energy"][tumbling.SAM]
    assert [box.max(), box.min()] == pytest.approx([1.041, 1.026], abs=6e-4)  # what ratios of two digits leave open
    assert tumbling.inverse(0.36, 0.97, 1.0, 368.7 / 67.27)["energy"][tumbling.SAM] == pytest.approx(1.02, abs=5e-4)


@pytest.mark.slow  # its kernel takes seconds to compile
def test_a_ratio_below_one_excludes_the_short_axis_mode():
    """1I/'Oumuamua: 6.58 h beside 8.67 h is long-axis only, 13.15 h and 54.48 h are both (Belton et al. 2018)."""
    I1, I2, I3, _ = bodies(300, 4)
    for P_psi, both in ((6.58, False), (13.15, True), (54.48, True)):
        found = tumbling.inverse(I1, I2, I3, P_psi / 8.67)
        assert np.isfinite(found["energy"][tumbling.SAM]).any() == both
        assert np.isfinite(found["energy"][tumbling.LAM]).any()


@pytest.mark.slow  # its kernel takes seconds to compile
def test_the_inverse_undoes_the_periods(tumblers):
    points, found = tumblers
    ratio = found["period_psi_exact"] / found["period_phi_long_axis_exact"]
    undone = tumbling.inverse(*points[:3], ratio)["energy"]
    known = np.where(found["mode"] == tumbling.SAM, undone[tumbling.SAM], undone[tumbling.LAM])
    moving = np.isfinite(ratio)
    # near an axis the ratio does not depend on the energy to first order in E - 1: 1e-16 of it is 1e-16 of E
    np.testing.assert_allclose(known[moving], points[3][moving], rtol=3e-13)
