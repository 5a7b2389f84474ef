"""Which sweeps there are: the definitions that ship, and any other by its path."""

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from sweeps.schema import DEFAULT_SYSTEM
from sweeps.schema.refusals import DefinitionError, hint

if TYPE_CHECKING:
    from sweeps.points.estimate import Estimate
    from sweeps.points.sweep import Sweep
    from sweeps.schema.definition import Definition

FOLDER = Path(__file__).parents[1] / "definitions"
DEFAULT = "tennis_racket"
TAKEN = "handbook"  # what results/ holds beside sweeps


def shipped() -> dict[str, Path]:
    """Return name → file of each definition in sweeps/definitions."""
    folder = FOLDER.relative_to(here) if FOLDER.is_relative_to(here := Path.cwd()) else FOLDER
    return {path.stem: path for path in sorted(folder.glob("*.yaml"))}


class Content(NamedTuple):
    """The name of the system, the number of points and the title of a shipped definition.

    Equilibria, modes and eigenvalues are not counted: each point has all of them.
    """

    system: str
    points: int
    title: str


def contents() -> dict[str, Content]:
    """Return name → content of each shipped definition, read without its system, whose equations take seconds."""
    from sweeps.reading.definitions import file_text, plain, read_text

    values = {name: plain(read_text(file_text(path))) for name, path in shipped().items()}
    return {n: Content(v.get("system", DEFAULT_SYSTEM), _points(v), v.get("title", n)) for n, v in values.items()}


def _points(values: Mapping) -> int:
    numbers = [_count(entry) for entry in values.get("grid", {}).values()] + [len(values.get("bodies", "1"))]
    axes = (1, 2, 3) if values.get("system", DEFAULT_SYSTEM) == DEFAULT_SYSTEM else (1,)
    return math.prod(numbers) * len(values.get("axes", axes))


def _count(entry: object) -> int:
    if isinstance(entry, Mapping):
        return entry["num"] if "num" in entry else math.prod(map(_count, entry.values()))
    return len(entry) if isinstance(entry, tuple) else 1


def resolve(text: str) -> Path:
    """Return the file of a sweep that ships, by its name, or of a path."""
    files = shipped()
    if text in files:
        return files[text]
    if "/" in text or "\\" in text or re.search(r"\.(ya?ml|json)$", text) or Path(text).is_file():
        return Path(text)
    raise DefinitionError(_unknown("definition", text, files, "or the path of a YAML file"))


def load(source: str | Path | Mapping) -> "Definition":
    """Return the definition of a mapping, of a path, or of the name of a sweep that ships."""
    from sweeps.points import loading

    return loading.load(source if isinstance(source, Mapping) else resolve(str(source)))


def compiled(source: str | Path | Mapping) -> "Definition":
    """Return a definition as `load`, with what measures it compiled where this process has the compiler."""
    from sweeps.points import compile, sweep

    definition = load(source)
    compile.ensure(sweep.of(definition))
    return definition


def _unknown(where: str, name: str, names: Iterable[str], otherwise: str) -> str:
    wrong = f"{name[:100]!r} is not the name of a sweep{hint(name[:100], names)}"
    return f"{where}: {wrong}; allowed: {', '.join(names)}, {otherwise}"


@dataclass(frozen=True)
class Plan:
    """A sweep, the file that defines it, and what it needs."""

    path: Path  #: the definition's file
    sweep: "Sweep"  #: the sweep, valid and small enough for this machine
    needs: "Estimate"  #: points, files, memory, disk and time

    def intention(self, folder: Path) -> str:
        """Return what a run makes in a folder, in one line."""
        return f"{self.sweep.name}: {self.sweep.counted} of {self.sweep.definition.system}, {self.needs} → {folder}"


def plan(
    source: str | Path, results: str | Path = "results", anywhere: bool = False, digest: str = "", check: bool = True
) -> Plan:
    """Check a definition, and that this machine has enough disk and memory for it, unless it is to run `anywhere`.

    The digest is that of the definition that another process planned, "" for any. With `check` its system also looks
    beyond the values.

    Raises:
        DefinitionError: also for one that is named like a definition that ships.
    """
    from sweeps.points.estimate import estimate, refuse_if_too_large
    from sweeps.points.loading import read

    path = Path(source)
    sweep = read(path, check=check)
    if sweep.name == TAKEN or shipped().get(sweep.name, path).resolve() != path.resolve():
        of = f"results/{TAKEN}, the handbook's folder" if sweep.name == TAKEN else "a sweep that ships"
        raise DefinitionError(f"{path}: (file name): {sweep.name!r} is the name of {of}; allowed: any other name")
    if digest not in ("", sweep.definition.digest):
        wrong = "the definition, or a file that it names, was changed while the workflow ran"
        raise DefinitionError(f"{path}: {wrong}; allowed: the same until the end (start the workflow again)")
    needs = estimate(sweep)
    if not anywhere:
        refuse_if_too_large(sweep, needs, results)
    return Plan(path, sweep, needs)


def requested(config: Mapping, targets: Iterable[str]) -> tuple[str, dict[str, Plan]]:
    """Return the sweep that a call of the workflow makes where no file is requested, and name → plan of all."""
    from sweeps.schema.definition import NAME_PATTERN

    source = resolve(str(config.get("definition", DEFAULT)))
    default = plan(source)
    plans = {default.sweep.name: default}
    files = {**shipped(), default.sweep.name: default.path}
    parts = [target.removeprefix("./").split("/", 2) for target in targets]
    for name in [part[1] for part in parts if part[0] == "results" and part[1:] and part[1]]:
        if not re.fullmatch(NAME_PATTERN, name) or name not in files:
            raise DefinitionError(_unknown("target", name, files, "or --config definition=PATH with that file name"))
        if name not in plans:
            plans[name] = plan(files[name])
    return default.sweep.name, plans
