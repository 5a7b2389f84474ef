"""Bodies by the parameters that give them: ratios of their moments."""

from collections.abc import Mapping

import numpy as np

from sweeps.systems.bodies.variables import MOMENTS

SHAPES = (MOMENTS, ("a_over_b", "b_over_c"), ("k1", "k3"), ("K",), ("asymmetry",))  # parameters that give a body


def inertia_ratios(points: Mapping[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Return I1/I3 and (I2 - I1)/I3 of points, from the parameters that give the body.

    The asymmetry alone is that of a body with I1 = I3. With `radial_axis` 2 both axes have changed places.
    """
    if "K" in points:
        ratio, asymmetry = 1.0 / points["K"], 0.0 / points["K"]
    elif "asymmetry" in points:
        ratio, asymmetry = np.ones_like(points["asymmetry"]), np.asarray(points["asymmetry"])
    elif "k1" in points:
        denominator = 1.0 - points["k1"] * points["k3"]
        ratio, asymmetry = (1.0 - points["k1"]) / denominator, (points["k1"] - points["k3"]) / denominator
    elif "a_over_b" in points:  # b is the unit
        radial, normal = np.square(points["a_over_b"]), 1.0 / np.square(points["b_over_c"])
        ratio, asymmetry = (1.0 + normal) / (1.0 + radial), (radial - 1.0) / (1.0 + radial)
    else:
        first, second, third = (points[name] for name in MOMENTS)
        ratio, asymmetry = first / third, (second - first) / third
    is_crosswise = np.equal(points.get("radial_axis", 1.0), 2.0)
    return np.where(is_crosswise, ratio + asymmetry, ratio), np.where(is_crosswise, -asymmetry, asymmetry)


def margin_of(points: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return the triangle margin of points."""
    from kernels.free.triangle import triangle_margin

    ratio, asymmetry = inertia_ratios(points)
    return triangle_margin(ratio, ratio + asymmetry, np.ones_like(ratio))
