"""From a definition to its finished files: what `polhode run` and `sweeps.run` do."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path

from sweeps.pipeline import finished
from sweeps.points import catalogue
from sweeps.process import machine, progress
from sweeps.schema.refusals import DefinitionError


def make(
    definition: str | Path,
    cores: int | None = None,
    again: bool = False,
    results: str | Path = "results",
    beside: Callable[[], AbstractContextManager] = nullcontext,
    replace: bool = False,
) -> Iterator[Path]:
    """Make the map, figures and report of a sweep unless they are there, and yield each.

    What is to be made, and how large it is, is printed on the error stream first.

    Args:
        definition: the path of a definition, or the name of one that ships.
        cores: number of processors; all by default.
        again: whether to make everything again.
        results: the folder for results; the sweep's own is below it.
        beside: `sweeps.views.drawing.worker` to draw in another process, too, which a program of ours may start: in a
            user's it would run the script again.
        replace: whether to replace the results of another definition with the same file name.
    """
    if cores is not None and cores < 1:
        raise DefinitionError(f"cores: {cores} is out of range; allowed: 1 or more")
    path = catalogue.resolve(str(definition))
    basis = finished.basis(path)
    if not again and (made := finished.found(path, basis, results)):
        yield from made
        return
    with progress.waiting(f"{path}: deriving its equations"):
        planned = catalogue.plan(path, results, check=False)
    progress.say(_intention(planned, Path(results)))
    from sweeps.pipeline import steps

    yield from steps.make(planned, results, cores or machine.cores(), again, beside, replace)
    finished.keep(planned.sweep, basis, results)


def _intention(planned: catalogue.Plan, results: Path) -> str:
    """Return what a run makes, in one line."""
    from sweeps.points.estimate import estimate, in_words, span

    needs, sweep = estimate(planned.sweep), planned.sweep
    time = f"about {span(needs.wait_seconds)} on one core, up to {in_words(needs.disk_bytes)} of disk"
    return f"{sweep.name}: {sweep.counted} of {sweep.definition.system}, {time} → {results / sweep.name}"
