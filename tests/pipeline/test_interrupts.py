"""Ctrl-C reaches every process of a terminal: those that a program started leave it to the program, and end with it."""

import multiprocessing
import os
import signal
import subprocess
import sys
import textwrap
import threading
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import psutil
import pytest
from workspaces import PATIENCE, wait_for

import sweeps
from sweeps import __main__
from sweeps.__main__ import main
from sweeps.commands import program
from sweeps.maps import storage
from sweeps.process import interrupts

PROGRAM = """\
import multiprocessing, os, time
from sweeps.process import interrupts

def work(pipe):
    interrupts.exit_with_parent()
    pipe.send(os.getpid())
    time.sleep(600)

if __name__ == "__main__":
    spawn = multiprocessing.get_context("spawn")
    ours, theirs = spawn.Pipe()
    with interrupts.ignore_interrupts():
        child = spawn.Process(target=work, args=(theirs,))
        child.start()
    print(ours.recv(), flush=True)
    time.sleep(600)
"""


def is_over(number):
    try:
        return psutil.Process(number).status() == psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return True


@pytest.mark.skipif(sys.platform != "linux", reason="asks /proc")
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_a_process_does_not_hear_ctrl_c_and_ends_with_its_parent(tmp_path, number):
    (tmp_path / "program.py").write_text(PROGRAM)
    words = [sys.executable, "program.py"]
    parent = subprocess.Popen(words, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    child = int(parent.stdout.readline())
    os.kill(child, signal.SIGINT)
    assert pending_signals(child) == {signal.SIGINT}
    parent.send_signal(number)
    parent.wait()
    assert wait_for(lambda: is_over(child))


def pending_signals(number):
    """Signals that a process has been sent and does not take."""
    with open(f"/proc/{number}/status") as file:
        fields = dict(line.split(":", 1) for line in file)
    pending = (int(fields["ShdPnd"], 16) | int(fields["SigPnd"], 16)) & int(fields["SigBlk"], 16)
    return {k + 1 for k in range(64) if pending >> k & 1}


def test_ctrl_c_while_the_commands_are_imported_is_no_traceback(monkeypatch, capsys):
    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(program, "build", interrupt)
    assert __main__.main(["show", "map.nc"]) == 130
    assert capsys.readouterr().err == "interrupted\n"


LOOK_CODE = """\
import os, signal
from sweeps.reading import sandbox

os.register_at_fork(after_in_parent=lambda: os.kill(os.getpid(), signal.SIGINT))
try:
    sandbox.run_in_child(lambda: {}, 1)
except KeyboardInterrupt:
    print("heard")
print(signal.pthread_sigmask(signal.SIG_BLOCK, ()))
"""


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere nothing is forked")
def test_ctrl_c_is_heard_where_a_process_has_just_forked_to_look_at_a_map():
    process = subprocess.run([sys.executable, "-c", LOOK_CODE], capture_output=True, text=True, check=True)
    assert (process.stdout, process.stderr) == ("heard\nset()\n", "")


INTERRUPTED = """\
import contextlib, ctypes, os, signal, time
from sweeps import __main__
from sweeps.commands import program

def interrupt(*_):
    os.kill(os.getpid(), signal.SIGINT)

class Disposed:
    __del__ = interrupt

class Asked:
    __getattr__ = interrupt

class Parser:
    def parse_args(self, words):
        return self

    def run(self, args):
%s

program.build = lambda: (Parser(), {})
print(__main__.main(["check"]))
assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
assert signal.getsignal(signal.SIGALRM) == signal.SIG_DFL
assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)
"""
SWALLOWED = {
    "as Python disposes of an object": "Disposed()",
    "by a library": "with contextlib.suppress(BaseException): interrupt()",
    "by a library, again and again": """
for k in range(3):
    with contextlib.suppress(BaseException):
        interrupt() if k == 0 else time.sleep(20)
""",
    "by C": "ctypes.pythonapi.PyObject_HasAttrString(ctypes.py_object(Asked()), b'name')",
}


def after_ctrl_c(code):
    """Run a command that does this; return its standard output and standard error."""
    words = [sys.executable, "-c", INTERRUPTED % textwrap.indent(code, " " * 8)]
    process = subprocess.run(words, capture_output=True, text=True, check=True)
    return process.stdout, process.stderr


@pytest.mark.parametrize("code", SWALLOWED.values(), ids=SWALLOWED)
@pytest.mark.parametrize("next_code", ["time.sleep(20); print('not heard')", ""], ids=["it goes on", "it ends"])
def test_ctrl_c_that_is_swallowed_is_heard(code, next_code):
    assert after_ctrl_c(f"{code}\n{next_code}") == ("130\n", "interrupted\n")


CLEANING = """
@contextlib.contextmanager
def cleaned():
    try:
        yield
    finally:
        try:
            raise OSError
        except OSError:
            time.sleep(10 * __main__.MOMENT)
        print("cleaned")

with cleaned():
    interrupt()
"""


def test_what_is_done_because_of_ctrl_c_is_not_cut_short():
    assert after_ctrl_c(CLEANING) == ("cleaned\n130\n", "interrupted\n")


def test_a_pool_that_is_abandoned_leaves_no_thread():
    before = threading.enumerate()
    pool = ProcessPoolExecutor(1, multiprocessing.get_context("spawn"))
    pool.submit(int)
    interrupts.end_processes(pool)
    assert threading.enumerate() == before


ROOT = Path(sweeps.__file__).parents[1]
MINE = {"grid": {"I1": {"start": 0.5, "stop": 1.5, "num": 6}, "I2": [0.6, 0.75, 0.9], "I3": 1.0, "omega0": 1.0}}


# Code of the disturbed command itself, as a test's own process may have to wait until all is drawn.
DRAW_CODE = """\
import multiprocessing, os, runpy, signal, threading, time

def disturb():
    while not multiprocessing.active_children():
        time.sleep(0.01)
    time.sleep(%s)
    %s

threading.Thread(target=disturb, daemon=True).start()
runpy.run_module("sweeps", run_name="__main__", alter_sys=True)
"""


def draw_and_disturb(folder, seconds, how):
    """Run `figures`, which executes the code `how` so many seconds after its worker was started.

    It has a folder, a process group and a folder for temporary files of its own. Return its process, standard output
    and standard error.
    """
    storage.write_map(sweeps.survey(MINE), folder / "map.nc")
    (temporary := folder / "temporary").mkdir()
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "TMPDIR": str(temporary)}
    options = {"cwd": folder, "env": environment, "start_new_session": True, "text": True}
    options |= {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    words = [sys.executable, "-c", DRAW_CODE % (seconds, how), "figures", "map.nc", "-o", "drawn"]
    drawing = subprocess.Popen(words, **options)
    return drawing, *drawing.communicate(timeout=PATIENCE)


def is_in(group, number):
    """Return whether a process is in a process group."""
    try:
        return os.getpgid(number) == group
    except ProcessLookupError:
        return False


@pytest.mark.slow
@pytest.mark.parametrize("seconds", [0.0, 0.7])
def test_ctrl_c_ends_both_processes_that_draw_and_leaves_nothing(tmp_path, seconds):
    process, out, message = draw_and_disturb(tmp_path, seconds, "os.killpg(0, signal.SIGINT)")
    assert (out, message) == ("", "interrupted\n")
    assert process.returncode in (130, -signal.SIGINT)  # the same to a shell; Python's own where it made a class
    assert wait_for(lambda: all(is_over(number) for number in psutil.pids() if is_in(process.pid, number)))
    assert {path.name for path in tmp_path.iterdir()} == {"map.nc", "temporary"}
    assert not any((tmp_path / "temporary").iterdir())


@pytest.mark.slow
@pytest.mark.parametrize("seconds", [0.0, 1.0])
def test_a_drawing_process_that_is_killed_is_one_message_and_the_next_call_goes_on(tmp_path, seconds):
    process, _, message = draw_and_disturb(
        tmp_path, seconds, "[child.kill() for child in multiprocessing.active_children()]"
    )
    assert (process.returncode, message.count("\n")) in ((1, 1), (0, 0)), message  # 0: it had drawn its last picture
    assert not message or message.startswith("a process that this command started was ended from outside")
    assert not list(tmp_path.glob(".drawn*"))
    assert main(["figures", str(tmp_path / "map.nc"), "-o", str(tmp_path / "drawn"), "--only", "stability"]) == 0
    assert list((tmp_path / "drawn").glob("*.png"))
