"""Faults that really happen here: processes are killed, disks are filled, files are damaged; then the same command."""

import os
import platform
import random
import shutil
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import pytest
from workspaces import SHARDS, assert_whole

import sweeps

pytestmark = [pytest.mark.slow, pytest.mark.faults]


@pytest.fixture(autouse=True)
def clear_results(workspace):
    workspace.settle()
    workspace.clear()
    workspace.define()
    yield
    workspace.settle()


def assert_words(output, *words):
    assert "Traceback" not in output
    for word in words:
        assert word in output


def interrupt_run(workspace, settle=True):
    """Kill a run after some shards; wait for the processes that it leaves if `settle`."""
    run = workspace.start()
    workspace.until_shards(run, 2)
    run.kill()
    run.communicate()
    if settle:
        workspace.settle()


# Two runs


def test_a_second_run_says_so_and_stops(workspace):
    first = workspace.start()
    workspace.until_shards(first, 1)
    first.send_signal(signal.SIGSTOP)  # so that it is still at work, however fast this machine is
    status, first_output = workspace.run()
    second_run = workspace.process([sys.executable, "-m", "sweeps", "run", "broken.yaml", "--cores", "1"])
    second_output, _ = second_run.communicate()
    first.send_signal(signal.SIGCONT)
    firsts, _ = first.communicate()
    assert status == 2
    assert_words(first_output, f"another run is active there (process {first.pid})", "allowed: one at a time")
    assert second_run.returncode == 2
    assert_words(second_output, "another run is active there")
    assert first.returncode == 0, firsts
    assert_whole(workspace)


# Disks


@contextmanager
def small_disk(folder, size):
    """A file system of its own at a folder."""
    folder.mkdir(parents=True)
    mount = shutil.which("mount")
    command = [mount, "-t", "tmpfs", "-o", f"size={size}", "tmpfs", folder]
    if mount is None or subprocess.run(command, check=False).returncode:
        pytest.skip("no file system can be mounted here: that takes root, and a machine that lets it")
    try:
        yield
    finally:
        subprocess.run(["umount", "-l", folder], check=True)


def fill(folder):
    """Leaves no byte free."""
    with (folder / "filler").open("wb", buffering=0) as file:
        try:
            while file.write(bytes(4096)):
                pass
        except OSError:
            pass


def test_a_disk_that_fills_up_is_said_and_loses_nothing(workspace):
    results = workspace.folder / "results"
    with small_disk(results, "24m"):
        run = workspace.start()
        workspace.until_shards(run, 3)  # of two jobs at a time: one at least has ended, its log and benchmark written
        fill(results)
        output, _ = run.communicate()
        assert run.returncode == 1
        assert_words(output, "No space left on device")
        assert not workspace.map.exists()
        assert not list(results.glob("broken/**/.*.part"))
        finished_shards = workspace.finished_shards()
        (results / "filler").unlink()
        status, output = workspace.run()
        assert status == 0, output
        assert finished_shards
        assert not [k for k in finished_shards if f"Measuring shard {k} of" in output]
        assert_whole(workspace)


@contextmanager
def read_only(folder):
    """A folder that cannot be written: its file system forbids it, or, to all but root, its mode."""
    if os.geteuid() == 0:
        with small_disk(folder, "24m"):
            subprocess.run(["mount", "-o", "remount,ro", folder], check=True)
            yield "Read-only file system"
        return
    folder.mkdir(mode=0o555)
    try:
        yield "Permission denied"
    finally:
        folder.chmod(0o755)


def test_a_results_folder_that_cannot_be_written_is_refused(workspace):
    with read_only(workspace.folder / "results") as reason:
        status, output = workspace.run()
        assert status == 2
        assert_words(output, f"cannot be written ({reason})", "allowed")
        assert output.count("\n") == 1


# Clocks


@pytest.mark.parametrize("years", [-30, 30])
def test_a_clock_that_jumps_changes_no_bit(workspace, years):
    interrupt_run(workspace)
    wrong_time = time.time() + years * 365.25 * 86400
    rng = random.Random(years)
    files = [
        workspace.folder / "broken.yaml",
        *workspace.shards.glob("[0-9]*.nc"),
        *workspace.folder.glob(".cache/polhode/*/*"),
    ]
    for path in files:
        if path.name in ("broken.yaml", "compiled") or rng.random() < 0.7:
            os.utime(path, (wrong_time, wrong_time))
    for _ in range(2):
        status, output = workspace.run()
        assert status == 0, output
        assert_whole(workspace)
        os.utime(workspace.map, (wrong_time, wrong_time))


# Code that changes


def test_a_kernel_edited_between_two_runs_is_what_makes_every_point(workspace):
    interrupt_run(workspace, settle=False)
    kernel, ours = workspace.folder / "kernels/estimator/measure.py", Path(workspace.ask(FOLDER))
    before = kernel.read_text()
    # while the jobs that the killed run has left still finish shards of the old kernels
    kernel.write_text(before + "\nEDITED = True\n")
    try:
        cache_of_edit = Path(workspace.ask(FOLDER))
        for code in ours.glob("kernels_*"):  # Numba uses its files, except that of the edited source
            shutil.copytree(code, cache_of_edit / code.name, dirs_exist_ok=True)
        status, output = workspace.run()
        assert status == 0, output
        workspace.settle()
        with sweeps.open_map(workspace.map) as ds:
            map_fingerprint = ds.attrs["kernel_fingerprint"]
        assert map_fingerprint == workspace.ask(
            "from sweeps import systems; print(systems.resolve('rigid_body').fingerprint())"
        )
        assert output.count("Measuring shard") == SHARDS
        assert workspace.content() == workspace.hash  # the edit changes no number
    finally:
        kernel.write_text(before)


FOLDER = "from kernels.compile.cache import cache_folder; print(cache_folder())"
HASH = "import sweeps; print(sweeps.survey('broken.yaml').attrs['content_hash'])"
OLD_PROCESSOR = "nehalem"  # an old processor of the same family, which newer ones can emulate


def compiled_of_an_edit(workspace, **settings):
    """The folder of compiled kernels that measure wrong rates; only measure.py shows it."""
    kernel = workspace.folder / "kernels/estimator/measure.py"
    before = kernel.read_text()
    edited_text = before.replace("TURNS[0]", "1.25 * TURNS[0]")  # of the series that most rates come from
    assert edited_text != before
    kernel.write_text(edited_text)
    try:
        return Path(workspace.ask(f"{HASH}; {FOLDER}", **settings).splitlines()[-1])
    finally:
        kernel.write_text(before)


@pytest.mark.parametrize("stale", ["source", "processor"])
def test_stale_compiled_code_in_our_place_is_not_run(workspace, stale):
    if stale == "processor" and platform.machine() != "x86_64":
        pytest.skip("the processor that is named here is none of this machine's kind")
    ours = Path(workspace.ask(FOLDER))
    backup = shutil.copytree(ours, ours.with_name("kept"))
    try:
        stale_folder = compiled_of_an_edit(
            workspace, **({"NUMBA_CPU_NAME": OLD_PROCESSOR} if stale == "processor" else {})
        )
        assert (stale_folder != ours) == (stale == "processor")
        if stale_folder != ours:  # another processor has a folder of its own; it is moved to this processor's place
            shutil.rmtree(ours)
            stale_folder.rename(ours)
        status, output = workspace.run()
        assert status == 0, output
        assert_words(output)
        assert_whole(workspace)
    finally:
        shutil.rmtree(ours)
        backup.rename(ours)
