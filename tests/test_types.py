"""Types, checked by mypy: none is wrong in the public modules and a user's script, and ever fewer in the whole tree.

As a script (the hook `mypy` of pre-commit) it prints the problems, and exits with 1 if there are any.
"""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
WITHOUT_ERROR = ("sweeps/__init__.py", "sweeps/plot.py", "sweeps/mechanics/__init__.py", "tests/typed_example.py")
MAX_ERRORS = 265  # number of errors in the whole tree, by the mypy of constraints.txt; only ever lowered


def find_problems() -> list[str]:
    """Return the errors of mypy in files that should have none, and the number of all errors if it is too large."""
    command = [sys.executable, "-m", "mypy", "--hide-error-context", "--no-pretty"]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    errors = [line for line in run.stdout.splitlines() if ": error: " in line]
    if run.returncode not in (0, 1) or (run.returncode == 1 and not errors):
        return [f"mypy: exit status {run.returncode}: {run.stdout}{run.stderr}"]
    problems = [line for line in errors if line.startswith(WITHOUT_ERROR)]
    if len(errors) > MAX_ERRORS:
        problems.append(f"{len(errors)} errors in the whole tree (mypy prints them); allowed: at most {MAX_ERRORS}")
    return problems


@pytest.mark.slow
def test_types():
    pytest.importorskip("mypy", reason="mypy is not installed: pip install --group lint")
    assert not find_problems()


if __name__ == "__main__":
    problems = find_problems()
    print("\n".join(problems))
    sys.exit(bool(problems))
