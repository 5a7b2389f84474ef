"""A free body that loses energy while its angular momentum stays: rates about each axis, and its way to a flat spin."""

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np

from kernels.estimator import statuses
from kernels.free.triangle import triangle_margin
from sweeps.schema.datasets import Dataset
from sweeps.schema.parameters import Range, grid_model, key, mapping, spread
from sweeps.schema.values import Axis, integer, number
from sweeps.schema.variables import Parameter, Quantity, Variable, table
from sweeps.systems import described
from sweeps.systems.bodies import variables as bodies
from sweeps.systems.bodies.body import BODIES, BodiesDefinition, Body, list_of
from sweeps.systems.bodies.free_body import FreeBody
from sweeps.systems.bodies.shapes import RATIOS
from sweeps.systems.bodies.variables import MOMENTS, Spin
from sweeps.systems.motion import UNROTATED
from sweeps.systems.relative_equilibrium.system import FlowIntegration, RelativeEquilibrium
from sweeps.systems.shared_variables import make_status, parse_rows, with_theory
from sweeps.systems.system import Cost, Example, Point, Reference

ARGUMENTS = (*MOMENTS, "loss", "from_angle", "phase", "to_angle", "omega0")
_RATES: dict = {"over": ("principal_axis", "eigenvalue")}
_NEVER = "0 where the motion starts at or below this energy, missing where it does not reach it"
_TRUSTED = "whether the eigenvalues can be trusted", "i1", statuses.STATUSES

VARIABLES = parse_rows(
    *with_theory("eigenvalue_real", "s-1", "real part of the eigenvalue about the axis", "a bound", **_RATES),
    *with_theory("eigenvalue_imag", "s-1", "imaginary part of the eigenvalue about the axis", "a bound", **_RATES),
    Variable("rates_status", None, *_TRUSTED, over=("principal_axis",)),
    f"""
    settling_time        s  time until L stays within to_angle of the axis of greatest inertia, measured [measurement]
        comment: {_NEVER}
    settling_time_error  s  error of the measured settling time
        comment: {bodies.TWO_RUNS}
    crossing_time        s  time until the energy is that of a spin about the intermediate axis, measured
        comment: {_NEVER}
    crossing_time_error  s  error of the measured crossing time
        comment: {bodies.TWO_RUNS}
    final_sense          -  sign of L along the axis of greatest inertia at the end [headline]
        flags: -1 undetermined negative positive
        comment: undetermined where a start displaced by the error to one side may end in the other sense
    """,
    make_status(),
    bodies.TRIANGLE_MARGIN,
)

Loss = Annotated[float, number(lambda x: 1e-9 <= x <= 1e3, "a number from 1e-9 to 1e3")]
Angle = Annotated[float, number(lambda x: 1e-9 <= x <= 0.5 * math.pi, "a number from 1e-9 to pi/2, in rad")]
MAX_ERROR = 1e-3  # relative error of the settling time above which the motion is reported as not converged
SMALL_ANGLE = 0.01  # rad, default distance of both ends of the motion from a spin about an axis

ANGLE, LOSS = Quantity("angle", "rad", "1e-9 to pi/2", Angle), Quantity("loss", "1", "1e-9 to 1e3", Loss)
_FROM = "initial direction of L about the axis of least inertia, from the intermediate to the greatest axis"
PARAMETERS = (
    *bodies.PRINCIPAL,
    Parameter("loss", LOSS, "alpha |L|: strength of the dissipation, dimensionless", required=True),
    Parameter("from_angle", ANGLE, "initial angle of L from the axis of least inertia", SMALL_ANGLE),
    replace(bodies.PHASE, long_name=_FROM, description=""),
    Parameter("to_angle", ANGLE, "largest angle of L from the axis of greatest inertia at the end", SMALL_ANGLE),
    bodies.spin("L/I1, the spin rate about the axis of least inertia with this L"),
)
_LAYOUT = bodies.layout(PARAMETERS, VARIABLES, [name for name, variable in VARIABLES.items() if not variable.over])
LAYOUT = replace(
    _LAYOUT,
    coordinates=_LAYOUT.coordinates
    | table(
        Variable("principal_axis", "1", "principal axis, by ascending moment", "i1"),
        Variable("eigenvalue", "1", "eigenvalue, by ascending imaginary, then real part", "i1"),
    ),
    spare=(*_LAYOUT.spare, "principal_axis", "eigenvalue"),
    values=_LAYOUT.values | {"principal_axis": Axis, "eigenvalue": Annotated[int, integer(1, 2, "1 or 2")]},
)

A_POINT = dict(zip(ARGUMENTS, (1.0, 2.0, 3.0, 0.1, 0.5, 0.6, 0.1, 1.0), strict=True))
DissipativeGrid: Any = grid_model("DissipativeGrid", PARAMETERS, __name__, RATIOS)


class Dissipative(Body):
    """A body that loses energy."""

    omega0: Spin = key("L/I1 of this body, rad s-1: 1e-150 ≤ omega0 ≤ 1e150")


Bodies: Any = list_of(Dissipative)


class DissipativeDefinition(BodiesDefinition):
    """A sweep of bodies that lose energy."""

    shareable: ClassVar = ("omega0",)
    integration: FlowIntegration = mapping("how each run is made", FlowIntegration)
    grid: DissipativeGrid = mapping("what is varied", DissipativeGrid, required=True)
    bodies: Bodies = key(BODIES, ())


class DissipativeBody(FreeBody):
    """A free body that loses energy: eigenvalues about each axis, times of its way to a flat spin, and its sense."""

    name = "dissipative_body"
    kernels = ("events.dissipation", "free.triangle", *RelativeEquilibrium.kernels)
    compiled = (*RelativeEquilibrium.compiled, Example("events.dissipation", "survey", (A_POINT, 1e-9)))
    compile_seconds = 25.0
    model = DissipativeDefinition
    method_text = "direct integration of the angular momentum in the body until it has settled"
    references = "Bloch, Krishnaprasad, Marsden and Ratiu, Communications in Mathematical Physics 175 (1996) 1"
    caption = "measured rates about each axis and times to a flat spin of bodies that lose energy"
    samples_per_second = 2_500_000

    def extra_dimensions(self, definition: DissipativeDefinition) -> dict[str, np.ndarray]:
        """Return the three axes and the two eigenvalues about each."""
        return {"principal_axis": np.array([1, 2, 3], np.int8), "eigenvalue": np.array([1, 2], np.int8)}

    def columns(self, points: Mapping[str, np.ndarray], integration: FlowIntegration) -> dict[str, np.ndarray]:
        """Return theory and the measured columns; see `kernels.events.dissipation` and `equations`."""
        from kernels.events import dissipation
        from sweeps.systems.dissipative_body import equations

        ratio, _complement, rate = dissipation.reduce_moments(np.sort([points[name] for name in MOMENTS], axis=0))
        settings = integration.rotations, integration.samples_per_rotation, integration.tolerance, integration.runs
        columns = equations.measure_rates(ratio, points["loss"], settings)
        for name in equations.COLUMNS:
            columns[name] *= (rate * points["omega0"])[:, None, None]
        columns |= dissipation.survey(points, integration.tolerance)
        columns["triangle_margin"] = triangle_margin(*(points[name] for name in MOMENTS))
        time, is_uncertain = columns["settling_time"], (columns["rates_status"] > 0).any(1)
        is_uncertain |= columns["settling_time_error"] > MAX_ERROR * time
        cases = [rate == 0.0, np.isnan(time), is_uncertain]
        kinds = [statuses.NO_TIME_SCALE, statuses.SHORT_WINDOW, statuses.NOT_CONVERGED]
        columns["status"] = np.select(cases, kinds, statuses.OK).astype(np.int8)
        return {name: columns[name] for name in VARIABLES}

    def cost(self, definition: DissipativeDefinition) -> Cost:
        """Return the steps of a motion, about a hundred over its loss, as samples."""
        losses = spread(definition.grid.loss)
        losses = losses.values(np.arange(losses.num)) if isinstance(losses, Range) else losses
        return Cost(int(np.minimum(100.0 / losses, MAX_STEPS).mean()))

    def examples(self, definition: DissipativeDefinition | None = None) -> tuple[Example, ...]:
        """Return the calls of relative equilibria and of motions, and the import of the generated code."""
        from sweeps.systems.dissipative_body import equations

        code = Example(str(equations.MODEL.code.path))
        return self.compiled if definition is None else (code, *self.compiled)

    def fingerprint(self) -> str:
        """Return a hash of the kernels, the generated code, its generator and the equations."""
        from sweeps.systems.dissipative_body import equations

        source = Path(__file__).with_name("equations.py").read_bytes()
        return described.hash_sources(self.kernels, equations.MODEL.code, source)

    def motion(self, point: Point, duration: float | None, samples: int | None, tolerance: float) -> Dataset:
        """Return omega = L/I and the attitude, until the motion has settled; see `Dynamics.motion`.

        The attitude turns at omega + alpha L x omega, so that L stays fixed in space.
        """
        import xarray as xr

        from sweeps.systems.motion import label_columns, sample_times, time_axis

        rate = float(point["omega0"])
        duration = duration or time_by_scipy(point)
        duration = duration if duration > 0.0 else 2.0 * math.pi * MAX_ROTATIONS / rate
        times = sample_times(duration, samples, 2.0 * math.pi / rate)
        share, run = solve(point, times[-1] * rate, tolerance, t_eval=times * rate)
        attitude = run.y[3:] / np.linalg.norm(run.y[3:], axis=0)
        columns = label_columns(rate * run.y[:3].T * share, attitude.T, "direct integration")
        return xr.Dataset(columns, {"time": time_axis(times, "the start")})

    def reference(self) -> Reference:
        """Return the times of settling and crossing by SciPy's DOP853."""
        settling, crossing = (
            Reference(name, {"SciPy DOP853": partial(time_by_scipy, name=name)}, allowed_deviation)
            for name in ("settling_time", "crossing_time")
        )
        return replace(settling, more=(crossing,))


MAX_STEPS = 5e6  # largest number of steps of a motion, that of the kernel
MAX_ROTATIONS = 300.0  # initial rotations after which SciPy, which takes some seconds for them, stops
CROSS = np.cross(np.eye(3)[:, None], np.eye(3)).transpose(2, 0, 1)  # Levi-Civita symbol: u @ CROSS @ v is u x v
REFERENCE_ERROR = 1e-8  # relative error of a time by DOP853 at loss 1 near the separatrix, where rounding grows


def initial_direction(point: Point) -> np.ndarray:
    """Return L/|L| at the start, along the axes of ascending moments."""
    theta, phi = float(point["from_angle"]), float(point["phase"])
    return np.array([math.cos(theta), math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi)])


def solve(point: Point, end: float, tolerance: float, attitude: tuple[float, ...] = UNROTATED, **options):
    """Return I1 over each moment, and SciPy's run of L/|L| in the body and the attitude q over omega0 t, up to ``end``.

    L' = L x w and q' = q w/2 with w = omega + alpha L x omega are the double bracket, with L fixed in space. The
    quaternion ``attitude`` is that at the start; () for none.
    """
    from scipy.integrate import solve_ivp

    moments, loss = np.sort([float(point[name]) for name in MOMENTS]), float(point["loss"])
    share = moments[0] / moments

    def slope(time, state):
        """Return the rates of the direction of L and, if followed, of the attitude's quaternion."""
        direction = state[:3]
        omega = share * direction
        rate = omega + loss * (direction @ CROSS @ omega)
        if not attitude:
            return direction @ CROSS @ rate
        scalar, vector = state[3], state[4:]
        vector_rate = 0.5 * (scalar * rate + vector @ CROSS @ rate)
        return np.concatenate([direction @ CROSS @ rate, [-0.5 * vector @ rate], vector_rate])

    first = [*initial_direction(point), *attitude]
    return share, solve_ivp(slope, (0.0, end), first, "DOP853", rtol=max(tolerance, 1e-13), atol=1e-15, **options)


def time_by_scipy(point: Point, integration: FlowIntegration | None = None, name: str = "settling_time") -> float:
    """Return settling_time or crossing_time, s, by SciPy's DOP853; NaN beyond MAX_ROTATIONS, 0 for a time before."""
    low, middle, high = np.sort([float(point[name]) for name in MOMENTS])
    levels = np.array([(high - low) / high, (high - middle) / middle * (low / high), 0.0])  # energies about the axes
    to_angle, is_settling = float(point["to_angle"]), name == "settling_time"
    target = levels[1] * (math.sin(to_angle) ** 2 if is_settling else 1.0)

    def energy(time, state):
        direction = np.asarray(state)
        return direction**2 @ levels / (direction @ direction) - target

    if energy(0.0, initial_direction(point)) <= 0.0:
        return 0.0
    e_folds = -math.log(float(point["from_angle"])) - (2.0 * math.log(to_angle) if is_settling else 0.0)
    if not e_folds < 2.0 * math.pi * MAX_ROTATIONS * float(point["loss"]) * levels[0]:
        return math.nan
    event: Any = energy
    event.terminal = True
    run = solve(point, 2.0 * math.pi * MAX_ROTATIONS, 1e-13, (), events=event)[1]
    return float(run.t_events[0][0]) / float(point["omega0"]) if run.t_events[0].size else math.nan


def allowed_deviation(point: Point, integration: FlowIntegration) -> float:
    """Return the allowed distance of a measured time from DOP853's, s."""
    return REFERENCE_ERROR * (1.0 + 1.0 / float(point["loss"])) / float(point["omega0"])


SYSTEM = DissipativeBody()
