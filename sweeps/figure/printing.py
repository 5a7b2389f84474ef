"""What commands print: tables by Rich, JSON for machines."""

import json
import math
from typing import TextIO

from rich.console import Console
from rich.table import Table

STANDARD_OUTPUT_WIDTH = 100  # where it is no terminal


def console(file: TextIO | None = None) -> Console:
    """Return a console on the standard output, or on a file."""
    result = Console(file=file, highlight=False, emoji=False, markup=False)
    if not result.is_terminal:
        result.width = STANDARD_OUTPUT_WIDTH
    return result


def table(*headings: str, right: tuple[int, ...] = ()) -> Table:
    """Return an empty table; columns numbered in `right` are aligned to the right."""
    made = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="bold")
    for number, heading in enumerate(headings):
        made.add_column(heading, justify="right" if number in right else "left", overflow="fold")
    return made


def print_json(value) -> None:
    """Print a value as JSON; NaN and infinities become null."""
    print(json.dumps(_known(value), indent=1, ensure_ascii=False, allow_nan=False))


def _known(value):
    if isinstance(value, dict):
        return {key: _known(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_known(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
