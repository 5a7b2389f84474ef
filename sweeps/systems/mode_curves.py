"""Curves of modes along a parameter: each mode continues the mode whose state (shape, and shape times rate) is nearest.

Nearest is the mode with which the state overlaps most. Between values where states change by more than MAX_CHANGE of
their distance from the next mode, or where two modes exchange their order, theory is evaluated halfway: at a veering
states turn into each other, and the order stays; at a crossing they do not, down to 2^-MAX_HALVINGS of a cell. So
curves do not depend on the grid.
"""

from collections.abc import Mapping

import numpy as np

from sweeps.systems.described import Described

MAX_CHANGE = 0.25  # distance 1 - overlap of a mode from its continuation, relative to its distance from other modes
MAX_HALVINGS = 24  # halvings of a cell; a veering narrower than that is taken for a crossing


def follow_modes(system: Described, arguments: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return the number of each mode's curve, shape (points, modes); 0 if it is not known.

    Where modes meet in rate and shape, as at the onset of flutter, curves end, and others begin with further numbers.

    Args:
        system: the system.
        arguments: of the points of a grid, shape (points,); modes are followed along the last, which varies fastest.
    """
    along, values = [*arguments][-1], np.unique([*arguments.values()][-1])
    starts = {name: column[:: values.size] for name, column in arguments.items() if name != along}

    def states_at(lines, nodes):
        """Return the states of all modes at values of the parameter on lines, shape (points, modes, components)."""
        at_nodes = {name: column[lines] for name, column in starts.items()} | {along: nodes}
        return system.mode_shapes(at_nodes)[2]

    lines = np.repeat(np.arange(arguments[along].size // values.size), values.size)
    on_grid = np.tile(values, lines.size // values.size)
    grid_lines, grid_states = lines, states_at(lines, on_grid)
    is_whole = np.isfinite(grid_states).all(axis=(1, 2))  # no two modes are equal
    lines, nodes, states = lines[is_whole], on_grid[is_whole], grid_states[is_whole]
    for _halving in range(MAX_HALVINGS):
        is_certain, numbers = _continues(states[:-1], states[1:])
        is_open = ~is_certain.all(axis=1) | (numbers != range(states.shape[1])).any(axis=1)  # a crossing, or a veering
        is_open &= np.diff(lines) == 0
        if not is_open.any():
            break
        new_lines, middle = lines[:-1][is_open], 0.5 * (nodes[:-1] + nodes[1:])[is_open]
        new_states = states_at(new_lines, middle)
        is_whole = np.isfinite(new_states).all(axis=(1, 2))
        lines, nodes = np.append(lines, new_lines[is_whole]), np.append(nodes, middle[is_whole])
        order, states = np.lexsort((nodes, lines)), np.concatenate([states, new_states[is_whole]])
        lines, nodes, states = lines[order], nodes[order], states[order]
    is_certain, numbers = _continues(states[:-1], states[1:])
    curves = np.tile(np.arange(1, grid_states.shape[1] + 1), (lines.size, 1))
    largest = curves.max(axis=1, initial=0)
    for node in np.flatnonzero(np.diff(lines) == 0):
        curves[node + 1, numbers[node]] = np.where(is_certain[node], curves[node], 0)
        is_new = curves[node + 1] == 0
        curves[node + 1, is_new] = largest[node] + 1 + np.arange(is_new.sum())
        largest[node + 1] = largest[node] + is_new.sum()
    result = np.zeros(grid_states.shape[:2], dtype=np.int64)
    for row, (line, value) in enumerate(zip(grid_lines, on_grid, strict=True)):
        members = np.flatnonzero(lines == line)
        if members.size:
            nearest = members[np.abs(nodes[members] - value).argmin()]
            is_continued, number = _continues(states[nearest][None], grid_states[row][None])
            result[row, number[0]] = np.where(is_continued[0], curves[nearest], 0)
    return result


def find_cuts(system: Described, arguments: Mapping[str, np.ndarray], curves: np.ndarray, parameter: str) -> np.ndarray:
    """Return True at points from which two modes go on with exchanged curves at the next value of a parameter.

    Around a point at which two modes coincide in rate and shape (an exceptional point) they exchange: numbers that are
    continuous along one parameter jump, on a cut that ends there, along another.

    Args:
        system: the system.
        arguments: of the points of a grid, shape (points,), as of `follow_modes`.
        curves: of `follow_modes`.
        parameter: another one of the arguments.
    """
    shape = [np.unique(column).size for column in arguments.values()]
    axis = [*arguments].index(parameter)
    columns = {name: np.moveaxis(column.reshape(shape), axis, -1).ravel() for name, column in arguments.items()}
    columns[parameter] = columns.pop(parameter)  # the last
    numbers = follow_modes(system, columns).reshape(*np.delete(shape, axis), shape[axis], -1)
    curves = np.moveaxis(curves.reshape(*shape, -1), axis, -2)
    pairs = [(values[..., :-1, :, None], values[..., 1:, None, :]) for values in (numbers, curves)]
    is_same_mode, is_other_curve = pairs[0][0] == pairs[0][1], pairs[1][0] != pairs[1][1]
    is_known = np.all([np.minimum(*pair) > 0 for pair in pairs] + [np.maximum(*pairs[1]) <= curves.shape[-1]], axis=0)
    is_cut = (is_same_mode & is_other_curve & is_known).any(axis=(-2, -1))
    padding = [(0, 0)] * (len(shape) - 1) + [(0, 1)]
    return np.moveaxis(np.pad(is_cut, padding), -1, axis)


def _continues(first: np.ndarray, second: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return whether each first mode's continuation among the second modes is certain, and the continuation's index."""
    from scipy.optimize import linear_sum_assignment

    def overlaps(left, right):
        return np.nan_to_num(np.abs(np.einsum("pic,pjc->pij", left.conj(), right)))

    across, diagonal = overlaps(first, second), range(first.shape[1])
    number = np.array([linear_sum_assignment(-each)[1] for each in across]).reshape(across.shape[:2]).astype(int)
    continued = np.take_along_axis(across, number[..., None], axis=2)[..., 0]
    rivals = np.nan_to_num(overlaps(first, first))
    rivals[:, diagonal, diagonal] = 0.0
    return 1.0 - continued <= MAX_CHANGE * (1.0 - rivals.max(axis=2)), number
