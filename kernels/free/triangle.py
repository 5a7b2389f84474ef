r"""Triangle inequality of moments of inertia, the condition for a physically possible rigid body.

A body made of mass has second moments :math:`J_i = (I_j + I_k - I_i)/2 \ge 0`, so no moment exceeds the sum of the
remaining two; equality is a flat body or a rod.

Source: Landau and Lifshitz, Mechanics, section 32.
"""

import numpy as np

FLATNESS_TOLERANCE = 1e-9  # deviation of a flat body's moments printed to nine digits, relative to I1 + I2 + I3


def sort_moments(I1, I2, I3):
    """Sort the arrays `I1`, `I2`, `I3` element by element; all three elements are NaN if any is."""
    low, high = np.minimum(I1, I2), np.maximum(I1, I2)
    return np.minimum(low, I3), np.maximum(low, np.minimum(high, I3)), np.maximum(high, I3)


def triangle_margin(I1, I2, I3):
    """Return the least of (I_b + I_c - I_a)/(I1 + I2 + I3) over the axes: negative for impossible bodies.

    At most 1/3 (the sphere). A margin between -FLATNESS_TOLERANCE and 0 is due to rounded moments of a flat body, and
    returned as 0.

    Args:
        `I1`, `I2`, `I3` (array_like): Moments in a common unit; they are broadcast together.
    """
    smallest, middle, greatest = sort_moments(I1, I2, I3)
    # ratios to the greatest, with the difference first: no overflow, and exactly 0 for a plate
    excess = smallest / greatest - (greatest - middle) / greatest
    margin = excess / (1.0 + middle / greatest + smallest / greatest)
    return np.where((margin < 0.0) & (margin >= -FLATNESS_TOLERANCE), 0.0, margin)
