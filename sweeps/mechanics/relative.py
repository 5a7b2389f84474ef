"""Relative equilibria: points of a system in, columns out; theory's spectrum beside what motions show, which is blind.

*Units.* Nothing hangs on them: with |J| the absolute values of the Jacobian's terms, the states' sizes are those of
|J|'s Perron vector and the scale S, a bound on every possible rate, is its Perron root (a little more: every state is
taken to feel a hundredth of every other). Both come from the sizes of terms, so nothing vanishes where terms cancel.

*What is free.* Motions keep to the level sets of what is conserved, so the nudges are tangent to these, and the
eigenvalues measured are those of the Jacobian there; the zero that belongs to each quantity is left out.
"""

from collections.abc import Mapping

import numpy as np

from kernels import codes, jacobians, matrices, statuses
from kernels.blocks import W
from sweeps.mechanics.equilibria import runs_of
from sweeps.mechanics.landscape import changed

CHUNK, CHUNK_BYTES = 4096, 1 << 26  # points, and memory of their samples, that are measured together: a block at least
SMALL = 1e-25  # no larger perturbation has an amplitude that counts
TIED = (1e-6, 3e-6)  # of the scale: imaginary parts nearer than the first are one where eigenvalues are ordered
ORDERED = 1e-7  # of the scale: imaginary parts known to less are in the order of theory's
ALIKE = 1e-12  # of the scale: real parts nearer than this are in an order of rounding's
ROUNDINGS = 256 * np.finfo(np.float64).eps  # of the scale: what theory's own eigenvalues are known to
INVARIANTS = ("sum_of_squares", "product_of_squares", "discriminant")  # S, D, S² - 4D of four eigenvalues
MOVED = ((4.0, 2), (4.0, 4), (48.0, 4))  # changes of S, D, S² - 4D where a matrix of norm S changes, and their units
SLOW = 1 / 64  # of the scale
MIN_DEFECTIVE_CONDITION = (
    1e4  # condition number of an eigenvalue from which on the joint one of all eigenvectors is computed as well
)
EXACT = 1e-12  # of their terms: what slopes and curvatures of conserved quantities are known to, with room


def usual_runs(model) -> int:
    """Return the default number of runs of a point: one for every two eigenvalues, from two to four.

    Where motions soon grow tenfold, modes of similar rates are separated mainly by their initial values.
    """
    return min(max(2, -(-model.n // 2)), 4)


# -- theory


def theory(model, points: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the eigenvalues of the Jacobian at points, given by each parameter and `equilibrium` (slot from 0).

    Returns:
        `place`; `eigenvalues` (s-1, complex, ordered) and `condition`, shape (points, n); `scale` (s-1), `sizes`
        (points, N), `basis` of what is not conserved (points, N, n, in units of the sizes), `matrix` (points, n, n):
        the Jacobian in that basis. NaN where there is no equilibrium.
    """
    slot = np.asarray(points["equilibrium"])
    parameters = model.parameters(points, slot.size)
    located = model.located(parameters, slot)
    x, land = list(located["place"].T), model.landscape
    with np.errstate(all="ignore"):
        slopes, terms = land.slopes(parameters, x)
        J, bound, sizes = _jacobian(model, parameters, x, slopes, terms)
        S, sizes = jacobians.scales(bound, sizes)
        conserved = land.conserved_slopes(parameters, x, sizes)
        basis = _free(conserved[0], model.n)
        scaled = J * sizes[:, None, :] / sizes[:, :, None]
        matrix = np.swapaxes(basis, 1, 2) @ scaled @ basis if model.n < model.equations.n else scaled
        changes = _changes(model, parameters, x, sizes, terms, conserved)
    acting = bound + np.swapaxes(bound, 1, 2) > 0.0
    idle = np.isfinite(J).all((1, 2)) & np.isnan(S) & ~np.linalg.matrix_power(bound > 0.0, J.shape[1]).any((1, 2))
    matrix[idle] = 0.0  # no state acts on itself in any number of steps: all eigenvalues are 0, and none is a scale
    located |= {"idle": idle, "separate": (acting.sum(2) <= 1).all(1)}
    located |= _eigen(matrix, S) | {"scale": S, "sizes": sizes, "basis": basis, "matrix": matrix}
    located |= {"paired": paired(model, slopes, terms), "parameters": parameters, "changes": changes}
    located |= {"reversible": model.symmetries.has_pairs(parameters, located["place"], terms)}
    return located | {"moved": _moved(model, located, J)}


def _jacobian(model, parameters, x, slopes, terms):
    """Return the Jacobian, its terms' absolute values, and the states' sizes (of velocities: of size in 1/S)."""
    sizes = model.landscape.sizes(parameters, x)
    if not model.equations.v:
        return slopes, terms, sizes
    m, a = model.equations.m, model.landscape.a(parameters, x)
    inverse = matrices.by_matrix(np.linalg.inv, np.where(np.isfinite(a), a, np.nan))  # NaN where there is none
    J, bound = (np.zeros((len(sizes), model.equations.n, model.equations.n)) for _ in range(2))
    J[:, range(m), range(m, 2 * m)] = bound[:, range(m), range(m, 2 * m)] = 1.0
    J[:, m:] = inverse @ slopes
    bound[:, m:] = np.abs(inverse) @ terms
    scaled = jacobians.with_velocities(bound, sizes)
    root = jacobians.roots(bound * scaled[:, None, :] / scaled[:, :, None])
    return J, bound, np.concatenate([sizes, sizes * root[:, None]], axis=1)


def _moved(model, theory, J):
    """Return by how much the scaled Jacobian may differ at the equilibrium itself, over S; 0 below a rounding."""
    S, place, sizes = theory["scale"], theory["place"], theory["sizes"]
    with np.errstate(invalid="ignore"):  # rounding moves a place far only where an eigenvalue is small
        slow = np.abs(theory["eigenvalues"]).min(1, initial=np.inf) < SLOW * S * theory["condition"].max(1, initial=1.0)
    moved, rows = np.zeros(len(S)), np.flatnonzero(slow | theory["hidden"].any(1))
    chosen, ratio = [p[rows] for p in theory["parameters"]], sizes[rows, None, :] / sizes[rows, :, None]

    def at(there):
        x = list(there.T)
        return _jacobian(model, chosen, x, *model.landscape.slopes(chosen, x))[0]

    with np.errstate(all="ignore"):
        error = model.landscape.place_error(chosen, place[rows], theory["hidden"][rows])
        change = changed(at, J[rows], place[rows], error) * ratio
        moved[rows] = matrices.length(change) / S[rows]
    return np.where(moved > ROUNDINGS, moved, 0.0)


def _shifts(moved, theory):
    """Return by how much eigenvalues may be off, over S, where the matrix is: the least of three bounds.

    By the largest condition of one; by that of the matrix of all eigenvectors, where equal ones have as many (Bauer and
    Fike); or by Elsner's.
    """
    n = theory["condition"].shape[1]
    with np.errstate(invalid="ignore"):
        linear = n * np.fmin(theory["condition"].max(1), 2.0 * theory["joint_condition"]) * moved
        return np.where(moved > 0.0, np.fmin(linear, 2.0 * moved ** (1.0 / n)), 0.0)


def paired(model, slopes, terms):
    """Return where the Jacobian's own symmetry makes eigenvalues come in pairs ±μ; of `slopes` of a landscape.

    Coordinates: forces of a potential and gyroscopic ones alone, so that the slopes of the forces by the places are
    symmetric and those by the velocities antisymmetric (Hamilton's equations); or no slopes by velocities. States: the
    Jacobian couples each state of one class with states of another class only, so that changing the sign of one class
    reverses time. Then no closed walk in the graph of its entries has an odd length. `Symmetries.has_pairs` says where
    this holds of the whole equations.
    """
    if model.equations.v and model.equations.conservative:
        return np.ones(len(slopes), dtype=bool)
    if model.equations.v:
        m = model.equations.m
        turned = np.concatenate([-slopes[:, :, :m], slopes[:, :, m:]], axis=2).reshape(-1, m, 2, m)
        size = terms.reshape(-1, m, 2, m)
        odd = np.abs(slopes.reshape(-1, m, 2, m) + np.swapaxes(turned, 1, 3))
        hamiltonian = (odd <= ROUNDINGS * (size + np.swapaxes(size, 1, 3))).all((1, 2, 3))
        return hamiltonian | (terms[:, :, m:] == 0.0).all((1, 2))
    joined = terms + np.swapaxes(terms, 1, 2) > 0.0
    first, back = runs_of(list(joined.reshape(len(terms), -1).T))  # most points share one pattern
    walks = np.linalg.matrix_power(joined[first].astype(np.float64), model.equations.n | 1)
    return (np.einsum("pii->p", walks) == 0.0)[back]


def definite(model, parameters, place, hidden, regular=False):
    """Return where a combination of the conserved quantities proves that an equilibrium is stable.

    Of coordinates, the energy where its potential has a strict minimum, also with gyroscopic forces (Thomson and Tait).
    Of states, the gradient of C = Σ λ_k C_k vanishes there, and its second derivatives are definite across all
    gradients: then |C − C(0)| + K Σ (C_k − C_k(0))² is a Lyapunov function for a large K (energy and Casimirs: Marsden
    and Ratiu, Introduction to Mechanics and Symmetry, section 1.7). Of several such C those nearest to each C_k are
    tried. Where second derivatives of states need only be `regular`, eigenvalues come in pairs ±μ: these are a
    Hamiltonian of the linear motion (Kozlov, J. Appl. Math. Mech. 56 (1992) 803).
    """
    proved, rows = np.zeros(len(place), dtype=bool), np.flatnonzero(np.isfinite(place).all(1))
    quantities, land = model.system.conserved_quantities.values(), model.landscape
    if model.equations.v and not regular:
        rows = rows[model.symmetries.keeps_energy([p[rows] for p in parameters])]
        proved[rows] = _is_minimum(land, [p[rows] for p in parameters], place[rows], hidden[rows])
    if not (quantities and rows.size) or any(e.has(model.system.time) for e in quantities):
        return proved
    place, parameters = place[rows], [p[rows] for p in parameters]
    x = list(place.T)
    with np.errstate(all="ignore"):
        sizes, error = land.sizes(parameters, x), land.place_error(parameters, place, hidden[rows])
        slack = EXACT + (error / sizes).max(1)
        (slopes, steep), (bent, terms) = land.gradients(parameters, x), land.curvatures(parameters, x)
        both = (sizes[:, :, None] * sizes[:, None])[:, None]
        whole = (steep * sizes[:, None]).sum(2) + (terms * both).sum((2, 3))  # no unit of a quantity counts
        moved = changed(lambda at: land.curvatures(parameters, list(at.T))[0], bent, place, error)
        loose = (moved + slack[:, None, None, None] * terms) * both / whole[:, :, None, None]
        slopes, bent = slopes * sizes[:, None] / whole[:, :, None], bent * both / whole[:, :, None, None]
    sound = np.isfinite(slopes).all((1, 2)) & np.isfinite(bent + loose).all((1, 2, 3))
    proved[rows[sound]] = _extremal(*(values[sound] for values in (slopes, bent, loose, slack)), regular)
    return proved


@np.errstate(all="ignore")
def _is_minimum(land, parameters, place, hidden):
    """Return where the potential energy has positive second derivatives, beyond errors (Lagrange and Dirichlet)."""

    def hessian(x):
        return -land.slopes(parameters, list(x.T))[0][:, :, : land.m]

    H, terms = hessian(place), land.slopes(parameters, list(place.T))[1][:, :, : land.m]
    unit = 1.0 / np.sqrt(np.einsum("pii->pi", terms))
    both, error = unit[:, :, None] * unit[:, None], land.place_error(parameters, place, hidden)
    loose = (EXACT * terms + changed(hessian, H, place, error)) * both
    return np.linalg.eigvalsh(np.nan_to_num(H * both))[:, 0] > np.linalg.norm(loose, axis=(1, 2))


def _extremal(slopes, bent, loose, slack, regular):
    """Return where a combination without a slope has definite (or regular) second derivatives across all slopes."""
    left, singular, right = np.linalg.svd(slopes)
    steep = np.zeros((len(slopes), max(slopes.shape[1:])), dtype=bool)
    steep[:, : singular.shape[1]] = singular > slack[:, None]
    weights = left * ~steep[:, None, : left.shape[1]] @ np.swapaxes(left, 1, 2)
    H = right[:, None] @ np.einsum("prk,pkij->prij", weights, bent) @ np.swapaxes(right, 1, 2)[:, None]
    room = np.linalg.norm(np.einsum("prk,pkij->prij", np.abs(weights), loose), axis=(2, 3))
    off = slack / np.where(singular > slack[:, None], singular, 1.0).min(1)  # of the directions without a slope
    room += 4.0 * (off * np.sqrt((bent**2).sum((1, 2, 3))))[:, None]
    steep = steep[:, None, : right.shape[1], None]
    H = np.where(steep | np.swapaxes(steep, 2, 3), 0.0, H)
    filled = np.where(steep, np.eye(right.shape[1]), 0.0)  # the steep directions are left out
    both = [np.linalg.eigvalsh(sign * H + filled) for sign in (1.0, -1.0)]
    least = np.abs(both[0]).min(2) if regular else np.maximum(*(values[:, :, 0] for values in both))
    return (least > room).any(1)


def _changes(model, parameters, x, sizes, terms, conserved):
    """Return the largest change of each conserved quantity in a motion of the states' sizes, and its order."""
    if model.equations.conservative:
        m, a = model.equations.m, np.abs(model.landscape.a(parameters, x))
        parts = (terms[:, :, :m], sizes[:, :m]), (a, sizes[:, m:])
        return [(0.5 * sum(matrices.total(A * of[:, :, None] * of[:, None]) for A, of in parts), 2)]
    if not model.quantities:
        return []
    sloped, bent = np.abs(conserved[0]).sum(2), conserved[1]
    return [(0.5 * bent[:, k], 2) if flat else (sloped[:, k], 1) for k, flat in enumerate(model.equations.second)]


# -- motion


def measured(model, points, theory, cycles: float, samples_per_cycle: int, tolerance: float, runs: int):
    """Measure points by their motions; only places, sizes and the scale are used from theory.

    Returns:
        `raw` (points, …) of `kernels.flows`, `status` (int8) and `spacing` (in 1/S).
    """
    from kernels import flows as kernel
    from kernels.runs import Sampling

    sampling = Sampling.of(cycles, samples_per_cycle, tolerance)
    intervals, spacing, _ = sampling
    count, quantities = len(points["epsilon"]), len(model.quantities)
    raw = np.full((count, kernel.FIRST + quantities + codes.HEAD + 4 * model.n), np.nan)
    status = theory["status"].copy()
    here = status == statuses.OK
    sound = here & np.isfinite(theory["scale"]) & np.isfinite(theory["matrix"]).all(axis=(1, 2))
    status[here & ~sound] = np.where(theory["idle"], statuses.NO_TIME_SCALE, statuses.NON_FINITE)[here & ~sound]
    which = np.flatnonzero(sound)
    block = 8 * W * kernel.rows(runs, quantities, model.n, intervals)
    size = min(CHUNK, W * max(1, CHUNK_BYTES // block))
    for start in range(0, which.size, size):
        part = which[start : start + size]
        raw[part] = _run(model, points, theory, part, runs, sampling)
        status[part] = kernel.status(raw[part], quantities, model.n, intervals, tolerance, runs, spacing)
    wide = kernel.is_too_wide(raw, quantities, model.n, theory["scale"], theory["paired"])
    wide &= status == statuses.OK
    bent = raw[wide, kernel.LEFT] > EXACT  # else, as of linear equations, no amplitude is the cause
    status[wide] = np.where(bent, statuses.PERTURBATION_TOO_LARGE, statuses.NOT_CONVERGED)
    raw[wide, kernel.FIRST + quantities :] = np.nan
    return {"raw": raw, "status": status, "spacing": spacing}


def _run(model, points, theory, part, runs, sampling):
    from kernels import flows as kernel
    from kernels.runs import SIZES, Runs

    parameters = [p[part] for p in theory["parameters"]]
    epsilon = np.asarray(points["epsilon"], dtype=np.float64)[part]
    sizes, basis = theory["sizes"][part], theory["basis"][part]
    twice = (epsilon > SMALL).astype(np.int64)
    motions = [(size, sign) for size in SIZES for sign in (1.0, -1.0)] if twice.any() else [(1.0, 1.0)]
    x = [sizes * (basis @ direction) for direction in directions(model.n, runs)]
    starts = [(size * epsilon, sign * y.T) for y in x for size, sign in motions]
    starts = model.code.starts(parameters, theory["place"][part], starts).reshape(part.size, runs, len(motions), -1)
    project = np.ascontiguousarray(np.swapaxes(basis, 1, 2) / sizes[:, None, :])
    family = np.asarray(points["equilibrium"], dtype=np.int64)[part]
    scale = theory["scale"][part]
    batch = Runs(starts, project, scale, epsilon, twice, family, scale[:, None])
    return kernel.run(model.code.integrator(), batch, len(model.quantities), sampling)


# -- both


def survey(
    model, points, cycles: float = 4, samples_per_cycle: int = 16, tolerance: float = 1e-12, runs: int | None = None
) -> dict[str, np.ndarray]:
    """Return all columns of points (each parameter, `epsilon`, `equilibrium`, `eigenvalue` from 1), in units."""
    first, back = runs_of([np.asarray(points[name]) for name in (*model.names, "epsilon", "equilibrium")])
    motions = {name: np.asarray(values)[first] for name, values in points.items()}
    linear = theory(model, motions)
    measurement = measured(model, motions, linear, cycles, samples_per_cycle, tolerance, runs or usual_runs(model))
    columns = _columns(model, linear, measurement)
    each = back * model.n + np.asarray(points["eigenvalue"]).astype(np.int64) - 1
    return {name: values.reshape(-1)[each if values.ndim == 2 else back] for name, values in columns.items()}


def _columns(model, theory, measured):
    """Return columns over the motions; those of eigenvalues have them along their last axis."""
    from kernels import flows as kernel

    q, n, S = len(model.quantities), model.n, theory["scale"]
    raw = measured["raw"]
    fit = raw[:, kernel.FIRST + q :]
    parts = np.stack([fit[:, codes.HEAD + i * n : codes.HEAD + (i + 1) * n] for i in range(4)])
    # the samples' spacing tells which imaginary parts count as one there: here the scale, as for theory's
    number = _ordered(parts[0] + 1j * parts[1], S)[1]
    shift = (S * _shifts(theory["moved"], theory))[:, None]
    re, im, e_re, e_im = np.take_along_axis(parts, number[None], axis=2)
    e_re, e_im = e_re + shift, e_im + shift
    true, wider = theory["eigenvalues"], _exchanged(re, im, e_re, e_im, S)
    table = {  # by theory, as measured, its error
        "eigenvalue_real": (true.real, re, wider[0]),
        "eigenvalue_imag": (true.imag, im, wider[1]),
        "growth_rate": (true.real.max(1), *_growth(re, e_re)),
    }
    smooth, exact = None, None
    if n == 4:
        blurred = [factor * theory["moved"] * S**power for factor, power in MOVED]
        measurements = fit[:, codes.SUM : codes.DISCRIMINANT_ERROR + 1].T.reshape(3, 2, -1)
        smooth = [(value, error + w) for (value, error), w in zip(measurements, blurred, strict=True)]
        predicted = zip(_invariants(theory["matrix"]), blurred, (2, 4, 4), strict=True)
        exact = [(v, ROUNDINGS * S**k + w) for v, w, k in predicted]
        table |= {name: (v, *both) for name, (v, _), both in zip(INVARIANTS, exact, smooth, strict=True)}
    columns = {name + kind: row[k] for name, row in table.items() for k, kind in enumerate(("_theory", "", "_error"))}
    slack = np.fmin(ROUNDINGS * np.maximum(1.0, theory["condition"]), _shifts(ROUNDINGS, theory)[:, None])
    slack = np.where(theory["idle"][:, None], 0.0, S[:, None] * slack + shift)
    pairs = theory["paired"], theory["reversible"], theory["separate"]
    family = theory["dimension"] if n == model.equations.n else np.zeros(len(S), dtype=np.int8)
    by_theory, as_measured = (true.real, true.imag, slack, slack), (re, im, e_re, e_im)
    both = [
        _on_family(regimes(*spectrum, of_four, *pairs), family, *spectrum)
        for spectrum, of_four in ((by_theory, exact), (as_measured, smooth))
    ]
    columns["regime_theory"], columns["regime"] = _where_proved(
        model, theory, both, [by_theory, as_measured], [exact, smooth]
    )
    amplitude = raw[:, kernel.AMPLITUDE]
    for k, (name, (size, power)) in enumerate(zip(model.quantities, theory["changes"], strict=True)):
        with np.errstate(all="ignore"):
            columns[f"{name}_drift"] = raw[:, kernel.FIRST + k] / (size * amplitude**power)
    return columns | {
        "eigenvalue_condition": theory["condition"],
        "smallest_singular_value": fit[:, codes.MOVED],
        **model.columns_of_runs(theory, measured, raw[:, kernel.SAMPLES], raw[:, kernel.STEPS]),
    }


def directions(n: int, runs: int) -> np.ndarray:
    """Return fixed directions of the perturbations, shape (runs, n), of size one at most, no two components alike."""
    return np.array([[np.cos(1.0 + 2.399963229728653 * (i + 1) * (r + 1) + r) for i in range(n)] for r in range(runs)])


def _free(gradients, n):
    """Return an orthonormal basis orthogonal to the gradients, shape (points, N, n); NaN where it has more vectors."""
    points, count, N = gradients.shape
    if n == N:  # nothing is conserved to first order: gradients that vanish have no direction but their rounding's
        return np.broadcast_to(np.eye(N), (points, N, N))
    norm, basis = np.linalg.norm(gradients, axis=2, keepdims=True), np.full((points, N, n), np.nan)
    sound = np.flatnonzero(np.isfinite(norm).all((1, 2)) & ((norm > 0.0).sum((1, 2)) >= N - n))
    rows = gradients[sound] / np.where(norm[sound] > 0.0, norm[sound], 1.0)
    if count == N - n:  # none hangs on the others: the last columns are across all of them
        basis[sound] = np.linalg.qr(np.swapaxes(rows, 1, 2), mode="complete")[0][:, :, count:]
    else:
        basis[sound] = np.swapaxes(np.linalg.svd(rows)[2][:, N - n :], 1, 2)
    return basis


def _eigen(matrix, S):
    """Return eigenvalues in order, and their condition numbers."""
    values, _ = _ordered(matrices.eigenvalues(matrix), S)
    condition = jacobians.conditions(matrix, values, S)
    joint, rows = np.full(len(S), np.inf), np.flatnonzero(~(condition.max(1, initial=0.0) < MIN_DEFECTIVE_CONDITION))
    joint[rows] = matrices.eigenvector_conditions(matrix[rows])
    return {"eigenvalues": values, "condition": condition, "joint_condition": joint}


def _ordered(values, S):
    """Return eigenvalues in order, and which of the unsorted each is."""
    return matrices.ordered(values, 2.0 * codes.SAME * np.nan_to_num(S))


def _invariants(matrix):
    """Return S, D and S² - 4D of 4 x 4 matrices."""
    S = 0.5 * matrices.total(matrix * np.swapaxes(matrix, 1, 2))
    with np.errstate(invalid="ignore"):
        D = np.linalg.det(matrix)
    return S, D, S * S - 4.0 * D


def _exchanged(re, im, re_error, im_error, S):
    """Return errors that cover eigenvalues which may have changed places.

    Eigenvalues are ordered by imaginary part, and by real part where those count as one. Where errors leave open which
    of the two decides, the errors of both eigenvalues reach the other one.
    """
    re_error, im_error = re_error.copy(), im_error.copy()
    with np.errstate(invalid="ignore"):
        tied = np.abs(im[:, :, None] - im[:, None]) < TIED[1] * S[:, None, None]
        alike = (
            np.abs(re[:, :, None] - re[:, None]) <= re_error[:, :, None] + re_error[:, None] + ALIKE * S[:, None, None]
        )
        by_rounding = tied & alike & ~np.eye(re.shape[1], dtype=bool)  # and theory's order is another rounding's
        rows = np.flatnonzero((im_error > ORDERED * S[:, None]).any(axis=1) | by_rounding.any(axis=(1, 2)))
        least, most = (k * S[rows, None, None] for k in TIED)
        x, y, u, v = (values[rows] for values in (re, im, re_error, im_error))
        apart, open_ = np.abs(y[:, :, None] - y[:, None]), v[:, :, None] + v[:, None]
        exchanged = (apart + open_ > least) & (apart - open_ < most) | by_rounding[rows]
        for error, value, part in ((re_error, x, u), (im_error, y, v)):
            reach = np.abs(value[:, :, None] - value[:, None]) + part[:, None]
            error[rows] = np.maximum(part, np.where(exchanged, reach, 0.0).max(axis=2, initial=0.0))
    return re_error, im_error


def _growth(re, error):
    """Return the largest real part, and the largest error of those that may be it."""
    finite = np.isfinite(re).all(1)
    growth = np.where(finite, re.max(1), np.nan)
    with np.errstate(invalid="ignore"):
        rival = re + error >= growth[:, None]
    return growth, np.where(finite, np.where(rival, error, 0.0).max(1), np.nan)


def regimes(re, im, re_error, im_error, invariants=None, pairs=None, reversible=True, separate=False):
    """Return the regimes of spectra with errors, int8 of `kernels.codes`, -1 where there is none.

    Of real and imaginary parts and their errors, shape (points, n); `invariants` are for four eigenvalues (S, its
    error), (D, …), (S² - 4D, …), shape (points,) each. `pairs` says where the Jacobian makes them come in pairs ±μ:
    there alone an eigenvalue is known to lie on the axis, and the invariants decide. Where it is not `reversible`, only
    the linear part has pairs, and terms of higher order decide about eigenvalues on the axis. States are `separate`
    where each acts on one other alone: then pairs of eigenvalues may be equal.
    """
    with np.errstate(invalid="ignore"):
        grows = (re - re_error > 0).any(1)
        rival = re + re_error >= (re - re_error).max(1)[:, None]  # any of these may grow fastest
        turns = ((np.abs(im) > im_error) | ~rival).all(1)
        decays = (re + re_error < 0).all(1)
        level = (np.abs(re) <= re_error).all(1) & (np.abs(im) > im_error).all(1)
        if pairs is not None:
            level &= pairs & reversible  # else an eigenvalue may lie beside the axis, within its error
        single, rows = level & separate, np.flatnonzero(level)
        level[rows] = _told_apart(re[rows], im[rows], np.hypot(re_error, im_error)[rows]).all(1)
        level |= single
        cases = [grows & turns, grows, decays, level]
        values = [codes.FLUTTER, codes.UNSTABLE, codes.ASYMPTOTICALLY_STABLE, codes.STABLE]
        regime = np.select(cases, values, codes.MARGINAL)
        if invariants is not None:
            by_pairs = _by_pairs(*invariants)
            known = pairs & (by_pairs != codes.MARGINAL) & ((by_pairs != codes.STABLE) | reversible)
            regime = np.where(known, by_pairs, regime)
    return np.where(np.isfinite(re).all(1), regime, -1).astype(np.int8)


@np.errstate(invalid="ignore")
def _on_family(regime, dimension, re, im, re_error, im_error):
    """Return the regimes, stable where an equilibrium lies in a family whose dimension is the number of zeros.

    Each direction along a family of equilibria has an eigenvalue 0. Where as many as the dimension are 0 within their
    errors, these are the family's own; where all others decay, a motion nearby ends at a member (Aulbach, J. Math.
    Anal. Appl. 101 (1984) 543).
    """
    zero, decays = (np.abs(re) <= re_error) & (np.abs(im) <= im_error), re + re_error < 0
    attracts = (dimension > 0) & (zero.sum(1) == dimension) & (zero | decays).all(1)
    return np.where(attracts, codes.STABLE, regime).astype(np.int8)


def _where_proved(model, theory, both, spectra, invariants):
    """Return regimes of spectra where conserved quantities decide about marginal ones that are seen to turn.

    They are stable where `definite` proves it; where these quantities are regular, eigenvalues come in pairs.
    """
    turning = [_turns_marginally(regime, *spectrum[:3]) for regime, spectrum in zip(both, spectra, strict=True)]
    rows = np.flatnonzero(np.any(turning, axis=0))
    for regular in (True, False):
        proved = np.zeros(len(theory["place"]), dtype=bool)
        at = [p[rows] for p in theory["parameters"]], theory["place"][rows], theory["hidden"][rows]
        proved[rows] = definite(model, *at, regular)
        proved &= theory["paired"] | (not model.equations.v)  # where there is a linear drag, motions may decay
        for k, (here, spectrum, of_four) in enumerate(zip(turning, spectra, invariants, strict=True)):
            then = regimes(*spectrum, of_four, proved, proved, theory["separate"]) if regular else np.int8(codes.STABLE)
            both[k] = np.where(here & proved, then, both[k])
    return both


def _turns_marginally(regime, re, im, re_error):
    """Return where a spectrum is marginal, none of it is seen to grow, and its errors are less than its rates."""
    level = (re <= re_error).all(1) & (re_error.max(1) < np.hypot(re, im).max(1))
    return level & (regime == codes.MARGINAL)


def _told_apart(re, im, errors):
    """Return which eigenvalues, shape (points, n), differ from all others by more than the errors of both."""
    apart = np.hypot(re[:, :, None] - re[:, None], im[:, :, None] - im[:, None])
    return ((apart > errors[:, :, None] + errors[:, None]) | np.eye(re.shape[1], dtype=bool)).all(2)


def _by_pairs(total, product, discriminant):
    """Return regimes from the signs of S, D and S² - 4D, as far as their errors tell them."""
    up, down = (total[0] > total[1]), (total[0] < -total[1])
    above, below = (product[0] > product[1]), (product[0] < -product[1])
    split, joined = (discriminant[0] > discriminant[1]), (discriminant[0] < -discriminant[1])
    cases = [joined, below | up, down & above & split]  # S > 0 alone may be two real pairs or flutter: both grow
    return np.select(cases, [codes.FLUTTER, codes.UNSTABLE, codes.STABLE], codes.MARGINAL)
