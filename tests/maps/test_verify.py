import itertools
import shutil
import tracemalloc
from pathlib import Path
from types import SimpleNamespace

import netCDF4
import numpy as np
import pytest
import repeated
import xarray as xr
from maps import BODIES, write

import sweeps
from sweeps.__main__ import main
from sweeps.maps import verify
from sweeps.points import catalogue
from sweeps.points.loading import read_sweep
from sweeps.reading.definitions import plain, read_text
from sweeps.shards import content_hash

TINY = read_sweep(catalogue.shipped_files()["tiny"])
TOP = {"system": "symmetric_top", "grid": {"ratio": [0.5, 1.0, 1.7], "omega3": [-2.0, 1.0], "half_angle": 30.0}}
PENDULUM = {"system": "pendulum", "grid": {"length": [0.5, 1.0]}}  # its equations are derived where they are needed
COLLAPSED = {"grid": {"I1": [1.0, 2.0], "I2": 3.0, "I3": 4.0, "omega0": [1.0, 2.0]}, "integration": {"collapse": True}}


@pytest.fixture(scope="module")
def tiny_map(tmp_path_factory):
    return write(tmp_path_factory.mktemp("whole"), "tiny")


@pytest.fixture
def tiny(tiny_map, tmp_path):
    return Path(shutil.copy(tiny_map, tmp_path / "map.nc"))


def with_valid_hashes(path):
    """The file with hashes that are right again, as a forger would leave it."""
    with netCDF4.Dataset(path, "a") as file:
        file.set_auto_maskandscale(False)
        digest = content_hash.ContentHash()
        for name, variable in file.variables.items():
            digest.declare(name, variable.dimensions, variable.shape, variable.dtype)
            digest.update(name, variable[:])
        for name, digest_of in digest.digests().items():
            file[name].sha256 = digest_of
        file.content_hash = digest.hexdigest()
    return path


def findings(path, **options):
    """Return check's name → its findings."""
    return {check.name: check.findings for check in verify.verify(path, **options) if check.findings}


@pytest.mark.parametrize("definition", repeated.but(["tiny"], ["tiny", TOP, PENDULUM, COLLAPSED]))
def test_a_whole_map_holds(definition, tmp_path, capsys):
    write(tmp_path, definition, "stability_map.nc")
    assert main(["verify", str(tmp_path), "--points", "30"]) == 0
    output = capsys.readouterr()
    assert "differs" not in output.out
    assert "Traceback" not in output.err


def test_a_map_that_is_read_in_blocks_holds(tiny_map, monkeypatch):
    monkeypatch.setattr(verify, "BLOCK_POINTS", 100)  # the map has 864 points
    assert findings(tiny_map, points=30) == {}


def test_it_says_which_variable_differs(tiny, capsys):
    with netCDF4.Dataset(tiny, "a") as file:
        values = file["growth_rate"][:]
        values.reshape(-1)[9] = np.nextafter(values.reshape(-1)[9], np.inf)
        file["growth_rate"][:] = values
    assert main(["verify", str(tiny), "--points", "0"]) == 1
    assert "growth_rate: holds other values than were written" in capsys.readouterr().out


def shift(path, by):
    with netCDF4.Dataset(path, "a") as file:
        spin = file["omega0"][:][:, None, None]
        file["omega_squared"][:] = file["omega_squared"][:] + by * spin**2
    return with_valid_hashes(path)


ROTOR = {"system": "rotor", "grid": {"spin_rate": [0.5, 2.0, 4.5], "internal_damping": 0.1, "stiffness_y": 1.5}}


@pytest.fixture(scope="module")
def rotor(tmp_path_factory):
    path = write(tmp_path_factory.mktemp("rotor"), ROTOR)
    with netCDF4.Dataset(path, "a") as file:
        file.kernel_fingerprint = "0" * 64
    return path


@pytest.mark.slow
def test_eigenvalues_of_other_kernels_are_those_of_lapack_and_of_scipy(rotor):
    checks = verify.verify(rotor, points=40, any_kernels=True)
    assert not any(check.findings for check in checks)
    eigenvalue_checks = [check for check in checks if check.name in ("LAPACK", "SciPy DOP853")]
    assert len(eigenvalue_checks) == 12  # two parts, growth and three invariants, by theory and as measured
    assert not any(check.skip_reason for check in eigenvalue_checks)


WAYS = {name: "LAPACK" for name in ("eigenvalue_imag_theory", "growth_rate_theory", "discriminant_theory")}
WAYS |= {"product_of_squares": "LAPACK", "eigenvalue_real": "SciPy DOP853", "growth_rate": "SciPy DOP853"}


@pytest.mark.slow
@pytest.mark.parametrize("name", WAYS)
def test_wrong_eigenvalues_of_other_kernels_are_found(rotor, tmp_path, name):
    path = Path(shutil.copy(rotor, tmp_path / "map.nc"))
    with netCDF4.Dataset(path, "a") as file:
        file[name][:] = file[name][:] + 1e-5
    found_lines = findings(with_valid_hashes(path), points=40, any_kernels=True)
    assert found_lines[WAYS[name]][0].startswith(f"{name} at point")


def test_a_copy_with_text_stored_character_by_character_holds(tmp_path):
    """The classic model has no text: netCDF's library adds a dimension of the names' characters."""
    with xr.open_dataset(write(tmp_path, BODIES)) as ds:
        ds.to_netcdf(tmp_path / "copy.nc", format="NETCDF4_CLASSIC")
    with netCDF4.Dataset(tmp_path / "copy.nc") as file:
        assert len(file["body"].dimensions) == 2
    assert findings(tmp_path / "copy.nc", points=2) == {}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["spin_rate", "x_equilibrium"])
def test_other_units_of_what_a_description_names_are_found(rotor, tmp_path, name):
    path = Path(shutil.copy(rotor, tmp_path / "map.nc"))
    with netCDF4.Dataset(path, "a") as file:
        file[name].units = "furlong"
    assert findings(path, points=1)["attributes"][0].startswith(f"{name}: units is 'furlong', by the definition ")


ATTRIBUTES = {  # (variable, "" for the file; attribute; value) → finding
    ("", "title", "Something else"): "(file): title is 'Something else', by the definition 'One example of each",
    ("", "source", "Another program 1.0"): "(file): source is 'Another program 1.0', by the definition \"Polhode",
    ("", "references", "Newton"): "(file): references is 'Newton'",
    ("omega_squared", "valid_max", 0.5): "omega_squared: valid_max is '0.5', by the definition there is none",
    ("omega_squared", "long_name", "speed"): "omega_squared: long_name is 'speed', by the definition 'Ω²",
    ("growth_rate", "ancillary_variables", "status"): "growth_rate: ancillary_variables is 'status'",
    ("status", "comment", "all is well"): "status: comment is 'all is well'",
    ("I1", "valid_min", 0.7): "I1: valid_min is '0.7', by the definition there is none",
    ("I1", "long_name", None): "I1: long_name is missing",
}


def test_changed_attributes_are_found(tiny, monkeypatch):
    monkeypatch.setattr(verify, "MAX_LISTED", len(ATTRIBUTES))
    with netCDF4.Dataset(tiny, "a") as file:
        for name, attribute, value in ATTRIBUTES:
            holder = file[name] if name else file
            holder.delncattr(attribute) if value is None else holder.setncattr(attribute, value)
    lines = findings(tiny, points=0)["attributes"]
    assert len(lines) == len(ATTRIBUTES)
    assert all(any(line.startswith(words) for line in lines) for words in ATTRIBUTES.values())


def test_wrong_rates_of_other_kernels_are_found_by_scipy_and_by_the_closed_form(tiny):
    """tolerance 1e-10 and h = 2π/16 allow 8 · 1.01e-10/h² = 5.2e-9 of ω0²: twice that is found at every point."""
    with netCDF4.Dataset(tiny, "a") as file:
        file.kernel_fingerprint = "0" * 64
    assert findings(tiny, points=20, any_kernels=True) == {}
    assert set(findings(tiny, points=0)) == {"kernels"}
    lines_by_check = findings(shift(tiny, 1.1e-8), points=20, any_kernels=True)
    assert set(lines_by_check) == {"SciPy DOP853", "closed form", "errors"}
    assert all(" more" in lines[-1] for lines in lines_by_check.values())


def test_wrong_precession_is_found(tmp_path):
    path = write(tmp_path, TOP)
    with netCDF4.Dataset(path, "a") as file:
        file.kernel_fingerprint = "0" * 64
        file["precession_rate"][:] = file["precession_rate"][:] * (1 + 1e-9)
    assert set(findings(with_valid_hashes(path), any_kernels=True)) == {"SciPy DOP853", "closed form", "errors"}


def test_another_definition_is_recognised(tiny_map, tmp_path, capsys):
    second_definition = plain(read_text(TINY.definition.text)) | {"axes": [1, 2, 3], "integration": {"rotations": 5}}
    differences = findings(tiny_map, expected_sweep=read_sweep(second_definition), points=0)
    assert differences == {"definition": ("definition: another integration than sweep's",)}
    same_sweep = read_sweep(plain(read_text(TINY.definition.text)) | {"shards": 7})
    assert not findings(tiny_map, expected_sweep=same_sweep, points=0)
    folder = tmp_path / "results" / "breakdown"
    folder.mkdir(parents=True)
    shutil.copy(tiny_map, folder / "stability_map.nc")
    assert main(["verify", str(folder), "--points", "2"]) == 1
    assert "definition: another grid than breakdown's" in " ".join(capsys.readouterr().out.split())


def test_a_definition_that_was_swapped_is_found(tiny):
    with netCDF4.Dataset(tiny, "a") as file:
        file.definition = TINY.definition.text.replace("2.5]                  # kg", "2.6]  # kg")
    assert findings(tiny)["grid"] == ("I1: has other values than the definition's",)
    with netCDF4.Dataset(tiny, "a") as file:
        file.definition = TINY.definition.text.replace("num: 4", "num: 5")
    assert "5 I2" in findings(tiny)["grid"][0]


def test_points_that_were_never_written_are_found(tiny):
    with netCDF4.Dataset(tiny, "a") as file:
        file["omega_squared"][1, 2] = np.nan
        file["regime"][0, 0, 0, 0, 0] = 9
    lines = findings(with_valid_hashes(tiny), points=0)["values"]
    assert "regime: 2 flags without a meaning" in lines
    assert f"omega_squared: {4 * 3 * 3 * 2} points" in lines[1]


# Files that mean harm: no traceback, nothing run


def rebuilt(path, change):
    with xr.open_dataset(path, decode_times=False) as ds:
        ds = change(ds.load()).drop_encoding()
    ds.to_netcdf(path)


HOSTILE = {
    "no variable": (2, lambda ds: ds.drop_vars("omega_squared")),
    "no coordinate": (2, lambda ds: ds.drop_vars("I1")),
    "NaN everywhere": (1, lambda ds: ds.map(lambda v: v * np.nan if v.dtype.kind == "f" else v)),
    "other dimensions": (2, lambda ds: ds.transpose(..., "axis")),
    "renamed dimension": (2, lambda ds: ds.rename_dims(I1="J1")),
    "a part": (1, lambda ds: ds.isel(I1=slice(0, 2))),
    "text for numbers": (2, lambda ds: ds.assign(omega_squared=ds.omega_squared.astype(str).astype(object))),
    "no points": (2, lambda ds: ds.isel(I1=slice(0, 0))),
    "another variable": (1, lambda ds: ds.assign({"a b": ds.status})),
    "explosive definition": (1, lambda ds: ds.assign_attrs(definition="a: &a [1,1]\nb: &b [*a,*a]\nc: [*b,*b]\n")),
    "huge grid": (
        1,
        lambda ds: ds.assign_attrs(definition=TINY.definition.text.replace("num: 4", "num: 9007199254740992")),
    ),
    "own hash of another type": (1, lambda ds: ds.assign(regime=ds.regime.assign_attrs(sha256=[1, 2]))),
}


def test_what_is_computed_from_a_map_carries_no_hash_that_certifies_it(tiny, tmp_path, capsys):
    """xarray's arithmetic keeps attributes, and not the encoding; a written result keeps `content_hash`."""
    with sweeps.open_map(tiny) as ds:
        assert len(ds.growth_rate.encoding["sha256"]) == 64
        assert all("sha256" not in variable.attrs for variable in ds.variables.values())
        rate = ds.growth_rate
        for computed in (ds * 2, rate * 2, -rate, np.abs(rate), rate**2, ds.mean("I1"), ds.where(ds.status > 9)):
            variables = computed.data_vars.values() if isinstance(computed, xr.Dataset) else [computed]
            assert all("sha256" not in variable.attrs | variable.encoding for variable in variables)
        ds.assign(growth_rate=ds.growth_rate * 2).to_netcdf(tmp_path / "changed.nc")
        ds.to_netcdf(tmp_path / "same.nc")
    assert main(["verify", str(tmp_path / "changed.nc"), "--points", "0"]) == 1
    assert "content_hash: is not that of what the file holds" in capsys.readouterr().out
    assert main(["verify", str(tmp_path / "same.nc"), "--points", "0"]) == 0
    for path in ("changed.nc", "same.nc"):
        with netCDF4.Dataset(tmp_path / path) as file:
            assert all("sha256" not in variable.ncattrs() for variable in file.variables.values())


QUICK = ("no coordinate", "NaN everywhere", "explosive definition")


@pytest.mark.parametrize("name", repeated.but(QUICK, HOSTILE))
def test_a_hostile_map_is_told_apart_in_words(tiny, capsys, name):
    status, change = HOSTILE[name]
    rebuilt(tiny, change)
    assert main(["verify", str(tiny), "--points", "5"]) == status
    output = capsys.readouterr()
    assert "Traceback" not in output.out + output.err
    assert "\x1b[31m" not in output.out + output.err
    assert len(output.out + output.err) < 5000


@pytest.mark.parametrize("number", ["-1", "1000000000"])
def test_numbers_out_of_range_are_refused(tiny_map, capsys, number):
    assert main(["verify", str(tiny_map), "--points", number]) == 2
    assert f"--points: {number} is out of range; allowed: 0 to 100,000" in capsys.readouterr().err


def test_runs_of_a_thousand_million_samples_are_not_made_again(tiny, capsys):
    """A map may declare runs of that length: checks that would take minutes are skipped, and reported."""
    path = tiny
    definition = plain(read_text(TINY.definition.text))
    long = definition | {"integration": {"rotations": 62_500_000, "samples_per_rotation": 16}}
    with netCDF4.Dataset(path, "a") as file:
        file.definition = read_sweep(long).definition.text
    tracemalloc.start()
    checks = {check.name: check for check in verify.verify(path)}
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 2e8  # bytes; the times of one such run alone take 8e9
    assert checks["this project's kernels"].skip_reason == "a run of 1,000,000,000 samples takes more than 60 s"
    assert checks["SciPy DOP853"].skip_reason.startswith("no run of the sample is short enough")
    assert not any(check.findings for check in checks.values())
    assert main(["verify", str(path), "--points", "2"]) == 0
    assert "1,000,000,000" in capsys.readouterr().out


def test_a_check_ends_when_its_time_is_over(tiny_map, monkeypatch):
    """By a clock that goes 40 s further each time it is read: each part after the first finds the time over."""
    monkeypatch.setattr(verify, "time", SimpleNamespace(monotonic=itertools.count(0.0, 40.0).__next__))
    monkeypatch.setattr(type(TINY.system), "samples_per_second", 2048)  # a second's work is half a block
    checks = {check.name: check for check in verify.verify(tiny_map, points=100)}
    assert checks["this project's kernels"].covers.endswith("; 64 of them, no more in 60 s")
    assert checks["closed form"].covers.startswith("2 points")
    assert checks["SciPy DOP853"].covers.endswith("; no more in 60 s")
    assert not any(check.findings or check.skip_reason for check in checks.values())
