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

import numpy as np
import pytest
from houses import SHARDS, TARGET, assert_whole

import sweeps

pytestmark = [pytest.mark.slow, pytest.mark.faults]


@pytest.fixture(autouse=True)
def cleared(house):
    house.settle()
    house.clear()
    house.define()
    yield
    house.settle()


def assert_words(said, *words):
    assert "Traceback" not in said
    for word in words:
        assert word in said


def broken_off(house, settle=True):
    """A run that was killed when some shards were finished; what it left running is waited for, if wanted."""
    run = house.start()
    house.until_shards(run, 2)
    run.kill()
    run.communicate()
    if settle:
        house.settle()


# Two runs


def test_a_second_run_says_so_and_stops(house):
    first = house.start()
    house.until_shards(first, 1)
    first.send_signal(signal.SIGSTOP)  # so that it is still at work, however fast this machine is
    status, said = house.run()
    other = house.process([sys.executable, "-m", "sweeps", "run", "broken.yaml", "--cores", "1"])
    others, _ = other.communicate()
    first.send_signal(signal.SIGCONT)
    firsts, _ = first.communicate()
    assert status == 2
    assert_words(said, f"another run is active there (process {first.pid})", "allowed: one at a time")
    assert other.returncode == 2
    assert_words(others, "another run is active there")
    assert first.returncode == 0, firsts
    assert_whole(house)


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


def test_a_disk_that_fills_up_is_said_and_loses_nothing(house):
    results = house.folder / "results"
    with small_disk(results, "24m"):
        run = house.start()
        house.until_shards(run, 3)  # of two jobs at a time: one at least has ended, its log and benchmark written
        fill(results)
        said, _ = run.communicate()
        assert run.returncode == 1
        assert_words(said, "No space left on device")
        assert not house.map.exists()
        assert not list(results.glob("broken/**/.*.part"))
        kept = house.finished()
        (results / "filler").unlink()
        status, said = house.run()
        assert status == 0, said
        assert kept
        assert not [k for k in kept if f"Measuring shard {k} of" in said]
        assert_whole(house)


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


def test_a_results_folder_that_cannot_be_written_is_refused(house):
    with read_only(house.folder / "results") as reason:
        status, said = house.run()
        assert status == 2
        assert_words(said, f"cannot be written ({reason})", "allowed")
        assert said.count("\n") == 1


# Clocks


@pytest.mark.parametrize("years", [-30, 30])
def test_a_clock_that_jumps_changes_no_bit(house, years):
    broken_off(house)
    other = time.time() + years * 365.25 * 86400
    rng = random.Random(years)
    files = [house.folder / "broken.yaml", *house.shards.glob("[0-9]*.nc"), *house.folder.glob(".cache/polhode/*/*")]
    for path in files:
        if path.name in ("broken.yaml", "compiled") or rng.random() < 0.7:
            os.utime(path, (other, other))
    for _ in range(2):
        status, said = house.run()
        assert status == 0, said
        assert_whole(house)
        os.utime(house.map, (other, other))


# Code that changes


def test_a_kernel_edited_between_two_runs_is_what_makes_every_point(house):
    broken_off(house, settle=False)
    kernel, ours = house.folder / "kernels/estimator/measure.py", Path(house.ask(FOLDER))
    before = kernel.read_text()
    # while the jobs that the killed run has left still finish shards of the old kernels
    kernel.write_text(before + "\nEDITED = True\n")
    try:
        edited = Path(house.ask(FOLDER))
        for code in ours.glob("kernels_*"):  # of whose files Numba takes all but the edited one's
            shutil.copytree(code, edited / code.name, dirs_exist_ok=True)
        status, said = house.run()
        assert status == 0, said
        house.settle()
        with sweeps.open_map(house.map) as ds:
            held = ds.attrs["kernel_fingerprint"]
        assert held == house.ask("from sweeps import systems; print(systems.resolve('rigid_body').fingerprint())")
        assert said.count("Measuring shard") == SHARDS
        assert house.content() == house.hash  # the edit changes no number
    finally:
        kernel.write_text(before)


FOLDER = "from kernels.compile.cache import cache_folder; print(cache_folder())"
HASH = "import sweeps; print(sweeps.survey('broken.yaml').attrs['content_hash'])"
ANOTHER = "nehalem"  # a processor that every other of its kind can stand for


def compiled_of_an_edit(house, **settings):
    """The folder of compiled kernels that measure wrong rates; no file but measure.py says so."""
    kernel = house.folder / "kernels/estimator/measure.py"
    before = kernel.read_text()
    wrong = before.replace("TURNS[0]", "1.25 * TURNS[0]")  # of the series that most rates come from
    assert wrong != before
    kernel.write_text(wrong)
    try:
        return Path(house.ask(f"{HASH}; {FOLDER}", **settings).splitlines()[-1])
    finally:
        kernel.write_text(before)


@pytest.mark.parametrize("stale", ["source", "processor"])
def test_stale_compiled_code_in_our_place_is_not_run(house, stale):
    if stale == "processor" and platform.machine() != "x86_64":
        pytest.skip("the processor that is named here is none of this machine's kind")
    ours = Path(house.ask(FOLDER))
    kept = shutil.copytree(ours, ours.with_name("kept"))
    try:
        wrong = compiled_of_an_edit(house, **({"NUMBA_CPU_NAME": ANOTHER} if stale == "processor" else {}))
        assert (wrong != ours) == (stale == "processor")
        if wrong != ours:  # another processor has a folder of its own; what if it came to lie in ours?
            shutil.rmtree(ours)
            wrong.rename(ours)
        status, said = house.run()
        assert status == 0, said
        assert_words(said)
        assert_whole(house)
    finally:
        shutil.rmtree(ours)
        kept.rename(ours)


QUICK = ("elliptic", "measure", "direct", "solution")  # kernels that are soon compiled again


def compiled_files(house):
    """Those of some kernels; what another test has emptied stays so where nothing has called it since."""
    files = Path(house.ask(FOLDER), "code").iterdir()
    return sorted(p for p in files if p.name.partition(".")[0] in QUICK and p.stat().st_size)


def test_a_damaged_compiler_cache_is_not_believed(house):
    """What a failing disk may leave in the cache: halves, nothing, noise."""
    files = compiled_files(house)
    assert len(files) > 10
    rng = random.Random(5)
    for path in files:
        whole = path.read_bytes()
        damage = [whole[: len(whole) // 2], b"", whole.replace(b"0.", b"9.", 1), rng.randbytes(len(whole)), whole]
        path.write_bytes(rng.choice(damage))
    status, said = house.run()
    assert status == 0, said
    assert_whole(house)


COMMANDS = [
    f"verify {TARGET} --points 20",
    f"point {TARGET} --axis 2 --I1 0.7 --I2 0.9 --I3 1 --omega0 1 --trajectory results/motion.csv",
    "body racket",
    f"figures {TARGET} -o results/figures",
]


def test_a_bit_that_flips_in_compiled_code_is_never_run(house):
    """Wherever kernels are called: in every command that does, and in Python."""
    status, said = house.run()
    assert status == 0, said
    calls = [lambda line=line: house.command(*line.split()) for line in COMMANDS]
    rng = random.Random(6)
    for call in [*calls, lambda: house.ask(HASH)]:
        sound, motion = call(), house.folder / "results/motion.csv"
        moved = motion.read_bytes() if motion.exists() else b""
        for code in compiled_files(house):
            content = bytearray(code.read_bytes())
            content[rng.randrange(len(content))] ^= 1 << rng.randrange(8)
            code.write_bytes(content)
        assert call() == sound
        assert (motion.read_bytes() if motion.exists() else b"") == moved


def test_values_of_the_undisturbed_run_are_those_of_a_call(house):
    assert sweeps.survey(house.folder / "broken.yaml").attrs["content_hash"] == house.hash
    assert np.prod([20, 20, 2, 2, 3]) == 4800
