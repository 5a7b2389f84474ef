"""Kernels are compiled before a sweep is measured, whoever measures it, and once."""

import functools
import io
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import psutil
import pytest
import rich.console
from calls import refusal_message, run_command

import sweeps
from kernels.compile import cache, fingerprint
from kernels.events import flips
from sweeps import systems
from sweeps.points import catalogue, columns, compile_kernels
from sweeps.points.loading import read_sweep
from sweeps.process import progress
from sweeps.systems.system import Example

ROOT = compile_kernels.ROOT
FIRST, SECOND, LAST = (
    Example("free.exact", "one"),
    Example("free.exact", "one", (2.0,)),
    Example("free.linear", "last", is_last=True),
)


@pytest.fixture
def compiled(tmp_path, monkeypatch):
    """Set an empty cache, and return a list of requests in place of the program that compiles."""
    requests = []
    monkeypatch.setattr(compile_kernels, "cache_folder", lambda: tmp_path)
    monkeypatch.setattr(compile_kernels, "_compiled", set())
    monkeypatch.setattr(compile_kernels, "_run_compiler", requests.append)
    return requests


def test_what_is_missing_is_compiled_once(compiled):
    compile_kernels.compile_examples([FIRST, LAST])
    compile_kernels.compile_examples([FIRST, SECOND, LAST])
    compile_kernels.compile_examples([FIRST, SECOND, LAST])
    assert compiled == [[FIRST, LAST], [SECOND]]


@pytest.mark.parametrize("definition", ["tiny", "symmetric", "rackets", "pendulum", "mathieu"])
def test_what_cannot_be_kept_is_said_and_is_not_compiled_for_nobody(compiled, definition, monkeypatch, capsys):
    sweep = read_sweep(catalogue.find_definition(definition))
    monkeypatch.setattr(compile_kernels.machine, "num_processors", lambda: 2)
    seconds = compile_kernels.compile_seconds(sweep)
    assert seconds == pytest.approx(sweep.system.compile_seconds)
    assert "once per machine" in compile_kernels.compile_notice(sweep)
    monkeypatch.setattr(compile_kernels, "why_unkept", lambda: "/home/cache: Permission denied")
    line = compile_kernels.compile_notice(sweep)
    assert "they cannot be kept (/home/cache: Permission denied)" in line
    assert f"about {seconds * compile_kernels.SERIAL_FACTOR:.0f} s: " in line  # by this process alone
    assert "once" not in line
    compile_kernels.compile_examples(sweep.system.examples(sweep.definition))
    assert compiled == []
    monkeypatch.setattr(cache, "why_unkept", lambda: "/home/cache: Permission denied")
    assert "compile: they cannot be kept (/home/cache: Permission denied)" in refusal_message(
        capsys, "compile", definition
    )
    assert "of compiling, each time" in " ".join(run_command(capsys, "check", definition).split())


@pytest.mark.parametrize("stamp", [b"", b"another stamp", b"\xff"])
def test_what_is_of_an_edited_source_or_damaged_is_compiled(compiled, stamp):
    compile_kernels.compile_examples([FIRST, LAST])
    compile_kernels._mark_file(LAST).write_bytes(stamp)
    assert compile_kernels.missing_examples([FIRST, LAST]) == [LAST]
    compile_kernels.compile_examples([FIRST, LAST])
    assert compiled == [[FIRST, LAST], [LAST]]


def test_an_edit_misses_what_imports_it_and_nothing_else(compiled, monkeypatch):
    examples = systems.all_examples()
    compile_kernels.compile_examples(examples)
    assert not compile_kernels.missing_examples(examples)
    read_whole, edited_path = fingerprint._read, Path(flips.__file__)
    stamp = fingerprint.stamp.__wrapped__

    def read_edited(path):
        content, names = read_whole(path)
        return content + b"# edited\n" * (path == edited_path), names

    monkeypatch.setattr(fingerprint, "_read", read_edited)
    monkeypatch.setattr(compile_kernels, "stamp", stamp)
    missing = {example.module for example in compile_kernels.missing_examples(examples)}
    assert "near_axis.survey" in missing
    assert not missing & {"flow.oscillations", "flow.flows", "events.tumbling", "events.symmetric_top"}


def test_several_that_need_kernels_at_once_have_them_compiled_once(compiled, monkeypatch):
    def slowly(examples):
        time.sleep(0.2)
        compiled.append(examples)

    monkeypatch.setattr(compile_kernels, "_run_compiler", slowly)
    threads = [threading.Thread(target=compile_kernels.compile_examples, args=([FIRST],)) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert compiled == [[FIRST]]


@pytest.mark.compiled
@pytest.mark.parametrize("threads", [1, 2])
def test_the_door_to_the_kernels_has_them_compiled(compiled, threads):
    sweep = read_sweep({"grid": {"I1": 1.0, "I2": 2.0, "I3": [3.0, 2.5], "omega0": 1.0}})
    columns.measure_points(sweep.grid.points(0, 4), sweep, threads)
    assert compiled == [list(sweep.system.examples(sweep.definition))]


def test_what_few_definitions_ask_for_is_compiled_for_them():
    grid = {"grid": {"I1": 1.0, "I2": 2.0, "I3": 3.0, "omega0": 1.0}}
    usual, with_flips = read_sweep(grid), read_sweep(grid | {"integration": {"flips": True}})
    usual, with_flips = (
        {example.name for example in sweep.system.examples(sweep.definition)} for sweep in (usual, with_flips)
    )
    assert [name.partition("-")[0] for name in with_flips - usual] == ["near_axis.survey.measure_flips"]
    pendulum = read_sweep({"system": "pendulum", "grid": {"length": 1.0}})
    motion_code, own_code, *shared = pendulum.system.examples(pendulum.definition)
    assert {example.module for example in shared} == {"flow.oscillations", "flow.paths", "search.roots", "flow.runs"}
    assert Path(motion_code.module).read_text() == pendulum.system.mechanism.moving.text
    assert Path(own_code.module).read_text() == pendulum.system._code().text


# The program


DAEMON = """
from multiprocessing import get_context
def measure():
    import sweeps
    print(sweeps.survey({definition!r}).attrs["content_hash"])
{call}
"""
LITTLE = {"system": "symmetric_top", "grid": {"ratio": 1.9, "omega3": 1.0, "half_angle": 20.0}}  # soonest compiled


def program(code, **environment):
    """Run a script in a process of its own, which has a cache to fill."""
    path = {"PYTHONPATH": str(ROOT)}
    return subprocess.run(code, env={**os.environ, **path, **environment}, capture_output=True, text=True, check=False)


@pytest.mark.slow
@pytest.mark.compiled
def test_a_script_is_not_run_again_and_a_process_that_may_have_no_children_finds_kernels(tmp_path):
    daemon = "p = get_context('fork').Process(target=measure, daemon=True); p.start(); p.join()"
    (tmp_path / "daemon.py").write_text(DAEMON.format(call=daemon, definition=LITTLE))
    process = program([sys.executable, tmp_path / "daemon.py"], XDG_CACHE_HOME=str(tmp_path))
    assert process.returncode == 0, process.stderr
    (line,) = process.stderr.splitlines()  # no terminal, no bar
    assert line.startswith("compiling the kernels of symmetric_top, once per machine")
    assert process.stdout.split() == [sweeps.survey(LITTLE).attrs["content_hash"]]  # the script was run once


def test_a_kernel_that_cannot_be_compiled_is_said(monkeypatch):
    with pytest.raises(RuntimeError, match="nowhere"):
        compile_kernels._run_compiler([Example("nowhere")])


@pytest.mark.compiled
@pytest.mark.parametrize(
    "signals",
    [
        pytest.param(signal.SIGKILL, marks=pytest.mark.slow),
        pytest.param(signal.SIGINT, marks=pytest.mark.faults),
        pytest.param(signal.SIGTERM, marks=pytest.mark.faults),
    ],
)
def test_whoever_is_killed_while_kernels_are_compiled_leaves_no_process(tmp_path, signals):
    (tmp_path / "script.py").write_text(DAEMON.format(call="measure()", definition=LITTLE))
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "XDG_CACHE_HOME": str(tmp_path)}
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    script = psutil.Popen([sys.executable, tmp_path / "script.py"], env=environment, **quiet)
    end = time.monotonic() + 60
    while not list(tmp_path.glob("polhode/*/code/*")) and time.monotonic() < end:
        time.sleep(0.1)
    children = script.children(recursive=True)
    assert len(children) >= 2
    script.send_signal(signals)
    script.wait()
    _, alive = psutil.wait_procs(children, timeout=60)
    assert not alive
    assert program([sys.executable, tmp_path / "script.py"], XDG_CACHE_HOME=str(tmp_path)).returncode == 0


def test_a_bar_on_a_terminal_or_in_a_notebook_counts_pieces(monkeypatch):
    stream = io.StringIO()
    terminal = functools.partial(rich.console.Console, file=stream, force_terminal=True, width=80)
    monkeypatch.setattr(progress, "Console", lambda stderr: terminal())
    with progress.count_pieces(3, "compiling") as advance:
        advance()
        advance()
    assert "2 of 3" in stream.getvalue()
    quiet = io.StringIO()
    monkeypatch.setattr(progress, "Console", lambda stderr: rich.console.Console(file=quiet))
    with progress.count_pieces(3, "compiling") as advance:
        advance()
    assert quiet.getvalue() == ""
