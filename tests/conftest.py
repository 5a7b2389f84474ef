"""Settings of the whole test run: the same examples every time, and no time limit on any of them.

Tests run in parallel, a process a core (pytest-xdist). They share the compiled kernels: compiled once, before the
processes start; further code that a test compiles is stored by one process at a time.
"""

import contextlib
import gc
import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as commands set it: the tests' processes share the cores

import signal
import subprocess
import sys

import numba
import pytest
from hypothesis import settings

from sweeps import systems
from sweeps.points import compile_kernels

LEFT_TO_THE_SLOW = {
    "flow.spectrum",
    "flow.projection",
    "flow.invariants",
    "flow.flows",
    "events.in_space",
}  # kernels that no quick test needs

settings.register_profile("fixed", derandomize=True, deadline=None, max_examples=15)
settings.register_profile("without_jit", derandomize=True, deadline=None, max_examples=5)
settings.load_profile("without_jit" if numba.config.DISABLE_JIT else "fixed")


def pytest_configure(config):
    """Compile the kernels if processes share them and no earlier run has compiled them.

    Kernels that only slow tests need are compiled only if slow tests are selected.
    """
    if (
        signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    ):  # in a shell's background; tests interrupt processes that they start
        signal.signal(signal.SIGINT, signal.default_int_handler)
    slow = "slow" in config.option.markexpr and "not slow" not in config.option.markexpr
    examples = [example for example in systems.all_examples() if slow or example.module not in LEFT_TO_THE_SLOW]
    shared = not hasattr(config, "workerinput") and getattr(config.option, "numprocesses", None)
    if shared and not numba.config.DISABLE_JIT and compile_kernels.missing_examples(examples):
        with byte_code_made_beside(config.args):
            compile_kernels.compile_examples(examples)


@contextlib.contextmanager
def byte_code_made_beside(arguments):
    """Collect once, in a parallel process without kernels, to write byte code that each test process would compile."""
    plain = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    command = [sys.executable, "-m", "pytest", "--collect-only", "-q", "-n", "0", "-p", "no:cacheprovider", *arguments]
    with subprocess.Popen(command, env=plain, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL):
        yield


def pytest_collection_modifyitems(config, items):
    """Without compiled kernels, deselect tests of minutes, and ignore divisions by zero, which kernels handle.

    Such a run tests the lines of the kernels: the first, the middle and the last case of a test suffice for it; runs
    with compiled kernels test all cases.
    """
    if numba.config.DISABLE_JIT:
        selection = _three_of_each(items)
        config.hook.pytest_deselected(items=[item for item in items if item not in selection])
        items[:] = selection
        for item in items:
            item.add_marker(pytest.mark.filterwarnings("ignore::RuntimeWarning"))
            if item.get_closest_marker("compiled"):
                item.add_marker(pytest.mark.skip(reason="minutes in plain Python"))


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """Exclude imported objects, which stay, from garbage collection."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


def _three_of_each(items):
    """Return the first, the middle and the last case of each test."""
    cases = {}
    for item in items:
        cases.setdefault((item.path, item.originalname), []).append(item)
    return [case for of_one in cases.values() for case in dict.fromkeys(of_one[k] for k in (0, len(of_one) // 2, -1))]


if sys.prefix != sys.base_prefix:  # modules that pip left uncompiled are compiled once by the tests' many processes
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    sys.dont_write_bytecode = False


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty folder in which the test runs."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture(scope="module")
def tiny():
    """The map of the smallest sweep that ships."""
    import sweeps

    return sweeps.survey("tiny")


@pytest.fixture
def few_frames(monkeypatch):
    """Animations of three frames, and no film of them: they have tests of their own."""
    from sweeps.systems.oscillator.presentation import figure_motion
    from sweeps.systems.relative_equilibrium.presentation import figure_flat_spin
    from sweeps.systems.rigid_body.presentation import figure_flip
    from sweeps.views import films

    for module in (figure_flip, figure_motion, figure_flat_spin):
        monkeypatch.setattr(module, "FRAMES", 3)
    monkeypatch.setattr(films, "ffmpeg_path", lambda: None)


@pytest.fixture(scope="session")
def workspace(tmp_path_factory):
    """A copy of the sources with the kernels compiled, and the content hash of the map of its definition."""
    from workspaces import Workspace

    import sweeps

    workspace = Workspace(tmp_path_factory.mktemp("workspace"))
    workspace.hash = sweeps.survey(workspace.folder / "broken.yaml").attrs["content_hash"]
    return workspace
