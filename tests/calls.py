"""Calls of the command line in this process, and of Python code in a process of its own."""

import os
import subprocess
import sys
from pathlib import Path

from sweeps.__main__ import main

ROOT = Path(__file__).parents[1]


def python(code, *arguments, **settings):
    """Return what code prints in a fresh process of this checkout, whose environment has some settings besides."""
    environment = os.environ | {"PYTHONPATH": str(ROOT)} | settings
    command = [sys.executable, "-c", code, *map(str, arguments)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def said(capsys, *arguments, status=0):
    """What a call prints: its output, or its message where another status is expected."""
    capsys.readouterr()
    assert main([str(argument) for argument in arguments]) == status
    captured = capsys.readouterr()
    lines = captured.err.splitlines(keepends=True)
    error = "".join(line for line in lines if not line.startswith("compiling the kernels"))  # the first to need them
    assert (captured.out if status else error) == ""
    return error if status else captured.out


def refused(capsys, *arguments):
    """The one message of a refused call."""
    message = said(capsys, *arguments, status=2)
    assert "Traceback" not in message
    assert "allowed" in message
    return message
