"""From a definition to its finished files: what `polhode run` and `sweeps.run` do."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path

from sweeps.pipeline import up_to_date
from sweeps.process import machine
from sweeps.schema.refusals import DefinitionError


def run(
    definition: Path,
    cores: int | None = None,
    again: bool = False,
    results: str | Path = "results",
    drawing_worker: Callable[[], AbstractContextManager] = nullcontext,
    replace: bool = False,
) -> Iterator[Path]:
    """Make the map, figures and report of a sweep unless they are there, and yield each.

    The size of the work is printed on the error stream first.

    Args:
        definition: the file of a definition.
        cores: number of processors; all by default.
        again: whether to make everything again.
        results: the folder for results; the sweep's own is below it.
        drawing_worker: `sweeps.views.drawing.start_worker` to draw in another process, too, which a program of ours may
            start: in a user's it would run the script again.
        replace: whether to replace the results of another definition with the same file name.
    """
    if cores is not None and cores < 1:
        raise DefinitionError(f"cores: {cores} is out of range; allowed: 1 or more")
    outputs, recorded_inputs = up_to_date.unchanged_outputs(Path(results) / definition.stem)
    inputs = up_to_date.inputs_hash(definition)
    if outputs and inputs == recorded_inputs and not again:
        yield from outputs
        return
    from sweeps.pipeline import steps

    yield from steps.make(definition, inputs, Path(results), cores or machine.cores(), again, drawing_worker, replace)
