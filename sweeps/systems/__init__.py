"""Systems of equations of motion that a definition can name.

A system is one package: the module `system` with its variables, the model of its definition, its columns, motion and
references (see `Dynamics`), whose `SYSTEM` it is, and `presentation`: figures, page, words and colours (see
`sweeps.systems.presentation`). Packages without `system` (`bodies`, `rates`) are what several of them share. A package
here is found by itself; a package of somebody else names its module in an entry point of the group `polhode.systems`,
and edits nothing.
"""

from collections.abc import Collection, Mapping
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sweeps.schema import DEFAULT_SYSTEM
from sweeps.schema.boxes import Dataset
from sweeps.systems.system import Dynamics, Example

if TYPE_CHECKING:
    from sweeps.systems.described import Described
    from sweeps.systems.presentation import Presentation

GROUP = "polhode.systems"  # entry points by which other packages bring systems: name = module with a SYSTEM
# of definitions; what else a program gives as a keyword is a key of their grid
KEYS = ("title", "axes", "bodies", "draws", "grid", "integration", "keep", "method", "modulation", "sample", "seed")
KEYS += ("shards", "start_at", "system", "table", "turns", "twist", "uncertainty")
_HERE = Path(__file__).parent
_OURS = [p for p in sorted(_HERE.glob("*/system.py")) if "\nSYSTEM = " in p.read_text(encoding="utf-8")]
MODULES = {path.parent.name: f"sweeps.systems.{path.parent.name}.system" for path in _OURS}
DESCRIBED = tuple(f"sweeps.systems.{kind}.system" for kind in ("periodic", "relative_equilibrium", "oscillator"))
DESCRIPTIONS = Path(__file__).parents[1] / "mechanics" / "library"


@cache
def names() -> tuple[str, ...]:
    """Return the names of the systems: shipped, described, and of other packages."""
    ours = (*MODULES, *described_names())
    return (*ours, *(name for name in sorted(_brought()) if name not in ours))


@cache
def described_names() -> tuple[str, ...]:
    """Return the names of the described systems that ship."""
    return tuple(sorted(path.stem for path in DESCRIPTIONS.rglob("*.py") if path.stem != "__init__"))


@cache
def _brought() -> dict[str, str]:
    """Return name → module of each system that another package brings."""
    from importlib.metadata import entry_points

    return {point.name: point.module for point in entry_points(group=GROUP)}


def kinds() -> "list[type[Described]]":
    """Return the kinds of systems that a description can make, the more specific first."""
    return [import_module(module).KIND for module in DESCRIBED]


def forget() -> None:
    """Forget the systems of other packages, so that they are looked up again."""
    for remembered in (names, _brought, resolve):
        remembered.cache_clear()


def is_file(name: object) -> bool:
    """Return True if a definition's `system` names a Python file that describes a system."""
    return isinstance(name, str) and name.endswith(".py")


@cache
def resolve(name: str, folder: str = "") -> Dynamics:
    """Return the system of a name, or of a Python file, which is run.

    Args:
        name: what a definition's `system` says.
        folder: where a file's path starts, the definition's folder; left out, where the program runs.

    Raises:
        KeyError: for a name that is no system's.
        DefinitionError: for a file that cannot be run or describes no system.
    """
    if name in MODULES:
        return import_module(MODULES[name]).SYSTEM
    from sweeps.systems import described

    if name in described.BUILT:
        return described.BUILT[name]
    if is_file(name):
        description, _ = described.script(name, folder)
        kind = described.named(f"system: {name}", lambda: next(k for k in kinds() if k.describes(description)))
        return described.of_file(kind, name, folder)
    if name not in names():
        raise KeyError(name)
    for kind in kinds():
        if name in described.shipped(kind):
            return described.of_library(kind, name)
    return import_module(_brought()[name]).SYSTEM


def built(system: Any) -> str:
    """Return the name of a `System` that a program has built, which `resolve` knows from now on in this process."""
    from sweeps.systems import described

    return described.built(system, kinds())


def of_map(ds: Dataset) -> Dynamics:
    """Return the system of a map for its readers, without running a file that the map names."""
    return of_contents(ds.attrs, ds.variables)


def presentation_of(ds: Dataset) -> "Presentation":
    """Return the presentation of a map's system: figures, page, words and colours."""
    return presented(of_map(ds))


def presented(system: Dynamics) -> "Presentation":
    """Return the presentation of a system."""
    name = f"{type(system).__module__.rpartition('.')[0]}.presentation"
    module = import_module(name if find_spec(name) else "sweeps.systems.presentation")
    return module.PRESENTATION(system)


def of_contents(attributes: Mapping[str, Any], variables: Collection[str]) -> Dynamics:
    """Return the system of a map, from its attributes and the names of its variables and coordinates.

    A Python file that a map names is never run, for its author may be anybody: the names of the map's variables say
    whether it holds small oscillations or relative equilibria.
    """
    name = str(attributes.get("system", DEFAULT_SYSTEM))
    if is_file(name):
        from sweeps.systems import described

        return described.unread(next(kind for kind in kinds() if kind.holds(variables)), name)
    return resolve(name)


def all_examples() -> list[Example]:
    """Return the examples of all systems except those of generated code."""
    of_modules = (example for name in MODULES for example in resolve(name).examples())
    of_kinds = (example for kind in kinds() for example in kind.compiled)
    return list({example.name: example for example in (*of_modules, *of_kinds)}.values())


def moving() -> tuple[str, ...]:
    """Return the names of the systems whose maps have a motion at each point."""
    return tuple(n for n in (*MODULES, *_brought()) if type(resolve(n)).motion is not Dynamics.motion)
