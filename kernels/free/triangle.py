r"""The triangle inequality of moments of inertia: which moments belong to a rigid body.

A body made of mass has second moments :math:`J_i = (I_j + I_k - I_i)/2 \ge 0`, so no moment exceeds the sum of the
other two; equality is a flat body or a rod.

Source: Landau and Lifshitz, Mechanics, section 32.
"""

import numpy as np

FLAT = 1e-9  # of I1 + I2 + I3: a flat body's moments, printed to nine digits, miss equality by that


def ascending(I1, I2, I3):
    """Sort three arrays element by element; NaN in all three where one is NaN."""
    low, high = np.minimum(I1, I2), np.maximum(I1, I2)
    return np.minimum(low, I3), np.maximum(low, np.minimum(high, I3)), np.maximum(high, I3)


def triangle_margin(I1, I2, I3):
    """Return the least of (I_b + I_c - I_a)/(I1 + I2 + I3) over the axes: negative where no body can exist.

    At most 1/3 (the sphere). A margin between -FLAT and 0 is that of a flat body whose moments are rounded, and comes
    out as 0. Moments are in a common unit, and broadcast together.
    """
    least, middle, greatest = ascending(I1, I2, I3)
    # as ratios to the greatest, and the difference first: no overflow, and a plate's zero stays a zero
    excess = least / greatest - (greatest - middle) / greatest
    margin = excess / (1.0 + middle / greatest + least / greatest)
    return np.where((margin < 0.0) & (margin >= -FLAT), 0.0, margin)
