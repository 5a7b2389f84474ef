"""What a definition says of points that are drawn: how many, and how.

They stand along one dimension, `point`, and what is their own is a coordinate on it.
"""

from collections.abc import Mapping
from typing import Annotated, Any

from sweeps.schema.strict import Strict, key
from sweeps.schema.values import choice, whole

METHODS = ("sobol", "latin", "random")
MOST_DRAWN, MOST_SOBOL = 2**40, 2**30  # SciPy's Sobol points have 30 binary digits


class Sample(Strict):
    """Points drawn over the ranges of a grid, in place of all their combinations."""

    method: Annotated[str, choice(METHODS)] = key(
        "sobol (scrambled; most even, best with num a power of two), latin (Latin hypercube) or random", "sobol"
    )
    num: Annotated[int, whole(1, MOST_DRAWN, f"a whole number from 1 to {MOST_DRAWN:,}; sobol: {MOST_SOBOL:,}")] = key(
        "number of points: a whole number ≥ 1", ...
    )
    seed: Annotated[int, whole(0, 2**63 - 1, "a whole number ≥ 0")] = key(
        "seed: a whole number ≥ 0; equal seeds give equal points", 0
    )


def ends_alone(values: Mapping) -> dict:
    """Return the plain values of a definition with `num` added to the ranges of its grid that lack it."""
    grid = values.get("grid")
    if "sample" not in values or not isinstance(grid, dict):
        return dict(values)
    return {**values, "grid": {key: _with_num(entry) for key, entry in grid.items()}}


def _with_num(entry: Any) -> Any:
    if not isinstance(entry, dict) or "num" in entry:
        return entry
    if "start" not in entry:  # a mapping of ranges
        return {key: _with_num(item) for key, item in entry.items()}
    return {**entry, "num": 1 if entry["start"] == entry.get("stop") else 2}
