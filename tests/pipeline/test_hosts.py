"""Two machines, one folder; reused numbers of processes; and machines with few resources."""

import ctypes
import errno
import os
import platform
import resource
import shutil
import struct
import subprocess
import sys
import tempfile
import time
from functools import cache
from pathlib import Path

import pytest
from maps import DEFINITION, write
from test_process_identity import mark_with
from workspaces import wait_for

import sweeps
from sweeps.__main__ import main
from sweeps.commands import definitions
from sweeps.pipeline import claims
from sweeps.process import process_identity
from sweeps.schema.refusals import DefinitionError

CLAIM = (
    "import sys; from sweeps.pipeline import claims; claims.claim(['a']); "
    "print('claimed', flush=True); sys.stdin.read()"
)


def is_free(name):
    """Whether a sweep can be claimed; gives it back at once."""
    try:
        handles = claims.claim([name])
    except DefinitionError:
        return False
    for handle in handles:
        os.close(handle)
    return True


def elsewhere(code):
    """Python in a container of its own, with another host name and process numbers that begin at 1."""
    inside = f'hostname other && exec {sys.executable} -c "{code}"'
    command = ["unshare", "--pid", "--fork", "--kill-child", "--uts", "--mount-proc", "sh", "-c", inside]
    if shutil.which("unshare") is None or subprocess.run([*command[:-1], "true"], check=False).returncode:
        pytest.skip("no containers can be made here: that takes root, and a machine that lets it")
    return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)


@pytest.mark.slow
@pytest.mark.faults
def test_a_claim_holds_in_another_container_and_ends_with_it(folder):
    process = elsewhere(CLAIM)
    assert process.stdout.readline() == "claimed\n"
    leftover = folder / "results/a" / f".figures.{(folder / 'results/a/.running').read_text().strip()}.x.part"
    leftover.mkdir()
    with pytest.raises(DefinitionError, match=r"another run is active there \(process \d+ on other\)"):
        claims.claim(["a"])
    assert leftover.exists()
    process.kill()
    process.wait()
    wait_for(lambda: is_free("a"))
    assert leftover.exists()  # its process cannot be inspected from here: it is given a day
    os.utime(leftover, (time.time() - process_identity.DAY - 60,) * 2)
    for handle in claims.claim(["a"]):
        os.close(handle)
    assert not leftover.exists()


# File systems without locks


@pytest.fixture
def without_locks(folder, monkeypatch):
    def flock(handle, how):
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(claims.fcntl, "flock", flock)
    (folder / "results/a").mkdir(parents=True)
    return folder / "results/a/.running"


CLAIMS = {
    "a living process": ({}, 0, False),
    "a number that nobody has": ({"number": "99999999"}, 0, True),
    "another machine": ({"boot": "0" * 12, "host": "other"}, 0, False),
    "another machine, not renewed": ({"boot": "0" * 12, "host": "other"}, claims.MAX_SILENCE + 60, True),
}


@pytest.mark.parametrize("name", CLAIMS)
def test_without_locks_a_claim_holds_by_its_word_while_it_is_renewed(without_locks, name):
    fields, ago, is_free = CLAIMS[name]
    without_locks.write_text(mark_with(**fields))
    os.utime(without_locks, (time.time() - ago,) * 2)
    if not is_free:
        with pytest.raises(DefinitionError, match="another run is active there"):
            claims.claim(["a"])
        return
    for handle in claims.claim(["a"]):
        os.close(handle)
    assert without_locks.read_text().strip() == process_identity.process_mark()


def without_flock(code):
    """Let flock fail with an error from here on, in this process and its children: a filter of the kernel's calls."""
    # BPF: load the call's number; if it is flock (73 on x86-64), return the error, else allow the call
    rules = [(0x20, 0, 0, 0), (0x15, 0, 1, 73), (0x06, 0, 0, 0x00050000 | code), (0x06, 0, 0, 0x7FFF0000)]
    text = ctypes.create_string_buffer(b"".join(struct.pack("HBBI", *rule) for rule in rules))
    program = ctypes.create_string_buffer(struct.pack("HxxxxxxQ", len(rules), ctypes.addressof(text)))
    libc = ctypes.CDLL(None)
    if libc.prctl(38, 1, 0, 0, 0) or libc.prctl(22, 2, program, 0, 0):  # no new privileges; seccomp with a filter
        raise OSError


def can_be_without_flock():
    try:
        return not subprocess.run(["true"], preexec_fn=lambda: without_flock(errno.ENOLCK), check=False).returncode
    except (OSError, subprocess.SubprocessError):
        return False


SHARD = ["shard", "mine.yaml", "1", "1", "-o", "shard.nc"]
WAYS = {  # who writes the file → (arguments of Python, settings, exit status)
    "a command": (["-m", "sweeps", *SHARD], {}, 0),
    "a user's process": (["-c", f"import sys; from sweeps.__main__ import main; sys.exit(main({SHARD}))"], {}, 2),
    "a command that must lock": (["-m", "sweeps", *SHARD], {"HDF5_USE_FILE_LOCKING": "TRUE"}, 2),
}


@pytest.mark.compiled
@pytest.mark.parametrize("code", [errno.ENOLCK, pytest.param(errno.EOPNOTSUPP, marks=pytest.mark.slow)])
@pytest.mark.parametrize("way", WAYS)
def test_a_file_is_written_without_locks_or_the_message_names_the_setting(folder, way, code):
    if platform.machine() != "x86_64" or not can_be_without_flock():
        pytest.skip("flock cannot be made to fail here")
    (folder / "mine.yaml").write_text("grid: {I1: 1.0, I2: 1.5, I3: 2.5, omega0: 1.0}")
    arguments, settings, status = WAYS[way]
    answer = subprocess.run(
        [sys.executable, *arguments],
        env={**os.environ, **settings},
        preexec_fn=lambda: without_flock(code),
        capture_output=True,
        text=True,
        check=False,
    )
    assert answer.returncode == status, answer.stderr
    assert (folder / "shard.nc").exists() == (status == 0)
    assert ("HDF5_USE_FILE_LOCKING=FALSE" in answer.stderr) == (status == 2)


@pytest.mark.slow
@pytest.mark.compiled
def test_a_whole_run_needs_no_locks(folder):
    if platform.machine() != "x86_64" or not can_be_without_flock():
        pytest.skip("flock cannot be made to fail here")
    few = "axes: [2]\nintegration: {variables: [omega_squared, regime]}\n"  # soon drawn
    (folder / "mine.yaml").write_text(few + "grid: {I1: [1.0, 1.1], I2: [1.5, 1.6], I3: 2.5, omega0: 1.0}")
    run = [sys.executable, "-m", "sweeps", "run", "mine.yaml", "--cores", "1"]
    subprocess.run(run, preexec_fn=lambda: without_flock(errno.ENOLCK), check=True)
    assert sweeps.open_map("results/mine").sizes["I1"] == 2


def test_a_claim_that_is_a_link_is_refused_and_its_target_untouched(folder):
    (folder / "results/a").mkdir(parents=True)
    (folder / "precious").write_text("of somebody else")
    (folder / "results/a/.running").symlink_to(folder / "precious")
    with pytest.raises(DefinitionError, match=r"\.running: is a link; allowed: a plain file"):
        claims.claim(["a"])
    assert (folder / "precious").read_text() == "of somebody else"


REMEDIES = {
    errno.ENOSPC: "enough disk space",
    errno.EDQUOT: "quota",
    errno.EACCES: "that this user can read and write",
    errno.EROFS: "a file system that can be written",
    errno.EMFILE: "limit of open files",
    errno.ENOLCK: "HDF5_USE_FILE_LOCKING",
    errno.EBADF: "files that can be read and written",
}


@pytest.mark.parametrize("code", REMEDIES)
def test_a_message_blames_the_disk_for_what_is_the_disks_alone(monkeypatch, capsys, code):
    def fail(args):
        raise OSError(code, os.strerror(code), "map.nc")

    monkeypatch.setattr(definitions, "_check_definition", fail)
    assert main(["check", "tiny"]) == 2
    message = capsys.readouterr().err
    assert message.startswith(f"map.nc: {os.strerror(code)}; allowed: ")
    assert REMEDIES[code] in message
    assert ("disk" in message) == (code in (errno.ENOSPC, errno.EDQUOT))


# Machines that give little


@pytest.fixture(scope="module")
def small_map(tmp_path_factory):
    few = {"axes": [2], "integration": {"variables": ["omega_squared", "regime"]}}  # soon drawn
    return write(tmp_path_factory.mktemp("whole"), DEFINITION | few)


def with_limit(what, value):
    return lambda: resource.setrlimit(what, (value, value))


def somebody_else():
    os.setgid(65534)
    os.setuid(65534)


@cache
def can_be_run_by_somebody_else():
    command = [sys.executable, "-c", "import sweeps.__main__, xarray, numba"]
    try:
        return not subprocess.run(command, preexec_fn=somebody_else, capture_output=True, check=False).returncode
    except OSError:
        return False


NOBODY = {"HOME": "/nonexistent", "XDG_CACHE_HOME": None}
MACHINES = {
    "64 open files": ({}, with_limit(resource.RLIMIT_NOFILE, 64)),
    "1.5 GB": ({}, with_limit(resource.RLIMIT_AS, 1_500_000_000)),
    "files of 10 kB": ({}, with_limit(resource.RLIMIT_FSIZE, 10_000)),
    "no home": ({"HOME": None, "XDG_CACHE_HOME": None}, None),
    "a home that cannot be written": ({"HOME": "/proc", "XDG_CACHE_HOME": None}, None),
    "no folder for temporary files": ({"TMPDIR": "/proc"}, None),
    "the C locale": ({"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0", "PYTHONIOENCODING": None}, None),
    "settings for other machines": ({"MPLBACKEND": "nonsense", "TZ": "Nowhere", "COLUMNS": "-5"}, None),
    "another user": (NOBODY, somebody_else),
    "another user, whose folder it is": (NOBODY, somebody_else),
    "another user, who came in by no door": (NOBODY, somebody_else),
}
COMMANDS = {
    "show": ["show", "map.nc"],
    "slice": ["slice", "map.nc", "--axis", "2", "--omega0", "1", "--epsilon", "1e-6", "-o", "slice.nc"],
    "report": ["report", "map.nc", "-o", "report.html"],
    "figures": ["figures", "map.nc", "-o", "figures"],
    "shard": ["shard", "symmetric", "1", "2", "-o", "shard.nc"],  # its kernels are soonest compiled
}


@pytest.fixture
def place(machine, tmp_path):
    """A folder that everybody may enter; by way of the tests' own nobody else may."""
    if "no door" in machine:
        yield tmp_path
        return
    with tempfile.TemporaryDirectory() as name:
        yield Path(name)


@pytest.mark.slow
@pytest.mark.faults
@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("machine", MACHINES)
def test_a_machine_that_gives_little_is_enough_or_is_told(place, small_map, machine, command):
    settings, before = MACHINES[machine]
    if before is somebody_else and os.geteuid():
        pytest.skip("to become somebody else takes root")
    if before is somebody_else and not can_be_run_by_somebody_else():
        pytest.skip("this Python lies where nobody else may look")
    shutil.copy(small_map, place)
    place.chmod(0o777 if "whose" in machine else 0o755)
    environment = {name: value for name, value in {**os.environ, **settings}.items() if value is not None}
    answer = subprocess.run(
        [sys.executable, "-m", "sweeps", *COMMANDS[command]],
        env=environment,
        cwd=place,
        preexec_fn=before,
        capture_output=True,
        text=True,
        errors="replace",
        check=False,
    )
    assert answer.returncode in ((0,) if "whose" in machine else (0, 2)), answer.stderr[-2000:]
    assert "Traceback" not in answer.stderr
    if answer.returncode == 2:
        assert answer.stderr.strip().count("\n") == 0
        assert {path.name for path in place.iterdir()} <= {"map.nc", "results"}
