"""Pages that are written from the code: systems, commands, the gallery, and parts of further documents."""

import re
import shutil
import typing
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from pydantic import BaseModel

from sweeps import systems
from sweeps.handbook import gallery
from sweeps.points import catalogue

ROOT = Path(__file__).parents[2]
SYSTEMS = """# Systems, keys and variables

A page for each system (`system:`, default `rigid_body`): the keys of its definitions, and the coordinates and
variables of its maps. A number may be a list, or a range `{start, stop, num, spacing}`, where stated. A missing number
is NaN; flags are integers with `flag_meanings`. `polhode schema -o polhode.schema.json` writes the keys as JSON Schema,
from which editors complete them ([how](../tutorials/own-system.md)).
"""
INCLUDED = {  # files of the repository that the handbook includes
    "maps.md": "results/README.md",
    "system.md": "sweeps/mechanics/README.md",
    "speed.md": "tests/benchmarks/README.md",
    "engines.md": "tests/benchmarks/engines.md",
    "contributing.md": "CONTRIBUTING.md",
    "changelog.md": "CHANGELOG.md",
    "CITATION.cff": "CITATION.cff",
}


def write(folder: Path, work: Path, contents: Mapping[str, tuple[str, str]]) -> None:
    """Write all generated pages below a folder of pages, and the gallery's pictures and reports from `work`.

    `contents` are those of `gallery.make`.
    """
    texts = {"reference/commands": _commands(), **_systems(), **gallery.pages(contents)}
    for name, text in texts.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).with_suffix(".md").write_text(text, encoding="utf-8")
    (folder / "included").mkdir(exist_ok=True)
    for name, source in INCLUDED.items():
        text = re.sub(r"!\[[^\]]*\]\((?!http)[^)]*\)\n*", "", (ROOT / source).read_text(encoding="utf-8"))
        text = re.sub(r"\[([^\]]+)\]\((?!http)[^)]*\)", r"\1", text)  # the targets of relative links are not there
        (folder / "included" / name).write_text(text, encoding="utf-8")
    (folder / "gallery/definitions").mkdir()
    for name, path in catalogue.shipped_files().items():
        shutil.copy2(path, folder / "gallery/definitions")
        for picture in {f"{name}.png", contents[name][0]}:
            shutil.copy2(work / "gallery" / picture, folder / "gallery")
    shutil.copytree(work / "extra", folder / "extra")


def _cell(text: object) -> str:
    return str(text).replace("|", r"\|").replace("\n", " ").replace("<", "&lt;").replace("*", r"\*")


def _table(heads: Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    heads = list(heads)
    lines = [heads, ["---"] * len(heads), *([_cell(cell) for cell in row] for row in rows)]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def keys(model: type[BaseModel], before: str = "") -> Iterator[tuple[str, str, str]]:
    """Yield (key, meaning, default) of each key of a model of definitions and of the models within it."""
    for name, field in model.model_fields.items():
        value, default = field.default, "required" if field.is_required() else str(field.default)
        if before + name == "title" or value is None or value == ():  # the reader of the file fills in the title
            default = "left out"
        elif isinstance(value, BaseModel | tuple):
            default = ", ".join(map(str, value)) if isinstance(value, tuple) else "as below"
        yield before + name, field.description or "", default
        for kind in (field.annotation, *typing.get_args(field.annotation)):
            if isinstance(kind, type) and issubclass(kind, BaseModel) and kind.model_fields:
                yield from keys(kind, f"{before}{name}.")


def _systems() -> dict[str, str]:
    """Return name → text of the page that lists the systems, and of each one's page: keys, coordinates, variables."""
    rows, texts = [], {}
    for name in systems.system_names():
        system = systems.resolve(name)
        rows.append((f"[`{name}`](systems/{name}.md)", system.caption))
        text = [f"# `{name}`", "", f"{system.caption}.", "", "## Keys of a definition", ""]
        text.append(_table(("key", "meaning", "default"), ((f"`{key}`", *more) for key, *more in keys(system.model))))
        layout = system.layout()
        variables = {**system.variables(), **layout.variables}
        for heading, entries in (("Coordinates", layout.coordinates), ("Variables", variables)):
            entry_rows = [(f"`{key}`", *meaning(variable)) for key, variable in entries.items()]
            text += [f"## {heading}", "", _table(("name", "units", "meaning"), entry_rows)]
        texts[f"reference/systems/{name}"] = "\n".join(text)
    toctree = "\n".join(
        ["```{toctree}", ":hidden:", "", *(f"systems/{name}" for name in systems.system_names()), "```"]
    )
    return texts | {"reference/systems": f"{SYSTEMS}\n{_table(('system', 'equations of motion'), rows)}\n{toctree}\n"}


def meaning(variable) -> tuple[str, str]:
    """Return the units of a variable ("flags" or "text" without any) and its meaning, with flags and comment."""
    flags = ": " + ", ".join(variable.flags) if variable.flags else ""
    comment = f" ({variable.comment})" if variable.comment else ""
    return variable.units or ("flags" if variable.flags else "text"), variable.long_name + flags + comment


def _commands() -> str:
    """Return the page of all commands, each with the text of its --help."""
    from sweeps.commands import program

    text = ["# Commands", ""]
    text += ["Exit status of every command: 0 done; 2 invalid input, or not enough memory or disk (see message);"]
    text += ["130 interrupted; 1 anything else (of `verify`: the map differs).", ""]
    for name, command in program.build()[1].items():
        text += [f"## `polhode {name}`", "", "```text", command.format_help().rstrip(), "```", ""]
    return "\n".join(text)
