"""Relative equilibria: eigenvalues of the linear motion by theory, and measured from motions that do not know theory.

*Units.* With |J| the absolute values of the Jacobian's terms, the states' sizes are the Perron vector of |J|, and the
scale S, a bound on every possible rate, is its Perron root (slightly more: each state depends on every state by at
least a hundredth). Both come from the sizes of terms, so they do not vanish if terms cancel, and no unit counts.

*Conserved quantities.* Motions stay on the level sets of conserved quantities, so perturbations are tangent to these,
and the measured eigenvalues are those of the Jacobian there; the eigenvalue 0 of each quantity is left out.
"""

from collections.abc import Mapping
from functools import partial

import numpy as np

from kernels.compile.blocks import W
from kernels.estimator import statuses
from kernels.flow import codes, jacobians, matrices
from sweeps.mechanics import modes
from sweeps.mechanics.equilibria import runs_of
from sweeps.mechanics.landscape import matrix_change

MAX_CHUNK_POINTS, CHUNK_BYTES = 4096, 1 << 26  # points, and memory of their samples, that are measured together
MAX_LINEAR_PERTURBATION = 1e-25  # relative size up to which a perturbation has no effect of its amplitude in doubles
TIE_RANGE = (1e-6, 3e-6)  # relative to the scale; closer imaginary parts are ordered by real part; in between, unknown
ORDER_ERROR = 1e-7  # relative to the scale; imaginary parts with larger errors may be in another order than theory's
REAL_TIE = 1e-12  # relative to the scale; real parts closer than this are ordered by their rounding
THEORY_ROUNDING = 256 * np.finfo(np.float64).eps  # relative to the scale, error of theory's eigenvalues
INVARIANTS = ("sum_of_squares", "product_of_squares", "discriminant")  # S, D, S² - 4D of four eigenvalues
INVARIANT_CHANGES = ((4.0, 2), (4.0, 4), (48.0, 4))  # change of each by a unit change of a matrix of norm S; power of S
MAX_SLOW_RATE = 1 / 64  # relative to the scale; only eigenvalues below it are sensitive to the place's rounding
MIN_DEFECTIVE_CONDITION = 1e4  # condition number of an eigenvalue from which the joint one is computed as well
MAX_ADJUGATE_STATES = 24  # states up to which condition numbers come from adjugates, without eigenvectors
QUANTITY_ROUNDING = 1e-12  # relative to their terms, error of slopes and curvatures of conserved quantities


def usual_runs(model) -> int:
    """Return the default number of runs of a point: half the number of eigenvalues, from two to four.

    If motions soon grow tenfold, modes with similar rates are separated mainly by their initial values.
    """
    return min(max(2, -(-model.n // 2)), 4)


# -- theory


def theory(model, points: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the eigenvalues of the Jacobian at points, given by each parameter and `equilibrium` (slot from 0).

    Returns:
        `place`; `eigenvalues` (s-1, complex, ordered) and `condition`, shape (points, n); `scale` (s-1), `sizes`
        (points, N), `basis` of the level set's tangent space (points, N, n, in units of the sizes), `matrix`
        (points, n, n): the Jacobian in that basis. NaN if there is no equilibrium. `has_pairs`, `is_reversible`,
        `is_separate` as of :func:`regimes`; `is_idle`: all eigenvalues are 0; `matrix_change`: its error over S.
    """
    slot = np.asarray(points["equilibrium"])
    parameters = model.parameters(points, slot.size)
    columns = model.place_columns(parameters, slot)
    x, landscape = list(columns["place"].T), model.landscape
    with np.errstate(all="ignore"):
        slopes, terms = landscape.slopes(parameters, x)
        J, bound, sizes = _jacobian(model, parameters, x, slopes, terms)
        S, sizes = jacobians.rate_bounds(bound, sizes)
        gradients = landscape.conserved_slopes(parameters, x, sizes)
        basis = _level_set_basis(gradients[0], model.n)
        scaled_jacobian = J * sizes[:, None, :] / sizes[:, :, None]
        matrix = np.swapaxes(basis, 1, 2) @ scaled_jacobian @ basis if model.n < model.equations.n else scaled_jacobian
        changes = _quantity_scales(model, parameters, x, sizes, terms, gradients)
    is_coupled = bound + np.swapaxes(bound, 1, 2) > 0.0
    is_idle = np.isfinite(J).all((1, 2)) & np.isnan(S) & ~np.linalg.matrix_power(bound > 0.0, J.shape[1]).any((1, 2))
    matrix[is_idle] = 0.0  # no state acts on itself in any number of steps: all eigenvalues are 0
    columns |= {"is_idle": is_idle, "is_separate": (is_coupled.sum(2) <= 1).all(1)}
    columns |= _eigen_columns(matrix, S) | {"scale": S, "sizes": sizes, "basis": basis, "matrix": matrix}
    columns |= {
        "has_pairs": has_paired_jacobian(model, slopes, terms),
        "parameters": parameters,
        "quantity_scales": changes,
    }
    columns |= {"is_reversible": model.symmetries.has_pairs(parameters, columns["place"], terms)}
    return columns | {"matrix_change": _jacobian_change(model, columns, J)}


def _jacobian(model, parameters, x, slopes, terms):
    """Return the Jacobian, its terms' absolute values, and the states' sizes (of velocities: of size in 1/S)."""
    sizes = model.landscape.sizes(parameters, x)
    if not model.equations.v:
        return slopes, terms, sizes
    if model.equations.natural:  # its sizes may follow from V
        sizes = modes.sizes(model.landscape, parameters, np.stack(x, axis=1), terms[:, :, : model.equations.m])
    m, a = model.equations.m, model.landscape.a(parameters, x)
    inverse = matrices.apply_by_matrix(np.linalg.inv, np.where(np.isfinite(a), a, np.nan))  # NaN if singular
    J, bound = (np.zeros((len(sizes), model.equations.n, model.equations.n)) for _ in range(2))
    J[:, range(m), range(m, 2 * m)] = bound[:, range(m), range(m, 2 * m)] = 1.0
    J[:, m:] = inverse @ slopes
    bound[:, m:] = np.abs(inverse) @ terms
    all_sizes = jacobians.add_velocity_sizes(bound, sizes)
    root = jacobians.perron_roots(bound * all_sizes[:, None, :] / all_sizes[:, :, None])
    return J, bound, np.concatenate([sizes, sizes * root[:, None]], axis=1)


def _jacobian_change(model, theory, J):
    """Return the uncertainty of the scaled Jacobian due to that of the place, over S; 0 if below rounding."""
    S, place, sizes = theory["scale"], theory["place"], theory["sizes"]
    with np.errstate(invalid="ignore"):  # rounding moves a place far only if an eigenvalue is small
        slow = np.abs(theory["eigenvalues"]).min(1, initial=np.inf) < MAX_SLOW_RATE * S * theory["condition"].max(
            1, initial=1.0
        )
    change_norms, rows = np.zeros(len(S)), np.flatnonzero(slow | theory["place_uncertainty"].any(1))
    row_parameters, ratio = [p[rows] for p in theory["parameters"]], sizes[rows, None, :] / sizes[rows, :, None]

    def jacobian_at(place_shifted):
        x = list(place_shifted.T)
        return _jacobian(model, row_parameters, x, *model.landscape.slopes(row_parameters, x))[0]

    with np.errstate(all="ignore"):
        error = model.landscape.place_error(row_parameters, place[rows], theory["place_uncertainty"][rows])
        change = matrix_change(jacobian_at, J[rows], place[rows], error) * ratio
        change_norms[rows] = matrices.frobenius_norm(change) / S[rows]
    return np.where(change_norms > THEORY_ROUNDING, change_norms, 0.0)


def _eigenvalue_shifts(matrix_change, theory):
    """Return a bound on the shifts of eigenvalues, over S, due to a change of the matrix: the least of three.

    They are n times the largest condition number; Bauer and Fike's, for equal eigenvalues with a full set of
    eigenvectors; and Elsner's.
    """
    n = theory["condition"].shape[1]
    with np.errstate(invalid="ignore"):
        first_order = n * np.fmin(theory["condition"].max(1), 2.0 * theory["joint_condition"]) * matrix_change
        return np.where(matrix_change > 0.0, np.fmin(first_order, 2.0 * matrix_change ** (1.0 / n)), 0.0)


def has_paired_jacobian(model, slopes, terms):
    """Return True if the Jacobian's symmetry makes eigenvalues come in pairs ±μ, shape (points,).

    Coordinates: forces have a potential or are gyroscopic, so that their slopes by places are symmetric and those by
    velocities antisymmetric (Hamilton's equations); or they have no slopes by velocities. States: the Jacobian couples
    the states of one class only with states of another class, so that changing the sign of one class reverses time.
    Then no closed walk in the graph of its entries has an odd length. For the whole equations see
    `Symmetries.has_pairs`.

    Args:
        model: the system.
        slopes: of `Landscape.slopes`, shape (points, m, n).
        terms: their absolute terms, of the same shape.
    """
    if model.equations.v and model.equations.conservative:
        return np.ones(len(slopes), dtype=bool)
    if model.equations.v:
        m = model.equations.m
        mirror_slopes = np.concatenate([-slopes[:, :, :m], slopes[:, :, m:]], axis=2).reshape(-1, m, 2, m)
        size = terms.reshape(-1, m, 2, m)
        asymmetry = np.abs(slopes.reshape(-1, m, 2, m) + np.swapaxes(mirror_slopes, 1, 3))
        is_hamiltonian = (asymmetry <= THEORY_ROUNDING * (size + np.swapaxes(size, 1, 3))).all((1, 2, 3))
        return is_hamiltonian | (terms[:, :, m:] == 0.0).all((1, 2))
    is_coupled = terms + np.swapaxes(terms, 1, 2) > 0.0
    first_runs, run_index = runs_of(list(is_coupled.reshape(len(terms), -1).T))  # most points have the same pattern
    closed_walks = np.linalg.matrix_power(is_coupled[first_runs].astype(np.float64), model.equations.n | 1)
    return (np.einsum("pii->p", closed_walks) == 0.0)[run_index]


def is_proved_stable(model, parameters, place, uncertainty, regular=False):
    """Return True if conserved quantities prove that an equilibrium is stable, shape (points,).

    Coordinates: the energy, if its potential has a strict minimum, also with gyroscopic forces (Thomson and Tait).
    States: the gradient of C = Σ λ_k C_k vanishes, and its second derivatives are definite on the space orthogonal to
    all gradients: then |C − C(0)| + K Σ (C_k − C_k(0))² is a Lyapunov function for a large K (energy and Casimirs:
    Marsden and Ratiu, Introduction to Mechanics and Symmetry, section 1.7). Of several such C those nearest to each C_k
    are tried.

    Args:
        model: the system.
        parameters: one array (points,) for each.
        place: equilibria, shape (points, places).
        uncertainty: of the places, as of `equilibria.Equilibria`.
        regular: require second derivatives of states to be regular only: then eigenvalues come in pairs ±μ, since C is
            a Hamiltonian of the linear motion (Kozlov, J. Appl. Math. Mech. 56 (1992) 803).
    """
    is_proved, rows = np.zeros(len(place), dtype=bool), np.flatnonzero(np.isfinite(place).all(1))
    quantities, land = model.system.conserved_quantities.values(), model.landscape
    if model.equations.v and not regular:
        rows = rows[model.symmetries.keeps_energy([p[rows] for p in parameters])]
        is_proved[rows] = _is_minimum(land, [p[rows] for p in parameters], place[rows], uncertainty[rows])
    if not (quantities and rows.size) or any(e.has(model.system.time) for e in quantities):
        return is_proved
    place, parameters = place[rows], [p[rows] for p in parameters]
    x = list(place.T)
    with np.errstate(all="ignore"):
        sizes, error = land.sizes(parameters, x), land.place_error(parameters, place, uncertainty[rows])
        slack = QUANTITY_ROUNDING + (error / sizes).max(1)
        (slopes, steep), (curvatures, terms) = (land.gradients(parameters, x), land.curvatures(parameters, x))
        products = (sizes[:, :, None] * sizes[:, None])[:, None]
        # of each quantity, so that its unit cancels
        unit = (steep * sizes[:, None]).sum(2) + (terms * products).sum((2, 3))
        change = matrix_change(lambda at: land.curvatures(parameters, list(at.T))[0], curvatures, place, error)
        errors = (change + slack[:, None, None, None] * terms) * products / unit[:, :, None, None]
        slopes = slopes * sizes[:, None] / unit[:, :, None]
        curvatures = curvatures * products / unit[:, :, None, None]
    is_finite = np.isfinite(slopes).all((1, 2)) & np.isfinite(curvatures + errors).all((1, 2, 3))
    is_proved[rows[is_finite]] = _has_definite_combination(
        *(values[is_finite] for values in (slopes, curvatures, errors, slack)), regular
    )
    return is_proved


@np.errstate(all="ignore")
def _is_minimum(landscape, parameters, place, uncertainty):
    """Return True if the potential energy's second derivatives are positive beyond errors (Lagrange, Dirichlet)."""

    def hessian(x):
        return -landscape.slopes(parameters, list(x.T))[0][:, :, : landscape.m]

    H, terms = hessian(place), landscape.slopes(parameters, list(place.T))[1][:, :, : landscape.m]
    unit = 1.0 / np.sqrt(np.einsum("pii->pi", terms))
    unit_products, error = unit[:, :, None] * unit[:, None], landscape.place_error(parameters, place, uncertainty)
    error_matrix = (QUANTITY_ROUNDING * terms + matrix_change(hessian, H, place, error)) * unit_products
    return np.linalg.eigvalsh(np.nan_to_num(H * unit_products))[:, 0] > np.linalg.norm(error_matrix, axis=(1, 2))


def _has_definite_combination(slopes, H_k, errors, slack, regular):
    """Return True if a combination without gradient has definite (or regular) second derivatives across gradients."""
    left_vectors, singular, right_vectors = np.linalg.svd(slopes)
    is_steep = np.zeros((len(slopes), max(slopes.shape[1:])), dtype=bool)
    is_steep[:, : singular.shape[1]] = singular > slack[:, None]
    weights = left_vectors * ~is_steep[:, None, : left_vectors.shape[1]] @ np.swapaxes(left_vectors, 1, 2)
    H = right_vectors[:, None] @ np.einsum("prk,pkij->prij", weights, H_k) @ np.swapaxes(right_vectors, 1, 2)[:, None]
    error = np.linalg.norm(np.einsum("prk,pkij->prij", np.abs(weights), errors), axis=(2, 3))
    tilt = slack / np.where(singular > slack[:, None], singular, 1.0).min(1)  # angle
    error += 4.0 * (tilt * np.sqrt((H_k**2).sum((1, 2, 3))))[:, None]
    is_steep = is_steep[:, None, : right_vectors.shape[1], None]
    H = np.where(is_steep | np.swapaxes(is_steep, 2, 3), 0.0, H)
    identity = np.where(is_steep, np.eye(right_vectors.shape[1]), 0.0)  # excludes the steep directions
    spectra = [np.linalg.eigvalsh(sign * H + identity) for sign in (1.0, -1.0)]
    smallest = np.abs(spectra[0]).min(2) if regular else np.maximum(*(values[:, :, 0] for values in spectra))
    return (smallest > error).any(1)


def _quantity_scales(model, parameters, x, sizes, terms, gradients):
    """Return (change, order in the amplitude) of each conserved quantity over a motion of the states' sizes."""
    if model.equations.conservative:
        m, a = model.equations.m, np.abs(model.landscape.a(parameters, x))
        energies = (terms[:, :, :m], sizes[:, :m]), (a, sizes[:, m:])
        return [(0.5 * sum(matrices.sum_entries(A * s[:, :, None] * s[:, None]) for A, s in energies), 2)]
    if not model.quantities:
        return []
    first, second = np.abs(gradients[0]).sum(2), gradients[1]
    return [(0.5 * second[:, k], 2) if flat else (first[:, k], 1) for k, flat in enumerate(model.equations.second)]


# -- measurement


def measure_points(model, points, theory, sampling, runs: int):
    """Measure points by their motions; only places, sizes and the scale are used from theory.

    Args:
        model: the system.
        points: as of :func:`theory`, and `epsilon`.
        theory: of :func:`theory`.
        sampling: of `kernels.flow.runs.Sampling`.
        runs: number of runs of a point, in different directions.

    Returns:
        `raw` (points, …) of `kernels.flow.flows`, `status` (int8) and `spacing` (in 1/S).
    """
    from kernels.flow import flows as kernel

    count, quantities = len(points["epsilon"]), len(model.quantities)
    raw = np.full((count, kernel.FIRST + quantities + codes.HEAD + 4 * model.n), np.nan)
    status = theory["status"].copy()
    is_ok = status == statuses.OK
    is_finite = is_ok & np.isfinite(theory["scale"]) & np.isfinite(theory["matrix"]).all(axis=(1, 2))
    causes = np.where(theory["is_idle"], statuses.NO_TIME_SCALE, statuses.NON_FINITE)
    status[is_ok & ~is_finite] = causes[is_ok & ~is_finite]
    rows = np.flatnonzero(is_finite)
    block = 8 * W * kernel.count_rows(runs, quantities, model.n, sampling.intervals)
    size = min(MAX_CHUNK_POINTS, W * max(1, CHUNK_BYTES // block))
    measure = partial(kernel.measure_points, sampling=sampling)
    for start in range(0, rows.size, size):
        chunk = rows[start : start + size]
        raw[chunk] = integrate_runs(model, points, theory, chunk, runs, measure)
        status[chunk] = kernel.row_status(raw[chunk], quantities, model.n, sampling, runs)
    is_too_wide = kernel.is_too_wide(raw, quantities, model.n, theory["scale"], theory["has_pairs"])
    is_too_wide &= status == statuses.OK
    has_amplitude = raw[is_too_wide, kernel.REMAINDER] > QUANTITY_ROUNDING  # else the amplitude is not the cause
    status[is_too_wide] = np.where(has_amplitude, statuses.PERTURBATION_TOO_LARGE, statuses.NOT_CONVERGED)
    raw[is_too_wide, kernel.FIRST + quantities :] = np.nan
    return {"raw": raw, "status": status, "spacing": sampling.spacing}


def integrate_runs(model, points, theory, chunk, runs, measure):
    """Return the raw measurements of runs, shape (points of the chunk, columns of the measurement).

    Args:
        model: the system.
        points: as of :func:`measure_points`.
        theory: result of :func:`theory`; `parameters`, `place`, `sizes`, `basis` and `scale` are used.
        chunk: indices of the points.
        runs: number of directions of the perturbation.
        measure: function (integrator, runs, number of conserved quantities) → raw measurements.
    """
    from kernels.flow.runs import SIZES, Runs

    parameters = [p[chunk] for p in theory["parameters"]]
    epsilon = np.asarray(points["epsilon"], dtype=np.float64)[chunk]
    sizes, basis = theory["sizes"][chunk], theory["basis"][chunk]
    is_two_sided = (epsilon > MAX_LINEAR_PERTURBATION).astype(np.int64)
    motions = [(size, sign) for size in SIZES for sign in (1.0, -1.0)] if is_two_sided.any() else [(1.0, 1.0)]
    x = [sizes * (basis @ direction) for direction in perturbation_directions(model.n, runs)]
    starts = [(size * epsilon, sign * y.T) for y in x for size, sign in motions]
    starts = model.code.starts(parameters, theory["place"][chunk], starts).reshape(chunk.size, runs, len(motions), -1)
    project = np.ascontiguousarray(np.swapaxes(basis, 1, 2) / sizes[:, None, :])
    block_group = np.asarray(points["equilibrium"], dtype=np.int64)[chunk]  # points of a group share blocks of lanes
    scale = theory["scale"][chunk]
    batch = Runs(starts, project, scale, epsilon, is_two_sided, block_group, scale[:, None])
    return measure(model.code.integrator(), batch, len(model.quantities))


# -- columns


def survey(
    model, points, cycles: float = 4, samples_per_cycle: int = 16, tolerance: float = 1e-12, runs: int | None = None
) -> dict[str, np.ndarray]:
    """Return all columns of points, in units.

    Args:
        model: the system.
        points: each parameter, `epsilon`, `equilibrium` (slot from 0) and `eigenvalue` (from 1), shape (points,).
        cycles: length of a run, in 2π/S.
        samples_per_cycle: samples in 2π/S.
        tolerance: relative truncation error allowed over a run.
        runs: as of :func:`measure_points`; by default :func:`usual_runs`.
    """
    from kernels.flow.runs import Sampling

    sampling = Sampling.of(cycles, samples_per_cycle, tolerance)
    first_rows, row = runs_of([np.asarray(points[name]) for name in (*model.names, "epsilon", "equilibrium")])
    motions = {name: np.asarray(values)[first_rows] for name, values in points.items()}
    linear = theory(model, motions)
    measurement = measure_points(model, motions, linear, sampling, runs or usual_runs(model))
    columns = make_columns(model, linear, measurement)
    index = row * model.n + np.asarray(points["eigenvalue"]).astype(np.int64) - 1
    return {name: values.reshape(-1)[index if values.ndim == 2 else row] for name, values in columns.items()}


def make_columns(model, theory, results):
    """Return columns of motions; those of eigenvalues have shape (motions, n)."""
    from kernels.flow import flows as kernel

    q, n, S = len(model.quantities), model.n, theory["scale"]
    raw = results["raw"]
    fit = raw[:, kernel.FIRST + q :]
    spectra = np.stack([fit[:, codes.HEAD + i * n : codes.HEAD + (i + 1) * n] for i in range(4)])
    # the kernel's tie between imaginary parts depends on the spacing; order again with the scale, as theory is
    order = order_eigenvalues(spectra[0] + 1j * spectra[1], S)[1]
    shifts = (S * _eigenvalue_shifts(theory["matrix_change"], theory))[:, None]
    re, im, e_re, e_im = np.take_along_axis(spectra, order[None], axis=2)
    e_re, e_im = e_re + shifts, e_im + shifts
    eigenvalues, exchange_errors = theory["eigenvalues"], _errors_of_exchange(re, im, e_re, e_im, S)
    table = {  # theory, measured, its error
        "eigenvalue_real": (eigenvalues.real, re, exchange_errors[0]),
        "eigenvalue_imag": (eigenvalues.imag, im, exchange_errors[1]),
        "growth_rate": (eigenvalues.real.max(1), *_growth_rate(re, e_re)),
    }
    smooth, exact = None, None
    if n == 4:
        invariant_errors = [factor * theory["matrix_change"] * S**power for factor, power in INVARIANT_CHANGES]
        fitted = fit[:, codes.SUM : codes.DISCRIMINANT_ERROR + 1].T.reshape(3, 2, -1)
        smooth = [(value, error + w) for (value, error), w in zip(fitted, invariant_errors, strict=True)]
        predictions = zip(_quartic_invariants(theory["matrix"]), invariant_errors, (2, 4, 4), strict=True)
        exact = [(v, THEORY_ROUNDING * S**k + w) for v, w, k in predictions]
        table |= {name: (v, *regime_pair) for name, (v, _), regime_pair in zip(INVARIANTS, exact, smooth, strict=True)}
    columns = {name + kind: row[k] for name, row in table.items() for k, kind in enumerate(("_theory", "", "_error"))}
    slack = np.fmin(
        THEORY_ROUNDING * np.maximum(1.0, theory["condition"]), _eigenvalue_shifts(THEORY_ROUNDING, theory)[:, None]
    )
    slack = np.where(theory["is_idle"][:, None], 0.0, S[:, None] * slack + shifts)
    pairs = theory["has_pairs"], theory["is_reversible"], theory["is_separate"]
    family = theory["dimension"] if n == model.equations.n else np.zeros(len(S), dtype=np.int8)
    theory_spectrum, measured_spectrum = (eigenvalues.real, eigenvalues.imag, slack, slack), (re, im, e_re, e_im)
    regime_pair = [
        _regime_on_family(regimes(*spectrum, invariants, *pairs), family, *spectrum)
        for spectrum, invariants in ((theory_spectrum, exact), (measured_spectrum, smooth))
    ]
    columns["regime_theory"], columns["regime"] = _regimes_by_proof(
        model, theory, regime_pair, [theory_spectrum, measured_spectrum], [exact, smooth]
    )
    amplitude = raw[:, kernel.AMPLITUDE]
    for k, (name, (size, power)) in enumerate(zip(model.quantities, theory["quantity_scales"], strict=True)):
        with np.errstate(all="ignore"):
            columns[f"{name}_drift"] = raw[:, kernel.FIRST + k] / (size * amplitude**power)
    return columns | {
        "eigenvalue_condition": theory["condition"],
        "smallest_singular_value": fit[:, codes.EXCITATION],
        **model.columns_of_runs(theory, results, raw[:, kernel.SAMPLES], raw[:, kernel.STEPS]),
    }


def perturbation_directions(n: int, runs: int) -> np.ndarray:
    """Return fixed directions of perturbations, shape (runs, n): components of size 1 at most, all different."""
    return np.array([[np.cos(1.0 + 2.399963229728653 * (i + 1) * (r + 1) + r) for i in range(n)] for r in range(runs)])


def _level_set_basis(gradients, n):
    """Return an orthonormal basis of the space orthogonal to gradients, (points, N, n); NaN if there is none."""
    points, count, N = gradients.shape
    if n == N:  # no quantity has a gradient but rounding
        return np.broadcast_to(np.eye(N), (points, N, N))
    norm, basis = np.linalg.norm(gradients, axis=2, keepdims=True), np.full((points, N, n), np.nan)
    rows = np.flatnonzero(np.isfinite(norm).all((1, 2)) & ((norm > 0.0).sum((1, 2)) >= N - n))
    unit_gradients = gradients[rows] / np.where(norm[rows] > 0.0, norm[rows], 1.0)
    if count == N - n:  # independent: QR's last columns are orthogonal to all
        basis[rows] = np.linalg.qr(np.swapaxes(unit_gradients, 1, 2), mode="complete")[0][:, :, count:]
    else:
        basis[rows] = np.swapaxes(np.linalg.svd(unit_gradients)[2][:, N - n :], 1, 2)
    return basis


def eigenvectors(matrix) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return eigenvalues, (points, n), unit eigenvectors in columns and condition numbers; NaN if not finite."""
    values, vectors = np.full(matrix.shape[:2], np.nan, dtype=complex), np.full(matrix.shape, np.nan, dtype=complex)
    rows = np.flatnonzero(np.isfinite(matrix).all(axis=(1, 2)))
    values[rows], vectors[rows] = np.linalg.eig(matrix[rows])
    inverse = matrices.apply_by_matrix(np.linalg.pinv, np.where(np.isfinite(vectors), vectors, 0.0))
    return values, vectors, np.linalg.norm(inverse, axis=2)


def _eigen_columns(matrix, S):
    """Return ordered eigenvalues, their condition numbers, and the joint condition number of the eigenvectors."""
    if matrix.shape[1] > MAX_ADJUGATE_STATES:
        values, _vectors, condition = eigenvectors(matrix)
        ordered, order = order_eigenvalues(values, S)
        condition = np.take_along_axis(condition, order, axis=1)
        joint = np.sqrt(matrix.shape[1]) * np.linalg.norm(condition, axis=1)
        return {"eigenvalues": ordered, "condition": condition, "joint_condition": joint}
    values, _ = order_eigenvalues(matrices.eigenvalues(matrix), S)
    condition = jacobians.condition_numbers(matrix, values, S)
    joint, rows = (np.full(len(S), np.inf), np.flatnonzero(~(condition.max(1, initial=0.0) < MIN_DEFECTIVE_CONDITION)))
    joint[rows] = matrices.eigenvector_conditions(matrix[rows])
    return {"eigenvalues": values, "condition": condition, "joint_condition": joint}


def order_eigenvalues(values, S):
    """Return ordered eigenvalues, and the index of each among the unordered."""
    return matrices.sort_eigenvalues(values, 2.0 * codes.MIN_IMAG_GAP * np.nan_to_num(S))


def _quartic_invariants(matrix):
    """Return S, D and S² - 4D of 4 x 4 matrices."""
    S = 0.5 * matrices.sum_entries(matrix * np.swapaxes(matrix, 1, 2))
    with np.errstate(invalid="ignore"):
        D = np.linalg.det(matrix)
    return S, D, S * S - 4.0 * D


def _errors_of_exchange(re, im, re_error, im_error, S):
    """Return errors that also cover an exchange of two eigenvalues in their order.

    Eigenvalues are ordered by imaginary part, and by real part if those are tied. If errors leave open which decides,
    the errors of both eigenvalues reach the other eigenvalue.
    """
    re_error, im_error = re_error.copy(), im_error.copy()
    with np.errstate(invalid="ignore"):
        is_tied = np.abs(im[:, :, None] - im[:, None]) < TIE_RANGE[1] * S[:, None, None]
        is_equal = (
            np.abs(re[:, :, None] - re[:, None])
            <= re_error[:, :, None] + re_error[:, None] + REAL_TIE * S[:, None, None]
        )
        by_rounding = is_tied & is_equal & ~np.eye(re.shape[1], dtype=bool)
        rows = np.flatnonzero((im_error > ORDER_ERROR * S[:, None]).any(axis=1) | by_rounding.any(axis=(1, 2)))
        low, high = (k * S[rows, None, None] for k in TIE_RANGE)
        growth, frequency, growth_error, frequency_error = (values[rows] for values in (re, im, re_error, im_error))
        distance = np.abs(frequency[:, :, None] - frequency[:, None])
        uncertainty = frequency_error[:, :, None] + frequency_error[:, None]
        may_exchange = (distance + uncertainty > low) & (distance - uncertainty < high) | by_rounding[rows]
        pairs = ((re_error, growth, growth_error), (im_error, frequency, frequency_error))
        for error, value, own_error in pairs:
            reach = np.abs(value[:, :, None] - value[:, None]) + own_error[:, None]
            error[rows] = np.maximum(own_error, np.where(may_exchange, reach, 0.0).max(axis=2, initial=0.0))
    return re_error, im_error


def _growth_rate(re, error):
    """Return the largest real part, and the largest error among the eigenvalues that may have it."""
    is_finite = np.isfinite(re).all(1)
    growth = np.where(is_finite, re.max(1), np.nan)
    with np.errstate(invalid="ignore"):
        may_be_largest = re + error >= growth[:, None]
    return growth, np.where(is_finite, np.where(may_be_largest, error, 0.0).max(1), np.nan)


def regimes(re, im, re_error, im_error, invariants=None, has_pairs=None, is_reversible=True, is_separate=False):
    """Return the regimes of spectra with errors, int8 of `kernels.flow.codes`, -1 if there is no spectrum.

    Args:
        re: real parts, shape (points, n).
        im: imaginary parts.
        re_error: errors of the real parts.
        im_error: errors of the imaginary parts.
        invariants: of four eigenvalues (S, its error), (D, …), (S² - 4D, …), shape (points,) each.
        has_pairs: the Jacobian makes eigenvalues come in pairs ±μ: only then is an eigenvalue known to be on the axis,
            and the invariants decide.
        is_reversible: the whole equations have such pairs; else terms of higher order decide about eigenvalues on the
            axis.
        is_separate: each state is coupled with one other state at most: then pairs of eigenvalues may be equal.
    """
    with np.errstate(invalid="ignore"):
        grows = (re - re_error > 0).any(1)
        may_grow_fastest = re + re_error >= (re - re_error).max(1)[:, None]
        rotates = ((np.abs(im) > im_error) | ~may_grow_fastest).all(1)
        decays = (re + re_error < 0).all(1)
        is_on_axis = (np.abs(re) <= re_error).all(1) & (np.abs(im) > im_error).all(1)
        if has_pairs is not None:
            is_on_axis &= has_pairs & is_reversible  # else an eigenvalue may be off the axis by its error
        keeps_simple_axis, rows = is_on_axis & is_separate, np.flatnonzero(is_on_axis)
        is_on_axis[rows] = _is_distinct(re[rows], im[rows], np.hypot(re_error, im_error)[rows]).all(1)
        is_on_axis |= keeps_simple_axis
        cases = [grows & rotates, grows, decays, is_on_axis]
        values = [codes.FLUTTER, codes.UNSTABLE, codes.ASYMPTOTICALLY_STABLE, codes.STABLE]
        regime = np.select(cases, values, codes.MARGINAL)
        if invariants is not None:
            pair_regime = _regime_of_pairs(*invariants)
            is_decided = has_pairs & (pair_regime != codes.MARGINAL) & ((pair_regime != codes.STABLE) | is_reversible)
            regime = np.where(is_decided, pair_regime, regime)
    return np.where(np.isfinite(re).all(1), regime, -1).astype(np.int8)


@np.errstate(invalid="ignore")
def _regime_on_family(regime, dimension, re, im, re_error, im_error):
    """Return the regimes, with STABLE for members of families of equilibria that attract.

    Each direction along a family has an eigenvalue 0. If as many as the family's dimension are 0 within their errors,
    and all remaining modes decay, a motion nearby ends at a member (Aulbach, J. Math. Anal. Appl. 101 (1984) 543).
    """
    is_zero, decays = (np.abs(re) <= re_error) & (np.abs(im) <= im_error), re + re_error < 0
    is_attracting = (dimension > 0) & (is_zero.sum(1) == dimension) & (is_zero | decays).all(1)
    return np.where(is_attracting, codes.STABLE, regime).astype(np.int8)


def _regimes_by_proof(model, theory, pair, spectra, invariants):
    """Return the regimes of spectra, with those of marginal rotations that conserved quantities decide.

    They are stable if :func:`is_proved_stable`; if these quantities are regular, eigenvalues come in pairs.
    """
    is_rotating = [_is_marginal_rotation(regime, *spectrum[:3]) for regime, spectrum in zip(pair, spectra, strict=True)]
    rows = np.flatnonzero(np.any(is_rotating, axis=0))
    for regular in (True, False):
        is_proved = np.zeros(len(theory["place"]), dtype=bool)
        at = ([p[rows] for p in theory["parameters"]], theory["place"][rows], theory["place_uncertainty"][rows])
        is_proved[rows] = is_proved_stable(model, *at, regular)
        is_proved &= theory["has_pairs"] | (not model.equations.v)  # with a linear drag motions may decay
        for k, (rotates, spectrum, of_invariants) in enumerate(zip(is_rotating, spectra, invariants, strict=True)):
            proved_regime = (
                regimes(*spectrum, of_invariants, is_proved, is_proved, theory["is_separate"])
                if regular
                else np.int8(codes.STABLE)
            )
            pair[k] = np.where(rotates & is_proved, proved_regime, pair[k])
    return pair


def _is_marginal_rotation(regime, re, im, re_error):
    """Return True for marginal spectra without measured growth, with errors below their largest rate."""
    is_on_axis = (re <= re_error).all(1) & (re_error.max(1) < np.hypot(re, im).max(1))
    return is_on_axis & (regime == codes.MARGINAL)


def _is_distinct(re, im, errors):
    """Return True for eigenvalues, (points, n), that differ from each other eigenvalue by more than both errors."""
    distance = np.hypot(re[:, :, None] - re[:, None], im[:, :, None] - im[:, None])
    return ((distance > errors[:, :, None] + errors[:, None]) | np.eye(re.shape[1], dtype=bool)).all(2)


def _regime_of_pairs(total, product, discriminant):
    """Return regimes by the signs of S, D and S² - 4D; MARGINAL if errors leave them open."""
    sum_positive, sum_negative = (total[0] > total[1]), (total[0] < -total[1])
    product_positive, product_negative = (product[0] > product[1]), (product[0] < -product[1])
    real_squares, complex_squares = (discriminant[0] > discriminant[1]), (discriminant[0] < -discriminant[1])
    # S > 0 alone: two real pairs or flutter, both grow
    cases = [complex_squares, product_negative | sum_positive, sum_negative & product_positive & real_squares]
    return np.select(cases, [codes.FLUTTER, codes.UNSTABLE, codes.STABLE], codes.MARGINAL)
