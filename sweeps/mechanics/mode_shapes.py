r"""Mode shapes of points, by linear theory and measured from the runs of the survey, with errors.

A mode is an eigenvector x of the Jacobian A, or of the propagator :math:`e^{Ah}` over a sample interval, which has the
same eigenvectors: theory's A is the Jacobian of `relative.theory`, the measured propagator is that of least squares,
:math:`y_{k+1} = e^{Ah} y_k` over all samples of a point (dynamic mode decomposition).

The equations of a natural system, :math:`\ddot q = -Bq`, make their modes those of B, in the order of the eigenvalues
Ω², and of the block :math:`\cos(\sqrt B h)` of the propagator.

*Scale.* Shapes of coordinates have :math:`x^{\mathsf H} M x = 1`, with M the kinetic matrix; those of states have the
sum 1 of :math:`|x_i|^2` over the squares of the states' sizes. The first component within 1 % of the largest, in these
units, is real and positive.

*Error.* With E the change of a matrix, its eigenvector :math:`x_i` is off by
:math:`\lVert E x_i\rVert \sum_{j\ne i} c_j \lVert x_j\rVert/|\lambda_i - \lambda_j|` or less in first order,
:math:`c_j` the condition number of :math:`\lambda_j`. Of the fit :math:`E x_i` is the error of all samples (their
scatter, remainder of the extrapolation, and rounding, as in `kernels.flow.flows`) times the norm of their shares in
:math:`x_i`. Where the error of a shape exceeds MAX_ERROR, as for equal eigenvalues, the shape is no property of the
system, and is missing.

Source: Kato, Perturbation Theory for Linear Operators (1995), II.2; Tu et al., J. Comput. Dyn. 1 (2014) 391.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from kernels.compile.blocks import W
from kernels.flow import codes
from sweeps.mechanics import relative

MAX_ERROR = 0.1  # error of a shape of length 1, above which it is missing
NORMALISATION_ROUNDING = 16.0 * codes.UNIT  # error of a shape of length 1 by its multiplication with masses and lengths
MAX_PHASE_TIE = 0.01  # components that are smaller than the largest by less than this may set the phase
HALVING, STEPS, MATRIX = range(3)  # columns of a raw result; from the last on, the propagator and its error


@dataclass(frozen=True)
class ModeShapes:
    """Mode shapes of points, ordered as their eigenvalues; NaN where a shape is not determined.

    Attributes:
        vectors: complex, shape (points, modes, components).
        errors: bounds on the length of each vector's deviation, in the norm in which it has length 1, (points, modes).
        participation: Re(x̄_i (M x)_i), shape (points, modes, components); NaN for states.
    """

    vectors: np.ndarray
    errors: np.ndarray
    participation: np.ndarray


def predict_shapes(model, theory: Mapping[str, np.ndarray]) -> ModeShapes:
    """Return the mode shapes of the Jacobian of `relative.theory`."""
    scale, matrix = theory["scale"], theory["matrix"]
    error = relative.THEORY_ROUNDING + theory["matrix_change"]
    if model.equations.natural:
        sizes, velocity_sizes = np.split(theory["sizes"], 2, axis=1)
        accelerations = matrix[:, sizes.shape[1] :, : sizes.shape[1]] * (velocity_sizes / sizes)[:, :, None]
        return find_shapes(model, theory, -accelerations, scale * scale * error, _ascending)
    return find_shapes(model, theory, matrix, scale * error, partial(order_rates, theory=theory))


def measure_shapes(model, points, theory: Mapping[str, np.ndarray], sampling, runs: int) -> ModeShapes:
    """Return the mode shapes of the propagator that is fitted to the samples of points.

    Args:
        model: the system.
        points: as of `relative.theory`, with `epsilon`.
        theory: result of `relative.theory`; places, sizes, basis and scale are used.
        sampling: length and samples of a run, of `kernels.flow.runs`.
        runs: number of runs of a point.
    """
    raw = np.full((len(theory["scale"]), MATRIX + 2 * model.n**2), np.nan)
    fit = partial(_fit_propagators, sampling=sampling)
    rows = np.flatnonzero(np.isfinite(theory["scale"]) & np.isfinite(theory["matrix"]).all(axis=(1, 2)))
    for chunk in np.array_split(rows, -(-rows.size // relative.MAX_CHUNK_POINTS)) if rows.size else ():
        raw[chunk] = relative.integrate_runs(model, points, theory, chunk, runs, fit)
    propagators, errors = np.swapaxes(raw[:, MATRIX:].reshape(-1, 2, model.n, model.n), 0, 1)
    if model.equations.natural:
        places = slice(model.equations.m)
        return find_shapes(model, theory, -propagators[:, places, places], errors[:, :, places], _ascending)
    return find_shapes(model, theory, propagators, errors, partial(order_propagator_rates, theory=theory))


def _ascending(values):
    """Return the order of Ω², or of -cos Ωh."""
    return np.argsort(values.real, axis=1)


def order_rates(values, theory):
    """Return the order of eigenvalues in a map."""
    return relative.order_eigenvalues(values, theory["scale"])[1]


def order_propagator_rates(values, theory):
    """Return the order of the eigenvalues of propagators in a map."""
    return order_rates(np.log(values), theory)


@np.errstate(all="ignore")
def floquet_shapes(model, points, tolerance: float | None) -> tuple[ModeShapes, ModeShapes, np.ndarray]:
    """Return predicted and measured shapes of the multipliers' modes, and theory's states.

    A shape consists of all states at the start of a period: an eigenvector of the monodromy matrix, of the sum 1 of
    :math:`|x_i|^2` over the squares of the states' sizes. The matrices are those of `periodic.survey`.

    Args:
        model: a system with a period.
        points: each parameter, `epsilon` and `equilibrium` (index of the name), shape (points,).
        tolerance: as of `periodic.survey`; None to integrate no motion, and return the predicted shapes twice.
    """
    from kernels.flow import floquet
    from sweeps.mechanics import periodic

    slot, count = np.asarray(points["equilibrium"]), model.equations.n
    base = periodic.BaseMotions(model, model.parameters(points, slot.size), slot)
    matrices, errors = np.full((2, slot.size, count, count), np.nan), np.full((2, slot.size), np.nan)
    multipliers = np.full((slot.size, count), np.nan, dtype=complex)
    for members in periodic.groups(base):
        part = base.select(members)
        flow = periodic.find_flow(part)[0]
        flows = [flow, flow]
        if tolerance and part.num_segments[0]:
            flows[1], is_too_large, _ = part.measure(np.asarray(points["epsilon"])[members], tolerance)
            flows[1].matrix[is_too_large] = np.nan
        for number, (matrix, error, *_) in enumerate(flows):
            matrices[number, members], errors[number, members] = matrix, np.linalg.norm(error, axis=(1, 2))
        columns = floquet.multiplier_columns(flow, part.period, bool(part.has_pairs[0]), False, part.coupling)
        multipliers[members] = columns["multiplier_real"] + 1j * columns["multiplier_imag"]
    theory = {"sizes": base.sizes, "basis": np.broadcast_to(np.eye(count), matrices.shape[1:])}
    order = partial(_order_as, multipliers)
    predicted, measured = (find_shapes(model, theory, *pair, order) for pair in zip(matrices, errors, strict=True))
    return predicted, measured, complete_states(model, theory, predicted)


def _order_as(multipliers, values):
    """Return the index of the eigenvalue that is each multiplier's nearest, each of them once."""
    from scipy.optimize import linear_sum_assignment

    distances = np.nan_to_num(np.abs(multipliers[:, :, None] - values[:, None]))
    return np.array([linear_sum_assignment(each)[1] for each in distances]).reshape(values.shape)


def _fit_propagators(integrator, batch, quantities, sampling):
    """Return raw results of points: change by halving the step, steps, the propagator and its error.

    The error is a matrix: its product with a vector is no shorter than the change of the propagator's product with it.

    Args:
        integrator: of `kernels.flow.runs`.
        batch: the runs.
        quantities: number of conserved quantities.
        sampling: of `kernels.flow.runs`.
    """
    from kernels.flow import flows
    from kernels.flow.runs import CHANGE, Measurement, refine_steps

    runs, num_states = batch.starts.shape[1], batch.project.shape[1]
    count = sampling.intervals + 1
    first_weight = flows.QUANTITY + 2 * quantities
    first_sample = first_weight + runs * count

    def fit_blocks(steps, order, bounds, _numbers, blocks):
        """Return the fitted flow of each point from its lane of the integrated blocks."""
        raw = np.full((steps.size, MATRIX + 2 * num_states * num_states), np.nan)
        for block, first, end in zip(blocks, bounds[:-1], bounds[1:], strict=True):
            weight = block[first_weight:first_sample].reshape(runs, count, W)
            samples = block[first_sample:].reshape(runs, count, num_states, W)
            for lane, point in enumerate(order[first:end]):
                is_pair = weight[:, 1:, lane] > 0.0
                before, after = samples[:, :-1, :, lane][is_pair], samples[:, 1:, :, lane][is_pair]
                largest, total = block[flows.LARGEST, lane], weight[..., lane].sum()
                raw[point, HALVING], raw[point, STEPS] = block[CHANGE, lane] / largest, steps[point]
                if len(before) < num_states or not np.isfinite(before).all():
                    continue
                left, singular, right = np.linalg.svd(before, full_matrices=False)
                if singular[-1] <= codes.MIN_EXCITATION * singular[0]:
                    continue
                inverse = right.T / singular
                transpose = inverse @ (left.T @ after)
                walk = flows.WALK_FACTOR * codes.UNIT * np.sqrt(steps[point] * before.size) * largest
                distance, change = np.sqrt(block[[flows.ONCE_SQUARES, flows.WHOLE_SQUARES], lane])
                decay = min(15.0 * distance / change, flows.MAX_DECAY) if change > 0.0 else 0.0
                remainder = distance * (flows.BASE_FACTOR + flows.DECAY_FACTOR * decay)
                truncation = max(block[CHANGE, lane] - 4.0 * codes.UNIT * np.sqrt(steps[point]) * largest, 0.0) * count
                of_samples = remainder + truncation * np.sqrt(num_states * total)
                spread = flows.SCATTER_FACTOR * np.linalg.norm(after - before @ transpose, 2) + walk
                spread += of_samples * (1.0 + np.linalg.norm(transpose, 2))
                raw[point, MATRIX:] = np.append(transpose.T, spread * inverse.T)
        return raw

    measurement = Measurement(
        flows.take_sample, fit_blocks, (num_states, 1, quantities, runs), first_sample + runs * count * num_states
    )
    return refine_steps(integrator, measurement, batch, sampling)


@np.errstate(all="ignore")
def complete_states(model, theory: Mapping[str, np.ndarray], shapes: ModeShapes) -> np.ndarray:
    """Return states of length 1 of theory's modes, in units in which modes of a natural system are orthogonal.

    Of coordinates a state is the shape and the shape times eigenvalue over scale; of a natural system the shape alone.
    """
    vectors = shapes.vectors
    if not _has_energy(model):
        return vectors / theory["sizes"][:, None]
    metric = model.landscape.a(theory["parameters"], list(theory["place"].T))
    root = np.linalg.cholesky(np.where(np.isfinite(metric), metric, np.eye(metric.shape[1])))
    unit_vectors = vectors @ root  # rows Lᵀx, with M = L Lᵀ
    if model.equations.natural:
        return unit_vectors
    rates = (theory["eigenvalues"] / theory["scale"][:, None])[..., None]
    return np.concatenate([unit_vectors, rates * unit_vectors], axis=2) / np.sqrt(1.0 + np.abs(rates) ** 2)


@np.errstate(all="ignore")
def find_shapes(model, theory, matrix, error, ordering):
    """Return the shapes of matrices.

    Args:
        model: the system.
        theory: result of `relative.theory`; places, sizes, basis and scale are used.
        matrix: shape (points, n, n).
        error: bound on the norm of a change of the matrix, shape (points,), or as of `_fit_propagators`.
        ordering: function that returns the order of modes from the eigenvalues, shape (points, n).
    """
    values, vectors, condition = relative.eigenvectors(matrix)
    order = ordering(values)
    values, vectors = np.take_along_axis(values, order, axis=1), np.take_along_axis(vectors, order[:, None], axis=2)
    condition = np.take_along_axis(condition, order, axis=1)
    gaps = np.abs(values[:, :, None] - values[:, None])
    gaps[:, range(len(gaps[0])), range(len(gaps[0]))] = np.inf
    changes = error[:, None] if error.ndim == 1 else np.linalg.norm(error @ vectors, axis=1)
    sizes, has_energy = theory["sizes"], _has_energy(model)
    if has_energy:
        sizes = sizes[:, : model.equations.m]
        mass = model.landscape.a(theory["parameters"], list(theory["place"].T))
    else:
        mass = np.eye(sizes.shape[1]) / sizes[:, None] ** 2
    states = vectors if model.equations.natural else theory["basis"] @ vectors  # the unit of a state is its size
    shapes = states[:, : sizes.shape[1]] * sizes[:, :, None]
    length = np.sqrt(np.einsum("pim,pij,pjm->pm", shapes.conj(), mass, shapes).real)
    errors = 2.0 * changes * ((condition * length)[:, None] / gaps).sum(axis=2) / length
    return _normalised(shapes / length[:, None], mass, errors + NORMALISATION_ROUNDING, has_energy)


def _has_energy(model) -> bool:
    """Return True if shapes are those of coordinates, with a kinetic energy, and not of all states."""
    return bool(model.equations.v) and model.system.given_period is None


def _normalised(shapes, mass, errors, has_energy):
    """Return shapes of length 1, shape (points, components, modes), with the phase of the module's first lines.

    Args:
        shapes: of length 1, of any phase.
        mass: matrix of their scalar product.
        errors: of the shapes.
        has_energy: the product is twice the kinetic energy, so that components have shares of it.
    """
    heights = np.abs(shapes) * np.sqrt(np.einsum("pii->pi", mass))[:, :, None]
    first = (heights >= (1.0 - MAX_PHASE_TIE) * heights.max(axis=1, keepdims=True)).argmax(axis=1)
    leading = np.take_along_axis(shapes, first[:, None], axis=1)
    is_determined = errors <= MAX_ERROR
    vectors = np.where(is_determined[:, None], shapes * leading.conj() / np.abs(leading), np.nan)
    participation = (vectors.conj() * (mass @ vectors)).real if has_energy else np.full(vectors.shape, np.nan)
    errors = np.where(is_determined, errors, np.nan)
    return ModeShapes(np.swapaxes(vectors, 1, 2), errors, np.swapaxes(participation, 1, 2))
