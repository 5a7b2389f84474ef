"""The systems of equations of motion that a definition can name, each imported when it is asked for."""

from functools import cache
from importlib import import_module
from pathlib import Path

from sweeps.systems.system import System

DEFAULT = "rigid_body"
MODULES = {"rigid_body": "sweeps.systems.rigid_body.system", "symmetric_top": "sweeps.systems.symmetric_top.system"}
DESCRIPTIONS = Path(__file__).parents[1] / "mechanics" / "library"


@cache
def names() -> tuple[str, ...]:
    """Names of the systems that ship."""
    described = (path.stem for path in DESCRIPTIONS.glob("*.py") if path.stem != "__init__")
    return (*MODULES, *sorted(described))


def is_file(name: object) -> bool:
    """Whether a definition's `system` means a Python file that describes a system."""
    return isinstance(name, str) and name.endswith(".py")


@cache
def resolve(name: str) -> System:
    """The system of a name, or of the Python file of that path (relative to where the program runs), which is run.

    Raises:
        KeyError: for a name that is no system's.
        DefinitionError: for a file that cannot be run or describes no system.
    """
    if name in MODULES:
        return import_module(MODULES[name]).SYSTEM
    oscillator = import_module("sweeps.systems.oscillator.system")
    if is_file(name):
        return oscillator.of_file(name)
    if name not in names():
        raise KeyError(name)
    return oscillator.of_library(name)
