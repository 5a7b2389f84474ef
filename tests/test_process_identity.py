"""The process that made a file, and whether it lives: exact on one machine, patient with further machines."""

import os
import subprocess
import sys
from functools import partial

import pytest

from sweeps.process import files, process_identity


def mark_with(**parts):
    """Return this process's mark, with some fields replaced."""
    names = ("host", "boot", "space", "number", "begun")
    fields = dict(zip(names, process_identity.process_mark().split("-"), strict=True)) | parts
    return "-".join(map(str, fields.values()))


@pytest.fixture
def dead_process():
    """The number of a process that is no more."""
    process = subprocess.Popen([sys.executable, "-c", ""])
    process.wait()
    return process.pid


def test_this_process_lives_and_ended_ones_do_not(dead_process):
    mark = process_identity.process_mark()
    assert not process_identity.is_over(mark, silence=1e9)
    assert process_identity.is_over(mark_with(number=dead_process), silence=0.0)
    assert process_identity.is_over(mark_with(begun=int(mark.rpartition("-")[2]) - 1), silence=0.0)  # used again
    process = subprocess.Popen([sys.executable, "-c", ""], stdout=subprocess.PIPE)
    process.stdout.read()
    os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)  # nobody has read its status
    assert process_identity.is_over(mark_with(number=process.pid, begun=0), silence=0.0)
    process.wait()


@pytest.mark.parametrize("elsewhere", [{"boot": "0" * 12}, {"space": 1}, {"boot": "0" * 12, "host": "other"}])
def test_processes_elsewhere_are_given_a_day(elsewhere, dead_process):
    """On another machine, or in a container with the same name, numbers name different processes."""
    for number in (os.getpid(), dead_process):
        assert not process_identity.is_over(mark_with(number=number, **elsewhere), silence=process_identity.DAY - 1)
        assert process_identity.is_over(mark_with(number=number, **elsewhere), silence=process_identity.DAY + 1)


def test_leftovers_of_dead_processes_go_and_those_of_living_ones_stay(tmp_path, dead_process):
    dead = mark_with(number=dead_process)
    marks = dead, process_identity.process_mark(), mark_with(number=dead_process, space=1)
    folders = [tmp_path / f".figures.{mark}.abc.part" for mark in marks]
    for leftover in folders:
        leftover.mkdir()
        (leftover / "made").mkdir()
        (leftover / "made/bodies.png").write_bytes(b"half")
    single = tmp_path / f".map.nc.{dead}.abc.part"
    single.write_bytes(b"half")
    with files.replace_output(tmp_path / "figures", is_folder=True) as folder:
        assert marks[1] in str(folder)
    assert [leftover.exists() for leftover in folders] == [False, True, True]
    assert single.exists()  # a file of a live machine; its next writer removes it
    files.remove_all_leftovers(tmp_path)
    assert not single.exists()
    assert [leftover.exists() for leftover in folders] == [False, True, True]


@pytest.mark.parametrize("is_folder", [False, True])
def test_ctrl_c_at_any_line_of_making_a_place_for_a_file_leaves_nothing(is_folder, tmp_path):
    """Each line of ours and of the library that runs until the block begins is broken off once."""
    path, lines, way = tmp_path / "made", 0, partial(files.replace_output, is_folder=is_folder)
    assert not is_interrupted(way, path, 10_000)  # a second call uses the library's cache
    while is_interrupted(way, path, lines):
        assert not list(tmp_path.iterdir())
        lines += 1
    assert lines > 50


def is_interrupted(way, path, line):
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
