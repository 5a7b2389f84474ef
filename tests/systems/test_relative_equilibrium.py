"""Relative equilibria as maps: names, dimensions, files of one's own, shards, pictures."""

import numpy as np
import pytest
import xarray as xr
from described import particle
from matplotlib.figure import Figure

import sweeps
from sweeps import systems
from sweeps.systems.relative_equilibrium import system as relative
from sweeps.systems.relative_equilibrium.presentation import figure_flat_spin, figure_spectra
from sweeps.systems.relative_equilibrium.system import INVARIANTS, REGIMES, VARIABLES

pytestmark = pytest.mark.slow  # compiling their kernels takes as long as compiling those of all quick tests
TOP = {"system": "sleeping_top", "grid": {"spin_rate": [3.0, 4.7, 4.8, 6.0], "moment_of_weight": [0.0, 2.0]}}


@pytest.fixture(scope="module")
def top():
    return sweeps.survey(TOP)


def test_map_has_the_contracts_names_and_dimensions(top):
    assert top["regime"].dims == (
        *("I1", "I2", "I3", "moment_of_weight", "spin_rate", "epsilon", "equilibrium", "eigenvalue"),
    )
    places = {f"{k}{i}_equilibrium" for k in ("omega", "gamma") for i in (1, 2, 3)}
    drifts = {"vertical_drift", "vertical_momentum_drift"}
    assert set(top.data_vars) == {*VARIABLES, *INVARIANTS, *places, *drifts}
    regimes = [REGIMES[k + 1] for k in top["regime"].squeeze().sel(moment_of_weight=2.0, eigenvalue=1).values]
    assert regimes == ["flutter", "flutter", "stable", "stable"]  # I3² W² = 4 I1 P at 4.714 rad/s
    growth = top["growth_rate"].squeeze().sel(moment_of_weight=2.0, spin_rate=3.0, eigenvalue=1)
    assert growth.values == pytest.approx(1.0908712114635715, rel=1e-9)
    assert (top["status"] == 0).all()


def test_a_spring_with_damping_is_a_relative_equilibrium():
    places = {"rest": [0]}
    system = particle(lambda x, k: k * x**2 / 2, bounds=(-1, 1), R=lambda v, k: v**2 / 10, places=places, stiffness=1.0)
    ds = sweeps.survey(system=system, stiffness=[-1.0, 0.5, 4.0]).squeeze()
    roots = [np.sort_complex(np.roots([1, 0.2, k])) for k in (-1.0, 0.5, 4.0)]
    eigenvalues = ds["eigenvalue_real"].values + 1j * ds["eigenvalue_imag"].values
    np.testing.assert_allclose(np.sort_complex(eigenvalues), roots, atol=1e-11)
    words = [REGIMES[k + 1] for k in ds["regime"].isel(eigenvalue=0).values]
    assert words == ["unstable", "asymptotically_stable", "asymptotically_stable"]
    assert type(systems.of_map(ds)) is relative.RelativeEquilibrium


def test_pictures(top):
    draw_functions = systems.presentation_of(top.assign_attrs(system="sleeping_top")).figures(top)
    assert set(draw_functions) == {"stability", "theory_against_measured"}
    for draw in draw_functions.values():
        assert isinstance(draw(), Figure)


@pytest.mark.parametrize("has_damping", [False, True])
def test_the_boundary_of_theory_is_found_between_the_points_of_a_map(has_damping):
    """λ² + c λ + k of two oscillators: stable for k > 0, and for c > 0; the last cell is a tenth inside."""
    stiffness, c = np.linspace(-0.97, 1.03, 21), 0.2 if has_damping else 0.0
    k, second_stiffness = np.meshgrid(stiffness, [1.5, 2.5], indexing="ij")
    roots = [[(-c + sign * np.sqrt(c**2 - 4 * value + 0j)) / 2 for sign in (1, -1)] for value in (k, second_stiffness)]
    eigenvalues = np.moveaxis(np.array(roots).reshape(4, *k.shape), 0, -1)
    growth, over = eigenvalues.real.max(axis=-1), ("k", "other")
    regime = np.where(growth > 1e-9, *(REGIMES.index(name) - 1 for name in ("unstable", "stable")))
    columns = {"growth_rate_theory": growth, "regime_theory": regime, "rate_scale": np.ones(k.shape)}
    stability_map = xr.Dataset({name: (over, column) for name, column in columns.items()})
    stability_map = stability_map.assign(eigenvalues=((*over, "eigenvalue"), eigenvalues))
    margin, _ = figure_spectra._stability_functions(stability_map)
    (last,) = np.flatnonzero(margin[1:, 0] * margin[:-1, 0] < 0.0)
    share = margin[last, 0] / (margin[last, 0] - margin[last + 1, 0])
    assert stiffness[last] + share * 0.1 == pytest.approx(0.0, abs=1e-12)  # the product of λ is linear in k


def test_a_slender_bodys_spin_ends_flat():
    """Growth as linear theory has it at first, L and its size kept, less and less energy, and the axis across L."""
    point = {"transverse_moment": 1.0, "axial_moment": 0.3, "slug_moment": 0.05, "drag": 0.03}
    point |= {"rotor_momentum": 0.0, "spin_rate": 2.0}
    (rate,) = np.unique(sweeps.survey({"system": "viscous_slug", "grid": point})["growth_rate"])
    times, momenta = figure_flat_spin.integrate(point | {"growth_rate": float(rate)})
    tilt, sizes = figure_flat_spin.tilt_angle(momenta), np.linalg.norm(momenta, axis=1)
    np.testing.assert_allclose(sizes, sizes[0], rtol=1e-7)  # the interpolation between steps
    early = (tilt > 0.012) & (tilt < 0.03)
    slope = np.polyfit(times[early], np.log(tilt[early]), 1)[0]
    assert slope == pytest.approx(rate, rel=0.02)  # a slug that has not yet settled, an angle that is no more small
    assert np.degrees(tilt[-1]) == pytest.approx(88.0, abs=0.1)


def test_the_flat_spin_is_drawn():
    ds = sweeps.survey({"system": "viscous_slug", "grid": {"axial_moment": [0.5, 1.5], "drag": 0.05}})
    animations = systems.make_presentation(systems.resolve("viscous_slug")).animations(ds)
    assert len(list(animations["flat_spin"]())) == figure_flat_spin.FRAMES + 1
    assert not list(figure_flat_spin.frames(ds.sel(axial_moment=[1.5])))


def test_a_stiff_mode_of_few_samples_a_turn_is_within_its_error():
    """With one step for each of nine samples, truncation is 2e-14 of the scale: more than the errors by rounding."""
    stiffness = {"stiffness_x": 15.323409960118326, "stiffness_y": 0.08429309363760218}
    damping = {"bearing_damping": 0.24670798588423715, "internal_damping": 0.0779189262769848}
    run = {"rotations": 5, "samples_per_rotation": 9, "tolerance": 1e-7}
    grid = {**stiffness, **damping, "spin_rate": 11.224745739250196, "epsilon": 3e-11}
    ds = sweeps.survey({"system": "rotor", "grid": grid, "integration": run})
    for name in ("eigenvalue_real", "eigenvalue_imag", "sum_of_squares"):
        assert (abs(ds[name] - ds[f"{name}_theory"]) <= ds[f"{name}_error"]).all(), name


@pytest.mark.parametrize("rate", [1.0, 1e-12])
def test_panels_and_colours_of_frequencies_know_no_units(rate):
    grid = {"length": [1.0, 2.0], "drag": 0.0, "gravity": [rate**2, 3.9 * rate**2], "spin_rate": [0.01 * rate, rate]}
    ds = sweeps.survey(system="foucault", grid=grid)
    figure = figure_spectra.draw(ds)
    meshes = [mesh for ax in figure.axes for mesh in ax.collections if mesh.get_gid() == "frequency"]
    max_frequency = float(np.abs(ds["eigenvalue_imag"]).max())
    assert len(meshes) == 2  # both spin rates
    for mesh in meshes:  # the single colour bar is right for all panels
        assert mesh.get_clim()[0] == 0.0
        assert max_frequency <= mesh.get_clim()[1] < 2.5 * max_frequency
