"""A second process that draws a map's pictures, the last first; what shows no measured value, before there is a map."""

import multiprocessing
import os
import sys
import threading
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from sweeps import interrupts, lean
from sweeps.files import temporary_folder

if TYPE_CHECKING:
    from sweeps.points.sweep import Sweep

EARLY = "made"  # folder, in one for temporary files, of what is drawn before there is a map


class Helper:
    """The other process.

    Args:
        path: of the map, which it opens for itself.
        alike: whether this process loads the same libraries in any case: first, where the other can be its copy.
    """

    def __init__(self, path: str | Path, alike: bool = False):
        self.path, self.cut = str(path), {}
        os.stat(os.getcwd())  # where the process begins: refused here in words, or there in none of ours
        self._is_copied, self._is_begun, self._lock = alike and _can_be_copied(), False, threading.Lock()
        self._foreseen = None
        if self._is_copied:
            _get_ready()
        way = multiprocessing.get_context("fork" if self._is_copied else "spawn")
        self._pool = ProcessPoolExecutor(1, way, _begin)

    def foresee(self, sweep: "Sweep", folder: Path) -> None:
        """Has it draw, before there is a map, what shows no measured value; that sweep's map it will be."""
        self._foreseen = sweep, folder / EARLY

    def begin(self) -> None:
        """Starts the process, where that is not done."""
        with self._lock:
            if self._is_begun:
                return
            self._is_begun = True
            with interrupts.left_to_the_parent(is_copied=self._is_copied):
                self._pool.submit(_get_ready)
            if self._foreseen:
                self._pool.submit(_foresee, *self._foreseen)

    def draw(self, names: Sequence[str], folder: Path, *how) -> Future:
        """Draws what nobody has begun of pictures and animations; see `sweeps.views.figures.draw_some`."""
        self.begin()
        return self._pool.submit(_draw, self.path, self.cut, names, folder, *how)

    def draw_foreseen(self, folder: Path) -> Future:
        """The same for all of them, some of which may be drawn by now."""
        self.begin()
        return self._pool.submit(_draw_foreseen, self.path, self._foreseen and self._foreseen[1], folder)

    def end(self, is_done: bool) -> None:
        """Ends the process, at once where its work is not wanted any more; it does not begin any more."""
        with self._lock:
            self._is_begun = True
            if is_done:
                self._pool.shutdown(cancel_futures=True)
            else:
                interrupts.abandon(self._pool)


def _can_be_copied() -> bool:
    """Whether a copy of this process works: it is a command's alone, without threads, whose locks would stay shut."""
    return lean.is_alone() and sys.platform == "linux" and threading.active_count() == 1


@contextmanager
def helping(
    path: str | Path, sweep: "Sweep | None" = None, alike: bool = False, at_once: bool = True
) -> Iterator[Helper]:
    """A helper for a map's pictures, while the block lasts; see `Helper`.

    Args:
        path: of the map.
        sweep: whose map that will be, where there is none yet.
        alike: whether this process loads the same libraries in any case.
        at_once: whether it begins now, or when it is told to or asked for something.
    """
    with ExitStack() as stack:
        helper, is_done = Helper(path, alike), False
        try:
            if sweep and not sweep.grid.scattered:
                with suppress(OSError):  # which is said by those who must write there
                    helper.foresee(sweep, stack.enter_context(temporary_folder(Path(path).with_name("figures"))))
            if at_once:
                helper.begin()
            yield helper
            is_done = True
        finally:
            helper.end(is_done)


def _begin() -> None:
    interrupts.end_with_the_parent()
    lean.leave_out(alone=True)
    lean.ends_with(0)


def _get_ready() -> None:
    from sweeps.views import figures  # noqa: F401


def _foresee(sweep: "Sweep", made: Path) -> None:
    from sweeps.maps.foreseen import UnmeasuredError, foreseen
    from sweeps.views import figures

    made.mkdir()
    ds = figures.drawn_plainly(foreseen(sweep))
    for name in reversed([*figures.pictures(ds), *figures.animations(ds)]) if ds else ():
        with suppress(UnmeasuredError):
            figures.draw_some(ds, [name], made)


def _draw(path: str, cut: Mapping[str, slice], names: Sequence[str], folder: Path, *how) -> list[str]:
    from sweeps.views import figures

    with figures.opened(path) as ds:
        return figures.draw_some(ds.isel(cut), names, folder, *how, from_the_end=True)


def _draw_foreseen(path: str, early: Path | None, folder: Path) -> list[str]:
    from sweeps.views import figures

    taken = figures.take(early, folder) if early else []
    return [*taken, *_draw(path, {}, (), folder)]
