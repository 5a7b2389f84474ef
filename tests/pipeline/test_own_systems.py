"""A user's own system outside the tree: every command, for each form that eigenvalues or multipliers describe."""

import json

import own_systems
import pytest
import repeated
from maps import random_map

import sweeps
from sweeps import systems
from sweeps.__main__ import main
from sweeps.maps import storage
from sweeps.systems.periodic.system import Periodic
from sweeps.systems.relative_equilibrium.system import RelativeEquilibrium

NAMES = list(own_systems.SYSTEMS)
KINDS = {"driven": (Periodic, {"tongues_swinging", "theory_against_measured"})}
EQUILIBRIUM_SYSTEM = RelativeEquilibrium, {"stability", "theory_against_measured"}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    systems.resolve.cache_clear()
    return tmp_path


def first_place(ds, names):
    """Options --NAME VALUE at the first place of some dimensions."""
    return [text for name in names for text in (f"--{name}", str(ds[name].values[0]))]


@pytest.mark.slow
@pytest.mark.parametrize("name", repeated.but(("driven",), NAMES))
def test_a_map_of_a_users_own_system_is_read_by_every_command(folder, name, capsys):
    path = folder / "map.nc"
    storage.write_map(random_map(own_systems.write(folder, name)), path)
    with sweeps.open_map(path) as ds:
        kind, figures = KINDS.get(name, EQUILIBRIUM_SYSTEM)
        assert type(systems.of_map(ds)) is kind
        long = [dim for dim in ds["regime"].dims if ds.sizes[dim] > 1]
        point, plane = first_place(ds, long), first_place(ds, long[2:])
    for command in (
        ["show", str(path)],
        ["show", str(path), "--json"],
        ["point", str(path), *point],
        ["slice", str(path), *plane, "-o", "slice.nc"],
        ["figures", str(path), "-o", "figures", "--only", min(figures)],
        ["report", str(path), "-o", "report.html"],
        ["verify", str(path)],
    ):
        assert main(command) == 0, capsys.readouterr()
    assert main(["show", "slice.nc", "--json"]) == 0
    output = capsys.readouterr()
    assert output.err == ""
    assert json.loads(output.out[output.out.rindex("\n{") :])["system"] == f"{name}.py"
