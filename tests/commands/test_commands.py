"""Each command as a person types it: output, files and refusals."""

import json
import math
import shutil
import subprocess
import tomllib
from importlib.metadata import EntryPoint, version
from pathlib import Path

import numpy as np
import pytest
import repeated
import xarray as xr
from calls import refusal_message, run_command
from damages import PICTURE_COLUMNS
from maps import BODIES, DEFINITION, write
from scipy.special import ellipk

import sweeps
from sweeps import systems
from sweeps.__main__ import command, main
from sweeps.maps import storage
from sweeps.points import catalogue
from sweeps.process import progress
from sweeps.schema.refusals import MapError

VARIABLES = [*PICTURE_COLUMNS, "frequency"]


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return write(tmp_path_factory.mktemp("maps"), DEFINITION | {"integration": {"variables": VARIABLES}})


@pytest.fixture(scope="module")
def bodies(path):
    return write(path.parent, BODIES, "bodies.nc")


def test_a_results_folder_stands_for_its_map(path, tmp_path, monkeypatch, capsys):
    folder = tmp_path / "results" / "mine"
    folder.mkdir(parents=True)
    shutil.copy(path, folder / "stability_map.nc")
    monkeypatch.chdir(tmp_path)
    place = ["--axis", "2", "--I1", "1", "--I2", "1", "--omega0", "1", "--epsilon", "1e-6"]
    assert run_command(capsys, "show", folder) == run_command(capsys, "show", folder / "stability_map.nc")
    assert run_command(capsys, "point", folder, *place) == run_command(
        capsys, "point", folder / "stability_map.nc", *place
    )
    run_command(capsys, "slice", folder, "--axis", "2", "--omega0", "1", "--epsilon", "1e-6", "-o", "slice.nc")
    run_command(capsys, "verify", folder, "--points", "1")
    with sweeps.open_map(folder) as ds, sweeps.open_map(path) as original:
        assert ds.identical(original)
    (tmp_path / "empty").mkdir()
    for arguments in ("show", "point --trajectory x.nc", "slice -o x.nc", "figures -o x", "report -o x.html"):
        message = refusal_message(capsys, *arguments.split(), tmp_path / "empty")
        assert message.startswith(f"{tmp_path / 'empty'}: this folder holds no stability_map.nc; allowed: a map")
    assert not list(tmp_path.glob("x*"))
    with pytest.raises(MapError, match=r"holds no stability_map\.nc"):
        sweeps.open_map(tmp_path / "empty")
    (tmp_path / "README.md").write_text("# Words\n" * 20)
    assert "(its first bytes are not those of netCDF-4)" in refusal_message(capsys, "show", "README.md")


# ---------------------------------------------------------------------------------------------------------
# show


def test_show_prints_the_counts_of_the_file(path, capsys):
    out = run_command(capsys, "show", path)
    with sweeps.open_map(path) as ds:
        appearance = systems.presentation_of(ds).appearance
        for value, word in zip(ds.regime.flag_values, ds.regime.flag_meanings.split(), strict=True):
            count = int((ds.regime == value).sum())
            line = [line for line in out.splitlines() if line.startswith(f"{appearance.words(word)} ")]
            assert (f"{count:,}" in line[0].split()) if count else not line
        assert f"{ds.regime.size:,} points" in out
        assert f"{float(abs(ds.propagation_error).max()):.2g}" in out
    assert "axis 2" in out


@pytest.mark.parametrize("axis", [1, 2, 3])
def test_show_warns_of_a_spin_about_the_axis_of_least_inertia(path, capsys, axis):
    out = run_command(capsys, "show", path, "--axis", axis)
    with sweeps.open_map(path) as ds:
        regimes = ds.regime.sel(axis=axis).isel({dim: 0 for dim in ("omega0", "epsilon", "phase") if dim in ds.dims})
        assert regimes.size < 2000  # each cell of the picture is one point
        is_least = bool((regimes == 0).any())
    assert ("stable, least inertia; with any loss of energy it ends in a flat spin" in out) == is_least


def test_show_as_json_is_the_same(path, capsys):
    facts = json.loads(run_command(capsys, "show", path, "--json"))
    with sweeps.open_map(path) as ds:
        assert facts["content_hash"] == ds.attrs["content_hash"]
        assert facts["points"] == ds.regime.size
        assert facts["counts"]["regime"]["unstable"] == int((ds.regime == 2).sum())
        worst = facts["checks"]["energy_drift"]
        assert worst["value"] == float(ds.energy_drift.max()) == float(ds.energy_drift.sel(worst["at"]))


COUNTED = {"pendulum": "6,400 points (2 equilibria each)", "mathieu": "101,136 points", "tiny": "864 points"}


@pytest.mark.parametrize("name", COUNTED)
def test_list_check_and_run_count_the_same_points(name, capsys):
    plan = catalogue.plan_sweep(catalogue.find_definition(name), anywhere=True, check=False)
    assert plan.sweep.size_in_words == COUNTED[name]
    assert f"{catalogue.shipped_contents()[name].points:,} points" == COUNTED[name].split(" (")[0]
    assert plan.intention(Path("results")).startswith(f"{name}: {COUNTED[name]} of ")
    number, each = COUNTED[name].split()[0], math.prod(plan.sweep.each.values())
    assert f"points      {COUNTED[name].replace(' points', '')} = " in run_command(capsys, "check", name)
    total = plan.sweep.grid.size
    with progress.count_points(total, name, each) as advance:
        advance(total)
    assert capsys.readouterr().err.startswith(f"{name}: {number} of {number} points, ")


# ---------------------------------------------------------------------------------------------------------
# slice


def test_slice_holds_the_plane_and_says_which(path, tmp_path, capsys):
    out = tmp_path / "slice.nc"
    words = run_command(capsys, "slice", path, "--axis", 2, "--omega0", "-2.5e+0", "--epsilon=3e-6", "-o", out)
    assert "omega0 = -3 rad s-1 (nearest to -2.5)" in words
    with sweeps.open_map(path) as full_map, sweeps.open_map(out) as slice_map:
        plane = full_map.sel(axis=2, omega0=-3.0, epsilon=1e-6).isel(I3=0, phase=0)
        assert slice_map.regime.dims == ("I1", "I2")
        for name in full_map.data_vars:
            np.testing.assert_array_equal(slice_map[name].values, plane[name].values)
            assert slice_map[name].attrs.get("units") == full_map[name].attrs.get("units")
        assert slice_map.omega0.item() == -3.0
        assert slice_map.attrs["definition"] == full_map.attrs["definition"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], "5 dimensions are without a value (axis, I1, I2, omega0, epsilon)"),
        (["--axis", "2"], "--I1 0.5, 0.75, 1.0, 1.25, 1.5"),
        (["--axis", "2", "--I1", "1", "--omega0", "1", "--epsilon", "1"], "1 dimension is without a value (I2)"),
        (["--axs", "2"], "did you mean axis?"),
        (["--axis", "7"], "7 is not in this map"),
        (["--I1", "one"], "'one' is no number"),
    ],
)
def test_slice_refuses_what_is_no_plane(path, tmp_path, capsys, arguments, words):
    answer = refusal_message(capsys, "slice", path, "-o", tmp_path / "s.nc", *arguments)
    assert words.replace("1.0,", "1,") in answer
    assert list(tmp_path.iterdir()) == []


# ---------------------------------------------------------------------------------------------------------
# point


def test_point_is_the_row_of_the_file(path, capsys):
    where = ["--axis", 2, "--I1", 0.7, "--I2", 1.38, "--omega0", 1, "--epsilon", 1e-6]
    facts = json.loads(run_command(capsys, "point", path, *where, "--json"))
    with sweeps.open_map(path) as ds:
        row = ds.sel(axis=2, I1=0.75, I2=1.4, omega0=1.0, epsilon=1e-6).isel(I3=0, phase=0)
        for name, entry in facts["variables"].items():
            value = row[name].item()
            if "flag_meanings" in ds[name].attrs:
                meanings = dict(zip(ds[name].flag_values, ds[name].flag_meanings.split(), strict=True))
                assert entry["value"] == meanings[value]
            else:
                assert entry["value"] == (None if np.isnan(value) else value)
            assert entry["units"] == ds[name].attrs.get("units", "")
        out = run_command(capsys, "point", path, *where)
        assert f"{row.growth_rate.item():.6g}" in out or f"{row.frequency.item():.6g}" in out
    assert "I1 = 0.75 kg m2 (nearest to 0.7)" in out
    assert "rad s-1" in out


@pytest.mark.slow
def test_point_writes_a_motion_whose_flips_are_scipys(bodies, tmp_path, capsys):
    out = tmp_path / "motion.nc"
    words = run_command(
        capsys, "point", bodies, "--body", "racket", "--axis", 2, "--epsilon", 1e-2, "--trajectory", out
    )
    assert "body = Tennis racket" in words
    with xr.open_dataset(out) as motion:
        spin, times = motion.omega2.values, motion.time.values
        turns = np.flatnonzero(np.diff(np.sign(spin)))
        crossings = times[turns] - spin[turns] * (times[turns + 1] - times[turns]) / (spin[turns + 1] - spin[turns])
        I1, I2, I3 = 0.00121, 0.01638, 0.01748
        w = motion[["omega1", "omega2", "omega3"]].isel(time=0).to_array().values
        energy = I1 * w[0] ** 2 + I2 * w[1] ** 2 + I3 * w[2] ** 2
        momentum = (I1 * w[0]) ** 2 + (I2 * w[1]) ** 2 + (I3 * w[2]) ** 2
    # Landau and Lifshitz (37.11, 37.12), for L2 above or below 2 E I2
    low, high = (I1, I3) if momentum > energy * I2 else (I3, I1)
    k2 = (I2 - low) * (energy * high - momentum) / ((high - I2) * (momentum - energy * low))
    half = 2 * ellipk(k2) * np.sqrt(I1 * I2 * I3 / ((high - I2) * (momentum - energy * low)))
    # crossings by straight lines between samples, 32 a rotation
    assert crossings[1] - crossings[0] == pytest.approx(half, rel=1e-4)
    assert len(crossings) == 2


# ---------------------------------------------------------------------------------------------------------
# body


def test_body_says_what_the_racket_does(capsys):
    out = " ".join(run_command(capsys, "body", "racket").split())
    # 1/λ and 2π/Ω of Brody's moments at 10 rad s-1, by hand: λ² = 100 (I2 - I1)(I3 - I2)/(I1 I3)
    rate = 10 * np.sqrt(0.01517 * 0.0011 / (0.00121 * 0.01748))
    assert f"grow e-fold in {1 / rate:.4g} s" in out
    assert f"wobble period {2 * np.pi / (10 * np.sqrt(0.01517 * 0.01627 / (0.01638 * 0.01748))):.4g} s" in out
    assert "the body flips every" in out
    assert "flip times are for ε = 1e-06; larger perturbations flip sooner" in " ".join(out.split())
    assert "perturbed by ε = 1e-06 (transverse ω over ω₀)" in out
    assert "axis 2 (usual spin)" in out


def test_body_says_what_people_observed(capsys):
    out = run_command(capsys, "body", "earth")
    assert "303.7 days" in out
    assert "observed: 433 days, Chandler wobble" in out


def test_body_as_json(capsys):
    facts = json.loads(run_command(capsys, "body", "--ratios", 1, 2, 2.5, "--omega0", "-1e+1", "--json"))
    assert facts["omega0"] == -10.0
    assert [axis["regime"] for axis in facts["axes"]] == ["stable_minor", "unstable", "stable_major"]
    assert facts["axes"][1]["e_folding_time"] == pytest.approx(np.sqrt(2.5 / 0.5) / 10, rel=1e-14)
    assert facts["axes"][1]["euler_period"] is None


def test_body_takes_a_tensor_and_a_mesh(tmp_path, capsys):
    trimesh = pytest.importorskip("trimesh")
    tensor = ["2", "-5e-1", "0", "-0.5", "2", "-.1", "0", "-1e-1", "3"]
    facts = json.loads(run_command(capsys, "body", "--tensor", *tensor, "--json"))
    values = np.linalg.eigvalsh([[2, -0.5, 0], [-0.5, 2, -0.1], [0, -0.1, 3]])
    np.testing.assert_allclose(facts["moments"], values, rtol=1e-14)
    trimesh.creation.box((3, 2, 1)).export(tmp_path / "brick.obj")
    out = run_command(capsys, "body", "--mesh", tmp_path / "brick.obj", "--mass", 12, "--unit", "m")
    for line in ("12 kg, 6 m³, 3 × 2 × 1 m, 12 faces", "I1 = 5 kg m²  about x", "I3 = 13 kg m²  about"):
        assert line in out


def test_body_knows_the_bodies_of_ones_own_definition(tmp_path, capsys):
    (tmp_path / "mine.yaml").write_text(
        "bodies: [{name: Brick, tensor: [[5, 0, 0], [0, 13, 0], [0, 0, 10]], omega0: 2.0}]\n"
    )
    out = run_command(capsys, "body", "brick", "--definition", tmp_path / "mine.yaml")
    assert "I2 = 10 kg m²  about z" in out
    assert run_command(capsys, "body", "--definition", tmp_path / "mine.yaml") == "Brick\n"
    assert "Earth\nMoon" in run_command(capsys, "body")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["raket"], "did you mean Tennis racket (Wilson T-2000)?"),
        (["Erath"], "did you mean Earth?"),
        (["qqq"], "is not among the names; allowed: Earth, Moon"),
        (["earth", "--moments", 1, 2, 3], "more than one is given"),
        (["--moments", 1, 2, -3], "body: I3: -3 is out of range"),
        (["--tensor", 1, 2, 0, 2, 1, 0, 0, 0, 1], "body: tensor: "),
        (["--mesh", "none.stl", "--mass", 1], "body: mesh.file: 'none.stl' is not there"),
        (["--mesh", "none.stl"], "body: mesh.density: is missing"),
        (["none.stl"], "body: mesh.density: is missing"),
        (["earth", "--epsilon", 2], "body: epsilon: 2 is out of range"),
        (["earth", "--omega0", 0], "body: omega0: 0 is out of range"),
        (["earth", "--definition", "tiny"], "bodies: is missing"),
        (["earth", "--definition", "bodes"], "did you mean bodies?"),
    ],
)
def test_body_refuses_in_words(capsys, arguments, words):
    assert words in refusal_message(capsys, "body", *arguments)


# ---------------------------------------------------------------------------------------------------------
# check


def test_check_as_json_and_with_axes(tmp_path, capsys):
    (tmp_path / "mine.yaml").write_text(
        "bodies: [{name: Brick, tensor: [[5, 0, 0], [0, 13, 0], [0, 0, 10]], omega0: 2.0}]\n"
    )
    facts = json.loads(run_command(capsys, "check", tmp_path / "mine.yaml", "--json"))
    assert facts["dimensions"] == {"body": 1, "axis": 3, "epsilon": 1, "phase": 1}
    assert facts["bodies"]["Brick"]["moments"] == [5.0, 10.0, 13.0]
    assert np.linalg.det(facts["bodies"]["Brick"]["axes"]) == pytest.approx(1.0)
    assert "I1 = 5 kg m²  about x" in run_command(capsys, "check", tmp_path / "mine.yaml")
    assert json.loads(run_command(capsys, "check", "--list", "--json"))["bodies"] == "Real bodies"


def test_polhode_is_the_same_command(capsys):
    """The console script calls the function of `python -m sweeps`; each names itself in its help."""
    scripts = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())["project"]["scripts"]
    assert EntryPoint("polhode", scripts["polhode"], "console_scripts").load() is command
    assert sweeps.__version__ == version("polhode")
    with pytest.raises(SystemExit) as end:
        main(["--version"])
    assert end.value.code == 0
    assert capsys.readouterr().out == f"Polhode {sweeps.__version__}\n"


@pytest.mark.parametrize("shell", ["bash", "zsh", "tcsh"])
def test_a_shell_gets_its_completion(shell, capsys):
    pytest.importorskip("shtab")
    with pytest.raises(SystemExit) as end:
        main(["--completion", shell])
    assert end.value.code == 0
    script = capsys.readouterr().out
    assert "--trajectory" in script
    if shutil.which(shell):
        subprocess.run([shell, "-n"], input=script, text=True, check=True)


def test_a_place_that_cannot_be_written_is_said_in_one_line(path, tmp_path, capsys):
    (tmp_path / "file").write_text("")
    status = main(
        ["slice", str(path), "--axis", "2", "--omega0", "1", "--epsilon", "1e-6", "-o", str(tmp_path / "file" / "s.nc")]
    )
    assert status == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_pictures_that_are_asked_for_at_a_place_in_a_form_for_print(path, tmp_path, capsys):
    options = ["--format", "svg", "--only", "stability", "--axis", "2", "--at", "omega0=1"]
    lines = run_command(capsys, "figures", path, "-o", tmp_path / "slides", *options).splitlines()
    assert lines[0] == str(tmp_path / "slides/stability_axis_2.svg")
    assert [line.partition(" ")[0] for line in lines[1:]] == ["axis", "omega0"]
    svg = (tmp_path / "slides/stability_axis_2.svg").read_text()
    assert "axis 2" in svg  # in a comment at its letters' curves
    assert [file.name for file in (tmp_path / "slides").iterdir()] == ["stability_axis_2.svg"]


# ---------------------------------------------------------------------------------------------------------
# dimensions that one point has by itself: multipliers, modes, eigenvalues

SPECTRA = {  # system → (its grid, the dimension of the spectrum, a variable along it, number of values)
    "mathieu": ({"a": [0.5, 1.5], "q": [0.1, 0.3]}, "multiplier", "multiplier_real", 2),
    "rotor": ({"spin_rate": [0.5, 1.5], "internal_damping": [0.1, 0.2]}, "eigenvalue", "eigenvalue_imag", 4),
    "double_pendulum": ({"mass1": [1.0, 2.0], "length1": [1.0, 2.0]}, "mode", "frequency", 2),
}


@pytest.mark.compiled
@pytest.mark.parametrize("name", repeated.but(("mathieu",), SPECTRA))
def test_a_point_has_its_whole_spectrum_and_a_slice_keeps_or_chooses(name, tmp_path, capsys):
    grid, dim, variable, count = SPECTRA[name]
    path, out = tmp_path / "map.nc", tmp_path / "slice.nc"
    ds = sweeps.survey({"system": name, "grid": grid})
    storage.write_map(ds, path)
    place = {d: str(ds[d].values[-1]) for d, size in ds.sizes.items() if size > 1 and d != dim}
    options = [word for d, value in place.items() for word in (f"--{d}", value)]
    expected = ds[variable].sel({d: ds[d].values[-1] for d in place}).squeeze()
    facts = json.loads(run_command(capsys, "point", path, *options, "--json"))["variables"][variable]
    np.testing.assert_array_equal(np.array(facts["value"], float), expected.values)
    assert sweeps.point(path, **place)[variable].sizes == {dim: count}
    single_place = {**place, dim: 2}
    assert sweeps.point(path, **single_place)[variable].item() == expected.values[1] or np.isnan(expected.values[1])

    plane = [d for d in place][:2]
    options_of_slice = [word for d in place if d not in plane for word in (f"--{d}", place[d])]
    has_inner_dim = dim == "multiplier"  # an inner dimension of single variables, not a dimension of the map
    words = run_command(
        capsys, "slice", path, *options_of_slice, *([] if has_inner_dim else [f"--{dim}", "2"]), "-o", out
    )
    with xr.open_dataset(out) as slice_map:
        assert set(slice_map[variable].dims) == {*plane, *([dim] if has_inner_dim else [])}
    assert (f"{variable}" in words and f"--{dim} VALUE" in words) == has_inner_dim
    run_command(capsys, "slice", path, *options_of_slice, f"--{dim}", "2", "-o", out)
    with xr.open_dataset(out) as slice_map:
        assert set(slice_map[variable].dims) == {*plane}
        at = {d: ds[d].values[-1] for d in place if d not in plane} | {dim: 2}
        np.testing.assert_array_equal(
            slice_map[variable], ds[variable].sel(at).squeeze().transpose(*slice_map[variable].dims)
        )


@pytest.mark.parametrize("tool", [["cdo", "-s", "infon", "-selname,growth_rate"], ["ncks", "-m", "-v", "growth_rate"]])
@pytest.mark.parametrize("of_bodies", [False, True])
def test_other_programs_open_a_slice(path, bodies, tmp_path, capsys, tool, of_bodies):
    if shutil.which(tool[0]) is None:
        pytest.skip(f"{tool[0]} is not here")
    out = tmp_path / "slice.nc"
    place = [bodies] if of_bodies else [path, "--omega0", 1, "--epsilon", 1e-6]
    run_command(capsys, "slice", *place, "--axis", 2, "-o", out)
    answer = subprocess.run([*tool, out], capture_output=True, text=True, check=False)
    assert answer.returncode == 0
    assert "growth_rate" in answer.stdout
