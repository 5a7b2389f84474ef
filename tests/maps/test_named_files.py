"""Files that a map names: none of them is run or read, whatever is done with the map."""

import damages
import pytest
import repeated
from maps import BODIES

import sweeps
from sweeps.__main__ import main
from sweeps.maps import storage
from sweeps.systems.rigid_body import fits

TOLD = {"name": "Tennis racket", "axis": 1, "observed": {"period_days": 1.0, "what": "a wobble"}}


@pytest.fixture(scope="module")
def bodies():
    return sweeps.survey(BODIES).load()


@pytest.fixture(scope="module")
def pendulum():
    return sweeps.survey({"system": "pendulum", "grid": {"length": [0.5, 1.0]}}).load()


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Return a folder with a Python file that describes a system and leaves a mark when it is run."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "evil.py").write_text(
        "from pathlib import Path\n"
        f"Path({str(tmp_path / 'mark')!r}).write_text('run')\n"
        "from sweeps.mechanics import System\n"
        "system = System('Evil')\n"
        "x = system.coordinate('x', 'm', bounds=(-1, 1))\n"
        "system.particle(1.0, (x,))\n"
        "system.potential(x**2)\n"
    )
    return tmp_path


def write_named_map(ds, folder, system, definition):
    """Write a map with these attributes and return its path."""
    storage.write_map(ds.assign_attrs(system=system, definition=definition), folder / "map.nc")
    return str(folder / "map.nc")


@pytest.mark.usefixtures("few_frames")
@pytest.mark.parametrize("place", ["definition", "system"])
@pytest.mark.parametrize("door", repeated.but(("show", "point --trajectory"), damages.COMMANDS))
def test_a_python_file_that_a_map_names_is_not_run(bodies, pendulum, folder, capsys, door, place):
    evil = folder / "evil.py"
    if place == "system":
        write_named_map(pendulum, folder, str(evil), f"system: {evil}\ngrid: {{}}\n")
    else:
        definition = f"system: {evil}\nbodies: [{TOLD}]\ngrid: {{}}\n".replace("'", '"')
        write_named_map(bodies, folder, "rigid_body", definition)
    sweeps.open_map("map.nc").close()
    # a motion is refused without a known system
    some_pictures = ["--only", "theory_against_measured"] if door == "figures" else []
    status = main(damages.commands("map.nc")[door] + some_pictures)
    output = capsys.readouterr()
    assert status == (2 if (door, place) == ("point --trajectory", "system") else 0), output
    assert door != "verify" or "run only where --definition names it" in " ".join(output.out.replace("│", "").split())
    assert not (folder / "mark").exists()


@pytest.mark.parametrize("entry", ["7", "{period_days: -1.0, what: x}", "{period_days: 2.0, what: [1]}", "[1, 2]"])
def test_what_a_map_says_was_observed_may_be_anything(bodies, entry):
    definition = f"bodies: [{{name: Tennis racket, axis: 1, observed: {entry}}}, 3, {{name: [1]}}]"
    assert fits.compare_periods(bodies.assign_attrs(definition=definition)) == []
