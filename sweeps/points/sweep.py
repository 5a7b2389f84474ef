"""A sweep that can be measured: its definition, resolved once, handed on the whole way to a map."""

from dataclasses import dataclass

from sweeps import systems
from sweeps.points.grid import Grid
from sweeps.schema.definition import MAX_SHARDS, Definition
from sweeps.schema.variables import Variable

SHARD_SECONDS = 10  # a file and a job cost a second or so: a shard is worth ten of work


@dataclass(frozen=True, eq=False)
class Sweep:
    """A checked definition with its system and its grid."""

    definition: Definition  #: what a person wrote
    system: systems.Dynamics  #: its equations of motion
    grid: Grid  #: its points
    variables: dict[str, Variable]  #: name → each variable of its map, in the order of the file

    @property
    def name(self) -> str:
        """The sweep's name: the stem of its definition's file."""
        return self.definition.name

    @property
    def shards(self) -> int:
        """Number of files the work is cut into, never more than points.

        For `shards: auto`, as many as leave each ten seconds of work at the system's speed, and at least one.
        """
        size, definition = self.grid.size, self.definition
        if definition.shards != "auto":
            return min(definition.shards, size)
        worthwhile = size * self.system.cost(definition).samples // (self.system.samples_per_second * SHARD_SECONDS)
        return max(1, min(worthwhile, size, MAX_SHARDS))

    def shape_at(self, name: str) -> tuple[int, ...]:
        """Return the shape of a variable's value at one point: () without further dimensions."""
        return tuple(self.grid.further[dim].size for dim in self.variables[name].over)

    def __reduce__(self):
        """Pickle a sweep as its definition."""
        return of, (self.definition,)


def of(definition: Definition, system: systems.Dynamics | None = None) -> Sweep:
    """Return the sweep of a definition and its system, which is looked up if not given."""
    system = (system or systems.resolve(definition.system, definition.folder)).bound(definition)
    return Sweep(definition, system, Grid(definition, system), system.variables(definition))
