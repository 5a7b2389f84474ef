"""Files that a map names: none of them is run or read, whatever is done with the map."""

import numpy as np
import pytest
import repeated
from maps import BODIES

import sweeps
from sweeps.__main__ import main
from sweeps.maps import storage

TOLD = {"name": "Tennis racket", "axis": 1, "observed": {"period_days": 1.0, "what": "a wobble"}}
DOORS = {
    "show": lambda path: ["show", path],
    "show --json": lambda path: ["show", path, "--json"],
    "point": lambda path: ["point", path, "--axis", "2", "--body", "plate", "--epsilon", "1e-6"],
    "trajectory": lambda path: [*DOORS["point"](path), "--trajectory", "t.csv"],
    "slice": lambda path: ["slice", path, "--epsilon", "1e-6", "-o", "s.nc"],
    "report": lambda path: ["report", path, "-o", "report.html"],
    "figures": lambda path: ["figures", path, "-o", "figures"],
    "verify": lambda path: ["verify", path, "--points", "3"],
}


@pytest.fixture(scope="module")
def bodies():
    return sweeps.survey(BODIES).load()


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with a Python file that leaves a mark where it is run, and describes a system besides."""
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


def written(ds, folder, system, definition):
    """The path of a map whose attributes say these."""
    storage.write_map(ds.assign_attrs(system=system, definition=definition), folder / "map.nc")
    return str(folder / "map.nc")


@pytest.mark.usefixtures("few_frames")
@pytest.mark.parametrize("door", repeated.but(("trajectory",), DOORS))
def test_a_python_file_that_the_definition_in_a_map_names_is_not_run(bodies, folder, capsys, door):
    evil = folder / "evil.py"
    path = written(bodies, folder, "rigid_body", f"system: {evil}\nbodies: [{TOLD}]\ngrid: {{}}\n".replace("'", '"'))
    sweeps.open_map(path).close()
    assert main(DOORS[door](path)) == 0, capsys.readouterr()  # `verify` says that it looked at the content alone
    assert not (folder / "mark").exists()


@pytest.mark.usefixtures("few_frames")
@pytest.mark.parametrize("door", repeated.but(("show",), DOORS))
def test_a_python_file_that_a_map_names_as_its_system_is_not_run(folder, capsys, door):
    evil = folder / "evil.py"
    ds = sweeps.survey({"system": "pendulum", "grid": {"length": [0.5, 1.0]}})
    path = written(ds, folder, str(evil), f"system: {evil}\ngrid: {{}}\n")
    sweeps.open_map(path).close()
    asked = DOORS[door](path)
    if door in ("point", "trajectory"):
        asked = [*asked[:2], "--length", "1", "--equilibrium", "upright", *asked[8:]]
    elif door == "slice":
        asked = [*asked[:2], *asked[4:]]
    # a motion is refused; `verify` finds that the definition cannot be followed, and says so
    assert main(asked) == {"trajectory": 2}.get(door, 0), capsys.readouterr()
    assert not (folder / "mark").exists()


@pytest.mark.parametrize("observed", ["7", "{period_days: -1.0, what: x}", "{period_days: 2.0, what: [1]}", "[1, 2]"])
def test_what_a_map_says_was_observed_may_be_anything(bodies, observed):
    definition = f"bodies: [{{name: Tennis racket, axis: 1, observed: {observed}}}, 3, {{name: [1]}}]"
    from sweeps.systems.rigid_body import fits

    assert fits.periods(bodies.assign_attrs(definition=definition)) == []


def test_what_a_map_says_was_observed_is_told(bodies, folder):
    from sweeps.systems.rigid_body import fits

    definition = f"bodies: [{TOLD}]".replace("'", '"')
    with storage.open_map(written(bodies, folder, "rigid_body", definition)) as ds:
        (period,) = fits.periods(ds)
    assert (period.body, period.axis, period.observed_days, period.what) == ("Tennis racket", 1, 1.0, "a wobble")
    assert np.isfinite(period.measured_days)
