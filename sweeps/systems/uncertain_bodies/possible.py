r"""Projection of Gaussian draws of a tensor of inertia to possible bodies, with the least change of the draws.

A tensor T is that of a body if its second moments :math:`\Sigma = \int x x^\mathsf{T} dm = \tfrac12\mathrm{tr}(T)\,1
- T` are not negative: the eigenvalues :math:`J_i = (I_j + I_k - I_i)/2 \ge 0`. A Gaussian draw of T violates this if
the body is nearly flat or the uncertainty large. A draw keeps its principal axes, and each of its J is mapped by one
function,

.. math:: g(J) = J \quad (J \ge \delta), \qquad g(J) = \delta^2/(2\delta - J) \quad (J < \delta),

which is smooth, increasing and positive: J below zero becomes a nearly flat body, within a fraction of δ, and draws
with all J ≥ δ do not change. δ is a hundredth of the largest standard deviation of a J.

*Reasons for this choice.* g is the same increasing function for all three J, so the *order* of the moments is that of
the Gaussian draw: the probability that an axis is the intermediate one is that of the normal distribution, for every
uncertainty, and has a closed form. g does not depend on coordinates and rejects no draw: a Sobol sequence remains one.
Log-normal second moments do not exist if two J are strongly anticorrelated; a Cholesky factor of the pseudo-inertia
depends on the order of the coordinates; rejecting impossible draws shifts mean and spread more. A map states the shift:
mean and spread of the moments as requested, and as drawn.

Source: for second moments, Wensing, Kim, Slotine (2018), IEEE Robotics and Automation Letters 3, 60; the function g is
ours.
"""

from itertools import permutations

import numpy as np

RELATIVE_DELTA = 0.01  # δ over the largest standard deviation of a second moment
MIN_DELTA = 1e-12  # least δ over the sum of the second moments, above the rounding of moments

ORDERS = np.array(list(permutations(range(3))))
# entries of a symmetric tensor, in the order of a covariance
ENTRIES = {"Ixx": (0, 0), "Iyy": (1, 1), "Izz": (2, 2), "Ixy": (0, 1), "Ixz": (0, 2), "Iyz": (1, 2)}


def softness(covariance: np.ndarray, moments: np.ndarray) -> float:
    """Return δ of a body from the covariance of its moments, or of the six entries of its tensor, and its moments."""
    if len(covariance) == 3:
        rows = 0.5 - np.eye(3)
    else:  # for entries, the variance of a second moment along each coordinate axis is sufficient
        rows = np.hstack([0.5 - np.eye(3), np.zeros((3, 3))])
        covariance = covariance + np.diag([0.0, 0.0, 0.0, *np.diag(covariance)[3:]])
    spread = float(np.sqrt(np.max(np.einsum("ij,jk,ik->i", rows, covariance, rows), initial=0.0)))
    spread = max(spread, float(np.sqrt(np.max(np.diag(covariance)))))
    return max(RELATIVE_DELTA * spread, MIN_DELTA * float(np.sum(moments)))


def project_second_moments(second: np.ndarray, delta: float) -> np.ndarray:
    """Return g of second moments."""
    is_low = second < delta
    if not is_low.any():
        return second
    return np.where(is_low, delta * (delta / (2 * delta - np.where(is_low, second, 0.0))), second)


def project_moments(moments: np.ndarray, delta: float) -> tuple[np.ndarray, np.ndarray]:
    """Return moments of possible bodies from Gaussian moments, shape (n, 3), and True for impossible bodies."""
    columns = moments.T
    half = (columns[0] + columns[1] + columns[2]) / 2
    second = [half - column for column in columns]
    impossible = (second[0] < 0) | (second[1] < 0) | (second[2] < 0)
    first, middle, last = (project_second_moments(column, delta) for column in second)
    possible = np.empty_like(moments)
    for k, column in enumerate((middle + last, first + last, first + middle)):
        possible[:, k] = column
    return possible, impossible


def project_entries(entries: np.ndarray, delta: float, axes: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return possible bodies from the six entries of Gaussian tensors.

    Args:
        entries: shape (n, 6), in the order of `ENTRIES`.
        delta: δ.
        axes: principal axes of the nominal body, as rows.

    Returns:
        Moments, shape (n, 3), numbered as the nearest axes of the nominal body; True for impossible draws; and
        rotations, shape (n, 3, 3), from components along the nominal axes to components along the draw's.
    """
    moments, rotations = find_axes(entries, axes)
    return *project_moments(moments, delta), rotations


def find_axes(entries: np.ndarray, axes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return principal moments, (n, 3), of any sign, and rotations of tensors, as `project_entries` for its draws.

    Row i of a rotation is the tensor's axis i along the nominal axes, within a right angle of the nominal axis i,
    except for the third if right-handedness reverses it.
    """
    tensors = np.empty((len(entries), 3, 3))
    for (i, j), entry in zip(ENTRIES.values(), entries.T, strict=True):
        tensors[:, i, j] = tensors[:, j, i] = entry
    moments, vectors = np.linalg.eigh(axes @ tensors @ axes.T)
    rows = np.swapaxes(vectors, 1, 2)
    # rows are numbered as the nearest nominal axes
    order = ORDERS[np.abs(rows[:, ORDERS, range(3)]).sum(axis=2).argmax(axis=1)]
    rows = np.take_along_axis(rows, order[:, :, None], axis=1)
    rows *= np.where(np.diagonal(rows, axis1=1, axis2=2) < 0, -1.0, 1.0)[:, :, None]
    rows[:, 2] *= np.sign(np.linalg.det(rows))[:, None]
    return np.take_along_axis(moments, order, axis=1), rows


def middle_probability(moments: np.ndarray, covariance: np.ndarray, axis: int) -> float:
    r"""Return the probability that the moment about `axis` is intermediate, for normal `moments` with a `covariance`.

    X = I_s − I_a and Y = I_s − I_b have opposite signs with the probability

    .. math:: P = 2\,T(x, a_x) + 2\,T(y, a_y) + [xy < 0], \qquad a_x = \frac{y - \rho x}{x\sqrt{1 - \rho^2}}

    and likewise :math:`a_y`, with x and y the means over their standard deviations, and Owen's function T: this is
    Φ(x) + Φ(y) − 2 Φ2(x, y; ρ), without cancellation.

    Source: Owen (1956), Annals of Mathematical Statistics 27, 1075, equation (3.4).
    """
    from scipy.special import owens_t

    s, a, b = axis - 1, axis % 3, (axis + 1) % 3
    rows = np.zeros((2, 3))
    rows[0, [s, a]] = rows[1, [s, b]] = 1.0, -1.0
    means, spread = rows @ moments, rows @ covariance @ rows.T
    sigma = np.sqrt(np.diag(spread))
    if not (sigma > 0).all():
        return float("nan")
    x, y = means / sigma + 0.0  # no -0
    rho = float(np.clip(spread[0, 1] / sigma.prod(), -1.0, 1.0))
    if x == y == 0:
        return 0.5 - np.arcsin(rho) / np.pi
    root = np.sqrt((1.0 - rho) * (1.0 + rho))
    with np.errstate(divide="ignore", invalid="ignore"):
        slopes = np.divide([y - rho * x, x - rho * y], [x * root, y * root])
    has_opposite_signs = x * y < 0 or (x * y == 0 and x + y < 0)
    slopes = np.nan_to_num(slopes, posinf=np.inf, neginf=-np.inf)
    probability = 2 * owens_t([x, y], slopes).sum() + has_opposite_signs
    return float(min(max(probability, 0.0), 1.0))
