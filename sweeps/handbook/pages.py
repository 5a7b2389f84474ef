"""The pages: their text, the measured numbers in it, and the pictures of maps that they show."""

import re
from collections.abc import Callable
from pathlib import Path

TEXT = Path(__file__).parent / "text"
NUMBER = re.compile(r"([-−\d.,%×\u202f⁰¹²³⁴⁵⁶⁷⁸⁹⁻]*)<!--([a-z]\w*)(?: ([^ >]+))?-->")
PICTURE = re.compile(r"/pictures/(\w+)-(\w+)\.png")
NOTEBOOK = "---\nfile_format: mystnb\nkernelspec: {name: python3, display_name: Python 3}\n---\n\n"


def texts() -> dict[str, str]:
    """Return the name of each page (its path without `.md`) → its text, in order."""
    paths = sorted(TEXT.rglob("*.md"))
    return {str(path.relative_to(TEXT).with_suffix("")): path.read_text(encoding="utf-8") for path in paths}


def numbers(text: str) -> list[tuple[str, str, str]]:
    """Return (text on the page, name, format) of each measured number of a page.

    A page contains ``1.9<!--racket_growth .2g-->``: Markdown shows the number and hides its name and format.
    """
    return [(text_on_page, name, form or ".3g") for text_on_page, name, form in NUMBER.findall(text)]


def with_numbers(text: str, write: Callable[[str, str], str]) -> str:
    """Return a page with each measured number and its comment replaced by `write(name, format)`."""
    return NUMBER.sub(lambda mark: write(mark[2], mark[3] or ".3g"), text)


def as_notebook(page: str, text: str) -> str:
    """Return a page with the header by which MyST-NB runs its code; a tutorial offers itself for download, too."""
    if "{code-cell}" not in text:
        return text
    name = page.rpartition("/")[2]
    download = f"\n\n{{nb-download}}`Download this page as a notebook <{name}.ipynb>`\n"
    return NOTEBOOK + text + (download if page.startswith("tutorials/") else "")
