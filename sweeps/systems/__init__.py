"""The systems of equations of motion that a definition can name, each imported when it is asked for."""

from functools import cache
from importlib import import_module

from sweeps.systems.system import System

DEFAULT = "rigid_body"
MODULES = {"rigid_body": "sweeps.systems.rigid_body", "symmetric_top": "sweeps.systems.symmetric_top"}


def names() -> tuple[str, ...]:
    """Names of the systems that ship."""
    return tuple(MODULES)


@cache
def resolve(name: str) -> System:
    """The system of a name.

    Raises:
        KeyError: for a name that is no system's.
    """
    return import_module(MODULES[name]).SYSTEM
