r"""Equations of a free body with modulated moments, as a described system of two states.

The angular momentum :math:`\mathbf L = L\boldsymbol\ell` obeys :math:`\dot{\boldsymbol\ell} = \boldsymbol\ell\times L
I(t)^{-1}\boldsymbol\ell`, so |L| is constant and a spin about a principal axis a is a solution for any moments.
With the coordinates of Lambert's equal-area projection about that axis,

.. math:: \ell_a = 1 - \tfrac12 R^2,\quad \ell_b = X\sqrt{1 - \tfrac14R^2},\quad \ell_c = Y\sqrt{1 - \tfrac14R^2},
          \qquad R^2 = X^2 + Y^2

the equations are Hamilton's, :math:`\dot X = -\partial H/\partial Y,\ \dot Y = \partial H/\partial X`, and
:math:`H = \tfrac L2\sum\ell_i^2/I_i(t)` is a polynomial. To first order X and Y are the tilt of L along b and c. Time
is :math:`u = \nu t`, from 0 to 2 pi; both states are rotated by `direction`: perturbations start along and across it.

Source: derived from Euler's equations; Magnus and Winkler, Hill's Equation (1966), for the theory.
"""

from functools import cache

import numpy as np

from sweeps.mechanics import System, periodic
from sweeps.mechanics.model import Model

AXES = "abc"


@cache
def tilt_model(inverse: bool) -> Model:
    r"""Return the system of the canonical tilt coordinates (X, Y) of L from the spin axis a, over the time u = νt.

    ν is the angular frequency of the modulation. Without constant terms, the Hamiltonian over ν is

    .. math:: H = \tfrac12 (\beta X^2 + \alpha Y^2)\left(1 - \tfrac14 (X^2 + Y^2)\right), \quad
              \alpha = \frac L\nu\left(\frac1{I_c} - \frac1{I_a}\right), \quad
              \beta = \frac L\nu\left(\frac1{I_b} - \frac1{I_a}\right)

    with moments that depend on u, or inverse moments. The states v and w are X and Y rotated by `direction`.

    Args:
        inverse: True if 1/I_i is modulated instead of I_i.
    """
    from sympy import cos, pi, sin

    system = System("Body whose moments change with time")
    # means (alpha, beta) and modulations are separate parameters, which makes bounds on them tight
    alpha, beta = (system.parameter(n, default=1.0, meaning=f"mean of {n}/ν") for n in ("alpha", "beta"))
    waves = []
    for i in AXES:
        wave = system.parameter(f"wave_{i}", default=0.0, meaning=f"depth of the modulation times L/(I_{i} ν)")
        depth = system.parameter(f"depth_{i}", default=0.0, meaning=f"depth of the modulation of I_{i}")
        lag = system.parameter(f"lag_{i}", "rad", default=0.0, meaning=f"phase of the modulation of I_{i}")
        cosine = cos(system.time + lag)
        waves.append(wave * cosine if inverse else -wave * cosine / (1 + depth * cosine))
    phase = system.parameter("direction", "rad", default=0.0, meaning="direction of the perturbation")
    w, v = (system.state(name, bounds=(-1, 1), size=1, meaning=f"tilt {name}") for name in "wv")
    along, across = cos(phase), sin(phase)
    X, Y = along * v - across * w, across * v + along * w
    a, b, c = waves
    square, alpha, beta = (X**2 + Y**2) / 4, alpha + c - a, beta + b - a
    quartic = (beta * X**2 + alpha * Y**2) / 4
    x_dot, y_dot = -Y * (alpha * (1 - square) - quartic), X * (beta * (1 - square) - quartic)
    system.rate(v, along * x_dot + across * y_dot)
    system.rate(w, along * y_dot - across * x_dot)
    system.period(2 * pi)
    system.equilibrium("spin", {w: 0, v: 0})
    return Model(system)


def survey(points, inverse: bool = False, tolerance: float = 1e-12) -> dict[str, np.ndarray]:
    """Return all columns of points; see `sweeps.mechanics.periodic`.

    Points are axis (1, 2 or 3), I1, I2, I3 (common unit), depth1, depth2, depth3, lag1, lag2, lag3 (rad), frequency
    (rad s-1), omega0 (rad s-1), epsilon and phase (rad), each an array (n,). With `inverse`, 1/I_i is modulated
    instead of I_i. `tolerance` is the truncation error over a period, relative to the monodromy matrix.
    """
    axis, frequency = np.asarray(points["axis"]), np.asarray(points["frequency"], dtype=np.float64)
    arguments = {
        "direction": points["phase"],
        "epsilon": points["epsilon"],
        "equilibrium": np.zeros(axis.size, dtype=int),
    }
    with np.errstate(over="ignore", invalid="ignore"):
        ratio = points["omega0"] / frequency
        spin_moment = np.choose(axis - 1, [points[f"I{i}"] for i in (1, 2, 3)])
        for k, name in enumerate(AXES):
            index = (axis - 1 + k) % 3  # number of the moment, less 1
            moment, depth, lag = (
                np.choose(index, [points[f"{x}{i}"] for i in (1, 2, 3)]) for x in ("I", "depth", "lag")
            )
            arguments |= {
                f"wave_{name}": depth * ratio * (spin_moment / moment),
                f"depth_{name}": depth,
                f"lag_{name}": lag,
            }
            if k:
                arguments["beta" if name == "b" else "alpha"] = ratio * ((spin_moment - moment) / moment)
        columns = periodic.survey(tilt_model(inverse), arguments, tolerance)
        for name in columns:
            if name.startswith(("exponent", "growth_rate")):
                columns[name] = (columns[name].T * frequency).T
    return columns
