"""Mathieu's equation y″ + (a - 2 q cos 2t) y = 0, published numbers and its matrix over π; errors of multipliers."""

import numpy as np
import precise
from scipy.integrate import solve_ivp

from kernels.estimator.statuses import OK
from kernels.flow import floquet

# traces over t = π, computed by two codes of 30 and 40 digits
TRACES = {
    (1, 0.1): -2.024666915416,
    (1, 0.5): -2.612418906625,
    (1, 1): -4.396667734799,
    (4, 1): 2.021314397417,
    (2, 1): -1.554649354177,
    (0, 0.9): -1.930617777201,
    (0, 0.92): -2.104134363645,
}
# characteristic values a0, b1, a1, b2, a2 of q, likewise
VALUES = {
    0.1: (-0.004994543801, 0.898765556994, 1.098734312963, 3.999166702832, 4.004161159833),
    0.5: (-0.121765544941, 0.470654354934, 1.466766842516, 3.979189215751, 4.100900595560),
    1.0: (-0.455138604107, -0.110248816992, 1.859108072514, 3.917024772998, 4.371300982735),
    5.0: (-5.800046020852, -5.790080598638, 1.858187541548, 2.099460445487, 7.449109739529),
}


def monodromy_matrix(a, q):
    """Return the matrix over a period in long doubles: its columns are the solutions from (1, 0) and (0, 1)."""
    a, q = np.longdouble(a), np.longdouble(q)

    def rates(t, y):
        return np.concatenate([y[2:], (2 * q * np.cos(2 * t) - a) * y[:2]])

    return precise.extrapolate(rates, np.eye(2).reshape(4, 1), [4 * np.arctan(np.longdouble(1))], 16).reshape(2, 2)


def solve_with_perturbations(rates, start, times, **options):
    """Return the state at the end and the matrix of perturbations by SciPy's DOP853, of rates (t, x) → x'.

    The rates are analytic in x: a step of 1e-30 in the complex plane differentiates them, and nothing is subtracted.
    """
    count = len(start)

    def all_rates(t, y):
        slopes = [np.imag(rates(t, y[:count] + 1e-30j * unit)) / 1e-30 for unit in np.eye(count)]
        return np.concatenate([rates(t, y[:count]), (np.transpose(slopes) @ y[count:].reshape(count, -1)).ravel()])

    begin = np.concatenate([start, np.eye(count).ravel()])
    end = solve_ivp(all_rates, times, begin, "DOP853", rtol=1e-13, atol=1e-15, **options).y[:, -1]
    return end[:count], end[count:].reshape(count, count)


def check_errors(columns, share=1.0):
    """Check columns and regimes against the variational flow's, if the status is OK; a share is within its errors."""
    is_ok = columns["status"] == OK
    for name in (c for c in columns if f"{c}_error" in columns and f"{c}_theory" in columns):
        deviation = np.abs(columns[name] - columns[f"{name}_theory"])[is_ok]
        assert (deviation <= columns[f"{name}_error"][is_ok]).mean() >= share, name
    decided = np.all([columns[name] != floquet.MARGINAL for name in ("regime", "regime_theory")], axis=0) & is_ok
    assert (columns["regime"] == columns["regime_theory"])[decided].all()
