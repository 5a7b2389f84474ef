r"""Response of stable linear motion to a harmonic force: the periodic motion, by theory and measured from its samples.

With states y, :math:`\dot y = Ay + b\cos wt` has the periodic motion :math:`\mathrm{Re}\,Y e^{iwt}`,
:math:`Y = (iw - A)^{-1} b`, which is :math:`(K - w^2 M + iwC)^{-1} f` for coordinates. It is measured without this
formula: cos wt and sin wt are two more states of a linear motion, which is integrated by Taylor steps. With the flow P
over a period and the states g that the force makes in it from rest, the motion that starts from
:math:`(I - P)^{-1} g` has no transient; from its samples over PERIODS periods Y is fitted by least squares.

*Error.* Put into the equations a measured Y leaves :math:`r = (iw - A)Y - b`, so it is off by
:math:`\lVert (iw - A)^{-1}\rVert\,(\lVert r\rVert + \text{rounding})` at most.
"""

import numpy as np

from sweeps.mechanics import linear_model

SAMPLES, PERIODS = 16, 2  # samples of a period, from which cosine and sine are fitted, and periods of a run
MAX_STEPS = 2.0**40  # steps of a sample, beyond which they are too long to be accurate, and the response is missing
MAX_RELATIVE_ERROR = 0.1  # error of a measured response, relative to its states, beyond which it is missing
ROUNDING = 2.0 * np.finfo(float).eps  # rounding error of each complex product and sum, relative to its terms


@np.errstate(all="ignore")
def scaled_push(model, theory, forces) -> np.ndarray:
    """Return b of one point, s-1, shape (n,), from forces along coordinates, or additions to the rates of states."""
    sizes, forces = theory["sizes"][0], np.asarray(forces, dtype=float)
    if not model.equations.v:
        return forces / sizes
    masses = model.landscape.a(theory["parameters"], list(theory["place"].T))[0]
    return np.append(np.zeros(forces.size), np.linalg.solve(masses, forces)) / sizes


@np.errstate(all="ignore")
def respond(matrix, push, scale: float, frequencies) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return Y by theory and measured, complex, shape (frequencies, n), and a bound on the measured one's error.

    Args:
        matrix: A, s-1, shape (n, n), with its states in units of their sizes.
        push: b, s-1, shape (n,), in the same units.
        scale: bound S on every rate, s-1.
        frequencies: w, rad s-1, > 0, shape (frequencies,).
    """
    count, size = len(push), np.linalg.norm(push) / scale
    unit, rates = push / size, np.asarray(frequencies, dtype=float)
    forced = np.zeros((rates.size, count + 2, count + 2))
    forced[:, :count, :count], forced[:, :count, count] = matrix, unit
    forced[:, count, count + 1], forced[:, count + 1, count] = -rates, rates
    sample_time = 2.0 * np.pi / rates / SAMPLES
    steps = np.ceil(np.fmin(sample_time * np.maximum(scale, rates) / linear_model.SPACING, MAX_STEPS)).astype(int)
    propagators = linear_model.taylor_propagators(forced, sample_time / steps)
    measured = np.array([_fit(np.linalg.matrix_power(*pair), count) for pair in zip(propagators, steps, strict=True)])
    resolvent = 1j * rates[:, None, None] * np.eye(count) - matrix
    residual = np.einsum("fij,fj->fi", resolvent, measured) - unit
    terms = np.abs(measured) @ np.abs(matrix).T + rates[:, None] * np.abs(measured) + np.abs(unit)
    left, singular, right = np.linalg.svd(resolvent)
    errors = np.linalg.norm(np.abs(residual) + ROUNDING * (count + 2) * terms, axis=1) / singular[:, -1]
    is_known = errors <= MAX_RELATIVE_ERROR * np.linalg.norm(measured, axis=1)
    is_regular = singular > ROUNDING * count * singular[:, :1]
    inverse = np.where(is_regular, 1.0 / singular, np.nan)  # infinite at a resonance without damping
    theory = np.einsum("fji,fj,fkj,k->fi", right.conj(), inverse, left.conj(), push)
    return theory, np.where(is_known[:, None], measured * size, np.nan), np.where(is_known, errors * size, np.nan)


def _fit(flow, count):
    """Return the complex amplitudes of the periodic motion, from the flow of states, cosine and sine over a sample."""
    period = np.linalg.matrix_power(flow, SAMPLES)
    if not np.isfinite(period).all():
        return np.full(count, np.nan)
    inverse = np.linalg.pinv(np.eye(count) - period[:count, :count], rcond=0.0)
    states = [np.append(inverse @ period[:count, count], [1.0, 0.0])]
    for _sample in range(SAMPLES * PERIODS - 1):
        states.append(flow @ states[-1])
    phases = 2.0 * np.pi * np.arange(SAMPLES * PERIODS) / SAMPLES
    waves = np.column_stack([np.cos(phases), np.sin(phases)])
    parts = np.linalg.lstsq(waves, np.array(states)[:, :count], rcond=None)[0]
    return parts[0] - 1j * parts[1]
