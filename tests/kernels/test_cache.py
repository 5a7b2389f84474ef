"""The cache of kernels, filled by other processes, forks of the test's: stale and damaged code is found."""

import errno
import multiprocessing
import os
import shutil
import sys
from pathlib import Path

import pytest
from calls import python

from kernels.compile import cache, fingerprint

ROOT = Path(cache.__file__).parents[2]
SOURCE = """\
from kernels.estimator import statuses
from kernels.compile.jit import OPTIONS, njit

@njit(**OPTIONS)
def double(x):
    return x + x

def times(factor):
    @njit(name=f"times_{factor}", **OPTIONS)
    def multiplied(x):
        return factor * x
    return multiplied

twice, thrice = times(2.0), times(3.0)

@njit(**OPTIONS)
def both(x):
    return twice(x) + 100.0 * thrice(x)
"""
CALL = """
import doubled
send((doubled.{function}({argument}), sum(doubled.{function}.stats.cache_hits.values())))
"""
FORK = multiprocessing.get_context("fork")


class Cache:
    """Calls in separate processes, which store compiled code in one folder."""

    def __init__(self, folder):
        (folder / "doubled.py").write_text(SOURCE)
        self.parent = folder
        self.call(1)
        (self.folder,) = (folder / "cache" / "polhode").glob("*-*")

    def begin(self, code):
        """Run code in a new process; return the process, and the end of the pipe into which its `send` puts a value."""
        receiver, sender = FORK.Pipe(duplex=False)
        process = FORK.Process(target=self._run, args=(code, sender.send))
        process.start()
        sender.close()
        return process, receiver

    def _run(self, code, send):
        os.environ |= {"XDG_CACHE_HOME": str(self.parent / "cache"), "NUMBA_CACHE_DIR": ""}
        sys.path.insert(0, str(self.parent))
        exec(code, {"send": send})

    def call(self, argument, function="double"):
        """Return the value of a function in a new process, and the number of its codes that were loaded."""
        process, receiver = self.begin(CALL.format(function=function, argument=argument))
        value = receiver.recv()
        process.join()
        assert process.exitcode == 0
        return value

    def files(self):
        return sorted((self.folder / "code").iterdir())


@pytest.fixture(scope="module")
def cache_and_backup(tmp_path_factory):
    """A cache as a first call leaves it, and a copy to put in its place again."""
    cache = Cache(tmp_path_factory.mktemp("cache"))
    return cache, shutil.copytree(cache.folder, cache.folder.parent.with_name("kept"))


@pytest.fixture
def warm_cache(cache_and_backup):
    cache, backup = cache_and_backup
    shutil.rmtree(cache.folder)
    shutil.copytree(backup, cache.folder)
    return cache


pytestmark = pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="nothing is stored uncompiled")


def test_what_is_sound_is_loaded_and_stays(warm_cache):
    (file,) = warm_cache.files()
    before = file.stat().st_mtime_ns
    assert warm_cache.call(2) == (4, 1)
    assert file.stat().st_mtime_ns == before
    assert file.stat().st_mode & 0o777 == 0o600


@pytest.mark.slow
def test_code_that_has_changed_is_not_run_but_made_again(warm_cache):
    (file,) = warm_cache.files()

    def flip(at):
        content = bytearray(file.read_bytes())
        content[at] ^= 1
        return content

    for damaged in (lambda: flip(0), lambda: flip(-1), lambda: file.read_bytes()[:999]):
        file.write_bytes(damaged())
        assert warm_cache.call(21) == (42, 0)
    assert warm_cache.call(21) == (42, 1)


@pytest.mark.slow
def test_code_of_another_signature_in_its_place_is_not_run(warm_cache):
    (integer_code,) = warm_cache.files()
    warm_cache.call(1.5)
    (real,) = set(warm_cache.files()) - {integer_code}
    shutil.copy(integer_code, real)
    assert warm_cache.call(1.5) == (3.0, 0)


@pytest.mark.slow
def test_an_edit_of_an_imported_kernel_compiles_what_imports_it_and_nothing_else(tmp_path, monkeypatch):
    checkout = tmp_path / "checkout"
    shutil.copytree(ROOT / "kernels", checkout / "kernels", ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.chdir(checkout)
    (checkout / "user.py").write_text(SOURCE)
    (checkout / "other.py").write_text(SOURCE.replace("from kernels.estimator import statuses\n", ""))
    call = "import user, other; print(*(sum(m.double.stats.cache_hits.values()) for m in (user, other) if m.double(1)))"
    places = {"XDG_CACHE_HOME": str(tmp_path / "cache"), "PYTHONPATH": str(checkout), "NUMBA_CACHE_DIR": ""}

    def count_loaded():
        return [int(count) for count in python(call, **places).split()]

    assert [count_loaded(), count_loaded()] == [[0, 0], [1, 1]]
    with (checkout / "kernels" / "estimator" / "statuses.py").open("a") as file:
        file.write("# edited\n")
    assert [count_loaded(), count_loaded()] == [[0, 1], [1, 1]]


@pytest.mark.slow
def test_closures_of_one_place_that_several_processes_compiled_are_not_taken_for_each_other(warm_cache):
    assert [warm_cache.call(1.0, function)[0] for function in ("twice", "both")] == [2.0, 302.0]


@pytest.mark.slow
def test_what_processes_store_at_one_moment_is_all_there(warm_cache):
    processes = [warm_cache.begin(CALL.format(function="double", argument=argument)) for argument in 2 * (1.0, 1j)]
    for process, _ in processes:
        process.join()
        assert process.exitcode == 0
    assert len(warm_cache.files()) == 3
    code = "import doubled; [doubled.double(x) for x in (1, 1.0, 1j)]; "
    process, receiver = warm_cache.begin(code + "send(sum(doubled.double.stats.cache_hits.values()))")
    assert receiver.recv() == 3
    process.join()


SLOWLY = """
from pathlib import Path
write = Path.write_bytes
def write_slowly(self, content):
    with self.open("wb") as file:
        file.write(content[:999])
        file.flush()
        send("half")
        import time; time.sleep(60)
Path.write_bytes = write_slowly
import doubled; doubled.double(1.0)
"""


@pytest.mark.slow
def test_a_process_killed_while_it_stores_leaves_nothing_that_is_run(warm_cache):
    process, receiver = warm_cache.begin(SLOWLY)
    assert receiver.recv() == "half"
    process.kill()
    process.join()
    assert warm_cache.call(1.0) == (2.0, 0)
    assert warm_cache.call(1.0) == (2.0, 1)


@pytest.mark.slow
def test_where_nothing_can_be_written_code_is_compiled_for_the_process_alone(warm_cache):
    shutil.rmtree(warm_cache.folder / "code")
    (warm_cache.folder / "code").write_text("a file stands where the folder should")
    assert warm_cache.call(1j) == (2j, 0)


# The folder


@pytest.fixture
def home(tmp_path, monkeypatch):
    """Set a user's cache folder, and a second folder for temporary files."""
    cache._folder.cache_clear()
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(cache.tempfile, "tempdir", str(tmp_path))
    yield tmp_path / "cache"
    cache._folder.cache_clear()


def test_a_machine_and_a_checkout_have_a_folder(home, tmp_path):
    folder = cache.cache_folder()
    assert folder.parent == home / "polhode"
    assert folder.is_dir()
    assert folder.name.startswith(fingerprint.machine()[:16])
    second_folder = cache._folder("", fingerprint.home(), tmp_path / "another" / "kernels")
    assert second_folder.parent == folder.parent
    assert second_folder != folder


def test_without_a_named_cache_it_is_the_home_folders(tmp_path, home, monkeypatch):
    for setting in (None, ""):
        if setting is None:
            monkeypatch.delenv("XDG_CACHE_HOME")
        else:
            monkeypatch.setenv("XDG_CACHE_HOME", setting)
        monkeypatch.setattr(Path, "home", lambda: tmp_path / "home")
        assert cache.cache_folder().parent == tmp_path / "home" / ".cache" / "polhode"


def test_a_cache_of_somebody_elses_is_not_used(home, tmp_path, monkeypatch):
    ours, uid = cache.cache_folder(), os.getuid()
    assert fingerprint.is_safe(ours)
    monkeypatch.setattr(os, "getuid", lambda: uid + 1)
    cache._folder.cache_clear()
    folder = cache.cache_folder()
    assert folder.parent.parent == tmp_path
    assert folder.parent.name.startswith("polhode-")
    assert folder.name == ours.name
    assert folder.parent.stat().st_mode & 0o777 == 0o700


def test_a_folder_in_which_nothing_can_be_kept_says_why(home, tmp_path, monkeypatch):
    assert cache.why_unkept() == ""
    assert not list(cache.cache_folder().iterdir())
    for number in (errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EACCES, errno.EIO):

        def refuse(path, content, number=number):
            raise OSError(number, os.strerror(number))

        with monkeypatch.context() as patch:
            patch.setattr(cache, "replace", refuse)
            assert cache.why_unkept() == f"{cache.cache_folder()}: {os.strerror(number)}"
    uid = os.getuid()
    monkeypatch.setattr(os, "getuid", lambda: uid + 1)  # everything belongs to somebody else
    cache._folder.cache_clear()
    assert cache.why_unkept() == f"{home / 'polhode'}: belongs to another user, or cannot be written"
    shutil.rmtree(home)
    home.write_text("a file stands where the folder should")
    assert cache.why_unkept() == f"{home / 'polhode'}: {os.strerror(errno.ENOTDIR)}"
