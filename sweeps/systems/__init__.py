"""The systems of equations of motion that a definition can name, each imported when it is asked for."""

from functools import cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from sweeps.schema.definition import DEFAULT_SYSTEM
from sweeps.systems.system import System

if TYPE_CHECKING:
    import xarray as xr

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


def of_map(ds: "xr.Dataset") -> System:
    """The system of a map, with all that a reader of maps needs: the one way to it from a file.

    A Python file that a map names is never run, for its author may be anybody: what such a map holds is read as any
    oscillator's is.

    Raises:
        KeyError: for a name that is no system's.
    """
    name = str(ds.attrs.get("system", DEFAULT_SYSTEM))
    if is_file(name):
        return import_module("sweeps.systems.oscillator.system").unread(name)
    return resolve(name)


def compile_shared() -> None:
    """Compiles all that is not generated for one sweep's system alone."""
    for name in MODULES:
        resolve(name).compile()
    import_module("sweeps.systems.oscillator.system").compile_shared()


def moving() -> tuple[str, ...]:
    """Names of the systems whose maps have a motion at each point."""
    return tuple(name for name in MODULES if type(resolve(name)).motion is not System.motion)
