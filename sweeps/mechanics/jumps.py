"""Times at which functions jump or have a kink, and the values of their `sweeps.mechanics.switches` between.

A switch is constant between the zeros of its root. The zeros lie between neighbours of a grid at which the root has two
signs, and are found by bisection, to a rounding. That there are no further jumps is proved by enclosures: between
neighbours the root or its slope has one sign. Where that cannot be proved the grid is refined, and in the end the jumps
are not known. Times that a description declares are taken in place of zeros.
"""

import numpy as np
import sympy as sp

from sweeps.mechanics.graph import compile_expression
from sweeps.mechanics.tape import Tape

# intervals that enclose the roots in a piece; prime numbers, so that few zeros lie on the grid
GRID_SIZES = (127, 1021, 16381)
MAX_BISECTIONS = 60
MIN_JUMP_DISTANCE = 1e-12  # jumps closer to each other than this fraction of the whole time count as one


class Jumps:
    """The times of jumps of a system with switches, and the switches between them."""

    def __init__(self, equations):
        system, time = equations.system, equations.system.time
        self.switches, self.parameters = system.switches, equations.parameters
        arguments = (*self.parameters, time)
        self._values = [compile_expression(arguments, [s.value]) for s in self.switches]
        self._roots = [compile_expression(arguments, [s.root]) for s in self.switches]
        self._tapes = [Tape([s.root], [time], self.parameters) for s in self.switches]
        period = system.given_period or sp.oo
        self._times = compile_expression(self.parameters, [*system.given_jumps, period]) if system.given_jumps else None
        free_symbols = sp.Tuple(*system.given_jumps, *(s.value for s in self.switches)).free_symbols
        self._own = [i for i, p in enumerate(self.parameters) if p in free_symbols]

    def pieces(self, parameters, ends) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the times between which nothing jumps, from 0 to the ends, the switches between, and their number.

        Shapes (points, pieces + 1), (points, pieces, switches) and (points,). A point with fewer pieces than another
        has some of no length at the end; the number is 0 where jumps are not known.
        """
        keys, of_point = np.unique(np.stack([*(parameters[i] for i in self._own), ends]), axis=1, return_inverse=True)
        first = np.unique(of_point, return_index=True)[1]
        distinct_points = [self.of_point([p[k] for p in parameters], 0.0, ends[k]) for k in first]
        number = np.array([0 if pair is None else len(pair[1]) for pair in distinct_points])
        edges = np.repeat(keys[-1][:, None], max(2, number.max() + 1), axis=1)
        edges[:, 0] = 0.0
        values = np.zeros((len(distinct_points), edges.shape[1] - 1, len(self.switches)))
        for k in np.flatnonzero(number):
            edges[k, : number[k] + 1], values[k, : number[k]] = distinct_points[k]
        return edges[of_point], values[of_point], number[of_point]

    def of_point(self, parameters, begin: float, end: float) -> tuple[np.ndarray, np.ndarray] | None:
        """Return times (pieces + 1,) from `begin` to `end`, s, and switches (pieces, switches), for `parameters`.

        None if the jumps cannot be proved.
        """
        edges = np.array([begin, end], dtype=np.float64)
        own = np.array(parameters[: len(self.parameters) - len(self.switches)], dtype=np.float64)
        if not (np.isfinite(edges).all() and begin < end):
            return None
        if self._times:
            *times, period = self._times(*own, *np.zeros(len(self.switches)))
            numbers = np.arange(begin // period, end // period + 1.0) if np.isfinite(period) else np.zeros(1)
            edges = _join_times(edges, np.ravel([time + n * period if n else time for time in times for n in numbers]))
        for k in range(0 if self._times else len(self.switches)):
            zeros = self._zeros(k, self._at(own, edges, 0.5, k), edges)
            if zeros is None:
                return None
            edges = _join_times(edges, zeros)
        values = [self._at(own, edges, share, len(self.switches)) for share in (0.5, *np.arange(1, 32) / 32)]
        return (edges, values[0][len(own) :].T) if all(np.array_equal(values[0], v) for v in values) else None

    def _at(self, own, edges, share, count):
        """Return parameters and so many switches at a share of each piece, shape (parameters, pieces)."""
        times = edges[:-1] + share * np.diff(edges)
        at = np.zeros((len(self.parameters), times.size))
        at[: len(own)] = own[:, None]
        for k in range(count):
            (at[len(own) + k],) = self._values[k](*at, times)
        return at

    def _zeros(self, k, at, edges):
        """Return the zeros of a root within all pieces; None if it is not proved that these are all."""
        for count in GRID_SIZES:
            grid = edges[:-1, None] + np.diff(edges)[:, None] * np.linspace(0.0, 1.0, count + 1)
            low, high = (times.reshape(-1, 1) for times in (grid[:, :-1], grid[:, 1:]))
            owner = np.repeat(np.arange(len(grid)), count)
            enclosure = self._tapes[k].slopes(self._tapes[k].constants(list(at)), owner, low, high)[0][:, 0]
            if ((enclosure[..., 0] > 0.0) | (enclosure[..., 1] < 0.0)).any(axis=1).all():
                break
        else:
            return None
        is_up = self._roots[k](*at[:, :, None], grid)[0] >= 0.0
        crossings = np.flatnonzero((is_up[:, 1:] != is_up[:, :-1]).ravel())
        at, a, b, up = at[:, owner[crossings]], low[crossings, 0], high[crossings, 0], is_up[:, 1:].ravel()[crossings]
        for _ in range(MAX_BISECTIONS):
            middle = 0.5 * (a + b)
            later = (self._roots[k](*at, middle)[0] >= 0.0) != up
            a, b = np.where(later, middle, a), np.where(later, b, middle)
        return b


def _join_times(edges, times):
    """Return ascending edges and the times between them, those that are equal once."""
    for time in sorted(times):
        if edges[0] < time < edges[-1] and np.abs(edges - time).min() > MIN_JUMP_DISTANCE * np.ptp(edges):
            edges = np.sort(np.append(edges, time))
    return edges
