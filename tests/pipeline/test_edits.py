"""A definition that is edited, replaced, cut short or deleted while it is run: every map states its own."""

import json
import random
from functools import cache
from pathlib import Path

import pytest

import sweeps
from sweeps.__main__ import main
from sweeps.pipeline import run as pipeline
from sweeps.pipeline import up_to_date
from sweeps.points import catalogue
from sweeps.schema.refusals import RefusedError
from sweeps.shards import merging

GRID = {"I1": [0.5, 1.0], "I2": 0.75, "I3": 1.0, "omega0": 1.0}
MINE = {"grid": GRID, "axes": [2], "shards": 2, "integration": {"variables": ["omega_squared", "status"]}}
TEXT = json.dumps(MINE)
MINE_PATH, MAP = Path("mine.yaml"), Path("results/mine/stability_map.nc")


def replace_definition(text):
    Path("other.yaml").write_text(text)
    Path("other.yaml").replace(MINE_PATH)


DAMAGES = {
    "edited": lambda rng: MINE_PATH.write_text(TEXT.replace("0.75", f"0.7{rng.randrange(3)}")),
    "a comment more": lambda rng: MINE_PATH.write_text(f"# {rng.randrange(3)}\n{TEXT}"),
    "replaced": lambda rng: replace_definition(json.dumps(MINE | {"shards": rng.choice([1, 3])})),
    "other points": lambda rng: replace_definition(TEXT.replace("0.5, 1.0", f"0.5, 0.9, 1.{rng.randrange(3)}")),
    "truncated": lambda rng: MINE_PATH.write_text(TEXT[: rng.randrange(len(TEXT))]),
    "deleted": lambda rng: MINE_PATH.unlink(missing_ok=True),
}


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(pipeline, "_write_views", lambda *_: None)


@cache
def content_hash(text):
    return sweeps.survey(json.loads(text.partition("\n")[2] if text.startswith("#") else text)).attrs["content_hash"]


def stated_definition():
    """Return the definition that the map states, and check that the map has its content; None without a map."""
    if not MAP.exists():
        return None
    with sweeps.open_map(MAP) as ds:
        assert ds.attrs["content_hash"] == content_hash(ds.attrs["definition"])
        return ds.attrs["definition"]


def with_damage(function, moment, rng):
    """A function, with damage to the definition before or after it."""

    def edits(*args, **options):
        damage = DAMAGES[rng.choice([*DAMAGES])]
        if moment == "before":
            damage(rng)
        try:
            return function(*args, **options)
        finally:
            if moment == "after":
                damage(rng)

    return edits


STEPS = [
    (catalogue, "plan_sweep"),
    (pipeline, "measure_map"),
    (pipeline, "write_shard"),
    (merging, "merge_shards"),
    (merging, "_merge_once"),
    (up_to_date, "find_outdated"),
    (up_to_date, "record"),
]


def run():
    """Exit status of `run`."""
    return main(["run", "mine.yaml", "--cores", "1"])


@pytest.mark.parametrize("number", [2, pytest.param(200, marks=pytest.mark.faults)])
def test_a_run_makes_the_map_of_the_definition_that_it_states(number, monkeypatch):
    rng = random.Random(number)
    for _ in range(number):
        MINE_PATH.write_text(TEXT)
        if rng.random() < 0.3 and MAP.exists():
            MAP.unlink()
        with monkeypatch.context() as patch:
            where, name = rng.choice(STEPS)
            patch.setattr(where, name, with_damage(getattr(where, name), rng.choice(["before", "after"]), rng))
            assert run() in (0, 2)
        stated_definition()
        now = MINE_PATH.read_text() if MINE_PATH.exists() else TEXT
        if run() == 0:
            assert stated_definition() == now
        MINE_PATH.write_text(TEXT)
        assert run() == 0
        assert stated_definition() == TEXT


def jobs():
    """Return the jobs that the workflow plans for its definition: functions that return an exit status."""
    sweep = catalogue.plan_sweep(MINE_PATH).sweep
    digest, shards = ["--digest", sweep.definition.digest], Path("results/mine/shards")
    for k in range(1, sweep.shards + 1):
        words = ["shard", "mine.yaml", str(k), str(sweep.shards), "-o", str(shards / f"{k}-of-{sweep.shards}.nc")]
        yield lambda words=words: main([*words, *digest])
    yield lambda: main(["merge", "--renew", "mine.yaml", str(shards), "-o", str(MAP), *digest])


@pytest.mark.parametrize("number", [5, pytest.param(200, marks=pytest.mark.faults)])
def test_a_workflow_makes_the_map_of_the_definition_that_it_planned(number, capsys):
    rng = random.Random(number)
    for _ in range(number):
        MINE_PATH.write_text(TEXT)
        MAP.unlink(missing_ok=True)
        plan = list(jobs())
        at = rng.randrange(len(plan) + 1)
        statuses = []
        for k, job in enumerate(plan):
            if k == at:
                DAMAGES[rng.choice([*DAMAGES])](rng)
                if rng.random() < 0.2:
                    MINE_PATH.write_text(TEXT)  # put back
            statuses.append(job())
            if statuses[-1]:
                assert statuses[-1] == 2
                assert "allowed" in capsys.readouterr().err
                break
        assert stated_definition() == (TEXT if statuses == [0] * len(plan) else None)


def test_a_definition_that_was_edited_is_refused_in_words():
    MINE_PATH.write_text(TEXT)
    digest = catalogue.plan_sweep(MINE_PATH).sweep.definition.digest
    MINE_PATH.write_text(TEXT + "\n")
    with pytest.raises(RefusedError, match="was changed while the workflow ran; allowed: the same until the end"):
        catalogue.plan_sweep(MINE_PATH, digest=digest)
