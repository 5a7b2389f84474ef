r"""Multipliers, exponents and stability of linear periodic motion, from monodromy matrices and their errors.

Over a period T a small perturbation changes by the monodromy matrix M; the multipliers mu are its eigenvalues, and the
exponents ln(mu)/T. Where two multipliers meet, they move like the root of what moves M, and half of the digits are
lost; traces and determinants are smooth. So regimes are decided by these, and multipliers are found from them:

* two by two: :math:`\mu^2 - t\mu + d = 0`, t the trace, d the determinant (1 where M is symplectic);
* four by four and symplectic: with :math:`a = \mathrm{tr} M,\ b = (a^2 - \mathrm{tr} M^2)/2` each
  :math:`s = \mu + 1/\mu` solves :math:`s^2 - a s + b - 2 = 0`, whose discriminant is Krein's, D = a^2 - 4b + 8, and

  .. math:: \det(M - 1) = (2 - s_1)(2 - s_2),\qquad \det(M + 1) = (2 + s_1)(2 + s_2)

  All multipliers lie on the unit circle, and apart, where both determinants and D are positive and :math:`|a| < 4`.

Errors: the invariants' are linear in those of M's entries, with a bound on the squares; multipliers, exponents and
regimes are worked out again at the ends of the invariants' intervals, which is right where multipliers meet, too. A
regime that is not the same at all ends is marginal, or unstable where all of the intervals have a multiplier off the
unit circle. Matrices of another kind have no such invariants: their multipliers are eigenvalues, with errors by their
condition numbers or, where that is too rough, by Elsner's bound.

*Large multipliers.* Beside a multiplier of 1e8 the doubles of M hold eight digits of the others. The determinant of two
by two matrices and b of four by four ones are therefore taken from products of the second compounds of short segments:
the lesser of two multipliers is d over the greater, and the lesser s is (b - 2) over the greater.

*Branch.* The logarithm leaves the exponent's imaginary part open by multiples of 2 pi/T. Of a two by two matrix with
determinant 1 the number of half turns that any perturbation made in the period decides it: between two of them no
multiplier is real, and there all perturbations have made the same number of whole half turns. So it is continuous from
small modulation on. Elsewhere it is given between -pi/T and pi/T.

Source: Yakubovich and Starzhinskii, Linear Differential Equations with Periodic Coefficients (1975); Broucke, AIAA
Journal 7 (1969) 1003, for the classes of four multipliers. Derived again.
"""

from functools import reduce
from itertools import combinations, product
from typing import NamedTuple

import numpy as np

from kernels.codes import INVARIANTS
from kernels.matrices import length, total
from kernels.monodromy import LARGE

STABLE, ASYMPTOTICALLY_STABLE, UNSTABLE, PERIOD_DOUBLING, FLUTTER, MARGINAL = range(6)
UNDETERMINED = -1
GROWING = (UNSTABLE, PERIOD_DOUBLING, FLUTTER)
ROUNDING = 4.0 * float(np.finfo(np.float64).eps)


class Matrices(NamedTuple):
    """Matrices of points, and what they are known by beside."""

    matrix: np.ndarray  #: monodromy matrices, shape (n, d, d)
    error: np.ndarray  #: of their entries
    turns: np.ndarray | None = None  #: whole half turns of a perturbation in the period, floor(angle/pi), of d = 2
    #: the determinant (d = 2) or second invariant (d = 4) and its error, NaN where those of the matrix are as good
    second: np.ndarray | None = None

    def put(self, which, part):
        """Write the matrices of some points."""
        self.matrix[which], self.error[which] = part.matrix, part.error
        self.turns[which], self.second[:, which] = part.turns, part.second


@np.errstate(all="ignore")
def columns(found, period, reciprocal=True, with_errors=True, acting=None):
    """Return the columns of monodromy matrices; see :func:`_columns`.

    ``acting``, shape (n, d, d), says which states act on which at any time. Blocks of states that do not act on each
    other have a regime each. That of all is the fastest growing block's; without growth, equal multipliers of two
    blocks cannot leave the unit circle together.
    """
    result = _columns(found, period, reciprocal, with_errors)
    if acting is None:
        return result
    blocks = (
        np.linalg.matrix_power((acting | acting.swapaxes(1, 2) | np.eye(acting.shape[1], dtype=bool)) * 1.0, 24) > 0
    )
    patterns, number = np.unique(blocks.reshape(len(blocks), -1), axis=0, return_inverse=True)
    for k, pattern in enumerate(patterns):
        which, groups = np.flatnonzero(number.ravel() == k), np.unique(pattern.reshape(blocks.shape[1:]), axis=0)
        if len(groups) > 1:
            parts = [[x[which][:, group][:, :, group] for x in found[:2]] for group in groups]
            regime = _of_blocks([_columns(Matrices(*part), period[which], reciprocal) for part in parts])
            known = result["regime"][which] != UNDETERMINED
            result["regime"][which] = np.where(known, regime, UNDETERMINED)
    return result


def _of_blocks(parts):
    """Return the regime of independent blocks together."""
    names = "regime", "growth_per_period", "growth_per_period_error"
    regime, growth, error = (np.array([part[name] for part in parts]) for name in names)
    rival, grows = growth + error >= (growth - error).max(axis=0), np.isin(regime, GROWING).any(axis=0)
    kinds = [(~rival | (regime == kind)).all(axis=0) & grows for kind in GROWING]
    lasting = [(regime == ASYMPTOTICALLY_STABLE).all(axis=0), (regime < UNSTABLE).all(axis=0)]
    values = [*GROWING, UNSTABLE, ASYMPTOTICALLY_STABLE, STABLE]
    return np.select([*kinds, grows, *lasting], values, MARGINAL).astype(np.int8)


def _columns(found, period, reciprocal=True, with_errors=True):
    """Return the columns of monodromy matrices, taken as one block.

    Args:
        found (Matrices): Matrices; those that are not finite make columns of NaN.
        period (numpy.ndarray, shape (n,)): s.
        reciprocal (bool): Whether the equations are proved to be Hamiltonian: multipliers in pairs mu, 1/mu.
        with_errors (bool): Whether errors are found of more than the invariants.

    Returns:
        dict of str to numpy.ndarray: multiplier_real, multiplier_imag (1), exponent_real, exponent_imag (s-1), shape
            (n, d), by falling modulus, then argument; growth_rate (s-1, the largest real part), growth_per_period,
            trace and for d = 4 those of INVARIANTS, where they are reciprocal, shape (n,); each with its error as
            name_error; regime (number in REGIMES, less 1).
    """
    M, error, half_turns, second = found
    d = M.shape[-1]
    half_turns = half_turns if d == 2 else None
    if d != 2 and not (d == 4 and reciprocal):
        return _by_eigenvalues(M, error, period, reciprocal)
    second = None if second is None or np.isnan(second).all() else second
    found, names = invariants(M, error, second), INVARIANTS if d == 4 else ("trace", "determinant")
    smooth, spreads = ([found[name + end] for name in names] for end in ("", "_error"))
    if d == 4:
        smooth[1] = smooth[1] * (np.nan if second is None else np.where(smooth[1] == second[0], 1.0, np.nan))
    elif reciprocal:
        smooth[1], spreads[1] = np.ones_like(smooth[1]), np.zeros_like(smooth[1])
    centre = _spectrum(smooth, period, half_turns)
    regime, worst = _regime(smooth), {name: np.zeros_like(values) for name, values in centre.items()}
    # regimes need no b, multipliers no determinant, and b only where it is given; a symplectic d = 1 has no error
    varied = (0, 2, 3, 4) if d == 4 else (0,) if reciprocal else (0, 1)
    near = _is_near(smooth, spreads) if d == 4 else slice(None)
    ends = _regime(_corners([x[near] for x in smooth], [x[near] for x in spreads], varied))
    open_ = np.where(_grow_throughout(smooth, spreads), UNSTABLE, MARGINAL)
    regime[near] = np.where((ends == regime[near]).all(axis=0), regime[near], open_[near])
    moved = varied[:2] if d == 2 or second is None else (0, 1, 2)
    corners = [*zip(*_corners(smooth, spreads, moved), strict=True), *_meetings(smooth, spreads)]
    open_order = np.flatnonzero(regime == MARGINAL)
    for ends in corners if with_errors else []:
        for name, apart in _distances(_spectrum(ends, period, half_turns), centre, open_order).items():
            worst[name] = np.maximum(worst[name], apart)
    found |= centre
    if with_errors:
        if d == 2:  # a determinant that may be 0 leaves the lesser multiplier's size open
            worst["exponent_real"][smooth[1] <= spreads[1], 1] = np.inf
        found |= {f"{name}_error": worst[name] + ROUNDING * np.abs(values) for name, values in centre.items()}
    sound = np.isfinite(found["growth_rate"] + found["trace_error"])
    found["regime"] = np.where(sound, regime, UNDETERMINED).astype(np.int8)
    return found


def compared(measured, linear, elsewhere, period, reciprocal=True, determinant=1.0, acting=None):
    """Return the columns of measured matrices beside the variational flow's, and whether both agree within errors.

    Args:
        measured, linear (Matrices): Measured matrices, and the variational flow's.
        elsewhere (numpy.ndarray, shape (n,)): Difference of the flow's traces from two phases of the period.
        period, reciprocal, determinant, acting: As in :func:`columns` and :func:`residuals`.

    Returns:
        dict of str to numpy.ndarray; numpy.ndarray of bool, shape (n,): Columns of :func:`columns`, of the variational
            flow as name_theory; determinant_residual, reciprocity_residual, phase_residual, propagation_error.
    """
    result = columns(measured, period, reciprocal, acting=acting)
    theory = columns(linear, period, reciprocal, False, acting)
    result |= {f"{name}_theory": values for name, values in theory.items() if f"{name}_error" in result}
    result["regime_theory"] = theory["regime"]
    result["determinant_residual"], result["reciprocity_residual"] = residuals(measured.matrix, determinant)
    size, apart = largest(linear.matrix), np.abs(measured.matrix - linear.matrix)
    result["phase_residual"] = elsewhere / size
    result["propagation_error"] = largest(apart) / size
    with np.errstate(invalid="ignore"):
        return result, largest(~(apart <= measured.error + linear.error)) == 0.0


def largest(M):
    """Return the largest absolute value of each matrix, shape (n, d, d): NumPy is slow to reduce short axes."""
    return reduce(np.maximum, np.abs(M.reshape(len(M), -1).T, dtype=float))


def residuals(M, determinant=1.0):
    """Return how far det M is from what it should be, and a Hamiltonian's characteristic polynomial from a palindrome.

    Each is relative to the product of the rows' lengths, which bounds the terms of a determinant. ``determinant``, one
    or one of each point: exponential of the integral of the trace of the equations over the period (Liouville).
    """
    lengths = np.linalg.norm(M, axis=2)
    scale = lengths.prod(axis=1)
    if M.shape[-1] == 2:
        off = np.abs(M[:, 0, 0] * M[:, 1, 1] - M[:, 0, 1] * M[:, 1, 0] - determinant) / scale
        return off, off
    off = np.abs(np.linalg.det(M) - determinant) / scale
    if M.shape[-1] != 4:
        return off, off
    third = np.einsum("nii->n", _cofactors(M))  # coefficient of mu, which is that of mu^3 of a Hamiltonian
    uneven = np.abs(third - np.einsum("nii->n", M)) / (scale[:, None] / lengths).sum(axis=1)
    return off, np.maximum(off, uneven)


def invariants(M, error, given=None):
    """Return trace and determinant (d = 2), or trace and INVARIANTS (d = 4), of matrices, each with its error.

    Where ``given``, determinant or b with its error, is better, it is taken, and ``det(M -+ 1) = b -+ 2a + 2`` with it.
    """
    identity = np.eye(M.shape[-1])
    trace, trace_error = np.einsum("nii->n", M), np.einsum("nii->n", error)
    values = {"trace": trace, "trace_error": trace_error}
    size = length(error)

    def put(name, value, gradient, squares):
        values[name] = value
        values[f"{name}_error"] = total(np.abs(gradient) * error) + squares

    if M.shape[-1] == 2:
        (m11, m12), (m21, m22) = M.transpose(1, 2, 0)
        gradient = np.stack([m22, -m21, -m12, m11], axis=1).reshape(-1, 2, 2)
        put("determinant", m11 * m22 - m12 * m21, gradient, size**2)
        signs = {"determinant": 0.0}
    else:
        put("first_invariant", trace, np.broadcast_to(identity, M.shape), 0.0)
        second = 0.5 * (trace**2 - total(M * M.swapaxes(1, 2)))
        leading = trace[:, None, None] * identity
        put("second_invariant", second, leading - M.swapaxes(1, 2), 2.0 * size**2)
        put("krein_discriminant", trace**2 - 4.0 * second + 8.0, 4.0 * M.swapaxes(1, 2) - 2.0 * leading, 8.0 * size**2)
        for name, sign in (("det_minus_identity", -1.0), ("det_plus_identity", 1.0)):
            shifted = M + sign * identity
            squares = 6.0 * size**2 * (length(shifted) + size) ** 2
            put(name, np.linalg.det(shifted), _cofactors(shifted), squares)
        signs = {"second_invariant": 0.0, "det_minus_identity": -2.0, "det_plus_identity": 2.0}
    for name, sign in signs.items() if given is not None else ():
        spread = given[1] + np.abs(sign) * trace_error
        is_better = spread < values[f"{name}_error"]
        values[name] = np.where(is_better, given[0] + sign * trace + np.abs(sign), values[name])
        values[f"{name}_error"] = np.where(is_better, spread, values[f"{name}_error"])
    return values


def _by_eigenvalues(M, error, period, reciprocal):
    """Return the columns of matrices without smooth invariants, from eigenvalues and their conditions."""
    d, sound = M.shape[-1], np.isfinite(M).all(axis=(1, 2)) & np.isfinite(error).all(axis=(1, 2))
    safe = np.where(sound[:, None, None], M, np.eye(d))
    mu, right = (x.astype(complex) for x in np.linalg.eig(safe))  # real where all points' are, with other bits
    order = np.lexsort((np.angle(mu), -np.round(np.log(np.abs(mu)), 9)), axis=1)
    mu, right = np.take_along_axis(mu, order, axis=1), np.take_along_axis(right, order[:, None], axis=2)
    size, norm = length(error)[:, None], length(safe)[:, None]
    size = size + ROUNDING * norm
    gap = np.abs(mu[:, :, None] - mu[:, None] + np.where(np.eye(d), np.inf, 0.0)).min(axis=2)
    simple = 1.0 / np.abs(np.linalg.svd(right, compute_uv=False)[:, -1:]) * size  # bounds each condition
    joined = 2.0 * d**1.5 * simple  # Bauer and Fike: all that discs of this condition's radius join, if they do
    any_matrix = (2.0 * norm + size) ** (1.0 - 1.0 / d) * size ** (1.0 / d)
    off = np.where(4.0 * d * simple < gap, 1.5 * simple, np.minimum(joined, any_matrix))
    near = np.maximum(np.abs(mu) - off, 0.0)
    sizes, most, least = np.log(np.abs(mu)), np.log(np.abs(mu) + off), np.log(near)
    turned = np.where(near > 0.0, np.arcsin(np.minimum(off / np.abs(mu), 1.0)), np.pi)
    growth, top, bottom = sizes.max(axis=1), most.max(axis=1), least.max(axis=1)
    further, more = np.maximum(most - sizes, sizes - least), np.maximum(top - growth, growth - bottom)
    errors = off, off, further / period[:, None], turned / period[:, None], more / period, more
    found = _spectrum_of(mu, sizes, np.angle(mu), period)
    found |= {f"{name}_error": values for name, values in zip(found, errors, strict=True)}
    found |= {"trace": np.einsum("nii->n", safe), "trace_error": np.einsum("nii->n", error)}
    for values in found.values():
        values[~sound] = np.nan
    first = mu[:, 0]
    kind = np.where(np.abs(first.imag) > off[:, 0], FLUTTER, np.where(first.real > 0.0, UNSTABLE, PERIOD_DOUBLING))
    apart = (2.0 * off < gap) & (np.abs(mu.imag) > off) & reciprocal  # a single pair cannot leave the circle
    conditions = [~sound, bottom > 0.0, top < 0.0, (apart & (least < 0.0) & (most > 0.0)).all(axis=1)]
    kinds = [UNDETERMINED, kind, ASYMPTOTICALLY_STABLE, STABLE]
    return found | {"regime": np.select(conditions, kinds, MARGINAL).astype(np.int8)}


def _cofactors(M):
    """Return the gradients of det M, shape (n, 4, 4), with respect to its entries, by minors of two rows."""
    m, gradient = M.transpose(1, 2, 0), np.zeros((4, 4, len(M)))
    for i, j in combinations(range(4), 2):
        rows = (0, i, j), (2, *(c for c in range(4) if c not in (i, j)))
        upper, lower = (m[r, a] * m[r + 1, b] - m[r, b] * m[r + 1, a] for r, a, b in rows)
        sign = 1.0 if (i + j) % 2 else -1.0
        for (r, a, b), other in zip(rows, (sign * lower, sign * upper), strict=True):
            gradient[r, a] += m[r + 1, b] * other
            gradient[r, b] -= m[r + 1, a] * other
            gradient[r + 1, b] += m[r, a] * other
            gradient[r + 1, a] -= m[r, b] * other
    return gradient.transpose(2, 0, 1)


def _pair(s, d):
    """Return both solutions of ``mu^2 - s mu + d = 0``, the larger first, or that of the lesser argument."""
    half = 0.5 * s.astype(complex)
    root = np.sqrt(half * half - d)
    root = np.where((half.conj() * root).real < 0.0, -root, root)
    on_circle = (half.imag == 0.0) & (root.real == 0.0)
    big = np.where(on_circle, half - 1j * np.abs(root.imag), half + root)
    return big, np.where(on_circle, big.conj(), d / big)


def _spectrum(smooth, period, half_turns):
    """Return multipliers, exponents and growth of smooth invariants: (trace, determinant) or INVARIANTS."""
    if len(smooth) == 2:
        trace, d = smooth
        mu = np.array(_pair(trace, d)).T
        is_real = (mu.imag == 0.0).all(axis=1)
        sizes = np.where(is_real[:, None], np.log(np.abs(mu)), 0.5 * np.log(d)[:, None] + 0.0 * mu.real)  # NaN stays
    else:
        a, b, D, *_ = smooth
        root = np.where(a < 0.0, -1.0, 1.0) * np.sqrt(D.astype(complex))
        first, second = 0.5 * (a + root), 0.5 * (a - root)
        second = np.where((D > 0.0) & (np.abs(a) > LARGE) & np.isfinite(b), (b - 2.0) / first, second)
        mu = np.array([*_pair(first, 1.0), *_pair(second, 1.0)]).T
        sizes = np.log(np.abs(mu))
        sizes = np.where(np.abs(sizes) < ROUNDING, 0.0, sizes)  # on the circle: the argument decides the order
        sizes[:, 1::2] = -sizes[:, ::2]
        double = smooth[2] < 0.0  # mu, 1/mu and their conjugates
        sizes[:, 2:] = np.where(double[:, None], sizes[:, :2], sizes[:, 2:])
        mu[:, 2:] = np.where(double[:, None], mu[:, :2].conj(), mu[:, 2:])
        order = np.lexsort((np.angle(mu), -sizes), axis=1)
        mu, sizes = np.take_along_axis(mu, order, axis=1), np.take_along_axis(sizes, order, axis=1)
    angles = np.angle(mu)
    if half_turns is not None:
        odd = half_turns % 2.0 != 0.0
        locked = np.pi * np.where(odd == (trace < 0.0), half_turns, half_turns + 1.0)
        between = np.where(odd, np.pi * (half_turns + 1.0), -np.pi * half_turns) - np.abs(angles[:, 0])
        angles = np.where(is_real, locked, between)[:, None] * np.array([1.0, -1.0])
    return _spectrum_of(mu, sizes, angles, period)


def _spectrum_of(mu, sizes, angles, period):
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


def _corners(smooth, spreads, varied):
    """Return the invariants with those of some numbers at the ends of their intervals, arrays (corners, n)."""
    ends, signs = list(smooth), np.array([*product((-1.0, 1.0), repeat=len(varied))]).T[:, :, None]
    for k, sign in zip(varied, signs, strict=True):
        ends[k] = smooth[k] + sign * spreads[k]
    return np.broadcast_arrays(*ends)


def _is_near(smooth, spreads):
    """Return where an interval of INVARIANTS holds an end of a regime; elsewhere its corners have one."""
    ends = zip([*smooth, np.abs(smooth[0]) - 4.0], [*spreads, spreads[0]], strict=True)
    return np.any([np.abs(value) <= spread for value, spread in ends], axis=0)


def _grow_throughout(smooth, spreads):
    """Return where a multiplier is off the unit circle whatever the invariants are within their errors."""
    least = np.abs(smooth[0]) - spreads[0]
    if len(smooth) == 2:
        low, high = smooth[1] - spreads[1], smooth[1] + spreads[1]
        return (low > 1.0) | (least > 1.0 + np.minimum(high, 1.0))
    below = [value + spread < 0.0 for value, spread in zip(smooth[2:], spreads[2:], strict=True)]
    return (least > 4.0) | np.any(below, axis=0)


def _meetings(smooth, spreads):
    """Return the invariants where, within their errors, parts of multipliers turn: where they meet, and at trace 0."""
    first, second, *rest = smooth
    if not rest:
        places = [sign * 2.0 * np.sqrt(np.maximum(second, 0.0)) for sign in (-1.0, 0.0, 1.0)]
        return [[np.clip(place, first - spreads[0], first + spreads[0]), second] for place in places]
    ends = [first - spreads[0], first, first + spreads[0]]
    return [[a, second, np.clip(0.0, smooth[2] - spreads[2], smooth[2] + spreads[2]), *smooth[3:]] for a in ends]


def _distances(ends, centre, which):
    """Return name → distance of two spectra; at points where they may meet between, of each from the farthest."""
    distances = {name: np.abs(ends[name] - values) for name, values in centre.items()}
    for name, values in centre.items():
        if values.ndim == 2 and which.size:
            apart = np.abs(ends[name][which, None] - values[which, :, None])
            distances[name][which] = reduce(np.maximum, np.moveaxis(apart, 2, 0))
    return distances


def _regime(smooth):
    """Return the regime of smooth invariants: of several kinds of growth the fastest; MARGINAL on a boundary."""
    if len(smooth) == 2:
        trace, d = smooth
        minus, plus = 1.0 - trace + d, 1.0 + trace + d
        growing = np.where(trace * trace < 4.0 * d, FLUTTER, np.where(trace > 0.0, UNSTABLE, PERIOD_DOUBLING))
        inside = np.select([d < 1.0, d == 1.0], [ASYMPTOTICALLY_STABLE, STABLE], growing)
        kinds = [MARGINAL, UNSTABLE, PERIOD_DOUBLING]
        return np.select([minus * plus == 0.0, minus < 0.0, plus < 0.0], kinds, inside)
    a, _, D, minus, plus = smooth
    positive = np.where(a > 0.0, UNSTABLE, PERIOD_DOUBLING)
    conditions = [D == 0.0, D < 0.0, np.abs(a) > 4.0, minus * plus == 0.0, (minus < 0.0) & (plus < 0.0)]
    kinds = [MARGINAL, FLUTTER, positive, MARGINAL, positive]  # |a| > 4: the larger |s| is more than 2, of a's sign
    more = [minus < 0.0, plus < 0.0, np.abs(a) == 4.0]
    return np.select([*conditions, *more], [*kinds, UNSTABLE, PERIOD_DOUBLING, MARGINAL], STABLE)
