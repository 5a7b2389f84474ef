r"""Equations of a free body that loses energy, as a described system with its spins as relative equilibria.

Units and symbols are those of :mod:`kernels.events.dissipation`. With a and b the differences of 1/I about both other
axes from 1/I_k, over 1/I_1 - 1/I_3, linear theory about axis k is
:math:`\lambda^2 + q\,(a + b)\,\lambda + a b\,(1 + q^2) = 0`.
"""

import threading

import numpy as np

from sweeps.mechanics import System
from sweeps.mechanics.model import Model

COLUMNS = tuple(f"eigenvalue_{component}{kind}" for component in ("real", "imag") for kind in ("", "_theory", "_error"))
EPSILON = 1e-30  # relative size of the perturbations; motions are carried in units of it
_LOADING = threading.Lock()

description = System("Free body that loses energy")
ratio = description.parameter("ratio", default=0.5, least=0.0, most=1.0, meaning="(1/I2 - 1/I3)/(1/I1 - 1/I3)")
loss = description.parameter("loss", default=0.1, positive=True, meaning="alpha |L|")
direction = [description.state(f"l{axis}", bounds=(-2, 2), size=1, meaning=f"L{axis}/|L|") for axis in (1, 2, 3)]
minor, intermediate, greatest = direction
energy, square = minor**2 + ratio * intermediate**2, sum(component**2 for component in direction)
description.rate(minor, loss * (energy - square) * minor - ratio * intermediate * greatest)
description.rate(intermediate, loss * (energy - ratio * square) * intermediate + greatest * minor)
description.rate(greatest, loss * energy * greatest - (1 - ratio) * minor * intermediate)
description.conserved(square, "momentum")
for axis_name, spin in zip(("least", "intermediate", "greatest"), direction, strict=True):
    description.equilibrium(axis_name, {component: float(component is spin) for component in direction})
MODEL = Model(description)


def measure_rates(ratios, losses, settings) -> dict[str, np.ndarray]:
    """Return COLUMNS, shape (n, 3 axes, 2 eigenvalues), and `rates_status`, shape (n, 3); over tau.

    Args:
        ratios: r of each point, shape (n,).
        losses: q of each point, shape (n,).
        settings: cycles, samples per cycle, tolerance and runs, as of `sweeps.mechanics.relative.survey`.
    """
    bodies, index = np.unique(np.stack([ratios, losses]), axis=1, return_inverse=True)
    shape = bodies.shape[1], 3, 2
    names = ("ratio", "loss", "equilibrium", "eigenvalue", "epsilon")
    values = *bodies[:, :, None, None], *np.ogrid[:3, 1:3], EPSILON
    points = {name: np.broadcast_to(value, shape).ravel() for name, value in zip(names, values, strict=True)}
    with _LOADING:  # one thread loads the generated code for all
        MODEL.code.module()
    columns = MODEL.survey(points, *settings)
    rates = {name: columns[name].reshape(shape)[index.ravel()] for name in (*COLUMNS, "status")}
    return rates | {"rates_status": rates.pop("status")[..., 0]}
