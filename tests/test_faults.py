"""Faults that really happen here: processes are killed, disks are filled, files are damaged; then the same command."""

import os
import pickle
import platform
import random
import shutil
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path

import netCDF4
import numba
import numpy as np
import psutil
import pytest
from test_workflow import copied

import sweeps
from sweeps import verify

pytestmark = [pytest.mark.slow, pytest.mark.faults]

SHARDS = 10
TEXT = """\
title: A sweep to be broken off
grid:
  I1: {start: 0.5, stop: 1.5, num: 20}
  I2: {start: 0.5, stop: 1.5, num: 20}
  I3: [0.8, 1.0]
  omega0: [1.0, -10.0]
shards: 10
"""
TARGET = "results/broken/stability_map.nc"
PATIENCE = 120.0  # s until a process that must come has come


class House:
    """A copy of the sources with results and a compiler cache of its own."""

    def __init__(self, folder):
        self.folder = copied(folder)
        (folder / "broken.yaml").write_text(TEXT)
        self.map = folder / TARGET
        self.shards = folder / "results/broken/shards"
        self.environment = {**os.environ, "XDG_CACHE_HOME": str(folder / ".cache")}
        self.environment.pop("NUMBA_CACHE_DIR", None)

    def start(self, said=None, *options):
        """The workflow, not waited for; what it says goes to the file `said`, or is kept for communicate()."""
        command = [sys.executable, "-m", "snakemake", *(options or ("--cores", "2"))]
        return self.process([*command, "--config", "definition=broken.yaml", "--", TARGET], said)

    def process(self, command, said=None):
        output = subprocess.PIPE if said is None else said.open("w")
        try:
            return subprocess.Popen(
                command,
                cwd=self.folder,
                env=self.environment,
                stdout=output,
                stderr=subprocess.STDOUT,
                text=True,
            )
        finally:
            if said is not None:
                output.close()

    def run(self):
        """The workflow to its end: (exit status, what it said)."""
        process = self.start()
        said, _ = process.communicate()
        return process.returncode, said

    def ask(self, code, **settings):
        """What Python code prints in this house."""
        command, environment = [sys.executable, "-c", code], {**self.environment, **settings}
        answer = subprocess.run(command, cwd=self.folder, env=environment, capture_output=True, text=True, check=False)
        assert answer.returncode == 0, answer.stderr
        return answer.stdout.strip()

    def clear(self):
        shutil.rmtree(self.folder / "results", ignore_errors=True)

    def finished(self):
        """Numbers of the finished shards."""
        return [path.name.partition("-")[0] for path in self.shards.glob("[0-9]*.nc")]

    def content(self):
        with sweeps.open_map(self.map) as ds:
            return ds.attrs["content_hash"]

    def until_shards(self, process, count):
        wait_for(lambda: len(list(self.shards.glob("[0-9]*.nc"))) >= count, process)

    def orphans(self):
        """Processes that work in this house."""
        found = []
        for process in psutil.process_iter():
            try:
                if process.cwd() == str(self.folder) and process.pid != os.getpid():
                    found.append(process)
            except psutil.Error:
                continue
        return found

    def settle(self):
        """Waits for what killed runs have left running."""
        _, alive = psutil.wait_procs(self.orphans(), timeout=PATIENCE)
        assert not alive


def wait_for(condition, process=None):
    end = time.monotonic() + PATIENCE
    while not (found := condition()):
        if process is not None and process.poll() is not None:
            return None
        assert time.monotonic() < end
        time.sleep(0.02)
    return found


@pytest.fixture(scope="module")
def house(tmp_path_factory):
    """With the kernels compiled and the content hash of an undisturbed run."""
    house = House(tmp_path_factory.mktemp("house"))
    status, said = house.run()
    assert status == 0, said
    house.hash = house.content()
    return house


@pytest.fixture(autouse=True)
def cleared(house):
    house.settle()
    house.clear()
    os.utime(house.folder / "broken.yaml")
    yield
    house.settle()


def assert_whole(house):
    """The map of the undisturbed run, and nothing beside it that a killed process has left."""
    assert house.content() == house.hash
    assert [check for check in verify.verify(house.map, points=20, any_kernels=True) if check.findings] == []
    assert not list(house.folder.glob("results/broken/**/.*.part"))
    assert not list(house.shards.glob("[0-9]*.nc"))


def assert_words(said, *words):
    assert "Traceback" not in said
    for word in words:
        assert word in said


# Kills


def victim(run, kind):
    """The process of that kind below a run of the workflow, once it is there; None where the run has ended before."""
    if kind == "snakemake":
        return psutil.Process(run.pid)

    def look():
        try:
            below = psutil.Process(run.pid).children(recursive=True)
        except psutil.NoSuchProcess:
            return None
        for process in below:
            try:
                words = process.cmdline()
            except psutil.Error:
                continue
            if words[1:4] == ["-m", "sweeps", kind]:
                return process
        return None

    return wait_for(look, run)


def kill(house, kind, moment):
    """Starts the workflow and kills a process of it `moment` seconds after it is there: whether that came to pass."""
    before = house.finished()
    said = house.folder / "said.log"
    run = house.start(said)
    if kind == "snakemake":
        wait_for(lambda: (house.folder / "results/broken/.running").exists(), run)
        moment *= 4  # its jobs take longer to come
    found = victim(run, kind)
    killed = False
    if found is not None:
        try:
            found.wait(moment)
        except psutil.TimeoutExpired:
            found.send_signal(signal.SIGKILL)
            killed = True
    run.wait()
    said = said.read_text()
    assert "Traceback" not in said
    assert run.returncode in (0, 1, -9), said
    assert not [k for k in before if f"Measuring shard {k} of" in said]  # none is computed twice
    return killed


@pytest.mark.parametrize("seed", [1, 2])
def test_thirty_kills_change_no_bit_and_lose_no_shard(house, seed):
    rng = random.Random(seed)
    kinds = ["shard"] * 5 + ["snakemake"] * 5
    rng.shuffle(kinds)
    for kind in [*kinds, *["merge"] * 5]:
        for _ in range(10):  # where the victim was done before the moment came, another moment
            if kill(house, kind, rng.uniform(0.0, 1.5)):
                break
            if house.map.exists():
                house.map.unlink()
        else:
            pytest.fail(f"no {kind} was killed in ten attempts")
    kept = house.finished()
    status, said = house.run()
    assert status == 0, said
    assert not [k for k in kept if f"Measuring shard {k} of" in said]
    house.settle()
    assert_whole(house)


# Two runs


def test_a_second_run_says_so_and_stops(house):
    first = house.start()
    house.until_shards(first, 1)
    status, said = house.run()
    assert status == 2
    assert_words(said, f"another run is at work there (process {first.pid})", "allowed: one at a time")
    other = house.process([sys.executable, "-m", "sweeps", "run", "broken.yaml", "--cores", "1"])
    said, _ = other.communicate()
    assert other.returncode == 2
    assert_words(said, "another run is at work there")
    assert first.communicate() is not None
    assert first.returncode == 0
    assert_whole(house)


# Damaged shards


def cut(path):
    with path.open("r+b") as file:
        file.truncate(path.stat().st_size // 2)


def flip(path):
    with netCDF4.Dataset(path) as file:
        wanted = file["omega_squared"][8:16].tobytes()
    content = bytearray(path.read_bytes())
    content[content.index(wanted) + 5] ^= 1
    path.write_bytes(content)


def test_damaged_shards_are_measured_again_and_never_merged(house):
    run = house.start()
    house.until_shards(run, 4)
    run.kill()
    run.communicate()
    house.settle()
    first, second = sorted(house.shards.glob("[0-9]*.nc"))[:2]
    cut(first)
    flip(second)
    status, said = house.run()
    assert status == 0, said
    log = (house.folder / "results/broken/logs/merge.log").read_text()
    assert_words(log, first.name, second.name, "measured again")
    assert_whole(house)


# Disks


@contextmanager
def small_disk(folder, size):
    """A file system of its own at a folder."""
    folder.mkdir(parents=True)
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", folder], check=False)
    if mounted.returncode:
        pytest.skip("this machine lets nobody but root mount a file system")
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


@pytest.mark.skipif(shutil.which("mount") is None, reason="there is no mount here")
def test_a_disk_that_fills_up_is_said_and_loses_nothing(house):
    results = house.folder / "results"
    with small_disk(results, "24m"):
        run = house.start()
        house.until_shards(run, 3)
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


@pytest.mark.skipif(shutil.which("mount") is None, reason="there is no mount here")
def test_a_results_folder_that_cannot_be_written_is_refused(house):
    results = house.folder / "results"
    with small_disk(results, "24m"):
        subprocess.run(["mount", "-o", "remount,ro", results], check=True)
        status, said = house.run()
        assert status == 2
        assert_words(said, "cannot be written (Read-only file system)", "allowed")
        assert said.count("\n") == 1


# Clocks


@pytest.mark.parametrize("years", [-30, 30])
def test_a_clock_that_jumps_changes_no_bit(house, years):
    run = house.start()
    house.until_shards(run, 4)
    run.kill()
    run.communicate()
    house.settle()
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
    run = house.start()
    house.until_shards(run, 4)
    run.kill()
    run.communicate()
    kernel = house.folder / "kernels/measure.py"
    before = kernel.read_text()
    # while the jobs that the killed run has left still finish shards of the old kernels
    kernel.write_text(before + "\nEDITED = True\n")
    try:
        status, said = house.run()
        assert status == 0, said
        house.settle()
        with sweeps.open_map(house.map) as ds:
            held = ds.attrs["kernel_fingerprint"]
        assert held == house.ask("from kernels.fingerprint import fingerprint; print(fingerprint())")
        assert said.count("Measuring shard") == SHARDS
        assert house.content() == house.hash  # the edit changes no number
    finally:
        kernel.write_text(before)


FOLDER = "from kernels.fingerprint import cache_folder; print(cache_folder())"
COMPILE = f"from sweeps import systems; systems.resolve('rigid_body').compile(); {FOLDER}"
HASH = "import sweeps; print(sweeps.survey('broken.yaml').attrs['content_hash'])"
ANOTHER = "nehalem"  # a processor that every other of its kind can stand for


def compiled_of_an_edit(house, **settings):
    """The folder of compiled kernels that measure wrong rates; no file but measure.py says so."""
    kernel = house.folder / "kernels/measure.py"
    before = kernel.read_text()
    kernel.write_text(before.replace("4.0 * angle * angle", "5.0 * angle * angle"))
    try:
        return Path(house.ask(COMPILE, **settings))
    finally:
        kernel.write_text(before)


def make_older(index):
    content = BytesIO(index.read_bytes())
    assert pickle.load(content) == numba.__version__
    index.write_bytes(pickle.dumps("0.50.0") + content.read())


@pytest.mark.parametrize("stale", ["version", "processor"])
def test_stale_compiled_code_in_our_place_is_not_run(house, stale):
    if stale == "processor" and platform.machine() != "x86_64":
        pytest.skip("the processor that is named here is none of this machine's kind")
    wrong = compiled_of_an_edit(house, **({"NUMBA_CPU_NAME": ANOTHER} if stale == "processor" else {}))
    ours = Path(house.ask(FOLDER))
    assert wrong != ours  # another processor or an edit has a folder of its own; what if it came to lie in ours?
    kept = ours.rename(ours.with_name("kept"))
    try:
        wrong.rename(ours)
        (ours / "compiled").write_text("another fingerprint\n")
        if stale == "version":
            assert house.ask(HASH) != house.hash  # as it lies there, it is run
            for index in ours.rglob("*.nbi"):
                make_older(index)
        status, said = house.run()
        assert status == 0, said
        assert_words(said)
        assert_whole(house)
    finally:
        shutil.rmtree(ours)
        kept.rename(ours)


def test_a_damaged_compiler_cache_is_not_believed(house):
    """What a failing disk may leave in the cache: halves, nothing, noise."""
    files = sorted((house.folder / ".cache").rglob("*.nb[ic]"))
    assert len(files) > 10
    rng = random.Random(5)
    for path in files:
        whole = path.read_bytes()
        damage = [whole[: len(whole) // 2], b"", whole.replace(b"0.", b"9.", 1), rng.randbytes(len(whole)), whole]
        path.write_bytes(rng.choice(damage))
    status, said = house.run()
    assert status == 0, said
    assert_whole(house)


def test_values_of_the_undisturbed_run_are_those_of_a_call(house):
    assert sweeps.survey(house.folder / "broken.yaml").attrs["content_hash"] == house.hash
    assert np.prod([20, 20, 2, 2, 3]) == 4800
