"""A ledger over a cache that a real Numba fills."""

import json
import os
import pickle
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from kernels import stored

ROOT = Path(stored.__file__).parents[1]
SOURCE = """\
from numba import njit

@njit(cache=True)
def double(x):
    return x + x
"""
CALL = "import kernels, doubled; print(doubled.double({}))"


class Cache:
    """Calls in processes of their own, which keep what they compile in one folder."""

    def __init__(self, folder):
        (folder / "doubled.py").write_text(SOURCE)
        self.environment = {
            **os.environ,
            "NUMBA_CACHE_DIR": str(folder / "chosen"),
            "PYTHONPATH": os.pathsep.join([str(ROOT), str(folder)]),
        }
        self.environment.pop("NUMBA_DISABLE_JIT", None)
        self.call("1")
        (self.folder,) = (folder / "chosen").iterdir()

    def call(self, argument):
        command = [sys.executable, "-c", CALL.format(argument)]
        return subprocess.run(
            command, env=self.environment, capture_output=True, text=True, check=True, cwd=ROOT
        ).stdout.strip()

    def files(self, kind):
        return sorted(self.folder.rglob(f"*.{kind}"))

    def ledger(self):
        return json.loads((self.folder / stored.LEDGER).read_text())


@pytest.fixture(scope="module")
def filled(tmp_path_factory):
    """A cache as a first call leaves it, and a copy to put in its place again."""
    cache = Cache(tmp_path_factory.mktemp("cache"))
    return cache, shutil.copytree(cache.folder, cache.folder.parent.with_name("kept"))


@pytest.fixture
def cache(filled):
    cache, kept = filled
    shutil.rmtree(cache.folder)
    shutil.copytree(kept, cache.folder)
    return cache


def flip(path, at):
    content = bytearray(path.read_bytes())
    content[at] ^= 1
    path.write_bytes(content)


@pytest.mark.slow
def test_what_is_sound_is_noted_and_stays(cache):
    before = {path: path.stat().st_mtime_ns for path in (*cache.files("nbi"), *cache.files("nbc"))}
    assert len(before) == 2
    assert set(cache.ledger()) == {str(path.relative_to(cache.folder)) for path in before}
    assert cache.call("2") == "4"
    assert cache.call("1.5") == "3.0"  # a second signature: the index grows
    assert len(cache.ledger()) == 3
    assert stored.is_whole(cache.folder)
    assert len(cache.files("nbc")) == 2
    first = min(before)
    assert before[first] == first.stat().st_mtime_ns


@pytest.mark.slow
def test_a_module_is_held_where_python_can_call_it(cache):
    assert stored.holds(cache.folder, "doubled")
    assert not stored.holds(cache.folder, "double")
    for file in list(cache.folder.rglob("*.nbi")):  # a part for the linker lies a folder deeper
        (file.parent / "parts").mkdir(exist_ok=True)
        file.rename(file.parent / "parts" / file.name)
    assert not stored.holds(cache.folder, "doubled")


@pytest.mark.slow
def test_code_that_has_changed_is_removed_and_made_again(cache):
    (code,) = cache.files("nbc")
    was = code.read_bytes()
    flip(code, len(was) // 2)
    stored.remove_damaged(cache.folder)
    assert not code.exists()
    assert cache.files("nbi")
    assert not stored.is_whole(cache.folder)
    assert cache.call("21") == "42"
    assert code.exists()
    assert stored.is_whole(cache.folder)


@pytest.mark.slow
@pytest.mark.parametrize("noted", [False, True])
@pytest.mark.parametrize("content", [b"", b"noise", pickle.dumps("0.1.0") + pickle.dumps((b"", {}))])
def test_an_index_that_numba_cannot_use_goes_with_its_code(cache, content, noted):
    if not noted:
        (cache.folder / stored.LEDGER).unlink()
    (index,) = cache.files("nbi")
    index.write_bytes(content)
    stored.remove_damaged(cache.folder)
    assert not cache.files("nb[ic]")
    assert not stored.is_whole(cache.folder)
    assert cache.call("21") == "42"
    stored.note(cache.folder)
    assert stored.is_whole(cache.folder)
    assert len(cache.files("nb[ic]")) == 2


@pytest.mark.slow
def test_an_index_that_gives_two_signatures_one_code_goes(cache):
    cache.call("1.5")
    (index,) = cache.files("nbi")
    index.write_bytes(index.read_bytes().replace(b".2.nbc", b".1.nbc"))
    stored.remove_damaged(cache.folder)
    assert not cache.files("nb[ic]")


@pytest.mark.slow
@pytest.mark.parametrize("ledger", ["", "{", "[]", '{"a": 1}'])
def test_a_damaged_ledger_is_written_anew(cache, ledger):
    (cache.folder / stored.LEDGER).write_text(ledger)
    stored.remove_damaged(cache.folder)
    assert len(cache.ledger()) == 2
    assert len(cache.files("nb[ic]")) == 2


def test_a_folder_that_is_not_there_is_left_alone(tmp_path):
    stored.remove_damaged(tmp_path / "nowhere")
    stored.note(tmp_path / "nowhere")
    assert stored.is_whole(tmp_path / "nowhere")
    assert not list(tmp_path.iterdir())


def test_one_process_at_a_time_has_the_ledger(tmp_path):
    fcntl = pytest.importorskip("fcntl")
    (lock := tmp_path / f".{stored.LEDGER}.lock").touch()
    with stored._locked(tmp_path), lock.open("r+") as other, pytest.raises(BlockingIOError):
        fcntl.flock(other, fcntl.LOCK_EX | fcntl.LOCK_NB)
    with lock.open("r+") as other:
        fcntl.flock(other, fcntl.LOCK_EX | fcntl.LOCK_NB)


SLOWLY = """
import time
import kernels
from kernels import stored
from numba.core.caching import IndexDataCacheFile as File
write = File._save_index
File._save_index = lambda *arguments: (time.sleep(0.3), write(*arguments))
{}
import doubled
doubled.double({})
"""


@pytest.mark.slow
@pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="nothing is stored without the compiler")
def test_what_processes_store_at_one_moment_is_all_there(cache):
    codes = [SLOWLY.format("stored.store_in_turn()", argument) for argument in ("1.0", "1j", "True")]
    begun = [subprocess.Popen([sys.executable, "-c", code], env=cache.environment, cwd=ROOT) for code in codes]
    assert [process.wait() for process in begun] == [0, 0, 0]
    with cache.files("nbi")[0].open("rb") as index:
        pickle.load(index)
        _, names = pickle.loads(index.read())
    assert len(set(names.values())) == len(names) == 4
    assert len(cache.files("nbc")) == 4


def test_numba_is_loaded_once_where_the_ledger_lags_behind(cache):
    (cache.folder / stored.LEDGER).unlink()  # as while another process is still compiling
    command = [sys.executable, "-c", "import kernels, numba, numba.core.ir_utils as of; print(of.numba is numba)"]
    done = subprocess.run(command, env=cache.environment, capture_output=True, text=True, check=True, cwd=ROOT)
    assert done.stdout.strip() == "True"
