r"""Oscillations about a degenerate equilibrium: V″ = 0, and a higher term of V confines the motion.

There is no rate there, for the frequency goes with the amplitude. Of one coordinate near its place, x the distance,

.. math:: \tfrac12 a\,\dot x^2 + c_m x^m = E, \qquad m \in \{4, 6, 8, 10\},\ c_m = V^{(m)}/m! > 0,\ a > 0

the turning point is :math:`A = (E/c_m)^{1/m}`, and a quarter of the period the time from 0 to A:

.. math:: T = 4\int_0^A \frac{dx}{\sqrt{2c_m(A^m - x^m)/a}}
            = 4A^{1 - m/2}\sqrt{\frac{a}{2c_m}}\int_0^1\frac{du}{\sqrt{1 - u^m}}, \qquad
          \int_0^1\frac{du}{\sqrt{1 - u^m}} = \frac{\sqrt\pi\,\Gamma(1 + 1/m)}{\Gamma(1/2 + 1/m)}

(a Beta function, :math:`\frac1m B(\frac1m, \frac12)`; :math:`\pi/2` for m = 2). So :math:`\omega \propto A^{m/2-1}`:
half the amplitude, half the frequency about :math:`x^4`.

*The confining term* is the largest one at its turning point; a place has a rounding error (of a double root its square
root), so lower terms do not vanish exactly. If the largest term has an odd order or is negative, no term confines the
motion.

*Error.* Another term of order k, :math:`r_k = |c_k|A^k/(c_mA^m)`, changes :math:`1 - u^m` by
:math:`r_k(1 - u^k) \le r_k\frac km(1 - u^m)` at most, and the period by half of that; the turning point moves by
:math:`r_k/m` of itself. Both together are below :math:`\frac km r_k` for k > m and below :math:`r_k` for k < m. a
that varies along the motion adds :math:`\frac12|a'|A/a + \frac14|a''|A^2/a`. Orders above 12 are left out.
"""

import math

import numpy as np

from sweeps.mechanics.equations import Equations
from sweeps.mechanics.graph import compile_expression

CONFINING_ORDERS = (4, 6, 8, 10)  # orders of terms that can confine a motion
ORDERS = range(2, 13)
RELATIVE_ROUNDING = 1e-14


def quarter_integral(m: int) -> float:
    """Return ∫ du/√(1 − u^m) from 0 to 1."""
    return math.sqrt(math.pi) * math.gamma(1 + 1 / m) / math.gamma(0.5 + 1 / m)


class Degenerate:
    """V's Taylor series and a of a system of one coordinate."""

    def __init__(self, equations: Equations):
        ((q,), e, a) = equations.q, equations.hessian[0, 0], equations.a[0, 0]
        arguments, terms = (*equations.parameters, q), []
        for k in ORDERS:
            terms.append(e / math.factorial(k))
            e = e.diff(q)
        self._series = compile_expression(arguments, terms)
        self._a = compile_expression(arguments, [a, a.diff(q), a.diff(q, 2)])

    def oscillations(self, parameters, place, x, v) -> dict[str, np.ndarray]:
        """Return the frequencies of motions that start at a distance from equilibria, with a velocity.

        Args:
            parameters: one array (points,) for each.
            place: the equilibria, shape (points,).
            x: distance from them at the start, shape (points,).
            v: velocity at the start, shape (points,).

        Returns:
            `degenerate_frequency` (rad/s), its `_error`, `degenerate_amplitude` (A) and `degenerate_order` (m, 0 if
            no term confines the motion; all further columns are NaN then).
        """
        with np.errstate(all="ignore"):
            c, a = (np.stack(function(*parameters, place)) for function in (self._series, self._a))
            is_confined, *values = zip(*(_confined_motion(m, c, a, x, v) for m in CONFINING_ORDERS), strict=True)
        columns = {"degenerate_order": np.select(is_confined, CONFINING_ORDERS, 0).astype(np.int8)}
        for name, of_orders in zip(("amplitude", "frequency", "frequency_error"), values, strict=True):
            columns[f"degenerate_{name}"] = np.select(is_confined, of_orders, np.nan)
        return columns


def _confined_motion(m, c, a, x, v):
    """Return (is_confined, turning point, frequency, its error) for the term of order m."""
    coefficient = c[m - ORDERS[0]]
    A = (0.5 * a[0] * v * v / coefficient + np.abs(x) ** m) ** (1.0 / m)
    sizes = np.stack([np.abs(c[k - ORDERS[0]] / coefficient) * A ** (k - m) for k in ORDERS])
    perturbing_terms = np.stack([sizes[k - ORDERS[0]] * max(k / m, 1.0) for k in ORDERS if k != m])
    frequency = 0.5 * math.pi * A ** (m / 2 - 1) * np.sqrt(2.0 * coefficient / a[0]) / quarter_integral(m)
    mass_change = 0.5 * np.abs(a[1] / a[0]) * A + 0.25 * np.abs(a[2] / a[0]) * A * A
    is_confined = (coefficient > 0.0) & (a[0] > 0.0) & (sizes <= 1.0).all(axis=0) & np.isfinite(frequency)
    return is_confined, A, frequency, frequency * (perturbing_terms.sum(axis=0) + mass_change + RELATIVE_ROUNDING)
