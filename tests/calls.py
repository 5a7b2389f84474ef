"""Calls of the command line in this process, and of Python code in a process of its own."""

import os
import re
import subprocess
import sys
from pathlib import Path

from sweeps.__main__ import main

ROOT = Path(__file__).parents[1]


def python(code, *arguments, **settings):
    """Return the output of code in a fresh process of this checkout, with some settings added to the environment."""
    environment = os.environ | {"PYTHONPATH": str(ROOT)} | settings
    command = [sys.executable, "-c", code, *map(str, arguments)]
    process = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert process.returncode == 0, process.stderr
    return process.stdout


def run_command(capsys, *arguments, status=0):
    """Return the output of a command, or its message if the expected status is not 0."""
    capsys.readouterr()
    assert main([str(argument) for argument in arguments]) == status
    captured = capsys.readouterr()
    lines = captured.err.splitlines(keepends=True)
    # what takes long on this machine at this moment says so: the first use of kernels, and equations under load
    error = "".join(line for line in lines if not re.match("compiling the kernels|.*: deriving its equations", line))
    assert (captured.out if status else error) == ""
    return error if status else captured.out


def refusal_message(capsys, *arguments):
    """Return the single message of a refused command."""
    message = run_command(capsys, *arguments, status=2)
    assert "Traceback" not in message
    assert "allowed" in message
    return message
