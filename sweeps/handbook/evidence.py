"""What the pages ask for, made: maps first, then the numbers, pictures and printed lines that come from them.

All of it lies below one folder, and what is still true is not made again: a map whose definition and kernels are the
same, a picture that is younger than its map and than the code that draws.
"""

import ast
import contextlib
import html
import io
import json
import os
import shlex
import subprocess
import sys
import warnings
from collections.abc import Callable, Iterable
from pathlib import Path

import xarray as xr

from sweeps.handbook import asked, numbers

MAPS = Path(__file__).parent / "maps"
ROOMS = ("commands", "maps", "mechanics", "pipeline", "points", "schema", "shards", "systems", "views")
COLUMNS = "84"  # letters in a line of what commands print


def definitions() -> dict[str, Path]:
    """Return name → definition of each map of the handbook; those of its gallery begin with `gallery_`."""
    return {path.stem: path for path in sorted(MAPS.glob("*.yaml"))}


def make(work: Path, say: Callable[[str], None] = print) -> dict[str, dict]:
    """Make all that the pages ask for, and return their measured numbers by name.

    Args:
        work: the folder it goes to: `maps/`, `pictures/` and `printed.json`.
        say: what takes each line of progress.

    Raises:
        RefusedError: for a page that asks for a map, a number or a picture that is not there.
        ValueError: for a command or a line of Python on a page that fails.
    """
    pages = asked.pages()
    maps = measured_maps(work, say)
    facts = measured_numbers(maps, say)
    if unknown := {name for text in pages.values() for _, name, _ in asked.numbers(text)} - set(facts):
        raise ValueError(f"no number of that name: {', '.join(sorted(unknown))}")
    for text in pages.values():
        for block in asked.asked_blocks(text):
            if block.kind == "picture":
                draw(block.argument, maps, work / "pictures", say)
    before, printed, done = _still_true(work / "printed.json"), {}, set()
    for page, text in pages.items():
        keys = [asked.key(page, block) for block in asked.asked_blocks(text) if block.kind in ("run", "python")]
        same = all(key in before for key in keys)
        printed |= {key: before[key] for key in keys} if same else _printed(page, text, work / "desk", done, say)
    (work / "printed.json").write_text(json.dumps(printed, indent=1, ensure_ascii=False), encoding="utf-8")
    return facts


def measured_maps(work: Path, say: Callable[[str], None]) -> dict[str, Path]:
    """Return the file of each map of the handbook by its name; measure those that are not there or out of date."""
    return {name: measured(path, work / "maps", say) for name, path in definitions().items()}


def _still_true(path: Path) -> dict[str, str]:
    """What was printed before, where no code is younger."""
    if path.exists() and path.stat().st_mtime > _youngest(ROOMS):
        return json.loads(path.read_text(encoding="utf-8"))
    return {}


def measured(definition: Path, folder: Path, say: Callable[[str], None]) -> Path:
    """Return the map of a definition, measured unless one of the same definition and kernels exists."""
    import sweeps
    from sweeps.maps import storage
    from sweeps.points import loading

    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{definition.stem}.nc"
    sweep = loading.read(definition)
    if path.exists():
        with xr.open_dataset(path, decode_cf=False) as old:
            same = sweep.definition.text, sweep.system.fingerprint()
            if (old.attrs.get("definition"), old.attrs.get("kernel_fingerprint")) == same:
                return path
    say(f"measuring {definition.stem}")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # remarks of the compiler
        storage.write_map(sweeps.survey(str(definition), threads=2), path)
    return path


def measured_numbers(maps: dict[str, Path], say: Callable[[str], None]) -> dict[str, dict]:
    """Return value, meaning, map and content hash of each measured number by its name."""
    import sweeps

    say("reading the numbers")
    found = {}
    for source, path in maps.items():
        with sweeps.open_map(path) as ds:
            for name, number in numbers.NUMBERS.items():
                if number.source == source:
                    told = {"meaning": number.meaning, "map": source, "content_hash": ds.attrs["content_hash"]}
                    found[name] = {"value": float(number.value(ds.load().squeeze())), **told}
    return found


def as_html(facts: dict[str, dict], name: str, form: str) -> str:
    """Return a measured number for a page of HTML, with its meaning, map and hash under the pointer."""
    fact = facts[name]
    source = f"{fact['meaning']} (map {fact['map']}, content hash {fact['content_hash'][:12]})"
    shown = numbers.shown(fact["value"], form)
    return f'<span class="measured" title="{html.escape(source)}">{shown}</span>'


def as_markdown(facts: dict[str, dict], name: str, form: str) -> str:
    """Return a measured number for a page of Markdown, with its name and format in a comment."""
    return f"{numbers.shown(facts[name]['value'], form)}<!--{name}{'' if form == '.3g' else ' ' + form}-->"


def picture_file(argument: str) -> str:
    """Return the file of a picture that a page names as "map picture"."""
    return argument.replace(" ", "-") + ".png"


def draw(argument: str, maps: dict[str, Path], folder: Path, say: Callable[[str], None] = print) -> Path:
    """Draw one picture, "map picture", unless it is newer than the map and the code, and return its file."""
    source, _, name = argument.partition(" ")
    path = folder / picture_file(argument)
    if path.exists() and path.stat().st_mtime > max(maps[source].stat().st_mtime, _youngest(("systems", "views"))):
        return path
    import sweeps
    from sweeps.views import figures

    say(f"drawing {argument}")
    folder.mkdir(parents=True, exist_ok=True)
    with sweeps.open_map(maps[source]) as ds:
        made = [file for file in figures.draw_all(ds, folder / "drawn", only=[name]) if file.stem == name]
        if not made:
            raise ValueError(f"{argument}: nothing to show")
        made[0].replace(path)
    return path


def _youngest(rooms: Iterable[str]) -> float:
    """When the code of some rooms was last changed."""
    root = Path(__file__).parents[1]
    return max(path.stat().st_mtime for room in rooms for path in (root / room).rglob("*.py"))


def _printed(page: str, text: str, desk: Path, done: set[str], say: Callable[[str], None]) -> dict[str, str]:
    """What the commands and lines of a page print, run in order in one folder; whole sweeps that are done, once."""
    found, names = {}, {}
    for block in asked.asked_blocks(text):
        if block.kind == "picture":
            continue
        desk.mkdir(parents=True, exist_ok=True)
        with contextlib.chdir(desk):
            if block.kind == "file":
                Path(block.argument).write_text(block.body + "\n", encoding="utf-8")
            else:
                say(f"{page}: {block.body.splitlines()[0]}")
                again = block.body in done and block.body.startswith("polhode run ")
                found[asked.key(page, block)] = "" if again else _run(block, names)
                done.add(block.body)
    return found


def _run(block: asked.Wanted, names: dict) -> str:
    """What a block prints."""
    out = io.StringIO()
    before, os.environ["COLUMNS"] = os.environ.get("COLUMNS"), COLUMNS
    try:
        with contextlib.redirect_stdout(out), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            if block.kind == "python":
                _python(block.body, names)
            else:
                _commands(block.body)
    except ValueError as error:
        raise ValueError(f"{error}\n{out.getvalue()}".strip()) from error
    finally:
        os.environ.pop("COLUMNS")
        os.environ |= {} if before is None else {"COLUMNS": before}
    text = out.getvalue().strip("\n").replace(f"{Path(__file__).parents[2]}/", "")  # as seen from the repository
    return "\n".join(line.rstrip() for line in text.splitlines())


def _python(code: str, names: dict) -> None:
    """Runs lines of Python, and prints the last one's value, as an interpreter does."""
    tree = ast.parse(code)
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, "<handbook>", "exec"), names)
    if (
        last is not None
        and (value := eval(compile(ast.Expression(last.value), "<handbook>", "eval"), names)) is not None
    ):
        print(value)


def _commands(lines: str) -> None:
    from sweeps.__main__ import main

    for line in lines.replace("\\\n", " ").splitlines():
        program, *arguments = shlex.split(line, comments=True)
        if program != "polhode":
            raise ValueError(f"{line}: a page runs `polhode` only")
        if status := _whole_sweep(arguments) if arguments[:1] == ["run"] else main(arguments):
            raise ValueError(f"{line}: exit status {status}")


def _whole_sweep(arguments: list[str]) -> int:
    """`polhode run`, in a process of its own: it claims a folder until that ends."""
    root = str(Path(__file__).parents[2])
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, (root, os.environ.get("PYTHONPATH"))))}
    command = [sys.executable, "-m", "sweeps", *arguments]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    print(done.stdout)
    if done.returncode:
        raise ValueError(done.stderr.strip())
    return 0
