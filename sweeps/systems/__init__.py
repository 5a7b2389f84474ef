"""Systems of equations of motion that a definition can name.

A system is one package: the module `system` with its variables, the model of its definition, its columns, motion and
references (see `Dynamics`), whose `SYSTEM` it is, and `presentation`: figures, page, words and colours (see
`sweeps.systems.presentation`). Packages without `system` (`bodies`, `rates`) contain code that several systems share.
Packages in this folder are found automatically; a package of another distribution names its module in an entry point of
the group `polhode.systems`.
"""

from collections.abc import Collection, Mapping
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sweeps.schema import DEFAULT_SYSTEM
from sweeps.schema.datasets import Dataset
from sweeps.systems.system import Dynamics, Example

if TYPE_CHECKING:
    from sweeps.systems.described import Described
    from sweeps.systems.presentation import Presentation

ENTRY_POINT_GROUP = "polhode.systems"  # entry points of systems in further packages: name = module with a SYSTEM
# Keys of definitions; any further keyword of a call is a key of the definition's grid.
KEYS: tuple[str, ...] = ("title", "axes", "bodies", "draws", "grid", "integration", "keep", "method", "modulation")
KEYS += ("motion", "planes", "sample", "seed", "shape_uncertainty", "shards", "start_at", "system", "table", "turns")
KEYS += ("twist", "uncertainty")
_FOLDER = Path(__file__).parent
_SYSTEM_FILES = [p for p in sorted(_FOLDER.glob("*/system.py")) if "\nSYSTEM = " in p.read_text(encoding="utf-8")]
MODULES = {path.parent.name: f"sweeps.systems.{path.parent.name}.system" for path in _SYSTEM_FILES}
DESCRIBED = tuple(
    f"sweeps.systems.{kind}"
    for kind in ("relative_equilibrium.linear", "periodic.system", "relative_equilibrium.system", "oscillator.system")
)
DESCRIPTIONS = Path(__file__).parents[1] / "mechanics" / "library"


@cache
def system_names() -> tuple[str, ...]:
    """Return the names of the systems: shipped, described, and of further packages."""
    ours = (*MODULES, *described_names())
    return (*ours, *(name for name in sorted(_external_modules()) if name not in ours))


@cache
def described_names() -> tuple[str, ...]:
    """Return the names of the described systems that ship."""
    return tuple(sorted(path.stem for path in DESCRIPTIONS.rglob("*.py") if path.stem != "__init__"))


@cache
def _external_modules() -> dict[str, str]:
    """Return name → module of each system of another package."""
    from importlib.metadata import entry_points

    return {point.name: point.module for point in entry_points(group=ENTRY_POINT_GROUP)}


def described_kinds() -> "list[type[Described]]":
    """Return the kinds of systems that a description can make, the more specific first."""
    return [import_module(module).KIND for module in DESCRIBED]


def forget_external() -> None:
    """Forget the systems of further packages, so that they are looked up again."""
    for cached_function in (system_names, _external_modules, resolve):
        cached_function.cache_clear()


def is_file(name: object) -> bool:
    """Return True if a definition's `system` names a Python file that describes a system."""
    return isinstance(name, str) and name.endswith(".py")


@cache
def resolve(name: str, folder: str = "") -> Dynamics:
    """Return the system of a name, or of a Python file, which is run.

    Args:
        name: value of a definition's key `system`.
        folder: folder from which a file's path starts, the definition's; left out, the working directory.

    Raises:
        KeyError: if no system has this name.
        DefinitionError: if the file cannot be run or describes no system.
    """
    if name in MODULES:
        return import_module(MODULES[name]).SYSTEM
    from sweeps.systems import described

    if name in described.REGISTERED:
        return described.REGISTERED[name]
    if is_file(name):
        description, _ = described.run_file(name, folder)
        kind = described.with_name(
            f"system: {name}", lambda: next(k for k in described_kinds() if k.describes(description))
        )
        return described.of_file(kind, name, folder)
    if name not in system_names():
        raise KeyError(name)
    for kind in described_kinds():
        if name in described.shipped_names(kind):
            return described.of_library(kind, name)
    return import_module(_external_modules()[name]).SYSTEM


def register_system(system: Any) -> str:
    """Register a `System` that a program has built; return its name, for which `resolve` returns it in this process."""
    from sweeps.systems import described

    return described.register_description(system, described_kinds())


def of_map(ds: Dataset) -> Dynamics:
    """Return the system of a map for its readers, without running a file that the map names."""
    return of_contents(ds.attrs, {*map(str, ds.variables)})


def presentation_of(ds: Dataset) -> "Presentation":
    """Return the presentation of a map's system: figures, page, words and colours."""
    return make_presentation(of_map(ds))


def make_presentation(system: Dynamics) -> "Presentation":
    """Return the presentation of a system."""
    name = f"{type(system).__module__.rpartition('.')[0]}.presentation"
    module = import_module(name if find_spec(name) else "sweeps.systems.presentation")
    return module.PRESENTATION(system)


def of_contents(attributes: Mapping[str, Any], variables: Collection[str]) -> Dynamics:
    """Return the system of a map, from its attributes and the names of its variables and coordinates.

    A Python file that a map names is never run, because anybody may have written it: the names of the map's variables
    determine which kind of described system the map contains.
    """
    name = str(attributes.get("system", DEFAULT_SYSTEM))
    if is_file(name):
        from sweeps.systems import described

        return described.make_unread(next(kind for kind in described_kinds() if kind.holds(variables)), name)
    return resolve(name)


def all_examples() -> list[Example]:
    """Return the examples of all systems except those of generated code."""
    of_modules = (example for name in MODULES for example in resolve(name).examples())
    of_kinds = (example for kind in described_kinds() for example in kind.compiled)
    return list({example.name: example for example in (*of_modules, *of_kinds)}.values())


def systems_with_motion() -> tuple[str, ...]:
    """Return the names of the systems with maps that have a motion at each point."""
    return tuple(n for n in (*MODULES, *_external_modules()) if type(resolve(n)).motion is not Dynamics.motion)
