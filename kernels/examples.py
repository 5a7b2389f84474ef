"""Calls of kernels on examples, which compile them: of the parts of a survey and of the planning of runs.

A survey of one point would compile them too. Called first, in processes side by side, they take half the time.
"""

import numpy as np

from kernels import blocks, direct, estimates, lanes, survey

EVERY_COLUMN = tuple(lanes.Work(*5 * [True]))
INTERVALS, TOLERANCE = 1, 1e-9


def follow_block() -> None:
    """Compile `follow`, by a block of zeros."""
    lanes.follow(blocks.scratch(estimates.ROWS), 0, 1, INTERVALS, EVERY_COLUMN, lanes.NONE)


def fill_columns() -> None:
    """Compile `fill`, by a block of zeros."""
    estimates.fill(blocks.scratch(estimates.ROWS), EVERY_COLUMN, lanes.NONE, 0, True, TOLERANCE)


def plan_points() -> None:
    """Compile the planning of a survey, by a point of zeros."""
    T = np.zeros(survey.PITCH * (survey.GATHERED + 1))
    plan = tuple(np.ones(1, np.int64) for _ in survey.PointPlan._fields)
    survey._plan(T, np.ones(1, np.int64), 1.0, INTERVALS, plan)
    survey._choose(T, INTERVALS, TOLERANCE, plan)
    survey._sort(plan)


def plan_runs() -> None:
    """Compile the planning of runs of described systems."""
    direct.truncation(1.0, direct.ORDERS[0])
    blocks.cut(np.zeros(1, np.int64), 1)
