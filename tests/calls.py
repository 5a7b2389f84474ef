"""Calls of the command line in this process."""

from sweeps.__main__ import main


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
