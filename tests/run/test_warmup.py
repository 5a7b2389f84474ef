import functools
import io
import multiprocessing.connection
import signal
import threading
import time
import types

import pytest
import rich.console

from sweeps.run import progress, warmup


class System:
    """One that counts how often it is compiled."""

    kernels = ()

    def __init__(self, folder):
        self.mark = folder / "compiled"
        self.times = 0

    def compiled(self):
        return self.mark

    def compile(self):
        self.times += 1


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setattr(warmup, "cache_folder", lambda: tmp_path)
    return tmp_path


@pytest.fixture
def system(folder):
    return System(folder)


def test_what_is_compiled_and_whole_is_not_compiled_again(system):
    warmup.compile_system(system)
    assert system.times == 1
    warmup.compile_missing(system)
    assert system.times == 1


@pytest.mark.parametrize("said", [None, "another fingerprint\n", b"\xff"])
def test_what_is_missing_or_of_another_version_or_processor_is_compiled(system, said):
    if said is not None:
        system.mark.write_bytes(said if isinstance(said, bytes) else said.encode())
    warmup.compile_missing(system)
    assert system.times == 1
    warmup.compile_missing(system)  # it is noted
    assert system.times == 1


def test_what_calls_the_defaults_has_them_compiled_first_and_by_two_processes(system, folder, monkeypatch):
    done = []
    default = types.SimpleNamespace(kernels=("survey",), compiled=lambda: folder / "default")
    monkeypatch.setattr(warmup.systems, "resolve", lambda name: default)
    monkeypatch.setattr(warmup, "compile_kernels", lambda: (done.append("kernels"), warmup._say_compiled(default)))
    system.kernels = ("survey", "twist")
    warmup.compile_missing(system)
    warmup.compile_missing(default)
    assert (done, system.times) == (["kernels"], 1)


@pytest.mark.parametrize("fails", [False, True])
def test_two_processes_share_the_list_and_what_one_fails_in_the_other_does(folder, monkeypatch, fails):
    """The second process is played by a thread of this one."""
    done, lock = [], threading.Lock()

    def compilation(number):
        def run():
            time.sleep(0.01)
            if fails and threading.current_thread() is not threading.main_thread():
                raise OSError("it was killed")
            with lock:
                done.append(number)

        return run

    class Played(threading.Thread):
        exitcode, sentinel = 0, None

        def __init__(self, target, args, daemon):
            super().__init__(target=target, args=args, daemon=daemon)

        def run(self):
            try:
                super().run()
            except OSError:
                self.exitcode = 1

    context = types.SimpleNamespace(Process=Played)
    monkeypatch.setattr(warmup.multiprocessing, "get_context", lambda kind: context)
    monkeypatch.setattr(warmup.os, "sched_getaffinity", lambda process: {0, 1})
    monkeypatch.setattr(warmup.interrupts, "end_with_the_parent", lambda: None)
    monkeypatch.setattr(warmup, "startup", types.SimpleNamespace(configure=lambda: None))
    monkeypatch.setattr(warmup.systems, "compilations", lambda *_: [compilation(number) for number in range(9)])
    said = []
    monkeypatch.setattr(warmup, "_say_compiled", lambda system: said.append((system.name, len(set(done)))))
    warmup.compile_kernels()
    assert said == [("rigid_body", 9)]
    assert set(done) == set(range(9))
    assert fails or len(done) == 9


def test_the_second_process_is_over_before_their_folder_goes(monkeypatch):
    waits = multiprocessing.connection.wait  # for nothing, ten minutes long: what a new process can find by its name
    monkeypatch.setattr(warmup, "_compile_as_the_second", waits)
    with pytest.raises(KeyboardInterrupt), warmup._second([], 600.0) as second:
        raise KeyboardInterrupt
    assert second.exitcode == -signal.SIGTERM


def test_a_bar_on_a_terminal_counts_what_either_process_has_done(monkeypatch, tmp_path):
    shown = io.StringIO()
    terminal = functools.partial(rich.console.Console, file=shown, force_terminal=True, width=80)
    monkeypatch.setattr(progress, "Console", lambda stderr: terminal())
    (tmp_path / "1").touch()  # the other process has begun it
    with progress.pieces(3, "compiling", lambda: warmup._done(tmp_path)):
        assert list(warmup._left(enumerate("abc"), tmp_path)) == ["a", "c"]
    assert "2 of 3" in shown.getvalue()
