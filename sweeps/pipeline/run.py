"""The function of `polhode run` and `sweeps.run`, from a definition to its files."""

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
        again: True to make everything again.
        results: the folder for results; the sweep's own is below it.
        drawing_worker: `sweeps.views.drawing.start_worker` to draw in a further process as well. Only Polhode's own
            commands can start it: in a user's program, it would run the script again.
        replace: True to replace the results of another definition with the same file name.
    """
    if cores is not None and cores < 1:
        raise DefinitionError(f"cores: {cores} is out of range; allowed: 1 or more")
    outputs, recorded_inputs = up_to_date.unchanged_outputs(Path(results) / definition.stem)
    inputs = up_to_date.inputs_hash(definition)
    if outputs and inputs == recorded_inputs and not again:
        yield from outputs
        return
    from sweeps.pipeline import steps

    yield from steps.make_outputs(
        definition, inputs, Path(results), cores or machine.num_processors(), again, drawing_worker, replace
    )
