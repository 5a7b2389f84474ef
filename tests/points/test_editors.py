"""JSON Schema of definitions, against a validator that is not ours."""

import json
from functools import cache

import jsonschema
import pytest
import repeated
from ruamel.yaml import YAML

from sweeps import systems
from sweeps.__main__ import main
from sweeps.points import catalogue, loading
from sweeps.schema.refusals import RefusedError

SHIPPED = catalogue.shipped_files()
QUICK = ("tiny", "bodies", "cubesats", "symmetric", "twist", "tumblers")
SLOW = ("breakdown", "dimorphos", "mathieu", "pendulum", "pumped_shapes", "rotor", "shapes", "tumbling")


@cache
def validator(*described):
    schema = loading.json_schema(described)
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


def schema_errors(definition, *described):
    return list(validator(*described).iter_errors(definition))


@pytest.mark.parametrize("name", repeated.but(QUICK, QUICK + SLOW))
def test_what_ships_is_valid(name):
    definition = json.loads(json.dumps(YAML(typ="safe", pure=True).load(SHIPPED[name].read_text())))
    system = definition.get("system")
    assert not schema_errors(definition, *([system] if system and system not in systems.MODULES else []))


def test_mistakes_are_marked():
    grid = {"I1": 1.0, "I2": 2.0, "I3": 2.5, "omega0": 1.0}
    assert not schema_errors({"grid": grid})
    assert schema_errors({"grid": grid, "shard": 2})
    assert schema_errors({"grid": "everything"})
    assert schema_errors({"system": "symmetric_top", "grid": grid, "axes": [1]})


def test_a_system_that_is_none_is_refused_with_a_near_one():
    with pytest.raises(RefusedError, match="did you mean pendulum"):
        loading.json_schema(["pendulumm"])


def test_the_command_writes_what_editors_read(tmp_path, capsys):
    path = tmp_path / "polhode.schema.json"
    assert main(["schema", "-o", str(path)]) == 0
    assert main(["schema"]) == 0
    assert json.loads(path.read_text()) == json.loads(capsys.readouterr().out)
