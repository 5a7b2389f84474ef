"""The gallery: every sweep that ships, its picture, its story, its command.

Pictures come from maps of their own with fewer points, so that the handbook is made in minutes; how many stands below
each.
"""

import io
import math
import re
from collections.abc import Callable, Iterator
from pathlib import Path

from sweeps.handbook import evidence
from sweeps.points import catalogue
from sweeps.reading.definitions import file_text, plain, read_text
from sweeps.schema.carried import DEFAULT_SYSTEM

MOST = 1_600  # points of a grid, before axes, bodies, equilibria and modes
MANY = {"rigid_body": 40_000, "symmetric_top": 40_000, "twist": 40_000}  # of systems whose points cost little
DRAWS = 512  # of each uncertain body
BEST = {  # where the first picture is not what one comes for
    "tennis_racket": "stability_axis_2",
    "tiny": "stability_axis_2",
    "breakdown": "breakdown",
    "symmetric": "precession",
    "rackets": "defect",
}
FIRST = (
    *("tennis_racket", "kapitzas_racket", "shapes", "bodies", "breakdown", "symmetric", "twist", "rackets"),
    *("tumbling", "tumblers"),
)


def names() -> list[str]:
    """Return the names of the shipped sweeps, in the order of the page."""
    return sorted(catalogue.shipped(), key=lambda name: (FIRST.index(name) if name in FIRST else len(FIRST), name))


def reduced(values: dict) -> dict:
    """Return a definition with so few points that it takes seconds: its longest ranges are cut."""
    grid = values.get("grid", {})
    ranges = list(_ranges(grid))
    most = MANY.get(values.get("system", DEFAULT_SYSTEM), MOST)
    while math.prod(r["num"] for r in ranges) > most:
        longest = max(ranges, key=lambda r: r["num"])
        longest["num"] = max(2, longest["num"] * 4 // 5)
    if "draws" in values:
        values["draws"] = DRAWS
    return values


def _ranges(entries: dict) -> Iterator[dict]:
    for entry in entries.values():
        if isinstance(entry, dict):
            yield from [entry] if "num" in entry else _ranges(entry)


def story(text: str) -> str:
    """Return the first paragraph of a definition's comment, or its title."""
    comments = []
    for line in text.splitlines():
        if line.startswith("#"):
            comments.append(line[1:].strip())
        elif comments or not line.startswith("title:"):
            break
    paragraph = " ".join(comments).strip() if "" not in comments else " ".join(comments[: comments.index("")])
    if len(paragraph) < 60 and "" in comments:  # a question: its answer too
        rest = comments[comments.index("") + 1 :]
        paragraph += " " + " ".join(rest[: rest.index("")] if "" in rest else rest)
    return paragraph


def draw(work: Path, say: Callable[[str], None]) -> None:
    """Measure and draw every shipped sweep, with fewer points, into `pictures/` below `work`."""
    for name, path in _definitions(work):
        map_path = evidence.measured(path, work / "gallery", say)
        evidence.draw(f"{name} {picture(name, map_path)}", {name: map_path}, work / "pictures", say)


def _definitions(work: Path) -> Iterator[tuple[str, Path]]:
    """Name and reduced definition of each, written below the work's folder."""
    from ruamel.yaml import YAML

    folder = work / "gallery"
    folder.mkdir(parents=True, exist_ok=True)
    for name, source in catalogue.shipped().items():
        values = reduced(plain(read_text(file_text(source))))
        stream = io.StringIO()
        YAML(typ="safe").dump(values, stream)
        path = folder / f"{name}.yaml"
        path.write_text(stream.getvalue(), encoding="utf-8")
        yield name, path


def picture(name: str, path: Path) -> str:
    """Return the name of the figure that represents a sweep."""
    import sweeps
    from sweeps.views import figures

    with sweeps.open_map(path) as ds:
        return BEST.get(name) or next(iter(figures.pictures(ds)))


def page(work: Path) -> str:
    """Return the page, once its pictures are drawn."""
    texts = ["# Gallery", "", (
        "All shipped sweeps. The figures here are drawn from maps with fewer points; the command writes the full "
        "map, with all its figures and its report, to `results/`."
    ), ""]  # fmt: skip
    for name in names():
        text = file_text(catalogue.shipped()[name])
        file = evidence.picture_file(f"{name} {picture(name, work / 'gallery' / f'{name}.nc')}")
        title = plain(read_text(text)).get("title", name)
        texts += [f"## {title}", "", _prose(story(text)), "", "```sh", f"polhode run {name}", "```", ""]
        texts += [f"![{title}: figure of this sweep](/pictures/{file})", ""]
    return "\n".join(texts)


def _prose(text: str) -> str:
    return re.sub(r"([*_<>$])", r"\\\1", text)
