"""Whose process made a file, and does it live: exact on one machine, patient with all others."""

import os
import re
import subprocess
import sys
from functools import partial

import pytest

from sweeps.process import files, process_identity


def of(number=None, **parts):
    """This process's mark, with other parts."""
    host, boot, space, own, begun = process_identity.process_mark().split("-")
    named = {
        "host": host,
        "boot": boot,
        "space": space,
        "number": own if number is None else str(number),
        "begun": begun,
    }
    return "-".join((named | {key: str(value) for key, value in parts.items()}).values())


@pytest.fixture
def ended():
    """The number of a process that is no more."""
    process = subprocess.Popen([sys.executable, "-c", ""])
    process.wait()
    return process.pid


def test_this_process_lives_and_an_ended_one_does_not(ended):
    assert not process_identity.is_over(process_identity.process_mark(), silence=1e9)
    assert process_identity.is_over(of(ended), silence=0.0)


def test_a_process_that_nobody_waited_for_has_ended():
    process = subprocess.Popen([sys.executable, "-c", ""], stdout=subprocess.PIPE)
    process.stdout.read()
    os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)
    assert process_identity.is_over(of(process.pid, begun=0), silence=0.0)
    process.wait()


def test_a_number_that_another_program_has_now_is_over():
    assert process_identity.is_over(of(begun=int(process_identity.process_mark().rpartition("-")[2]) - 1), silence=0.0)


@pytest.mark.parametrize("elsewhere", [{"boot": "0" * 12}, {"space": 1}, {"boot": "0" * 12, "host": "other"}])
def test_processes_elsewhere_are_given_a_day(elsewhere, ended):
    """On another machine, or in a container with the same name, numbers mean other processes."""
    for number in (os.getpid(), ended):
        assert not process_identity.is_over(of(number, **elsewhere), silence=process_identity.DAY - 1)
        assert process_identity.is_over(of(number, **elsewhere), silence=process_identity.DAY + 1)


def test_leftovers_of_dead_processes_go_and_those_of_living_ones_stay(tmp_path, ended):
    parts = [
        tmp_path / f".figures.{mark}.abc.part"
        for mark in (of(ended), process_identity.process_mark(), of(ended, space=1))
    ]
    for part in parts:
        part.mkdir()
        (part / "made").mkdir()
        (part / "made/bodies.png").write_bytes(b"half")
    single = tmp_path / f".map.nc.{of(ended)}.abc.part"
    single.write_bytes(b"half")
    with files.replace_output(tmp_path / "figures", is_folder=True) as folder:
        assert re.search(re.escape(process_identity.process_mark()), str(folder))
    assert [part.exists() for part in parts] == [False, True, True]
    assert single.exists()  # another's file, whose own next writer removes it
    files.remove_all_leftovers(tmp_path)
    assert not single.exists()
    assert [part.exists() for part in parts] == [False, True, True]


@pytest.mark.parametrize("is_folder", [False, True])
def test_ctrl_c_at_any_line_of_making_a_place_for_a_file_leaves_nothing(is_folder, tmp_path):
    """Each line of ours and of the library that runs until the block begins is broken off once."""
    path, lines, way = tmp_path / "made", 0, partial(files.replace_output, is_folder=is_folder)
    assert not broken_off(way, path, 10_000)  # what the library remembers, it need not find out again
    while broken_off(way, path, lines):
        assert not list(tmp_path.iterdir())
        lines += 1
    assert lines > 50


def broken_off(way, path, line):
    """Whether a block begun for a path was broken off before a line of this number, counted from its first."""

    def trace(frame, event, _):
        nonlocal line
        if event == "line":
            line -= 1
            if line < 0:
                sys.settrace(None)
                raise KeyboardInterrupt
        return trace

    before = sys.gettrace()
    sys.settrace(trace)
    try:
        with way(path):
            sys.settrace(before)
            raise NotImplementedError
    except KeyboardInterrupt:
        return True
    except NotImplementedError:
        return False
    finally:
        sys.settrace(before)
