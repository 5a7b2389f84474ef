r"""Multipliers, exponents and stability of linear periodic motion, from monodromy matrices and their errors.

Over a period T a small perturbation changes by the monodromy matrix M; the multipliers mu are its eigenvalues, and the
exponents ln(mu)/T. At a double multiplier, multipliers change like the square root of the change of M, and half of the
digits are lost; traces and determinants are smooth. So these decide regimes, and multipliers are computed from them:

* two by two: :math:`\mu^2 - t\mu + d = 0`, t the trace, d the determinant (1 where M is symplectic);
* four by four and symplectic: with :math:`a = \mathrm{tr} M,\ b = (a^2 - \mathrm{tr} M^2)/2` each
  :math:`s = \mu + 1/\mu` solves :math:`s^2 - a s + b - 2 = 0`, with Krein's discriminant D = a^2 - 4b + 8, and

  .. math:: \det(M - 1) = (2 - s_1)(2 - s_2),\qquad \det(M + 1) = (2 + s_1)(2 + s_2)

  All multipliers are on the unit circle, and simple, if both determinants and D are positive and :math:`|a| < 4`.

Errors: the invariants' errors are linear in those of M's entries, with a bound on the squares; multipliers, exponents
and regimes are computed again at the ends of the invariants' intervals, which is also correct at double multipliers. A
regime that differs between ends is marginal, or unstable if a multiplier is off the unit circle in the whole intervals.
All further matrices have no such invariants: their multipliers are eigenvalues, with errors by their condition numbers
or, if that is too rough, by Elsner's bound.

*Large multipliers.* If one multiplier is 1e8, the doubles of M have eight digits of the smaller multipliers. The
determinant of two by two matrices and b of four by four matrices therefore come from products of the second compounds
of short segments: the lesser of two multipliers is d over the greater, and the lesser s is (b - 2) over the greater.

*Branch.* The logarithm determines the exponent's imaginary part up to multiples of 2 pi/T. For a two by two matrix with
determinant 1 the number of half turns of any perturbation in the period decides it: if no multiplier is real, all
perturbations make the same number of whole half turns. So it is continuous from small modulation on. Otherwise it
is between -pi/T and pi/T.

Source: Yakubovich and Starzhinskii, Linear Differential Equations with Periodic Coefficients (1975); Broucke, AIAA
Journal 7 (1969) 1003, for the classes of four multipliers. Derived again.
"""

from functools import reduce
from itertools import combinations, product
from typing import NamedTuple

import numpy as np

from kernels.flow.codes import INVARIANTS
from kernels.flow.matrices import frobenius_norm, sum_entries
from kernels.flow.monodromy import LARGE_ENTRY

STABLE, ASYMPTOTICALLY_STABLE, UNSTABLE, PERIOD_DOUBLING, FLUTTER, MARGINAL = range(6)
UNDETERMINED = -1
GROWING_REGIMES = (UNSTABLE, PERIOD_DOUBLING, FLUTTER)
ROUNDING = 4.0 * float(np.finfo(np.float64).eps)


class Matrices(NamedTuple):
    """Monodromy matrices of points, with their errors and invariants."""

    matrix: np.ndarray  #: monodromy matrices, shape (n, d, d)
    error: np.ndarray  #: errors of their entries
    turns: np.ndarray | None = None  #: whole half turns of a perturbation in the period, floor(angle/pi), for d = 2
    #: the determinant (d = 2) or second invariant (d = 4) and its error, NaN if those of the matrix are as accurate
    second: np.ndarray | None = None

    def widen_second(self, other):
        """Add to the error of `second` its distance from that of the same matrices from elsewhere, if both have it."""
        if self.second is not None and other.second is not None:
            self.second[1] += np.nan_to_num(np.abs(self.second[0] - other.second[0]))

    def set_points(self, points, matrices):
        """Write the matrices of some points."""
        self.matrix[points], self.error[points] = matrices.matrix, matrices.error
        self.turns[points], self.second[:, points] = matrices.turns, matrices.second


@np.errstate(all="ignore")
def multiplier_columns(matrices, period, reciprocal=True, with_errors=True, coupling=None):
    """Return the columns of monodromy matrices; see :func:`_block_columns`.

    Independent blocks of states have a regime each. The regime of all is the fastest growing block's; without growth,
    equal multipliers of two blocks cannot leave the unit circle together.

    Args:
        matrices, period, reciprocal, with_errors: As in :func:`_block_columns`.
        coupling (numpy.ndarray of bool, shape (n, d, d)): Whether a state acts on another at any time.
    """
    result = _block_columns(matrices, period, reciprocal, with_errors)
    if coupling is None:
        return result
    neighbours = coupling | coupling.swapaxes(1, 2) | np.eye(coupling.shape[1], dtype=bool)
    blocks = np.linalg.matrix_power(neighbours * 1.0, 24) > 0
    patterns, pattern_index = np.unique(blocks.reshape(len(blocks), -1), axis=0, return_inverse=True)
    for k, pattern in enumerate(patterns):
        points, groups = (
            np.flatnonzero(pattern_index.ravel() == k),
            np.unique(pattern.reshape(blocks.shape[1:]), axis=0),
        )
        if len(groups) > 1:
            block_matrices = [[x[points][:, group][:, :, group] for x in matrices[:2]] for group in groups]
            columns = [_block_columns(Matrices(*block), period[points], reciprocal) for block in block_matrices]
            regime = _combine_blocks(columns)
            has_regime = result["regime"][points] != UNDETERMINED
            result["regime"][points] = np.where(has_regime, regime, UNDETERMINED)
    return result


def _combine_blocks(blocks):
    """Return the regime of independent blocks together."""
    names = "regime", "growth_per_period", "growth_per_period_error"
    regime, growth, error = (np.array([block[name] for block in blocks]) for name in names)
    is_rival, grows = growth + error >= (growth - error).max(axis=0), np.isin(regime, GROWING_REGIMES).any(axis=0)
    kinds = [(~is_rival | (regime == kind)).all(axis=0) & grows for kind in GROWING_REGIMES]
    conditions = [(regime == ASYMPTOTICALLY_STABLE).all(axis=0), (regime < UNSTABLE).all(axis=0)]
    values = [*GROWING_REGIMES, UNSTABLE, ASYMPTOTICALLY_STABLE, STABLE]
    return np.select([*kinds, grows, *conditions], values, MARGINAL).astype(np.int8)


def _block_columns(matrices, period, reciprocal=True, with_errors=True):
    """Return the columns of monodromy matrices as a single block.

    Args:
        matrices (Matrices): Matrices; those that are not finite give columns of NaN.
        period (numpy.ndarray, shape (n,)): Period, s.
        reciprocal (bool): Whether the equations are proved to be Hamiltonian: multipliers in pairs mu, 1/mu.
        with_errors (bool): Whether to compute errors other than those of the invariants.

    Returns:
        dict of str to numpy.ndarray: multiplier_real, multiplier_imag (1), exponent_real, exponent_imag (s-1), shape
            (n, d), by falling modulus, then argument; growth_rate (s-1, the largest real part), growth_per_period,
            trace and for d = 4 those of INVARIANTS, if they are reciprocal, shape (n,); each with its error as
            name_error; regime (number in REGIMES, less 1).
    """
    M, error, half_turns, second = matrices
    d = M.shape[-1]
    half_turns = half_turns if d == 2 else None
    if d != 2 and not (d == 4 and reciprocal):
        return _eigenvalue_columns(M, error, period, reciprocal)
    second = None if second is None or np.isnan(second).all() else second
    matrices, names = smooth_invariants(M, error, second), INVARIANTS if d == 4 else ("trace", "determinant")
    smooth, spans = ([matrices[name + end] for name in names] for end in ("", "_error"))
    if d == 4:
        smooth[1] = smooth[1] * (np.nan if second is None else np.where(smooth[1] == second[0], 1.0, np.nan))
    elif reciprocal:
        smooth[1], spans[1] = np.ones_like(smooth[1]), np.zeros_like(smooth[1])
    centre = _invariant_spectrum(smooth, period, half_turns)
    regime, deviations = _find_regime(smooth), {name: np.zeros_like(values) for name, values in centre.items()}
    # regimes need no b, multipliers no determinant, and b only if given; the determinant 1 of a pair has no error
    varied = (0, 2, 3, 4) if d == 4 else (0,) if reciprocal else (0, 1)
    near = _is_near(smooth, spans) if d == 4 else slice(None)
    ends = _find_regime(_interval_corners([x[near] for x in smooth], [x[near] for x in spans], varied))
    undecided_regime = np.where(_grow_throughout(smooth, spans), UNSTABLE, MARGINAL)
    regime[near] = np.where((ends == regime[near]).all(axis=0), regime[near], undecided_regime[near])
    corner_numbers = varied[:2] if d == 2 or second is None else (0, 1, 2)
    corners = [*zip(*_interval_corners(smooth, spans, corner_numbers), strict=True), *_meeting_points(smooth, spans)]
    marginal = np.flatnonzero(regime == MARGINAL)
    for ends in corners if with_errors else []:
        for name, distance in _spectrum_distances(
            _invariant_spectrum(ends, period, half_turns), centre, marginal
        ).items():
            deviations[name] = np.maximum(deviations[name], distance)
    matrices |= centre
    if with_errors:
        if d == 2:  # a determinant that may be 0 does not bound the lesser multiplier
            deviations["exponent_real"][smooth[1] <= spans[1], 1] = np.inf
        matrices |= {f"{name}_error": deviations[name] + ROUNDING * np.abs(values) for name, values in centre.items()}
    is_finite = np.isfinite(matrices["growth_rate"] + matrices["trace_error"])
    matrices["regime"] = np.where(is_finite, regime, UNDETERMINED).astype(np.int8)
    return matrices


def compare_flows(measured, linear, period, reciprocal=True, determinant=1.0, coupling=None):
    """Return the columns of measured matrices and of the variational flow's, and whether both agree within errors.

    Args:
        measured, linear (Matrices): Measured matrices, and the variational flow's.
        period, reciprocal, determinant, coupling: As in :func:`multiplier_columns` and :func:`matrix_residuals`.

    Returns:
        dict of str to numpy.ndarray; numpy.ndarray of bool, shape (n,): Columns of :func:`multiplier_columns`, those of
            the variational flow as name_theory; determinant_residual, reciprocity_residual, propagation_error.
    """
    result = multiplier_columns(measured, period, reciprocal, coupling=coupling)
    theory = multiplier_columns(linear, period, reciprocal, False, coupling)
    result |= {f"{name}_theory": values for name, values in theory.items() if f"{name}_error" in result}
    result["regime_theory"] = theory["regime"]
    result["determinant_residual"], result["reciprocity_residual"] = matrix_residuals(measured.matrix, determinant)
    difference = np.abs(measured.matrix - linear.matrix)
    result["propagation_error"] = largest_entry(difference) / largest_entry(linear.matrix)
    with np.errstate(invalid="ignore"):
        return result, largest_entry(~(difference <= measured.error + linear.error)) == 0.0


def largest_entry(M):
    """Return the largest absolute value of each matrix, shape (n, d, d): NumPy is slow to reduce short axes."""
    return reduce(np.maximum, np.abs(M.reshape(len(M), -1).T, dtype=float))


def matrix_residuals(M, determinant=1.0):
    """Return the errors of det M, and of the symmetry of a Hamiltonian's characteristic polynomial.

    Each is relative to the product of the rows' lengths, which bounds the terms of a determinant. ``determinant``, a
    number or shape (n,): exponential of the integral of the trace of the equations over the period (Liouville).
    """
    lengths = np.linalg.norm(M, axis=2)
    scale = lengths.prod(axis=1)
    if M.shape[-1] == 2:
        residual = np.abs(M[:, 0, 0] * M[:, 1, 1] - M[:, 0, 1] * M[:, 1, 0] - determinant) / scale
        return residual, residual
    residual = np.abs(np.linalg.det(M) - determinant) / scale
    if M.shape[-1] != 4:
        return residual, residual
    cubic_term = np.einsum("nii->n", _cofactors(M))  # coefficient of mu, which is that of mu^3 of a Hamiltonian
    asymmetry = np.abs(cubic_term - np.einsum("nii->n", M)) / (scale[:, None] / lengths).sum(axis=1)
    return residual, np.maximum(residual, asymmetry)


def smooth_invariants(M, error, better=None):
    """Return trace and determinant (d = 2), or trace and INVARIANTS (d = 4), of matrices, each with its error.

    Args:
        M, error (numpy.ndarray, shape (n, d, d)): Matrices, and errors of their entries.
        better (numpy.ndarray, shape (2, n)): Determinant or b with its error, which is used if its error is smaller,
            also in ``det(M -+ 1) = b -+ 2a + 2``.
    """
    identity = np.eye(M.shape[-1])
    trace, trace_error = np.einsum("nii->n", M), np.einsum("nii->n", error)
    values = {"trace": trace, "trace_error": trace_error}
    size = frobenius_norm(error)

    def set_invariant(name, value, gradient, squares):
        values[name] = value
        values[f"{name}_error"] = sum_entries(np.abs(gradient) * error) + squares

    if M.shape[-1] == 2:
        (m11, m12), (m21, m22) = M.transpose(1, 2, 0)
        gradient = np.stack([m22, -m21, -m12, m11], axis=1).reshape(-1, 2, 2)
        set_invariant("determinant", m11 * m22 - m12 * m21, gradient, size**2)
        signs = {"determinant": 0.0}
    else:
        set_invariant("first_invariant", trace, np.broadcast_to(identity, M.shape), 0.0)
        second = 0.5 * (trace**2 - sum_entries(M * M.swapaxes(1, 2)))
        trace_matrix = trace[:, None, None] * identity
        set_invariant("second_invariant", second, trace_matrix - M.swapaxes(1, 2), 2.0 * size**2)
        set_invariant(
            "krein_discriminant",
            trace**2 - 4.0 * second + 8.0,
            4.0 * M.swapaxes(1, 2) - 2.0 * trace_matrix,
            8.0 * size**2,
        )
        for name, sign in (("det_minus_identity", -1.0), ("det_plus_identity", 1.0)):
            sum_matrix = M + sign * identity
            squares = 6.0 * size**2 * (frobenius_norm(sum_matrix) + size) ** 2
            set_invariant(name, np.linalg.det(sum_matrix), _cofactors(sum_matrix), squares)
        signs = {"second_invariant": 0.0, "det_minus_identity": -2.0, "det_plus_identity": 2.0}
    for name, sign in signs.items() if better is not None else ():
        spread = better[1] + np.abs(sign) * trace_error
        is_better = spread < values[f"{name}_error"]
        values[name] = np.where(is_better, better[0] + sign * trace + np.abs(sign), values[name])
        values[f"{name}_error"] = np.where(is_better, spread, values[f"{name}_error"])
    return values


def _eigenvalue_columns(M, error, period, reciprocal):
    """Return the columns of matrices without smooth invariants, from eigenvalues and their conditions."""
    d, is_finite = M.shape[-1], np.isfinite(M).all(axis=(1, 2)) & np.isfinite(error).all(axis=(1, 2))
    safe = np.where(is_finite[:, None, None], M, np.eye(d))
    mu, right = (x.astype(complex) for x in np.linalg.eig(safe))  # with different bits if real
    order = np.lexsort((np.angle(mu), -np.round(np.log(np.abs(mu)), 9)), axis=1)
    mu, right = np.take_along_axis(mu, order, axis=1), np.take_along_axis(right, order[:, None], axis=2)
    size, norm = frobenius_norm(error)[:, None], frobenius_norm(safe)[:, None]
    size = size + ROUNDING * norm
    gap = np.abs(mu[:, :, None] - mu[:, None] + np.where(np.eye(d), np.inf, 0.0)).min(axis=2)
    simple = 1.0 / np.abs(np.linalg.svd(right, compute_uv=False)[:, -1:]) * size  # bounds each condition
    joint_bound = 2.0 * d**1.5 * simple  # Bauer and Fike: size of a union of overlapping discs of this radius
    any_matrix = (2.0 * norm + size) ** (1.0 - 1.0 / d) * size ** (1.0 / d)
    radius = np.where(4.0 * d * simple < gap, 1.5 * simple, np.minimum(joint_bound, any_matrix))
    nearest = np.maximum(np.abs(mu) - radius, 0.0)
    sizes, log_high, log_low = np.log(np.abs(mu)), np.log(np.abs(mu) + radius), np.log(nearest)
    angle_errors = np.where(nearest > 0.0, np.arcsin(np.minimum(radius / np.abs(mu), 1.0)), np.pi)
    growth, top, bottom = sizes.max(axis=1), log_high.max(axis=1), log_low.max(axis=1)
    log_errors, growth_error = np.maximum(log_high - sizes, sizes - log_low), np.maximum(top - growth, growth - bottom)
    exponent_errors = log_errors / period[:, None], angle_errors / period[:, None]
    errors = (radius, radius, *exponent_errors, growth_error / period, growth_error)
    result = _spectrum_columns(mu, sizes, np.angle(mu), period)
    result |= {f"{name}_error": values for name, values in zip(result, errors, strict=True)}
    result |= {"trace": np.einsum("nii->n", safe), "trace_error": np.einsum("nii->n", error)}
    for values in result.values():
        values[~is_finite] = np.nan
    first = mu[:, 0]
    real_kind = np.where(first.real > 0.0, UNSTABLE, PERIOD_DOUBLING)
    growth_kind = np.where(np.abs(first.imag) > radius[:, 0], FLUTTER, real_kind)
    # a single pair cannot leave the circle
    is_separate = (2.0 * radius < gap) & (np.abs(mu.imag) > radius) & reciprocal
    conditions = [~is_finite, bottom > 0.0, top < 0.0, (is_separate & (log_low < 0.0) & (log_high > 0.0)).all(axis=1)]
    kinds = [UNDETERMINED, growth_kind, ASYMPTOTICALLY_STABLE, STABLE]
    return result | {"regime": np.select(conditions, kinds, MARGINAL).astype(np.int8)}


def _cofactors(M):
    """Return the gradients of det M, shape (n, 4, 4), with respect to its entries, by minors of two rows."""
    m, gradient = M.transpose(1, 2, 0), np.zeros((4, 4, len(M)))
    for i, j in combinations(range(4), 2):
        rows = (0, i, j), (2, *(c for c in range(4) if c not in (i, j)))
        upper, lower = (m[r, a] * m[r + 1, b] - m[r, b] * m[r + 1, a] for r, a, b in rows)
        sign = 1.0 if (i + j) % 2 else -1.0
        for (r, a, b), minor in zip(rows, (sign * lower, sign * upper), strict=True):
            gradient[r, a] += m[r + 1, b] * minor
            gradient[r, b] -= m[r + 1, a] * minor
            gradient[r + 1, b] += m[r, a] * minor
            gradient[r + 1, a] -= m[r, b] * minor
    return gradient.transpose(2, 0, 1)


def _solve_pair(s, d):
    """Return both solutions of ``mu^2 - s mu + d = 0``, the larger first, or that with the lesser argument."""
    half = 0.5 * s.astype(complex)
    root = np.sqrt(half * half - d)
    root = np.where((half.conj() * root).real < 0.0, -root, root)
    on_circle = (half.imag == 0.0) & (root.real == 0.0)
    big = np.where(on_circle, half - 1j * np.abs(root.imag), half + root)
    return big, np.where(on_circle, big.conj(), d / big)


def _invariant_spectrum(smooth, period, half_turns):
    """Return multipliers, exponents and growth of smooth invariants: (trace, determinant) or INVARIANTS."""
    if len(smooth) == 2:
        trace, d = smooth
        mu = np.array(_solve_pair(trace, d)).T
        is_real = (mu.imag == 0.0).all(axis=1)
        sizes = np.where(is_real[:, None], np.log(np.abs(mu)), 0.5 * np.log(d)[:, None] + 0.0 * mu.real)  # NaN stays
    else:
        a, b, D, *_ = smooth
        root = np.where(a < 0.0, -1.0, 1.0) * np.sqrt(D.astype(complex))
        first, second = 0.5 * (a + root), 0.5 * (a - root)
        second = np.where((D > 0.0) & (np.abs(a) > LARGE_ENTRY) & np.isfinite(b), (b - 2.0) / first, second)
        mu = np.array([*_solve_pair(first, 1.0), *_solve_pair(second, 1.0)]).T
        sizes = np.log(np.abs(mu))
        sizes = np.where(np.abs(sizes) < ROUNDING, 0.0, sizes)  # on the circle: the argument decides the order
        sizes[:, 1::2] = -sizes[:, ::2]
        has_quadruple = smooth[2] < 0.0  # mu, 1/mu and their conjugates
        sizes[:, 2:] = np.where(has_quadruple[:, None], sizes[:, :2], sizes[:, 2:])
        mu[:, 2:] = np.where(has_quadruple[:, None], mu[:, :2].conj(), mu[:, 2:])
        order = np.lexsort((np.angle(mu), -sizes), axis=1)
        mu, sizes = np.take_along_axis(mu, order, axis=1), np.take_along_axis(sizes, order, axis=1)
    angles = np.angle(mu)
    if half_turns is not None:
        is_odd = half_turns % 2.0 != 0.0
        locked_angle = np.pi * np.where(is_odd == (trace < 0.0), half_turns, half_turns + 1.0)
        free_angle = np.where(is_odd, np.pi * (half_turns + 1.0), -np.pi * half_turns) - np.abs(angles[:, 0])
        angles = np.where(is_real, locked_angle, free_angle)[:, None] * np.array([1.0, -1.0])
    return _spectrum_columns(mu, sizes, angles, period)


def _spectrum_columns(mu, sizes, angles, period):
    """Return multipliers, exponents and growth, from the logarithms of the multipliers' sizes and their angles."""
    exponents = sizes / period[:, None]
    return {
        "multiplier_real": mu.real,
        "multiplier_imag": mu.imag,
        "exponent_real": exponents,
        "exponent_imag": angles / period[:, None],
        "growth_rate": exponents.max(axis=1),
        "growth_per_period": sizes.max(axis=1),
    }


def _interval_corners(smooth, spans, numbers):
    """Return the invariants, those of the given numbers at the ends of their intervals, arrays (corners, n)."""
    ends, signs = list(smooth), np.array([*product((-1.0, 1.0), repeat=len(numbers))]).T[:, :, None]
    for k, sign in zip(numbers, signs, strict=True):
        ends[k] = smooth[k] + sign * spans[k]
    return np.broadcast_arrays(*ends)


def _is_near(smooth, spans):
    """Return whether an interval of INVARIANTS contains a boundary of a regime; else all corners have one regime."""
    ends = zip([*smooth, np.abs(smooth[0]) - 4.0], [*spans, spans[0]], strict=True)
    return np.any([np.abs(value) <= spread for value, spread in ends], axis=0)


def _grow_throughout(smooth, spans):
    """Return whether a multiplier is off the unit circle for all invariants within their errors."""
    low_trace = np.abs(smooth[0]) - spans[0]
    if len(smooth) == 2:
        low_det, high_det = smooth[1] - spans[1], smooth[1] + spans[1]
        return (low_det > 1.0) | (low_trace > 1.0 + np.minimum(high_det, 1.0))
    is_below = [value + spread < 0.0 for value, spread in zip(smooth[2:], spans[2:], strict=True)]
    return (low_trace > 4.0) | np.any(is_below, axis=0)


def _meeting_points(smooth, spans):
    """Return the invariants, within their errors, at extremes of multipliers: double multipliers, and trace 0."""
    first, second, *higher = smooth
    if not higher:
        places = [sign * 2.0 * np.sqrt(np.maximum(second, 0.0)) for sign in (-1.0, 0.0, 1.0)]
        return [[np.clip(place, first - spans[0], first + spans[0]), second] for place in places]
    ends = [first - spans[0], first, first + spans[0]]
    return [[a, second, np.clip(0.0, smooth[2] - spans[2], smooth[2] + spans[2]), *smooth[3:]] for a in ends]


def _spectrum_distances(ends, centre, points):
    """Return name → distances |ends − centre| of two spectra, shape (points, …), as their values are numbered.

    At `points`, where the numbering is not certain, the distance of each value to the farthest value of the other.
    """
    distances = {name: np.abs(ends[name] - values) for name, values in centre.items()}
    for name, values in centre.items():
        if values.ndim == 2 and points.size:
            distance = np.abs(ends[name][points, None] - values[points, :, None])
            distances[name][points] = reduce(np.maximum, np.moveaxis(distance, 2, 0))
    return distances


def _find_regime(smooth):
    """Return the regime of smooth invariants: of several kinds of growth the fastest; MARGINAL on a boundary."""
    if len(smooth) == 2:
        trace, d = smooth
        minus, plus = 1.0 - trace + d, 1.0 + trace + d
        growth_regime = np.where(trace * trace < 4.0 * d, FLUTTER, np.where(trace > 0.0, UNSTABLE, PERIOD_DOUBLING))
        regime_inside = np.select([d < 1.0, d == 1.0], [ASYMPTOTICALLY_STABLE, STABLE], growth_regime)
        kinds = [MARGINAL, UNSTABLE, PERIOD_DOUBLING]
        return np.select([minus * plus == 0.0, minus < 0.0, plus < 0.0], kinds, regime_inside)
    a, _, D, minus, plus = smooth
    positive = np.where(a > 0.0, UNSTABLE, PERIOD_DOUBLING)
    conditions = [D == 0.0, D < 0.0, np.abs(a) > 4.0, minus * plus == 0.0, (minus < 0.0) & (plus < 0.0)]
    kinds = [MARGINAL, FLUTTER, positive, MARGINAL, positive]  # |a| > 4: the larger |s| is more than 2, of a's sign
    weak_conditions = [minus < 0.0, plus < 0.0, np.abs(a) == 4.0]
    return np.select([*conditions, *weak_conditions], [*kinds, UNSTABLE, PERIOD_DOUBLING, MARGINAL], STABLE)
