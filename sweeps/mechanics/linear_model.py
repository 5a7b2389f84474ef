r"""Linear systems of many coordinates, without generated code: theory and measurement by their matrices.

Theory is that of `relative`. The measured propagator :math:`P = e^{Ah}` of :math:`h = 1/2S` is that of perturbations in
every direction, integrated by Taylor steps of order TAYLOR_ORDER; eigenvalues are its logarithms over h. Their errors
are those of P, the change by halving the step and rounding, times the condition numbers, over h and twice: first order.
"""

from functools import cached_property, partial
from types import SimpleNamespace

import numpy as np

from kernels.estimator import statuses
from kernels.flow import codes, flows
from sweeps.mechanics import mode_shapes, relative
from sweeps.mechanics.equations import NO_PARAMETER
from sweeps.mechanics.equilibria import PROVED, runs_of
from sweeps.mechanics.graph import compile_table
from sweeps.mechanics.model import Model

TAYLOR_ORDER, NUM_STEPS, SPACING = 16, 2, 0.5  # steps of an interval, and its length in 1/S: truncation below rounding
PROPAGATOR_ROUNDING = 2.0 * codes.UNIT  # rounding error of a propagator for each state, relative to its norm


class LinearModel(Model):
    """A linear system's matrices, its points, theory and measurement."""

    def __init__(self, system):
        self.system, self.names, self.quantities = system, tuple(system.parameters), ()
        places = tuple(system.coordinates.values())
        size = len(places)
        velocities = [place.velocity for place in places]
        self.equations = SimpleNamespace(
            v=velocities, m=size, n=2 * size, natural=False, conservative=False, places=places, depends_on_time=False
        )
        self.symmetries = SimpleNamespace(has_pairs=_always(True), keeps_energy=_always(False))

    @property
    def n(self) -> int:
        """Number of eigenvalues."""
        return self.equations.n

    @cached_property
    def landscape(self):
        """Masses and slopes of forces as functions of parameters, in the place of `Landscape`."""
        size, symbols = self.equations.m, [p.symbol for p in self.system.parameters.values()] or [NO_PARAMETER]
        mass, stiffness, damping = self.system.linear_matrices
        masses = compile_table(symbols, mass, (size, size))
        forces = compile_table(symbols, -stiffness.row_join(damping), (size, 2 * size))

        def slopes(parameters, _x):
            values = forces(parameters)
            return values, np.abs(values)

        return SimpleNamespace(
            a=lambda parameters, _x: masses(parameters),
            m=size,
            slopes=slopes,
            sizes=lambda parameters, _x: np.ones((parameters[0].size, size)),
            conserved_slopes=lambda _parameters, _x, sizes: (sizes[:, None][:, :0], sizes[:, :0]),
            place_error=lambda _parameters, place, _uncertainty: np.zeros(place.shape),
        )

    def place_columns(self, parameters, slot) -> dict[str, np.ndarray]:
        """Return the equilibrium 0 of each point."""
        zeros, none = np.zeros((slot.size, self.equations.m)), np.zeros(slot.size, dtype=np.int8)
        columns = {"place": zeros, "place_uncertainty": zeros, "dimension": none, "certified": none + np.int8(PROVED)}
        return columns | {"is_order_decided": none == 0, "status": np.full(slot.size, statuses.OK, dtype=np.int8)}

    def survey(self, points, *_settings, **_further) -> dict[str, np.ndarray]:
        """Return all columns of points, in units, as `relative.survey` does."""
        first_rows, row = runs_of([np.asarray(points[name]) for name in (*self.names, "equilibrium")])
        theory = relative.theory(self, {name: np.asarray(values)[first_rows] for name, values in points.items()})
        propagators, error, halving = integrate(theory["matrix"], SPACING / theory["scale"])
        raw = np.full((len(error), flows.FIRST + codes.HEAD + 4 * self.n), np.nan)
        raw[:, flows.HALVING], raw[:, flows.STEPS], raw[:, flows.SAMPLES] = halving, 2 * NUM_STEPS, 2.0
        raw[:, flows.AMPLITUDE], raw[:, flows.REMAINDER], raw[:, flows.FIRST + codes.EXCITATION] = 1.0, 0.0, 1.0
        values, _vectors, condition = relative.eigenvectors(propagators)
        interval = SPACING / theory["scale"][:, None]
        rates, errors = np.log(values) / interval, 2.0 * error[:, None] * condition / (np.abs(values) * interval)
        raw[:, flows.FIRST + codes.HEAD :] = np.concatenate([rates.real, rates.imag, errors, errors], axis=1)
        status = np.where(np.isfinite(rates).all(axis=1), theory["status"], statuses.NON_FINITE).astype(np.int8)
        columns = relative.make_columns(self, theory, {"raw": raw, "status": status, "spacing": SPACING})
        index = row * self.n + np.asarray(points["eigenvalue"]).astype(np.int64) - 1
        return {name: values.reshape(-1)[index if values.ndim == 2 else row] for name, values in columns.items()}

    def mode_shapes(self, theory):
        """Return the shapes of the propagators' modes."""
        propagators, error, _halving = integrate(theory["matrix"], SPACING / theory["scale"])
        return mode_shapes.find_shapes(
            self, theory, propagators, error, partial(mode_shapes.order_propagator_rates, theory=theory)
        )


def integrate(matrices, intervals) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return propagators as of `taylor_propagators`, bounds on their errors' norms, and changes by halving steps."""
    coarse, propagators = (taylor_propagators(matrices, intervals, steps) for steps in (NUM_STEPS, 2 * NUM_STEPS))
    halving = np.abs(propagators - coarse).max(axis=(1, 2))
    size = np.linalg.norm(propagators, axis=(1, 2))
    return propagators, matrices.shape[1] * (halving + PROPAGATOR_ROUNDING * size), halving


def taylor_propagators(matrices, intervals, steps: int = NUM_STEPS) -> np.ndarray:
    """Return propagators e^{Ah}, shape (points, n, n), by Taylor steps.

    Args:
        matrices: A, s-1, shape (points, n, n), with its states in units of their sizes.
        intervals: h, s, at most SPACING over a bound of the rates of A, shape (points,).
        steps: number of steps of an interval.
    """
    propagators = np.broadcast_to(np.eye(matrices.shape[1]), matrices.shape)
    for _step in range(steps):
        term = propagators
        for order in range(1, TAYLOR_ORDER + 1):
            term = matrices @ term * (intervals / steps / order)[:, None, None]
            propagators = propagators + term
    return propagators


def _always(value):
    """Return a function of parameters that returns the value for each point."""
    return lambda parameters, *_more: np.full(np.size(parameters[0]), value)
