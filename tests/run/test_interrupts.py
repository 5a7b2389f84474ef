"""Ctrl-C reaches every process of a terminal: those that a program started leave it to the program, and end with it."""

import os
import signal
import subprocess
import sys

import psutil
import pytest
from houses import wait_for

from sweeps import __main__

PROGRAM = """\
import multiprocessing, os, time
from sweeps import interrupts

def work(pipe):
    interrupts.end_with_the_parent()
    pipe.send(os.getpid())
    time.sleep(600)

if __name__ == "__main__":
    spawn = multiprocessing.get_context("spawn")
    ours, theirs = spawn.Pipe()
    with interrupts.left_to_the_parent():
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
    assert waiting(child) == {signal.SIGINT}
    parent.send_signal(number)
    parent.wait()
    assert wait_for(lambda: is_over(child))


def waiting(number):
    """Signals that a process has been sent and does not take."""
    with open(f"/proc/{number}/status") as file:
        told = dict(line.split(":", 1) for line in file)
    sent = (int(told["ShdPnd"], 16) | int(told["SigPnd"], 16)) & int(told["SigBlk"], 16)
    return {k + 1 for k in range(64) if sent >> k & 1}


def test_ctrl_c_while_the_commands_are_imported_is_no_traceback(monkeypatch, capsys):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(__main__, "_parser", interrupted)
    assert __main__.main(["show", "map.nc"]) == 130
    assert capsys.readouterr().err == "interrupted; what was finished stays\n"
