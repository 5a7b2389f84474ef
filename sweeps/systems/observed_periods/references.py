r"""The energy that gives two periods, found again by SciPy: Jacobi's functions, quadrature and a root.

With L = 1 and moments I1 < I2 < I3 the angular momentum's components along the body are those of Landau and Lifshitz,
section 37, and the axis of least moment goes round L at the rate
:math:`\dot\phi = L\,(L_2\omega_2 + L_3\omega_3)/(L_2^2 + L_3^2)`. Its mean over the period of the angular velocity is
the mean over a quarter of it.
"""

import math
from collections.abc import Mapping

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import ellipj, ellipk

from sweeps.systems.system import Reference

NEAR_SEPARATRIX = 1e-6  # of the energies of a mode: where the ratio changes too fast for quadrature
ALLOWED = 1e-8


def ratio(moments: np.ndarray, energy: float) -> float:
    """Return P_psi/P_phi (long axis) of a body of ascending moments at the energy 2T I3/L^2, in either mode."""
    I1, I2, I3 = moments
    T2 = energy / I3  # at L = 1
    long = energy * I2 > I3  # the polhode encircles axis 1: the roles of axes 1 and 3 change
    Ia, Ic = (I3, I1) if long else (I1, I3)
    p = math.sqrt((Ic - I2) * (1.0 - T2 * Ia) / (I1 * I2 * I3))
    m = (I2 - Ia) * (T2 * Ic - 1.0) / ((Ic - I2) * (1.0 - T2 * Ia))
    a = math.sqrt(Ia * (T2 * Ic - 1.0) / (Ic - Ia))
    b = math.sqrt(I2 * (T2 * Ic - 1.0) / (Ic - I2))
    c = math.sqrt(Ic * (1.0 - T2 * Ia) / (Ic - Ia))
    K = float(ellipk(m))

    def rate(u):
        sn, cn, dn, _ = ellipj(u, m)
        along, second, encircled = a * cn, b * sn, c * dn
        third = along if long else encircled
        across = second * second + third * third
        return (second * second / I2 + third * third / I3) / across

    mean = quad(rate, 0.0, K, epsabs=0.0, epsrel=1e-12, limit=400)[0] / K
    return mean * 4.0 * K / p / (2.0 * math.pi)


def energy_of(point: Mapping[str, float], mode: str) -> float:
    """Return the energy of a mode that gives the point's ratio of periods; NaN where none does."""
    moments = np.sort([float(point[f"I{i}"]) for i in (1, 2, 3)])
    moments = moments / moments[2]
    wanted = float(point["P_psi"]) / float(point["P_phi"])
    separatrix = moments[2] / moments[1]
    end = 1.0 if mode == "sam" else moments[2] / moments[0]
    gap = separatrix - end
    if abs(gap) < 1e-3 or moments[0] == moments[1]:
        return math.nan
    low, high = end + 1e-9 * gap, separatrix - NEAR_SEPARATRIX * gap
    if not ratio(moments, low) < wanted < ratio(moments, high):
        return math.nan
    return float(brentq(lambda energy: ratio(moments, energy) - wanted, low, high, xtol=1e-13, rtol=1e-14))


def _reference(mode: str, words: str, *more: Reference) -> Reference:
    def allowed(point: Mapping[str, float], integration) -> float:
        return ALLOWED * max(point["I1"], point["I2"], point["I3"]) / min(point["I1"], point["I2"], point["I3"])

    return Reference(f"energy_{mode}", {f"SciPy, {words}": lambda point, _: energy_of(point, mode)}, allowed, more)


REFERENCE = _reference("lam", "long-axis mode", _reference("sam", "short-axis mode"))
