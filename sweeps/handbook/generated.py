"""Pages that are written from the code: the reference and the gallery, and the parts of results/README.md."""

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
PACKAGES = ("kernels", "sweeps")
ROOMS = {  # what each room is for, in the order in which one meets them
    "sweeps": "The front door",
    "sweeps.points": "From a definition to points",
    "sweeps.schema": "What a definition and a map may hold",
    "sweeps.systems": "Systems of equations of motion",
    "sweeps.mechanics": "Systems of one's own",
    "sweeps.shards": "Shards and merging",
    "sweeps.maps": "Maps",
    "sweeps.views": "Pictures and the report",
    "sweeps.run": "Running",
    "sweeps.commands": "Commands",
    "sweeps.handbook": "This handbook",
    "kernels": "Kernels",
}
INCLUDED = {  # pages of the repository that parts of the handbook are taken from
    "maps.md": "results/README.md",
    "system.md": "sweeps/mechanics/README.md",
    "speed.md": "tests/benchmarks/README.md",
}


def modules() -> dict[str, Path]:
    """Name → file of each module that has public names; those that begin with _ are private."""
    found = {}
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            parts = path.relative_to(ROOT).with_suffix("").parts
            if not any(part.startswith("_") and part != "__init__" for part in parts):
                found[".".join(part for part in parts if part != "__init__")] = path
    return found


def public(path: Path) -> list[str]:
    """Functions and classes that a module defines for others."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    kinds = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)
    return [node.name for node in tree.body if isinstance(node, kinds) and not node.name.startswith("_")]


def unlisted(inventory: bytes) -> list[str]:
    """Public names that a built reference does not have.

    Args:
        inventory: what Sphinx writes to `objects.inv`: four lines, then a compressed one for each object.
    """
    lines = zlib.decompress(inventory.split(b"\n", 4)[4]).decode("utf-8").splitlines()
    listed = {line.split(" ")[0] for line in lines if " py:" in line}
    names = (f"{module}.{name}" for module, path in modules().items() for name in public(path))
    return [name for name in names if name not in listed]


def room(module: str) -> str:
    """The room that a module belongs to."""
    return max((name for name in ROOMS if f"{module}.".startswith(f"{name}.")), key=len)


def write(folder: Path, work: Path) -> None:
    """Writes all generated pages below a folder of pages; the work's folder has the maps of the gallery."""
    pages = {
        "reference/definitions": _definitions(),
        "reference/variables": _variables(),
        "gallery": gallery.page(work),
    }
    pages |= {"reference/commands": _commands(), "reference/api": _api_index()}
    pages |= {f"reference/{_file(name)}": _api(name) for name in ROOMS}
    for name, text in pages.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).with_suffix(".md").write_text(text, encoding="utf-8")
    (folder / "included").mkdir(exist_ok=True)
    for name, source in INCLUDED.items():
        text = _without_links((ROOT / source).read_text(encoding="utf-8"))
        (folder / "included" / name).write_text(text, encoding="utf-8")


def _file(room: str) -> str:
    return "api-" + room.replace(".", "-")


def _without_links(text: str) -> str:
    """A page of the repository with its links to files beside it as words: they lead nowhere from here."""
    text = re.sub(r"!\[[^\]]*\]\((?!http)[^)]*\)\n*", "", text)
    return re.sub(r"\[([^\]]+)\]\((?!http)[^)]*\)", r"\1", text)


def _api_index() -> str:
    listed = "\n".join(_file(name) for name in ROOMS)
    return f"""# Python API

Every public function and class of `kernels` and `sweeps`. Names that begin with an underscore are private.

```{{toctree}}
{listed}
```
"""


def _api(of: str) -> str:
    """Every module of a room, with its public names."""
    lines = [f"# {ROOMS[of]}: `{of}`", ""]
    for name in modules():
        if room(name) == of:
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
    """(key, what it means and allows, default) of a model of definitions, those within it included."""
    for name, field in model.model_fields.items():
        default = "required" if field.is_required() else _default(field.default)
        if before + name == "title":  # which whoever reads the file fills in
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
    text = ["# What a definition may say", "", (
        "One section a system (`system:`, `rigid_body` if left out), from the models that read definitions. Whatever is"
        " a number may be a list, or a range `{start, stop, num, spacing}`, where it says so. `polhode schema -o"
        " polhode.schema.json` writes the same as JSON Schema, from which editors complete keys"
        " ([how](../tutorials/own-system.md))."
    ), ""]  # fmt: skip
    for name in systems.names():
        system = systems.resolve(name)
        rows = [(f"`{key}`", meaning, default) for key, meaning, default in keys(system.model)]
        text += [f"## `{name}`", "", f"{system.caption}.", "", _table(("key", "meaning", "default"), rows)]
    return "\n".join(text)


def _variables() -> str:
    text = ["# What a map holds", "", (
        "Every coordinate and variable of every system, from the tables that write the files. A missing number is NaN;"
        " flags are whole numbers whose words stand in `flag_meanings`."
    ), ""]  # fmt: skip
    for name in systems.names():
        system = systems.resolve(name)
        text += [f"## `{name}`", "", f"{system.caption}.", ""]
        for heading, found in (("coordinate", _coordinates(system)), ("variable", _all_variables(system))):
            rows = [(f"`{key}`", *_told(variable)) for key, variable in found.items()]
            text += [_table((heading, "units", "meaning"), rows)]
    return "\n".join(text)


def _coordinates(system) -> dict:
    return dict(system.layout().coordinates)


def _all_variables(system) -> dict:
    return {**system.variables(), **system.layout().variables}


def _told(variable) -> tuple[str, str]:
    flags = ": " + ", ".join(variable.flags) if variable.flags else ""
    comment = f" ({variable.comment})" if variable.comment else ""
    return variable.units or ("flags" if variable.flags else "text"), variable.long_name + flags + comment


def _commands() -> str:
    """What `polhode COMMAND --help` prints, of each."""
    from sweeps.commands import NAMES
    from sweeps.commands.parser import Parser

    parser = Parser(prog="polhode", formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers()
    for name in NAMES:
        importlib.import_module(f"sweeps.commands.{name}").add(commands)
    text = [
        "# Commands",
        "",
        "Exit status of every command: 0 done; 2 what was given is wrong, and a message said what;",
    ]
    text += ["130 interrupted; 1 anything else (of `verify`: the map differs).", ""]
    for name in NAMES:
        text += [f"## `polhode {name}`", "", "```text", commands.choices[name].format_help().rstrip(), "```", ""]
    return "\n".join(text)
