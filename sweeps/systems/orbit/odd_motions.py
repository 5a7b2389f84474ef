r"""All odd periodic planar motions of a body on its orbit, as the roots of one function of the initial rate.

With the angle :math:`\delta = (p - 1) f + x` from the radius, Beletsky's equation is the same for -x at -f. A motion
with x = 0 at the pericentre and at the apocentre is odd about both, so it closes after an orbit; motions that forcing
makes of rest, or of uniform rotation, are of this kind. They are the roots of the angle x(π) as a function of x'(0).

With :math:`M = (1 + e\cos f)^2 (1 + \delta')`, :math:`|M'| \le \tfrac32 |D| (1 + e\cos f)` and so
:math:`|M - M(0)| \le \tfrac32\pi |D|` up to the apocentre, D = (I2 - I1)/I3; 1 + δ' has the mean p. So all roots obey

.. math:: |(1 + e)^2 (p + x'(0)) - p (1 - e^2)^{3/2}| \le \tfrac32\pi |D|

Source: Beletsky, Motion of an Artificial Satellite about its Center of Mass (1966); the bound is derived here.
"""

import numpy as np

from sweeps.mechanics import motions
from sweeps.mechanics.model import Model

TRIAL_SPACING = 0.25  # rad, change of a sphere's angle at the apocentre between neighbouring trial rates
MIN_TRIALS, FINER_TRIALS = 16, 64  # trial rates of a point, and those around an extremum that may hide two roots
MAX_TRIALS = 4096  # enough for all possible bodies at eccentricities up to 0.95; beyond, no motion is searched for
MAX_RUNS = 1 << 18  # motions that are integrated together: their arrays take some 50 MB
ANGLE_TOLERANCE = 1e-11  # relative truncation error of an angle at the apocentre; Newton's method refines the motion
ROOT_WIDTH = 1e-13  # width of a root's last bracket


def find_odd_motions(model: Model, arguments: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Return x'(0) and number of each point's odd motion that has the least |x'(0)|, shape (points,).

    Odd motions are numbered by ascending x'(0), from 1. NaN and 0 for coefficients that no body can have.

    Args:
        model: Beletsky's equation of x.
        arguments: its parameters, shape (points,).
    """
    from scipy.optimize.elementwise import find_root

    eccentricity, spin = arguments["eccentricity"], arguments["p"]
    parameters = [arguments[name] for name in model.names]
    reach = 1.5 * np.pi * np.abs(arguments["asymmetry"]) + 1e-6  # a sphere has a range, too
    middle, slope = spin * (1.0 - eccentricity**2) ** 1.5, (1.0 + eccentricity) ** 2
    needed = np.maximum(2.0 * np.pi * reach * (1.0 - eccentricity**2) ** -1.5 / TRIAL_SPACING, MIN_TRIALS)
    trials = np.where(needed <= MAX_TRIALS, 2.0 ** np.ceil(np.log2(needed)), 0.0).astype(int)

    def apocentre_angle(rate, point):
        """Return x(π) of motions with x'(0) = `rate`, shape (…,), of points with these indices."""
        rates, points = rate.ravel(), np.broadcast_to(point, rate.shape).ravel()
        start, times = np.column_stack([0.0 * rates, rates]), np.tile([0.0, np.pi], (rates.size, 1))
        values = [column[points] for column in parameters]
        states = motions.integrate_in_steps(model.moving, values, start, times, ANGLE_TOLERANCE)[0]
        return states[:, 1, 0].reshape(rate.shape)

    def brackets(point, low, high, count, is_first=True):
        """Yield (point, low, high) of sign changes between trial rates, and of those hidden beside an extremum."""
        size = max(1, MAX_RUNS // count)
        for first in range(0, point.size, size):
            chunk = slice(first, first + size)
            rates = np.linspace(low[chunk], high[chunk], count + 1, axis=1)
            angles = apocentre_angle(rates, point[chunk, None])
            row, cell = np.nonzero((angles[:, :-1] * angles[:, 1:] < 0.0) | (angles[:, :-1] == 0.0))
            yield np.array([point[chunk][row], rates[row, cell], rates[row, cell + 1]])
            before, here, after = angles[:, :-2], angles[:, 1:-1], angles[:, 2:]
            is_lowest = (np.abs(here) <= np.abs(before)) & (np.abs(here) <= np.abs(after))
            row, cell = np.nonzero(is_lowest & (before * here > 0.0) & (here * after > 0.0))
            if row.size and is_first:
                yield from brackets(point[chunk][row], rates[row, cell], rates[row, cell + 2], FINER_TRIALS, False)

    triples = [np.empty((3, 0))]
    for count in np.unique(trials[trials > 0]):
        point = np.flatnonzero(trials == count)
        low, high = ((middle + sign * reach)[point] / slope[point] - spin[point] for sign in (-1, 1))
        triples += brackets(point, low, high, count)
    point, low, high = np.concatenate(triples, axis=1)
    point = point.astype(int)
    root = find_root(apocentre_angle, (low, high), args=(point,), tolerances={"xatol": ROOT_WIDTH}).x
    order = np.lexsort((root, point))
    point, root = point[order], root[order]
    number = np.arange(point.size) - np.searchsorted(point, point) + 1
    order = np.lexsort((np.abs(root), point))
    members, first = np.unique(point[order], return_index=True)
    least, branch = np.full(spin.size, np.nan), np.zeros(spin.size, dtype=np.int8)
    least[members], branch[members] = root[order][first], number[order][first]
    return least, branch
