import contextlib
import json
import multiprocessing
import os
import shlex
import signal
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from types import SimpleNamespace

import numpy as np
import pytest
from calls import refused

import sweeps
from sweeps import __main__
from sweeps.__main__ import main
from sweeps.commands import program
from sweeps.schema.refusals import DefinitionError

GOOD = "grid: {I1: 1.0, I2: 2.0, I3: [2.5, 3.0], omega0: 1.0}\n"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "good.yaml").write_text(GOOD)
    return tmp_path


def test_check_says_what_a_good_definition_takes(folder, capsys):
    assert main(["check", "good.yaml"]) == 0
    said = capsys.readouterr()
    assert said.err == ""
    assert "good.yaml: valid" in said.out
    assert "6 = 3 axis × 1 I1 × 1 I2 × 2 I3 × 1 omega0 × 1 epsilon × 1 phase" in said.out
    assert [p.name for p in folder.iterdir()] == ["good.yaml"]


def test_check_lists_what_ships(capsys):
    assert main(["check", "--list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    at = lines[0].index("system")
    assert all(line[at - 1] == " " for line in lines)  # in columns
    named = {line.split()[0]: line.split() for line in lines[1:] if not line.startswith(" ")}
    assert named["tiny"][1:3] == ["rigid_body", "864"]
    names = list(named)
    assert {"bodies", "breakdown", "symmetric", "tennis_racket", "tiny", "bead_on_hoop"} <= set(names)
    assert names == sorted(names)
    assert main(["check"]) == 0
    assert "tennis_racket.yaml: valid" in capsys.readouterr().out


def test_a_gigantic_grid_is_refused_with_its_bytes(folder, capsys):
    """`check` only says so: a sweep for a cluster is checked on a laptop."""
    long = "{start: 1.0, stop: 2.0, num: 1000000}"
    (folder / "huge.yaml").write_text(f"grid: {{I1: {long}, I2: {long}, I3: {long}, omega0: 1.0}}")
    said = refused(capsys, "run", "huge.yaml")
    assert "3,000,000,000,000,000,000 points" in said
    assert "of disk" in said
    assert said.count(" bytes)") == 2  # needed, and free
    assert main(["check", "huge.yaml"]) == 0
    checked = capsys.readouterr().out
    assert "not here    huge: grid: 3,000,000,000,000,000,000 points need " in checked
    assert "refuse it on this machine" in checked
    assert "years on one core, figures and report included" in checked
    assert main(["check", "huge.yaml", "--json"]) == 0
    assert "of disk" in json.loads(capsys.readouterr().out)["lacking_here"][0]
    assert not (folder / "results").exists()


def test_an_unknown_name_suggests_a_near_one(folder, capsys):
    for text in ("tenis_racket", "tenis", "raket"):
        assert "did you mean tennis_racket?" in refused(capsys, "check", text)
        with pytest.raises(DefinitionError, match=r"did you mean tennis_racket\?"):
            sweeps.survey(text)
    far = refused(capsys, "check", "zzz")
    assert "did you mean" not in far
    assert "tiny, tumblers, tumbling, twist, viscous_slug, or the path of a YAML file" in far


@pytest.mark.parametrize(
    ("numbers", "word"),
    [
        (("0", "2"), "K: part 0"),
        (("3", "2"), "K: part 3"),
        (("-1", "2"), "K: part -1"),
        (("1", "0"), "N: 0 parts"),
        (("1", "7"), "N: 7 parts"),
        (("1", "2", "--threads", "0"), "--threads: 0"),
    ],
)
def test_shard_refuses_numbers_out_of_range(folder, capsys, numbers, word):
    said = refused(capsys, "shard", "good.yaml", "-o", "a.nc", *numbers)
    assert said.startswith(word)
    assert "out of range" in said
    assert not (folder / "a.nc").exists()


def test_shard_and_merge_make_the_map(folder, capsys):
    for number in (1, 2):
        assert main(["shard", "good.yaml", str(number), "2", "-o", f"{number}.nc"]) == 0
    assert "shard 2 of 2: 3 of 3 points" in capsys.readouterr().err
    assert "missing" in refused(capsys, "merge", "good.yaml", "2.nc", "-o", "map.nc")
    assert "given twice" in refused(capsys, "merge", "good.yaml", "1.nc", "2.nc", "2.nc", "-o", "map.nc")
    assert "no such file" in refused(capsys, "merge", "good.yaml", "1.nc", "3.nc", "-o", "map.nc")
    assert not (folder / "map.nc").exists()
    assert main(["merge", "good.yaml", "2.nc", "1.nc", "-o", "map.nc"]) == 0
    expected = sweeps.survey("good.yaml").attrs["content_hash"]
    assert capsys.readouterr().out == f"content_hash {expected}\n"
    with sweeps.open_map("map.nc") as ds:
        assert ds.attrs["content_hash"] == expected


@pytest.mark.parametrize("arguments", [["--no"], ["chek"], ["shard", "good.yaml", "one", "2", "-o", "a.nc"], ["merge"]])
def test_a_call_that_is_none_leaves_with_2(arguments, capsys):
    with pytest.raises(SystemExit) as left:
        main(arguments)
    assert left.value.code == 2
    assert "Traceback" not in capsys.readouterr().err


PIPED = """\
import os, sys
number = int(sys.argv[1])
reader, writer = os.pipe()
os.close(reader)
os.dup2(writer, number)
sys.argv[1:] = sys.argv[2:]
os.execv(sys.executable, [sys.executable, "-m", "sweeps", *sys.argv[1:]])
"""
WORDS = [["--version"], ["check", "tiny"], ["check", "none"]]


@pytest.mark.parametrize("words", WORDS, ids=" ".join)
def test_a_reader_that_has_gone_ends_a_command_quietly(words):
    """With its output closed a command that prints ends with 1; what is refused ends with its own status."""
    done = subprocess.run([sys.executable, "-c", PIPED, "1", *words], stderr=subprocess.PIPE, check=False)
    assert (done.returncode, b"Traceback" in done.stderr) == (2 if "none" in words else 1, False)
    assert done.stderr.count(b"\n") == ("none" in words)


@pytest.mark.parametrize(
    ("words", "status", "closed"),
    [("check tiny", 0, "<&- >&- 2>&-"), ("check none", 2, "2>&-"), ("check none", 2, "<&-"), ("--version", 0, ">&-")],
)
def test_closed_streams_change_no_exit_status(words, status, closed):
    command = f"{shlex.quote(sys.executable)} -m sweeps {words}"
    lines = (command, f"{command} {closed}")
    whole, done = (subprocess.run(["sh", "-c", line], capture_output=True, check=False) for line in lines)
    assert done.returncode == whole.returncode == status
    assert done.stdout == (b"" if " >&-" in f" {closed}" else whole.stdout)
    assert done.stderr == (b"" if "2>&-" in closed else whole.stderr)


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no device that is always full")
@pytest.mark.parametrize("words", [["--version"], ["check", "tiny"]])
def test_output_that_finds_no_room_is_said(words):
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "sweeps", *words], stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert done.returncode == 2
    assert "No space left on device; allowed: " in done.stderr
    assert "Traceback" not in done.stderr


def test_a_process_that_is_killed_while_it_draws_is_one_message(monkeypatch, capsys):
    def die(args):
        with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
            pool.submit(os._exit, 9).result()

    parsed = SimpleNamespace(parse_args=lambda words: SimpleNamespace(run=die))
    monkeypatch.setattr(program, "build", lambda: (parsed, {}))
    assert __main__.main(["figures", "map.nc"]) == 1
    told = capsys.readouterr().err
    assert told.startswith("a process that this command started was ended from outside (killed")
    assert told.count("\n") == 1


def settings_of_the_process():
    """What a program that calls `main` shares with it."""
    import gc
    import logging
    import threading
    import warnings

    import matplotlib as mpl

    numbers = [signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM, signal.SIGPIPE)]
    streams = [(s.errors, s.encoding, s.line_buffering) for s in (sys.__stdout__, sys.__stderr__)]
    hooks = sys.excepthook, sys.unraisablehook, threading.excepthook
    others = gc.isenabled(), gc.get_threshold(), np.geterr(), dict(mpl.rcParams), logging.root.level
    return numbers, streams, hooks, others, list(warnings.filters), dict(os.environ), os.getcwd(), os.umask(os.umask(0))


@pytest.mark.parametrize(
    "words",
    [["check", "tiny"], ["check", "nowhere.yaml"], ["show", "nowhere.nc"], ["body", "--moments", "1", "2", "2.5"], []],
)
def test_a_program_that_calls_main_keeps_its_settings(words, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    with contextlib.suppress(SystemExit):
        main(words)  # what is imported registers its own
    with (tmp_path / "said").open("w", encoding="utf-8") as said:
        monkeypatch.setattr(sys, "stdout", said)
        monkeypatch.setattr(sys, "__stdout__", said)
        before = settings_of_the_process()
        with contextlib.suppress(SystemExit):
            main(words)
        assert settings_of_the_process() == before


def test_the_answer_for_one_body_does_not_load_the_compiler():
    words = [sys.executable, "-X", "importtime", "-m", "sweeps", "body", "--moments", "2.0", "3.0", "4.5"]
    answered = subprocess.run(words, capture_output=True, text=True, check=True)
    assert "tumbles" in answered.stdout or "unstable" in answered.stdout
    assert "numba" not in answered.stderr
