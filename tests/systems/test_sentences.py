"""Sentences of maps, the titles of their figures: each number against theory in closed form, at the map's grid."""

import re

import numpy as np
import pytest

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


NUMBERS = {  # sweep → function of its map that returns the numbers of its sentence
    "foucault": lambda _: [1.0, 23.9345 / np.sin(np.radians(48.85))],  # the sidereal day by the sine of the latitude
    "gravity_gradient": regions,
    "gravity_gradient_damped": regions,
    "gyrostat": gyrostat,
    "lagrange_points": lambda _: [(1.0 - np.sqrt(23.0 / 27.0)) / 2.0],  # Routh
    "rotating_saddle": lambda _: [1.0],  # (W² - 1)(W² - 1.0…) > 0 beyond both resonances
    "rotor": rotor,
    "sleeping_top": sleeping_top,
    "steady_precession": steady_precession,
    "viscous_slug": lambda _: [1.0],  # the major-axis rule
}
ROUNDING = 0.51  # deviation in units of the last printed digit; the spline adds a hundredth to the half of rounding
WORDS = re.compile(r"L4 and L5|I₃ = I₁")  # numerals that are names


@pytest.mark.parametrize("name", NUMBERS)
def test_numbers_of_the_sentence_are_those_of_theory(name):
    ds = sweeps.survey(gallery.reduce_points(plain(read_text(file_text(catalogue.shipped_files()[name])))))
    sentence = systems.presentation_of(ds).sentence(ds)
    printed = re.findall(r"\d+(?:\.\d+)?", WORDS.sub("", sentence))
    for text, number in zip(printed, NUMBERS[name](ds), strict=True):
        assert abs(float(text) - number) <= ROUNDING * 10.0 ** -len(text.partition(".")[2]), sentence
    figure = next(iter(figures.pictures(ds).values()))()
    assert figure.texts[0].get_text().replace("\n", " ").replace("\u00a0", " ") == sentence


def test_a_map_without_the_points_of_its_sentence_has_its_title():
    ds = sweeps.survey(title="Two momenta", system="gyrostat", rotor_momentum=[0.0, 2.0], I2=[1.5, 2.0])
    assert systems.presentation_of(ds).sentence(ds) == ""
    assert figures.pictures(ds)["stability"]().texts[0].get_text() == "Two momenta"
