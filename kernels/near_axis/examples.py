"""Calls of kernels on examples, which compile them: of the parts of a survey.

A survey of one point would compile them too. Called first, in processes side by side, they take half the time.
"""

import numpy as np

from kernels.compile import blocks
from kernels.near_axis import estimates, near_axis_block, survey

EVERY_COLUMN = tuple(near_axis_block.Work(*5 * [True]))
INTERVALS, TOLERANCE = 1, 1e-9


def follow_block() -> None:
    """Compile `follow`, by a block of zeros."""
    near_axis_block.integrate_block(
        blocks.scratch(estimates.ROWS), 0, 1, INTERVALS, EVERY_COLUMN, near_axis_block.NO_REDUCTION
    )


def fill_columns() -> None:
    """Compile `fill`, by a block of zeros."""
    estimates.write_columns(
        blocks.scratch(estimates.ROWS), EVERY_COLUMN, near_axis_block.NO_REDUCTION, 0, True, TOLERANCE
    )


def plan_points() -> None:
    """Compile the planning of a survey, by a point of zeros."""
    T = np.zeros(survey.ROW_LENGTH * (survey.NUM_GATHERED + 1))
    plan = tuple(np.ones(1, np.int64) for _ in survey.PointPlan._fields)
    survey._plan_points(T, np.ones(1, np.int64), 1.0, INTERVALS, plan)
    survey._choose_steps(T, INTERVALS, TOLERANCE, plan)
    survey._sort_points(plan)
