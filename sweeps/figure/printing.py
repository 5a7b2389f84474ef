"""Output of commands: tables by Rich, and JSON for machines."""

import json
import math
from typing import TextIO

from rich.console import Console
from rich.table import Table

STANDARD_OUTPUT_WIDTH = 100  # characters per line if the standard output is no terminal


def console(file: TextIO | None = None) -> Console:
    """Return a console on the standard output, or on a file."""
    result = Console(file=file, highlight=False, emoji=False, markup=False)
    if not result.is_terminal:
        result.width = STANDARD_OUTPUT_WIDTH
    return result


def table(*headings: str, right: tuple[int, ...] = ()) -> Table:
    """Return an empty table; columns numbered in `right` are aligned to the right."""
    new_table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="bold")
    for number, heading in enumerate(headings):
        new_table.add_column(heading, justify="right" if number in right else "left", overflow="fold")
    return new_table


def print_json(value) -> None:
    """Print a value as JSON; NaN and infinities become null."""
    print(json.dumps(_replace_nan(value), indent=1, ensure_ascii=False, allow_nan=False))


def _replace_nan(value):
    """Return a value of dictionaries and lists with None in place of NaN and infinities, for JSON."""
    if isinstance(value, dict):
        return {key: _replace_nan(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_replace_nan(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
