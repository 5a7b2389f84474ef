"""What the pages contain: measured numbers, pictures of maps, files for the reader, output of commands and Python."""

import re
import textwrap
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

TEXT = Path(__file__).parent / "text"
NUMBER = re.compile(r"([-−\d.,%×\u202f⁰¹²³⁴⁵⁶⁷⁸⁹⁻]*)<!--([a-z]\w*)(?: ([^ >]+))?-->")
BLOCK = re.compile(r"^([ ]*)(`{3,})\{(picture|file|run|python)\}[ ]*(.*?)\n(.*?)^\1\2[ ]*$", re.MULTILINE | re.DOTALL)
OPTION = re.compile(r"^:([a-z-]+):[ ]*(.*)$")


@dataclass(frozen=True)
class Wanted:
    """One block of a page.

    Attributes:
        kind: picture, file, run or python.
        argument: what stands behind the kind: a map and its picture, or a file's name.
        body: the lines of the block, without its options.
    """

    kind: str
    argument: str
    body: str


def pages(folder: Path = TEXT) -> dict[str, str]:
    """Return the name of each page (its path without `.md`) → its text, in order."""
    paths = sorted(folder.rglob("*.md"))
    return {str(path.relative_to(folder).with_suffix("")): path.read_text(encoding="utf-8") for path in paths}


def numbers(text: str) -> list[tuple[str, str, str]]:
    """Return (text on the page, name, format) of each measured number of a page.

    A page says ``1.9<!--racket_growth .2g-->``: Markdown shows the number and hides its name and format.
    """
    return [(shown, name, form or ".3g") for shown, name, form in NUMBER.findall(text)]


def with_numbers(text: str, write: Callable[[str, str], str]) -> str:
    """Return a page with each measured number and its comment replaced by what `write` makes of name and format."""
    return NUMBER.sub(lambda mark: write(mark[2], mark[3] or ".3g"), text)


def asked_blocks(text: str) -> Iterator[Wanted]:
    """Yield the other blocks of a page (pictures, files, output), in order."""
    for _, _, kind, argument, inside in BLOCK.findall(text):
        lines = textwrap.dedent(inside).splitlines()
        while lines and OPTION.match(lines[0]):
            lines.pop(0)
        yield Wanted(kind, argument.strip(), "\n".join(lines).strip("\n"))


def key(page: str, asked: Wanted) -> str:
    """Return the key of the output of a block: the same lines on two pages may print different output."""
    return f"{page}\n{asked.body}"
