"""Make the evidence on the pages: maps first, then the numbers and pictures that come from them.

All files are below one folder. A map is kept if its definition and kernels are the same, a picture or report if it is
younger than its map and the code that draws.
"""

import html
import warnings
from collections.abc import Callable, Collection, Iterator
from pathlib import Path
from typing import Any

import xarray as xr

from sweeps.handbook import numbers, pages

MAPS = Path(__file__).parent / "maps"
DRAWING = ("systems", "views", "figure")  # packages of the code that draws


def definitions() -> dict[str, Path]:
    """Return name → definition of each map of the handbook."""
    return {path.stem: path for path in sorted(MAPS.glob("*.yaml"))}


def make(work: Path, say: Callable[[str], None] = print) -> dict[str, dict]:
    """Make maps and pictures of the pages, and return their measured numbers by name.

    They go to `maps/` and `pictures/` below `work`. Raise a RefusedError for a page that shows a picture that its map
    does not have, and a ValueError for one with a number or a map that does not exist.
    """
    texts = pages.texts().values()
    maps = measure_maps(work, say)
    facts = measure_numbers(maps, say)
    if unknown := {name for text in texts for _, name, _ in pages.numbers(text)} - set(facts):
        raise ValueError(f"no number of that name: {', '.join(sorted(unknown))}")
    for text in texts:
        for source, name in pages.PICTURE.findall(text):
            draw(maps[source], name, work / "pictures" / f"{source}-{name}.png", say)
    return facts


def measure_maps(work: Path, say: Callable[[str], None]) -> dict[str, Path]:
    """Return the file of each map of the handbook by its name; measure those that are not there or out of date."""
    entries = counted(definitions().items(), say)
    return {name: measure_map(name, path, work / "maps", say_number) for say_number, (name, path) in entries}


def counted(entries: Collection, say: Callable[[str], None]) -> Iterator[tuple[Callable[[str], None], Any]]:
    """Yield a function that prints a notice after the number of the entry, "7 of 15: measuring top", and the entry."""
    for number, entry in enumerate(entries, 1):
        yield lambda text, number=number: say(f"{number} of {len(entries)}: {text}"), entry


def measure_map(name: str, definition: Path | dict, folder: Path, say: Callable[[str], None]) -> Path:
    """Return the map `folder`/`name`.nc of a `definition`, measured unless it is up to date; `say` prints a notice."""
    import sweeps
    from sweeps.maps import storage
    from sweeps.points import loading

    folder.mkdir(parents=True, exist_ok=True)
    path, sweep = folder / f"{name}.nc", loading.read_sweep(definition)
    if path.exists():
        with xr.open_dataset(path, decode_cf=False) as old:
            current = sweep.definition.text, sweep.system.fingerprint()
            if (old.attrs.get("definition"), old.attrs.get("kernel_fingerprint")) == current:
                return path
    say(f"measuring {name}")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # remarks of the compiler
        storage.write_map(sweeps.survey(definition, threads=2), path)
    return path


def measure_numbers(maps: dict[str, Path], say: Callable[[str], None]) -> dict[str, dict]:
    """Return value, meaning, map and content hash of each measured number by its name."""
    import sweeps

    say("reading the numbers")
    facts = {}
    for source, path in maps.items():
        with sweeps.open_map(path) as ds:
            values, source_facts = ds.load().squeeze(), {"map": source, "content_hash": ds.attrs["content_hash"]}
            for name, (meaning, formula) in numbers.NUMBERS.get(source, {}).items():
                facts[name] = {"meaning": meaning, "value": numbers.value(formula, values), **source_facts}
    return facts


def as_html(facts: dict[str, dict], name: str, form: str) -> str:
    """Return the number `facts[name]` in the format `form` for HTML, with meaning, map and hash under the pointer."""
    fact = facts[name]
    source = f"{fact['meaning']} (map {fact['map']}, content hash {fact['content_hash'][:12]})"
    text = numbers.format_number(fact["value"], form)
    return f'<span class="measured" title="{html.escape(source)}">{text}</span>'


def as_markdown(facts: dict[str, dict], name: str, form: str) -> str:
    """Return a measured number of `facts` for a page of Markdown, with its `name` and format `form` in a comment."""
    return f"{numbers.format_number(facts[name]['value'], form)}<!--{name}{'' if form == '.3g' else ' ' + form}-->"


def draw(map_path: Path, name: str, path: Path, say: Callable[[str], None] = print) -> None:
    """Draw the picture `name` of the map `map_path` to `path` (PNG) unless it is up to date; `say` prints a notice."""
    if is_up_to_date(path, map_path):
        return
    import sweeps
    from sweeps.views import figures

    say(f"drawing {path.stem}")
    path.parent.mkdir(parents=True, exist_ok=True)
    with sweeps.open_map(map_path) as ds:
        files = [file for file in figures.draw_all(ds, path.parent / "drawn", only=[name]) if file.stem == name]
    if not files:
        raise ValueError(f"{path.stem}: nothing to show")
    files[0].replace(path)


def is_up_to_date(path: Path, map_path: Path) -> bool:
    """Return True if a picture or report is newer than its map and the code that draws."""
    root = Path(__file__).parents[1]
    code = [file for name in DRAWING for file in (root / name).rglob("*.*") if file.suffix != ".pyc"]
    return path.exists() and path.stat().st_mtime > max(file.stat().st_mtime for file in [map_path, *code])
