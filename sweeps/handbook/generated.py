"""Pages that are written from the code: the reference, the gallery, and included parts of other documents."""

import argparse
import ast
import importlib
import re
import typing
import zlib
from collections.abc import Iterable, Iterator
from pathlib import Path

from pydantic import BaseModel

from sweeps import systems
from sweeps.handbook import gallery

ROOT = Path(__file__).parents[2]
TREES = ("kernels", "sweeps")
PACKAGES = {  # titles of the packages, in the order of the reference
    "sweeps": "Public functions",
    "sweeps.points": "Points and columns",
    "sweeps.schema": "Contents of definitions and maps",
    "sweeps.systems": "Systems of equations of motion",
    "sweeps.mechanics": "Described systems",
    "sweeps.shards": "Shards and merging",
    "sweeps.maps": "Maps",
    "sweeps.views": "Figures and the report",
    "sweeps.pipeline": "Running",
    "sweeps.commands": "Commands",
    "sweeps.handbook": "Handbook",
    "kernels": "Kernels",
}
INCLUDED = {  # files of the repository that the handbook includes
    "maps.md": "results/README.md",
    "system.md": "sweeps/mechanics/README.md",
    "speed.md": "tests/benchmarks/README.md",
    "contributing.md": "CONTRIBUTING.md",
    "CITATION.cff": "CITATION.cff",
}


def modules() -> dict[str, Path]:
    """Return name → file of each public module; names that begin with _ are private."""
    found = {}
    for package in TREES:
        for path in sorted((ROOT / package).rglob("*.py")):
            parts = path.relative_to(ROOT).with_suffix("").parts
            if not any(part.startswith("_") and part != "__init__" for part in parts):
                found[".".join(part for part in parts if part != "__init__")] = path
    return found


def public(path: Path) -> list[str]:
    """Return the names of the public functions and classes of a module."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    kinds = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)
    return [node.name for node in tree.body if isinstance(node, kinds) and not node.name.startswith("_")]


def unlisted(inventory: bytes) -> list[str]:
    """Return the public names that a built reference does not have.

    Args:
        inventory: what Sphinx writes to `objects.inv`: four lines, then a compressed one for each object.
    """
    lines = zlib.decompress(inventory.split(b"\n", 4)[4]).decode("utf-8").splitlines()
    listed = {line.split(" ")[0] for line in lines if " py:" in line}
    names = (f"{module}.{name}" for module, path in modules().items() for name in public(path))
    return [name for name in names if name not in listed]


def package_of(module: str) -> str:
    """Return the package of the reference to which a module belongs."""
    return max((name for name in PACKAGES if f"{module}.".startswith(f"{name}.")), key=len)


def write(folder: Path, work: Path) -> None:
    """Write all generated pages below a folder of pages; `work` holds the maps of the gallery."""
    pages = {
        "reference/definitions": _definitions(),
        "reference/variables": _variables(),
        "gallery": gallery.page(work),
    }
    pages |= {"reference/commands": _commands(), "reference/api": _api_index()}
    pages |= {f"reference/{_file(name)}": _api(name) for name in PACKAGES}
    for name, text in pages.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).with_suffix(".md").write_text(text, encoding="utf-8")
    (folder / "included").mkdir(exist_ok=True)
    for name, source in INCLUDED.items():
        text = _without_links((ROOT / source).read_text(encoding="utf-8"))
        (folder / "included" / name).write_text(text, encoding="utf-8")


def _file(package: str) -> str:
    return "api-" + package.replace(".", "-")


def _without_links(text: str) -> str:
    """Return a page of the repository with its relative links as words: their targets are not part of the handbook."""
    text = re.sub(r"!\[[^\]]*\]\((?!http)[^)]*\)\n*", "", text)
    return re.sub(r"\[([^\]]+)\]\((?!http)[^)]*\)", r"\1", text)


def _api_index() -> str:
    listed = "\n".join(_file(name) for name in PACKAGES)
    return f"""# Python API

Every public function and class of `kernels` and `sweeps`. Names that begin with an underscore are private.

```{{toctree}}
{listed}
```
"""


def _api(of: str) -> str:
    """Return the page of a package: every module with its public names."""
    lines = [f"# {PACKAGES[of]}: `{of}`", ""]
    for name in modules():
        if package_of(name) == of:
            options = "   :members:\n   :show-inheritance:" if of != "kernels" else "   :members:"
            lines += [f"## `{name}`", "", "```{eval-rst}", f".. automodule:: {name}", options, "```", ""]
    return "\n".join(lines)


def _cell(text: object) -> str:
    return str(text).replace("|", r"\|").replace("\n", " ").replace("<", "&lt;").replace("*", r"\*")


def _table(heads: Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    heads = list(heads)
    lines = [heads, ["---"] * len(heads), *([_cell(cell) for cell in row] for row in rows)]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def keys(model: type[BaseModel], before: str = "") -> Iterator[tuple[str, str, str]]:
    """Yield (key, meaning, default) of each key of a model of definitions and of the models within it."""
    for name, field in model.model_fields.items():
        default = "required" if field.is_required() else _default(field.default)
        if before + name == "title":  # filled in by the reader of the file
            default = "left out"
        yield before + name, field.description or "", default
        for kind in (field.annotation, *typing.get_args(field.annotation)):
            if isinstance(kind, type) and issubclass(kind, BaseModel) and kind.model_fields:
                yield from keys(kind, f"{before}{name}.")


def _default(value: object) -> str:
    if isinstance(value, BaseModel):
        return "as below"
    if value is None or value == ():
        return "left out"
    return ", ".join(map(str, value)) if isinstance(value, tuple) else str(value)


def _definitions() -> str:
    text = ["# Definitions", "", (
        "One section per system (`system:`, default `rigid_body`), from the models that read definitions. A number "
        "may be a list, or a range `{start, stop, num, spacing}`, where stated. `polhode schema -o "
        "polhode.schema.json` writes the same as JSON Schema, from which editors complete keys "
        "([how](../tutorials/own-system.md))."
    ), ""]  # fmt: skip
    for name in systems.names():
        system = systems.resolve(name)
        rows = [(f"`{key}`", meaning, default) for key, meaning, default in keys(system.model)]
        text += [f"## `{name}`", "", f"{system.caption}.", "", _table(("key", "meaning", "default"), rows)]
    return "\n".join(text)


def _variables() -> str:
    text = ["# Variables", "", (
        "Every coordinate and variable of every system, from the tables that write the files. A missing number is NaN;"
        " flags are integers with `flag_meanings`."
    ), ""]  # fmt: skip
    for name in systems.names():
        system = systems.resolve(name)
        text += [f"## `{name}`", "", f"{system.caption}.", ""]
        for heading, found in (("coordinate", _coordinates(system)), ("variable", _all_variables(system))):
            rows = [(f"`{key}`", *meaning(variable)) for key, variable in found.items()]
            text += [_table((heading, "units", "meaning"), rows)]
    return "\n".join(text)


def _coordinates(system) -> dict:
    return dict(system.layout().coordinates)


def _all_variables(system) -> dict:
    return {**system.variables(), **system.layout().variables}


def meaning(variable) -> tuple[str, str]:
    """Return the units of a variable ("flags" or "text" without any) and its meaning, with flags and comment."""
    flags = ": " + ", ".join(variable.flags) if variable.flags else ""
    comment = f" ({variable.comment})" if variable.comment else ""
    return variable.units or ("flags" if variable.flags else "text"), variable.long_name + flags + comment


def _commands() -> str:
    """Return the page of all commands, each with the text of its --help."""
    from sweeps.commands import NAMES
    from sweeps.commands.parser import Parser

    parser = Parser(prog="polhode", formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers()
    for name in NAMES:
        importlib.import_module(f"sweeps.commands.{name}").add(commands)
    text = [
        "# Commands",
        "",
        "Exit status of every command: 0 done; 2 invalid input, or not enough memory or disk (see message);",
    ]
    text += ["130 interrupted; 1 anything else (of `verify`: the map differs).", ""]
    for name in NAMES:
        text += [f"## `polhode {name}`", "", "```text", commands.choices[name].format_help().rstrip(), "```", ""]
    return "\n".join(text)
