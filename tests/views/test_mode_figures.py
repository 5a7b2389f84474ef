"""Campbell diagram and root locus: lines and marks against closed forms."""

import numpy as np
import pytest

import sweeps
from sweeps.maps.selection import SelectionError


@pytest.fixture(scope="module")
def foucault():
    """Return a map of Foucault's pendulum with g = l = 1 without drag: frequencies are |1 ± W|."""
    return sweeps.survey(system="foucault", gravity=1.0, spin_rate={"start": 0.05, "stop": 1.95, "num": 40})


def test_campbell_diagram_marks_each_crossing_with_its_value(foucault):
    assert {"campbell", "root_locus"} <= {*dir(foucault.polhode)}  # as Tab offers them
    ax = sweeps.plot.campbell(foucault, "spin_rate", orders=(1, 2, 3))
    curves = [line for line in ax.lines if line.get_linestyle() == "-" and len(line.get_xdata()) > 9]
    assert len(curves) >= 2
    for line in curves:
        speeds, frequencies = line.get_data()
        exact = np.abs(1.0 + np.outer([1.0, -1.0], speeds))
        assert np.abs(frequencies - exact).min(axis=0).max() < 1e-9  # the rates' errors are 1e-11
    # 1 - W = W at 1/2; 1 + W = 2 W at 1, 1 - W = 2 W at 1/3; 1 + W = 3 W at 1/2, 1 - W = 3 W at 1/4
    marked = sorted(line.get_xdata()[0] for line in ax.lines if line.get_marker() == "o")
    np.testing.assert_allclose(marked, [1 / 4, 1 / 3, 1 / 2, 1 / 2, 1.0], rtol=1e-9)
    assert {"1×: 0.5", "2×: 0.3333", "2×: 1", "3×: 0.5", "3×: 0.25"} == {text.get_text() for text in ax.texts}


def test_root_locus_has_the_eigenvalues_and_a_second_parameter_is_refused(foucault):
    ax = sweeps.plot.root_locus(foucault, "spin_rate")
    paths = [line for line in ax.lines if line.get_marker() == "."]
    imaginary = foucault.eigenvalue_imag.squeeze().values
    assert sum(len(line.get_xdata()) for line in paths) == (imaginary >= 0.0).sum()
    with pytest.raises(SelectionError, match=r"1 dimension has no value \(length\)"):
        sweeps.plot.campbell(sweeps.survey(system="foucault", length=[1.0, 2.0], spin_rate=[0.5, 1.0]), "spin_rate")


def test_surface_and_response_have_the_values_of_closed_forms():
    """Frequencies |1 ± W| in axes that turn at W; a pendulum's amplitude is 1/|1 - w²| of the moment of force."""
    ds = sweeps.survey(system="foucault", gravity=1.0, spin_rate=[0.2, 0.4, 0.6], drag=[0.0, 0.1])
    panel = sweeps.plot.mode_surface(ds, "spin_rate", "drag", 1)
    (mesh,) = (artist for artist in panel.collections if artist.get_array() is not None)
    without_drag = np.reshape(mesh.get_array(), (2, 3))[0]
    speeds = ds.spin_rate.values
    distance = np.abs(without_drag - np.abs(1.0 + np.outer([1.0, -1.0], speeds)))
    assert distance.min(axis=0).max() < 1e-9  # the rates' errors are 1e-11
    frequencies = [0.3, 0.7]
    pendulum = sweeps.survey(system="pendulum", length=1.0, gravity=1.0)
    axes = sweeps.plot.response(pendulum, {"theta": 1.0}, frequencies, at={"equilibrium": "hanging"})
    theory, measured = (line.get_ydata() for line in axes.lines)
    np.testing.assert_allclose(theory, 1.0 / (1.0 - np.square(frequencies)), rtol=1e-12)
    np.testing.assert_allclose(measured, theory, rtol=1e-12)
