"""The free rigid body, spun about a principal axis and perturbed."""

import math
from collections.abc import Mapping
from typing import Annotated, ClassVar

import numpy as np
from pydantic import model_validator

from kernels.estimator import statuses
from kernels.near_axis.propagators import PROPAGATORS
from sweeps.schema.datasets import Dataset
from sweeps.schema.definition import Integration
from sweeps.schema.parameters import Strict, grid_model, key, mapping, switch
from sweeps.schema.refusals import Problem, display, hint, refusals
from sweeps.schema.values import Axis, Epsilon, Phase, Positive, choice, in_unit, line_of_text, list_of_different
from sweeps.schema.variables import Parameter, Variable
from sweeps.systems import rates
from sweeps.systems.bodies import variables as bodies
from sweeps.systems.bodies.body import AXES, BODIES, BodiesDefinition, Body, list_of
from sweeps.systems.bodies.free_body import FreeBody
from sweeps.systems.bodies.shapes import RATIOS
from sweeps.systems.bodies.variables import MOMENTS, VERDICTS, Axes, SignedSpin
from sweeps.systems.reintegration import (
    MAX_GROWTH,
    MAX_STEPPED_SAMPLES,
    ROUNDING_ERROR,
    euler_coefficients,
    sample_spacing,
    squared_rate,
)
from sweeps.systems.shared_variables import STEPS, make_status, parse_rows, regime_pair
from sweeps.systems.system import Example, Point, Reference

SHAREABLE = ("omega0", "epsilon", "phase")  # parameters that a body may have; the grid has them otherwise
ARGUMENTS = ("axis", *MOMENTS, *SHAREABLE)

STATUSES = statuses.STATUSES[: statuses.NON_FINITE + 1]
# Regimes in the order of their codes in a map, from -1.
REGIMES = ("undetermined", *VERDICTS)

VARIABLES = rates.rate_variables(
    reduced="the variation of the spin is removed, from the samples",
    by="correction",
    size="the transverse size",
    window="omega0",
    sparse=True,
) | parse_rows(
    """
    e_folds       1  f4  e-folds of growth within the window of the log slope
    euler_period  s      wobble period in the body frame, measured; missing where not stable
    """,
    *regime_pair(REGIMES, from_zero=True),
    bodies.SHAPE,
    """
    growing_fraction  1  f4  projection of the initial perturbation on the growing mode
    encircles     -  principal axis that the angular momentum encircles at the amplitude of the motion, exact
        flags: 0 none minor_axis major_axis separatrix
        comment: from the sign of L^2 - 2T Imid: the component along that axis keeps its sign; separatrix where rounding
        hides the sign, none where the spin is steady (a sphere, or in the plane of two equal moments)
    samples_used  1  i4  number of samples inside the measurement window
    """,
    Variable("window_end", "s", "time of the last sample inside the measurement window", sparse=True),
    STEPS,
    make_status(statuses.NON_FINITE),
    bodies.TRIANGLE_MARGIN,
    """
    energy_drift        1  f4  largest relative change of twice the kinetic energy [check]
    momentum_drift      1  f4  largest relative change of the squared angular momentum [check]
    perturbation_drift  1  f4  largest change of the invariant of the perturbation, relative to the sum of its absolute
        terms [check]
        comment: Ib (Ib - Ia) wb^2 + Ic (Ic - Ia) wc^2: sensitive to errors that energy and momentum hide
    """,
)

TERMS = parse_rows(
    """
    omega_squared_error_scatter      s-2  term of omega_squared_error: scatter of the corrected samples
    omega_squared_error_integration  s-2  term of omega_squared_error: integration error
    omega_squared_error_amplitude    s-2  term of omega_squared_error: bias of the finite amplitude
    omega_squared_error_rounding     s-2  term of omega_squared_error: rounding
    """
)

CERTIFICATE = parse_rows(
    """
    propagation_error  1  f4  maximum integration error, relative to the running maximum of the perturbation
        [certificate]
        comment: certificate: distance from the exact solution at the samples used, by an exact step that shares no code
        with the direct integrator
    """
)

FLIPS = parse_rows(
    """
    flip_period        s  time between two flips (changes of sign of the spin), measured; missing where the spin keeps
        its sign
        comment: from the start forward to the first change and backward to the last one
    flip_period_exact  s  time between two flips (changes of sign of the spin), closed form: 2 K/p
    max_tilt           rad  largest angle of the angular velocity from the direction of the axis near which it starts,
        measured
    max_tilt_exact     rad  largest angle of the angular velocity from that direction, closed form
    frequency_exact    rad s-1  angular frequency at the amplitude of the motion, closed form: pi p/(2 K)
        comment: tends to frequency_theory about a stable axis as epsilon tends to 0
    """
)

IN_SPACE = parse_rows(
    """
    attitude_error    rad  f4  largest angle between the integrated attitude and the exact one [certificate]
        comment: certificate of the attitude: at the samples used, by an exact step that shares no code with the direct
        integrator
    space_rate        rad s-1  mean precession rate of the spin axis about L (inertial frame), measured; missing where
        not stable or L is not encircled
    space_rate_error  rad s-1  error of the measured precession rate about L
    space_rate_exact  rad s-1  mean precession rate of the spin axis about L (inertial frame), closed form; missing
        where the polhode does not encircle the axis
    geometric_phase_residual  rad  f4  residual of the geometric phase over one polhode period [check]
        comment: Montgomery's theorem: 2T P/L less the signed solid angle, by the trapezoidal rule
    """
)

_SPIN = "spin rate, rad s-1, 1e-150 ≤ |omega0| ≤ 1e150, negative spins the other way"
OMEGA0 = Parameter("omega0", bodies.SIGNED_SPIN, "spin rate", description=_SPIN)
PARAMETERS = (*bodies.PRINCIPAL, OMEGA0, bodies.EPSILON, bodies.PHASE)

LAYOUT = bodies.layout(PARAMETERS, VARIABLES | CERTIFICATE | FLIPS | IN_SPACE, VARIABLES, has_axis=True)


GridEntries = grid_model("GridEntries", PARAMETERS, __name__, RATIOS)


class Observed(Strict):
    """The observed motion of a body, for comparison only."""

    period_days: Positive = key("observed period, days of 86,400 s: > 0", ...)
    what: Annotated[str, line_of_text(100)] = key("the motion that has this period: one line of text", ...)


class SpunBody(Body):
    """A real body and its spin."""

    omega0: in_unit("rad s-1", SignedSpin) = key("spin rate of this body, rad s-1: 1e-150 ≤ |omega0| ≤ 1e150")
    epsilon: in_unit("1", Epsilon) = key("size of the perturbation of this body, relative: 0 < epsilon < 1")
    phase: in_unit("rad", Phase) = key("direction of the perturbation of this body, rad: finite")
    axis: Axis = key("the axis it spins about in nature: 1, 2 or 3")
    observed: Observed = key("observed motion: {period_days, what}")


class RigidBodyIntegration(Integration):
    """Method, length and accuracy of each run of a rigid body, and optional measurements."""

    propagator: Annotated[str, choice(tuple(PROPAGATORS))] = key(
        "integration method: " + " or ".join(f"{name} ({each.summary})" for name, each in PROPAGATORS.items()), "direct"
    )
    collapse: bool = switch("points that differ by units alone are integrated once and expanded")
    variables: list_of_different(str) = key(
        "which variables to make: a list of names of a map's variables; left out, all but the terms of "
        "omega_squared_error"
    )
    flips: bool = switch("to follow the motion on to its flips and its largest tilt, up to 20,000 rotations each way")
    attitude: bool = switch("to follow the attitude too, and measure how the spin axis moves in space")

    @property
    def table(self) -> dict[str, Variable]:
        """Name → variable of a map with these settings."""
        omitted_names = set(TERMS) if self.variables is None else set(self._possible) - set(self.variables)
        return {name: variable for name, variable in self._possible.items() if name not in omitted_names}

    @property
    def _possible(self) -> dict[str, Variable]:
        certificate = CERTIFICATE if PROPAGATORS[self.propagator].is_certified else {}
        attitude = IN_SPACE if self.attitude else {}
        return VARIABLES | certificate | (FLIPS if self.flips else {}) | attitude | TERMS

    @model_validator(mode="after")
    def _check_variables(self) -> "RigidBodyIntegration":
        """Check that all `variables` are variables of this sweep; refuse the unknown ones."""
        names, problems = self._possible, []
        for i, name in enumerate(self.variables or ()):
            if name not in names:
                reason = "is not a variable of this sweep" + hint(name, names)
                problems.append(Problem(("variables", i), display(name), reason, ", ".join(names)))
        if problems:
            raise refusals(problems)
        return self


class NearAxisDefinition(BodiesDefinition):
    """A sweep of spins near principal axes, over moments or bodies."""

    shareable: ClassVar = SHAREABLE
    axes: Axes = key(AXES, (1, 2, 3))
    grid: GridEntries = mapping("what is varied", GridEntries)
    bodies: list_of(SpunBody) = key(BODIES, ())


class RigidBodyDefinition(NearAxisDefinition):
    """A sweep of free rigid bodies, each integrated and measured."""

    integration: RigidBodyIntegration = mapping("how each run is made", RigidBodyIntegration)

    @property
    def follows_attitude(self) -> bool:
        """Return True if the attitude is requested."""
        return self.integration.attitude

    @property
    def differing_bits(self) -> str:
        """Why single points differ in the last bits: `collapse` integrates equivalent points once."""
        return "a collapsed map holds other points' motions in its own units" if self.integration.collapse else ""


A_POINT = {"I1": 1.0, "I2": 2.0, "I3": 3.0, "axis": 2, "omega0": 1.0, "epsilon": 1e-6, "phase": 0.6}
RUN = (1.0, 16, 1e-9)
SURVEY = (
    Example("near_axis.examples", "follow_block"),
    Example("near_axis.examples", "fill_columns"),
    Example("near_axis.survey", "predict_points", (A_POINT,)),
    Example("near_axis.examples", "plan_points"),
    Example("near_axis.survey", "survey", (A_POINT, *RUN), is_last=True),
)
FLIPPED = Example("near_axis.survey", "measure_flips", (A_POINT,))
ON_REQUEST = {  # key of `integration` → call that compiles its kernels
    "flips": FLIPPED,
    "attitude": Example("events.in_space", "survey", (A_POINT, *RUN)),
    "collapse": Example("near_axis.survey", "measure_collapsed", (A_POINT, *RUN), is_last=True),
}

# -- the system


class RigidBody(FreeBody):
    """Euler's equations without torque, near each principal axis."""

    name = "rigid_body"
    kernels = ("near_axis.survey", "events.in_space")
    compiled = SURVEY
    compile_seconds = 12.0
    model = RigidBodyDefinition
    variants: ClassVar = {"uncertainty": "uncertain_bodies"}
    references = "Landau and Lifshitz, Mechanics, sections 36 and 37"
    caption = "measured rates of small perturbations about each principal axis, compared with linear theory"
    picture_seconds = 4.5

    def variables(self, definition: RigidBodyDefinition | None = None) -> dict[str, Variable]:
        """Return name → variable: the certificate of direct integration, and flips and attitude on request."""
        return VARIABLES if definition is None else definition.integration.table

    def examples(self, definition: RigidBodyDefinition | None = None) -> tuple[Example, ...]:
        """Return the calls that compile a survey, and those for flips, attitude and collapse on request."""
        requested = [name for name in ON_REQUEST if definition is None or getattr(definition.integration, name)]
        return *self.compiled, *(ON_REQUEST[name] for name in requested)

    def columns(self, points: Mapping[str, np.ndarray], integration: RigidBodyIntegration) -> dict[str, np.ndarray]:
        """Return linear theory and the measured columns; see `kernels.near_axis.survey`."""
        from kernels.events import in_space  # noqa: F401  (a map's fingerprint covers it)
        from kernels.near_axis import survey

        settings = integration.rotations, integration.samples_per_rotation, integration.tolerance
        options = {"propagator": integration.propagator, "nonlinear": integration.flips, "wanted": integration.table}
        columns = survey.survey(points, *settings, collapse=integration.collapse, **options)
        if integration.attitude:
            columns |= _in_space(points, settings, columns, integration.table)
        return columns

    def motion(self, point: Point, duration: float | None, samples: int | None, tolerance: float) -> Dataset:
        """Return ω(t) and q(t) of a point, in closed form and by direct integration; see `Dynamics.motion`."""
        import xarray as xr

        from sweeps.systems.motion import attitude_columns, sample_times, time_axis

        moments, omega = initial_state(point)
        rotation = 2 * np.pi / np.abs(omega).max()
        times = sample_times(span_of(moments, omega, rotation) if duration is None else duration, samples, rotation)
        return xr.Dataset(
            attitude_columns(moments, omega, times, tolerance), {"time": time_axis(times, "the perturbation")}
        )

    def motions(self, points: Mapping[str, np.ndarray], integration: RigidBodyIntegration) -> int:
        """Return the number of points, or with `collapse` of distinct motions."""
        from kernels.near_axis import survey

        return survey.count_motions(points) if integration.collapse else super().motions(points, integration)

    def method(self, definition: RigidBodyDefinition) -> str:
        """Return the method of computation."""
        return PROPAGATORS[definition.integration.propagator].method

    def reference(self) -> Reference:
        """Return Ω² of a perturbed rotation, measured again by SciPy's DOP853 and by Jacobi's functions."""
        ways = {"SciPy DOP853": rotation_by_scipy, "closed form": rotation_in_closed_form}
        return Reference("omega_squared", ways, allowed_deviation)


def initial_state(point: Mapping[str, float]) -> tuple[np.ndarray, np.ndarray]:
    """Return moments (kg m2) and angular velocity at time 0 (rad s-1), shape (3,) each, of a point of the rigid body.

    ω_a = ω0, ω_b = ε ω0 cos φ, ω_c = ε ω0 sin φ, with (a, b, c) cyclic and a the spin axis.
    """
    moments = np.array([point[f"I{i}"] for i in (1, 2, 3)], dtype=float)
    spin, epsilon, phase = float(point["omega0"]), float(point["epsilon"]), float(point["phase"])
    a = int(point["axis"]) - 1
    omega = np.zeros(3)
    omega[[a, (a + 1) % 3, (a + 2) % 3]] = np.array([1.0, epsilon * math.cos(phase), epsilon * math.sin(phase)]) * spin
    return moments, omega


def span_of(moments: np.ndarray, omega: np.ndarray, rotation: float) -> float:
    """Return the time of two flips, or two wobble periods, s; four rotations if it exceeds MAX_ROTATIONS rotations.

    Args:
        moments: principal moments, kg m2, shape (3,).
        omega: initial angular velocity, rad s-1, shape (3,).
        rotation: time of one rotation, s.
    """
    from kernels.free import exact
    from sweeps.systems.motion import motion_span

    top = exact.set_up(*moments, *omega)
    flips = exact.max_tilt(top, int(np.abs(omega).argmax()) + 1) > 0.5 * math.pi
    return motion_span((1 if flips else 2) * exact.period(top), rotation)


def _in_space(points, settings, columns, wanted) -> dict[str, np.ndarray]:
    """Return the columns of the motion in the inertial frame.

    The precession rate of the spin axis is the sum of the rates of psi and of the wobble; its error is the sum of
    their errors and of the effect of an incomplete wobble at the end of the run. Both are missing if the motion
    does not encircle the axis.
    """
    from kernels.events import in_space
    from kernels.free import linear
    from kernels.near_axis import survey

    space_columns = in_space.survey(points, *settings)
    wobble_names = {"frequency", "frequency_error", "regime"}
    wobble = (
        columns if wobble_names <= columns.keys() else survey.measure_points(points, *settings, wanted=wobble_names)
    )
    senses = {linear.STABLE_MAJOR: 1.0, linear.STABLE_MINOR: -1.0}
    sense = np.select([wobble["regime"] == flag for flag in senses], list(senses.values()), np.nan)
    moments, axis_index = np.stack([points[name] for name in MOMENTS]), points["axis"] - 1
    Ia, Ib, Ic = (np.take_along_axis(moments, (axis_index + k)[None] % 3, axis=0)[0] for k in range(3))
    b, c = (points["epsilon"] * f(points["phase"]) for f in (np.cos, np.sin))
    spin = np.abs(points["omega0"])
    psi_spread, spin_spread = in_space.rate_variation(Ia, Ib, Ic, b, c)
    sense[np.isnan(spin_spread)] = np.nan
    wobble_rate, wobble_error = wobble["frequency"], wobble["frequency_error"]
    space_columns["space_rate"] = space_columns.pop("psi_rate") + sense * wobble_rate
    error = np.abs(sense) * (psi_spread * spin + wobble_error + (wobble_rate + wobble_error) * spin_spread)
    space_columns["space_rate_error"] = space_columns.pop("psi_rate_error") + error
    return {name: values for name, values in space_columns.items() if name in wanted}


MAX_CLOSED_FORM_SAMPLES = 1_000_000  # samples of a run; longer runs are not computed in closed form


def _moments_from_axis(point: Mapping[str, float]) -> np.ndarray:
    return np.roll([point["I1"], point["I2"], point["I3"]], 1 - int(point["axis"]))


def _point_spacing(point, integration) -> float:
    return sample_spacing(np.abs(euler_coefficients(_moments_from_axis(point))).max(), integration.samples_per_rotation)


def _sample_times(point, integration) -> np.ndarray:
    return _point_spacing(point, integration) * np.arange(integration.samples + 1)


def rotation_by_scipy(point: Mapping[str, float], integration) -> float:
    """Return Ω² of a perturbed rotation in s-2, by DOP853; NaN for runs of more than `MAX_STEPPED_SAMPLES` samples."""
    from scipy.integrate import solve_ivp

    if integration.samples > MAX_STEPPED_SAMPLES:
        return math.nan
    ca, cb, cc = euler_coefficients(_moments_from_axis(point))
    times, e2 = _sample_times(point, integration), point["epsilon"] ** 2
    start = [math.copysign(1.0, point["omega0"]), math.cos(point["phase"]), math.sin(point["phase"])]

    def rates(_, w):
        return ca * e2 * w[1] * w[2], cb * w[2] * w[0], cc * w[0] * w[1]

    def growth(_, w):
        return math.hypot(w[1], w[2]) - 2.0 * MAX_GROWTH

    growth.terminal = True
    accuracy = {"rtol": 1e-13, "atol": 1e-14}
    solution = solve_ivp(rates, (0.0, times[-1]), start, "DOP853", times, events=growth, **accuracy)
    return squared_rate(solution.y[1:].T, times[1], solution.y[0]) * point["omega0"] ** 2


def rotation_in_closed_form(point: Mapping[str, float], integration) -> float:
    """Return Ω² of a perturbed rotation in s-2, by Jacobi's functions; NaN for too many samples."""
    from kernels.free import exact

    if integration.samples > MAX_CLOSED_FORM_SAMPLES:
        return math.nan
    epsilon, phase, axis = point["epsilon"], point["phase"], int(point["axis"])
    start = [math.copysign(1.0, point["omega0"]), epsilon * math.cos(phase), epsilon * math.sin(phase)]
    moments, times = _moments_from_axis(point), _sample_times(point, integration)
    omega = exact.rotation(np.roll(moments, axis - 1), np.roll(start, axis - 1), times)
    components = np.roll(omega, 1 - axis, axis=1)
    return squared_rate(components[:, 1:] / epsilon, times[1], components[:, 0]) * point["omega0"] ** 2


def allowed_deviation(point: Mapping[str, float], integration) -> float:
    """Return the allowed distance of a measured Ω² from a reference, s-2.

    Errors δ of samples, relative to the largest so far, change D by 2δ, hence Ω² by 4δ/h². Both methods may have errors
    of the tolerance, and the references of `ROUNDING_ERROR`.
    """
    h = _point_spacing(point, integration)
    return 8.0 * (integration.tolerance + ROUNDING_ERROR) / h**2 * point["omega0"] ** 2


SYSTEM = RigidBody()
