"""Catalogue of sweeps: the definitions that ship with the program, and files of definitions by their paths."""

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
HANDBOOK_FOLDER = "handbook"  # folder of results/ that belongs to no sweep


def shipped_files() -> dict[str, Path]:
    """Return name → file of each definition in sweeps/definitions."""
    folder = FOLDER.relative_to(work_dir) if FOLDER.is_relative_to(work_dir := Path.cwd()) else FOLDER
    return {path.stem: path for path in sorted(folder.glob("*.yaml"))}


class Content(NamedTuple):
    """The name of the system, the number of points and the title of a shipped definition.

    Equilibria, modes and eigenvalues are not counted: each point has all of them.
    """

    system: str
    points: int
    title: str


def shipped_contents() -> dict[str, Content]:
    """Return name → content of each shipped definition, read without deriving the equations of its system."""
    from sweeps.reading.definitions import file_text, plain, read_text

    values = {name: plain(read_text(file_text(path))) for name, path in shipped_files().items()}
    return {n: Content(v.get("system", DEFAULT_SYSTEM), _count_points(v), v.get("title", n)) for n, v in values.items()}


def _count_points(values: Mapping) -> int:
    numbers = [_count_values(entry) for entry in values.get("grid", {}).values()] + [len(values.get("bodies", "1"))]
    axes = (1, 2, 3) if values.get("system", DEFAULT_SYSTEM) == DEFAULT_SYSTEM else (1,)
    return math.prod(numbers) * len(values.get("axes", axes))


def _count_values(entry: object) -> int:
    if isinstance(entry, Mapping):
        return entry["num"] if "num" in entry else math.prod(map(_count_values, entry.values()))
    return len(entry) if isinstance(entry, tuple) else 1


def find_definition(text: str) -> Path:
    """Return the file of a sweep that ships, by its name, or of a path."""
    files = shipped_files()
    if text in files:
        return files[text]
    if "/" in text or "\\" in text or re.search(r"\.(ya?ml|json)$", text) or Path(text).is_file():
        return Path(text)
    raise DefinitionError(_unknown_name("definition", text, files, "or the path of a YAML file"))


def load_definition(source: str | Path | Mapping) -> "Definition":
    """Return the definition of a mapping, of a path, or of the name of a sweep that ships."""
    from sweeps.points import loading

    return loading.read_definition(source if isinstance(source, Mapping) else find_definition(str(source)))


def load_compiled(source: str | Path | Mapping) -> "Definition":
    """Return a definition as `load_definition`, and compile its kernels if this process has the compiler."""
    from sweeps.points import compile_kernels, sweep

    definition = load_definition(source)
    compile_kernels.ensure_compiled(sweep.build_sweep(definition))
    return definition


def _unknown_name(where: str, name: str, names: Iterable[str], otherwise: str) -> str:
    problem = f"{name[:100]!r} is not the name of a sweep{hint(name[:100], names)}"
    return f"{where}: {problem}; allowed: {', '.join(names)}, {otherwise}"


@dataclass(frozen=True)
class Plan:
    """A sweep, the file that defines it, and the resources that it needs."""

    path: Path  #: the definition's file
    sweep: "Sweep"  #: the sweep, valid and small enough for this machine
    needs: "Estimate"  #: points, files, memory, disk and time

    def intention(self, folder: Path) -> str:
        """Return the sweep, its resources and the folder of its results in one line."""
        return (
            f"{self.sweep.name}: {self.sweep.size_in_words} of {self.sweep.definition.system}, {self.needs} → {folder}"
        )


def plan_sweep(
    source: str | Path, results: str | Path = "results", anywhere: bool = False, digest: str = "", check: bool = True
) -> Plan:
    """Check a definition, and that this machine has enough disk and memory for it, unless it is to run `anywhere`.

    Args:
        source: the file of the definition.
        results: the folder for results.
        anywhere: whether the sweep may need more than this machine has.
        digest: the digest of the definition that another process planned, "" for any.
        check: whether its system also checks the points, which takes longer.

    Raises:
        DefinitionError: also for a definition with the name of a shipped one.
    """
    from sweeps.points.estimate import estimate_needs, refuse_if_too_large
    from sweeps.points.loading import read_sweep

    path = Path(source)
    sweep = read_sweep(path, check=check)
    if sweep.name == HANDBOOK_FOLDER or shipped_files().get(sweep.name, path).resolve() != path.resolve():
        of = (
            f"results/{HANDBOOK_FOLDER}, the handbook's folder"
            if sweep.name == HANDBOOK_FOLDER
            else "a sweep that ships"
        )
        raise DefinitionError(f"{path}: (file name): {sweep.name!r} is the name of {of}; allowed: any other name")
    if digest not in ("", sweep.definition.digest):
        problem = "the definition, or a file that it names, was changed while the workflow ran"
        raise DefinitionError(f"{path}: {problem}; allowed: the same until the end (start the workflow again)")
    needs = estimate_needs(sweep)
    if not anywhere:
        refuse_if_too_large(sweep, needs, results)
    return Plan(path, sweep, needs)


def plan_targets(config: Mapping, targets: Iterable[str]) -> tuple[str, dict[str, Plan]]:
    """Return the name of the workflow's default sweep, and name → plan of all sweeps that its targets name."""
    from sweeps.schema.definition import NAME_PATTERN

    source = find_definition(str(config.get("definition", DEFAULT)))
    default = plan_sweep(source)
    plans = {default.sweep.name: default}
    files = {**shipped_files(), default.sweep.name: default.path}
    target_paths = [target.removeprefix("./").split("/", 2) for target in targets]
    for name in [
        path_parts[1] for path_parts in target_paths if path_parts[0] == "results" and path_parts[1:] and path_parts[1]
    ]:
        if not re.fullmatch(NAME_PATTERN, name) or name not in files:
            raise DefinitionError(
                _unknown_name("target", name, files, "or --config definition=PATH with that file name")
            )
        if name not in plans:
            plans[name] = plan_sweep(files[name])
    return default.sweep.name, plans
