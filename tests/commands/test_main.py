import json
import multiprocessing
import os
import shlex
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from types import SimpleNamespace

import pytest
from calls import refusal_message

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
    output = capsys.readouterr()
    assert output.err == ""
    assert "good.yaml: valid" in output.out
    assert "6 = 3 axis × 1 I1 × 1 I2 × 2 I3 × 1 omega0 × 1 epsilon × 1 phase" in output.out
    assert [p.name for p in folder.iterdir()] == ["good.yaml"]


def test_check_lists_what_ships(capsys):
    assert main(["check", "--list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    at = lines[0].index("system")
    assert all(line[at - 1] == " " for line in lines)  # in columns
    entries = {line.split()[0]: line.split() for line in lines[1:] if not line.startswith(" ")}
    assert entries["tiny"][1:3] == ["rigid_body", "864"]
    names = list(entries)
    assert {"bodies", "breakdown", "symmetric", "tennis_racket", "tiny", "bead_on_hoop"} <= set(names)
    assert names == sorted(names)
    assert main(["check"]) == 0
    assert "tennis_racket.yaml: valid" in capsys.readouterr().out


def test_a_gigantic_grid_is_refused_with_its_bytes(folder, capsys):
    """`check` only reports it: a sweep for a cluster is checked on a laptop."""
    long = "{start: 1.0, stop: 2.0, num: 1000000}"
    (folder / "huge.yaml").write_text(f"grid: {{I1: {long}, I2: {long}, I3: {long}, omega0: 1.0}}")
    message = refusal_message(capsys, "run", "huge.yaml")
    assert "3,000,000,000,000,000,000 points" in message
    assert "of disk" in message
    assert message.count(" bytes)") == 2  # needed, and free
    assert main(["check", "huge.yaml"]) == 0
    output = capsys.readouterr().out
    assert "not here    huge: grid: 3,000,000,000,000,000,000 points need " in output
    assert "refuse it on this machine" in output
    assert "years on one core, figures and report included" in output
    assert main(["check", "huge.yaml", "--json"]) == 0
    assert "of disk" in json.loads(capsys.readouterr().out)["lacking_here"][0]
    assert not (folder / "results").exists()


def test_an_unknown_name_suggests_a_near_one(folder, capsys):
    for text in ("tenis_racket", "tenis", "raket"):
        assert "did you mean tennis_racket?" in refusal_message(capsys, "check", text)
        with pytest.raises(DefinitionError, match=r"did you mean tennis_racket\?"):
            sweeps.survey(text)
    far = refusal_message(capsys, "check", "zzz")
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
    message = refusal_message(capsys, "shard", "good.yaml", "-o", "a.nc", *numbers)
    assert message.startswith(word)
    assert "out of range" in message
    assert not (folder / "a.nc").exists()


def test_shard_and_merge_make_the_map(folder, capsys):
    for number in (1, 2):
        assert main(["shard", "good.yaml", str(number), "2", "-o", f"{number}.nc"]) == 0
    assert "shard 2 of 2: 3 of 3 points" in capsys.readouterr().err
    assert "no such file" in refusal_message(capsys, "merge", "good.yaml", "1.nc", "3.nc", "-o", "map.nc")
    assert not (folder / "map.nc").exists()
    assert main(["merge", "good.yaml", "2.nc", "1.nc", "-o", "map.nc"]) == 0
    expected = sweeps.survey("good.yaml").attrs["content_hash"]
    assert capsys.readouterr().out == f"content_hash {expected}\n"
    with sweeps.open_map("map.nc") as ds:
        assert ds.attrs["content_hash"] == expected


@pytest.mark.parametrize("arguments", [["--no"], ["chek"], ["shard", "good.yaml", "one", "2", "-o", "a.nc"], ["merge"]])
def test_a_call_that_is_none_leaves_with_2(arguments, capsys):
    with pytest.raises(SystemExit) as end:
        main(arguments)
    assert end.value.code == 2
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
    """With its output closed a command that prints ends with 1; a refused command ends with its own status."""
    process = subprocess.run([sys.executable, "-c", PIPED, "1", *words], stderr=subprocess.PIPE, check=False)
    assert (process.returncode, b"Traceback" in process.stderr) == (2 if "none" in words else 1, False)
    assert process.stderr.count(b"\n") == ("none" in words)


@cache
def output_of(words):
    """Return the finished process of a command line of `polhode`."""
    line = f"{shlex.quote(sys.executable)} -m sweeps {words}"
    return subprocess.run(["sh", "-c", line], capture_output=True, check=False)


@pytest.mark.parametrize(
    ("words", "status", "redirection"),
    [("check tiny", 0, "<&- >&- 2>&-"), ("check none", 2, "2>&-"), ("check none", 2, "<&-"), ("--version", 0, ">&-")],
)
def test_closed_streams_change_no_exit_status(words, status, redirection):
    plain, process = output_of(words), output_of(f"{words} {redirection}")
    assert process.returncode == plain.returncode == status
    assert process.stdout == (b"" if " >&-" in f" {redirection}" else plain.stdout)
    assert process.stderr == (b"" if "2>&-" in redirection else plain.stderr)


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no device that is always full")
def test_output_that_finds_no_room_is_said():
    with open("/dev/full", "w") as full:
        words = [sys.executable, "-m", "sweeps", "--version"]
        process = subprocess.run(words, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert process.returncode == 2
    assert "No space left on device; allowed: " in process.stderr
    assert "Traceback" not in process.stderr


def test_a_process_that_is_killed_while_it_draws_is_one_message(monkeypatch, capsys):
    def die(args):
        with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
            pool.submit(os._exit, 9).result()

    parsed = SimpleNamespace(parse_args=lambda words: SimpleNamespace(run=die))
    monkeypatch.setattr(program, "build", lambda: (parsed, {}))
    assert __main__.main(["figures", "map.nc"]) == 1
    message = capsys.readouterr().err
    assert message.startswith("a process that this command started was ended from outside (killed")
    assert message.count("\n") == 1


def test_the_answer_for_one_body_does_not_load_the_compiler():
    words = [sys.executable, "-X", "importtime", "-m", "sweeps", "body", "--moments", "2.0", "3.0", "4.5"]
    process = subprocess.run(words, capture_output=True, text=True, check=True)
    assert "tumbles" in process.stdout or "unstable" in process.stdout
    assert "numba" not in process.stderr
