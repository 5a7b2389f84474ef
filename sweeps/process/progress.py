"""Progress of long work: a bar on a terminal, lines in a log."""

import contextvars
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    ProgressColumn,
    TaskProgressColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

SECONDS_BETWEEN_LINES = 10.0
SECONDS_ON_A_TERMINAL, SECONDS_IN_A_LOG = 2.0, 10.0  # a block that takes longer is announced
_is_silent: contextvars.ContextVar[bool] = contextvars.ContextVar("is_silent", default=False)


@contextmanager
def silence() -> Iterator[None]:
    """Print no progress within the block."""
    token = _is_silent.set(True)
    try:
        yield
    finally:
        _is_silent.reset(token)


def print_line(text: str) -> None:
    """Print a line on the error stream."""
    if not _is_silent.get():
        print(text, file=sys.stderr, flush=True)


@contextmanager
def announce(text: str) -> Iterator[None]:
    """Print a line on the error stream if the block takes more than two seconds; in a log, more than ten."""
    seconds = SECONDS_ON_A_TERMINAL if sys.stderr.isatty() else SECONDS_IN_A_LOG
    timer = threading.Timer(seconds, contextvars.copy_context().run, (print_line, f"{text} …"))
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()
        timer.join()  # a process without threads can be copied


class _Speed(ProgressColumn):
    """Points per second."""

    def render(self, task):
        return f"{task.speed or 0:,.0f} points/s"


@contextmanager
def count_points(total: int, label: str, each: int = 1) -> Iterator[Callable[[int], None]]:
    """Yield a function that takes the number of values just finished, and print the progress in points.

    Args:
        total: number of all values.
        label: text before the bar or at the beginning of each line.
        each: values per point.
    """
    console = Console(stderr=True)
    if console.is_terminal and not _is_silent.get():
        with _show_bar(console, total / each, label, TaskProgressColumn(), _Speed(), TimeRemainingColumn()) as advance:
            yield lambda values: advance(values / each)
    else:
        yield _line_counter(total, label, each)


def _line_counter(total: int, label: str, each: int) -> Callable[[int], None]:
    """Return a function that adds finished values and prints a line of progress now and then."""
    start = last_line = time.monotonic()
    values = 0

    def advance(new_values: int) -> None:
        """Add finished values; print share, speed and remaining time if the last line is old enough."""
        nonlocal values, last_line
        values += new_values
        now = time.monotonic()
        if values >= total or now - last_line >= SECONDS_BETWEEN_LINES:
            last_line, speed = now, values / each / max(now - start, 1e-9)
            share, seconds = f"{values // each:,} of {total // each:,} points", (total - values) / each / speed
            print_line(f"{label}: {share}, {speed:,.0f} points/s, {seconds:,.0f} s left")

    return advance


@contextmanager
def count_pieces(total: int, label: str) -> Iterator[Callable[[], None]]:
    """Yield a function to call after each piece of work, which moves a bar on a terminal or in a notebook."""
    console = Console(stderr=True)
    if _is_silent.get() or not (console.is_terminal or console.is_jupyter):
        yield lambda: None
        return
    columns = TextColumn("{task.completed} of {task.total}"), TimeElapsedColumn()
    with _show_bar(console, total, label, *columns) as advance:
        yield lambda: advance(1)


@contextmanager
def _show_bar(
    console: Console, total: float, label: str, *columns: ProgressColumn
) -> Iterator[Callable[[float], None]]:
    with Progress(TextColumn(label), BarColumn(), *columns, console=console) as bar:
        task = bar.add_task(label, total=total)
        yield lambda done: bar.advance(task, done)
