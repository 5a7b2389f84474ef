"""The gallery: thumbnails of every sweep that ships, and a page for each with story, command, figure and report.

Pictures and reports come from maps of their own with fewer points, so that the handbook is made in minutes.
"""

import math
import re
import tomllib
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from sweeps import systems
from sweeps.handbook import evidence
from sweeps.points import catalogue
from sweeps.reading.definitions import file_text, plain, read_text
from sweeps.schema import DEFAULT_SYSTEM
from sweeps.views import report

MAX_GRID_POINTS = 1_600  # number of grid points of a gallery map, without axes, bodies and modes: seconds of work
# the same for systems with cheap points, and for pumped bodies, which have narrow bands
MAX_CHEAP_POINTS = {"rigid_body": 40_000, "symmetric_top": 40_000, "twist": 40_000, "pumped_body": 20_000}
GALLERY_DRAWS = 512  # number of draws of each uncertain body in a gallery map
CARD = """:::{{grid-item-card}} {title}
:img-top: /gallery/{card}
:img-alt: {title}
:link: gallery/{name}
:link-type: doc

{sentence}

{badges}
:::
"""
PAGE = """# {title}

{badges}

**{sentence}** {story}

```sh
polhode run {name}
```

writes the full map, all its figures and its report to `results/{name}/`, from {{download}}`this definition
<definitions/{name}.yaml>`. Below: a map with fewer points.

```{{figure}} {name}.png

{title}
```

## Report

<p><a href="../reports/{name}.html">Open it in a window of its own</a></p>
<iframe class="report" src="../reports/{name}.html" title="Report: {title}" loading="lazy"></iframe>
"""
INTRODUCTION = """All shipped sweeps. Each page has a figure and a live report, drawn from a map with fewer points, and
the command that writes the full one."""
TOPICS = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))


def names() -> dict[str, dict]:
    """Return sweep → its entry in `gallery.toml`, of the shipped sweeps, in the order of the gallery."""
    return {name: entry for topic in TOPICS.values() for name, entry in topic.items()}


def reduce_points(values: dict) -> dict:
    """Return a definition with so few points that it takes seconds: its longest ranges are cut."""
    grid = values.get("grid", {})
    ranges = list(_ranges(grid))
    max_points = MAX_CHEAP_POINTS.get(values.get("system", DEFAULT_SYSTEM), MAX_GRID_POINTS)
    while math.prod(r["num"] for r in ranges) > max_points:
        longest = max(ranges, key=lambda r: r["num"])
        longest["num"] = max(2, longest["num"] * 4 // 5)
    if "draws" in values:
        values["draws"] = GALLERY_DRAWS
    return values


def _ranges(entries: dict) -> Iterator[dict]:
    for entry in entries.values():
        if isinstance(entry, dict):
            yield from [entry] if "num" in entry else _ranges(entry)


def story(text: str) -> str:
    """Return the first paragraph of a definition's comment; of a question, its answer too."""
    first, *next_paragraphs = report.comment_paragraphs(text)
    return f"{first} {next_paragraphs[0]}" if len(first) < 60 and next_paragraphs else first


def make(work: Path, say: Callable[[str], None]) -> dict[str, tuple[str, str]]:
    """Measure every shipped sweep with fewer points, and write its picture, its card and its report below `work`.

    Return name → (file name of the card's picture, a film where the map has motions; the map's sentence).
    """
    import sweeps
    from sweeps.handbook import cards
    from sweeps.views import figures, films

    contents = {}
    for notice, (name, path) in evidence.counted(catalogue.shipped_files().items(), say):
        definition = reduce_points(plain(read_text(file_text(path))))
        map_path = evidence.measure_map(name, definition, work / "gallery" / "maps", notice)
        with sweeps.open_map(map_path) as ds:
            picture = names()[name].get("figure") or next(iter(figures.pictures(ds)))
        evidence.draw(map_path, picture, work / "gallery" / f"{name}.png", notice)
        card = work / "gallery" / f"{name}.gif"
        with sweeps.open_map(map_path) as ds:
            if not evidence.is_up_to_date(card, map_path):
                films.write_frames(cards.frames(ds), card)
            sentence = systems.presentation_of(ds).sentence(ds)
        contents[name] = (card if card.exists() else card.with_suffix(".png")).name, sentence
        page = work / "extra" / "reports" / f"{name}.html"
        if not evidence.is_up_to_date(page, map_path):
            page.parent.mkdir(parents=True, exist_ok=True)
            with sweeps.open_map(map_path) as ds:
                report.write_report(ds, page)
    return contents


def pages(contents: Mapping[str, tuple[str, str]]) -> dict[str, str]:
    """Return name → text of the page of cards, and of the page of each sweep; `contents` are of `make`."""
    texts, grids = {}, []
    for topic, entries in TOPICS.items():
        grids += [f"## {topic}", "", "::::{grid} 2 2 3 3", ":gutter: 3", ""]
        for name in entries:
            text = file_text(catalogue.shipped_files()[name])
            title = plain(read_text(text)).get("title", name)
            badges = " ".join(f"{{bdg-secondary-line}}`{tag}`" for tag in entries[name]["tags"])
            card, sentence = contents[name]
            words = {"story": story(text), "sentence": f"{sentence}." if sentence else f"{title}."}
            fields = {field: re.sub(r"([*_<>$])", r"\\\1", value) for field, value in words.items()} | {"card": card}
            fields |= {"name": name, "title": title, "badges": badges, "topic": topic}
            grids.append(CARD.format(**fields))
            texts[f"gallery/{name}"] = PAGE.format(**fields)
        grids.append("::::\n")
    toctree = "\n".join(["```{toctree}", ":hidden:", "", *(f"gallery/{name}" for name in names()), "```"])
    return {"gallery": "\n".join(["# Gallery", "", INTRODUCTION, "", *grids, toctree, ""])} | texts
