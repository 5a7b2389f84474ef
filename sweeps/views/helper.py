"""A second process that draws a map's pictures, the last first; it loads its libraries as the first opens the map."""

import multiprocessing
import os
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import contextmanager
from pathlib import Path

from sweeps import interrupts, lean


class Helper:
    """The other process.

    Args:
        path: of the map, which it opens for itself.
    """

    def __init__(self, path: str | Path):
        self.path, self.cut = str(path), {}
        os.stat(os.getcwd())  # where the process begins: refused here in words, or there in none of ours
        self._pool = ProcessPoolExecutor(1, multiprocessing.get_context("spawn"), interrupts.end_with_the_parent)
        with interrupts.left_to_the_parent():
            self._pool.submit(_get_ready)

    def draw(self, names: Sequence[str], folder: Path, *how) -> Future:
        """Draws what nobody has begun of pictures and animations; see `sweeps.views.figures.draw_some`."""
        return self._pool.submit(_draw, self.path, self.cut, names, folder, *how)

    def end(self, is_done: bool) -> None:
        """Ends the process, at once where its work is not wanted any more."""
        if is_done:
            self._pool.shutdown(cancel_futures=True)
        else:
            interrupts.abandon(self._pool)


@contextmanager
def helping(path: str | Path) -> Iterator[Helper]:
    """A helper for a map's pictures, while the block lasts."""
    helper, is_done = Helper(path), False
    try:
        yield helper
        is_done = True
    finally:
        helper.end(is_done)


def _get_ready() -> None:
    lean.leave_out(alone=True)
    from sweeps.views import figures  # noqa: F401


def _draw(path: str, cut: Mapping[str, slice], names: Sequence[str], folder: Path, *how) -> list[str]:
    from sweeps.views import figures

    with figures.opened(path) as ds:
        return figures.draw_some(ds.isel(cut), names, folder, *how, from_the_end=True)
