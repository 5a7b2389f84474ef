"""The free rigid body, spun about a principal axis and perturbed: its definition, columns, motion and references."""

from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from sweeps.schema.boxes import Dataset
from sweeps.schema.variables import Variable
from sweeps.systems.bodies.family import FreeBody
from sweeps.systems.bodies.variables import MOMENTS
from sweeps.systems.rigid_body import variables
from sweeps.systems.system import Kernel, Point

if TYPE_CHECKING:
    from sweeps.systems.rigid_body.definition import RigidBodyDefinition, RigidBodyIntegration

# -- the compiled functions that a survey calls, in the order of compiling: the longest first

A_POINT = {"I1": 1.0, "I2": 2.0, "I3": 3.0, "axis": 2, "omega0": 1.0, "epsilon": 1e-6, "phase": 0.6}
RUN = (1.0, 16, 1e-9)
ROW, NUMBERS, WORK = "float64[::1]", "int64[::1]", "UniTuple(boolean, 5)"
LANES = "float64[:, :, ::1]"
SURVEY = (  # first what `_run` links
    Kernel("estimates", "fill", f"{ROW}, {WORK}, int64, int64, boolean, float64", seconds=2.5),
    Kernel("lanes", "advance", f"{ROW}, int64, int64", seconds=2.0),
    Kernel("lanes", "sample", f"{ROW}, int64, int64", seconds=1.0),
    Kernel("lanes", "begin_exact", f"{ROW},", seconds=1.0),
    *(
        Kernel("lanes", name, f"{ROW},", seconds=0.2)
        for name in ("_exact_samples", "guess", "log_sample", "begin", "watch_invariants", "begin_recurrence")
    ),
    *(Kernel("lanes", name, f"{ROW},", seconds=0.1) for name in ("begin_invariants", "certify", "begin_reduction")),
    Kernel("survey", "_keep", f"{ROW}, {NUMBERS}, float64[:, ::1]", seconds=0.1),
    Kernel("survey", "_gather", f"{ROW}, {ROW}, {NUMBERS}, int64", seconds=0.2),
    Kernel("lanes", "follow", f"{ROW}, int64, int64, int64, {WORK}, int64", seconds=1.0, stage=1),
    Kernel(
        "survey",
        "_run",
        f"{ROW}, {NUMBERS}, UniTuple({NUMBERS}, 2), Tuple((float64, int64, float64, boolean, boolean)), {WORK}, "
        f"Tuple(({NUMBERS}, {LANES}, uint32[::1]))",
        seconds=1.5,
        stage=2,
    ),
    Kernel("survey", "theory", example=(A_POINT,), seconds=1.0),
    Kernel("survey", "_choose", f"{ROW}, int64, float64, {NUMBERS}", seconds=0.5),
    Kernel("survey", "_lay_out", f"{ROW}, UniTuple({ROW}, 6)", seconds=0.5),
    Kernel("blocks", "cut", f"{NUMBERS}, int64", seconds=0.4),
    Kernel("survey", "_plan", f"{ROW}, {NUMBERS}, float64, int64, {NUMBERS}", seconds=0.3),
    *(
        Kernel("survey", "_sort_back", f"int64, {ROW}, uint32[::1], int64, int64, {kind}[:, ::1]", seconds=0.1)
        for kind in ("float64", "int32", "int8")
    ),
)
FLIPS = Kernel("survey", "flipped", "", (A_POINT,), 4.0, 0, lambda sweep: sweep.integration.flips)
COLLAPSED = Kernel("survey", "collapsed", "", (A_POINT, *RUN), 1.0, 3, lambda sweep: sweep.integration.collapse)
IN_SPACE = Kernel("in_space", "survey", "", (A_POINT, *RUN), 6.0, 0, lambda sweep: sweep.integration.attitude)
KERNELS = (*SURVEY, FLIPS, IN_SPACE, COLLAPSED)

# -- the system

COMPARED = 32  # points of a block that a collapsed sweep also integrates as themselves


class RigidBody(FreeBody):
    """Euler's equations without torque, near each principal axis."""

    name = "rigid_body"
    kernels = ("survey", "in_space")
    compiled = KERNELS
    tables = variables
    variants: ClassVar = {"uncertainty": "uncertain_bodies"}
    references = "Landau and Lifshitz, Mechanics, sections 36 and 37"
    caption = "measured rates of small perturbations about each principal axis, compared with linear theory"
    picture_seconds = 4.5

    @cached_property
    def model(self) -> "type[RigidBodyDefinition]":
        """The model of its definitions, which takes longer to build than a map's layout to know."""
        from sweeps.systems.rigid_body.definition import RigidBodyDefinition

        return RigidBodyDefinition

    def variables(self, definition: "RigidBodyDefinition | None" = None) -> dict[str, Variable]:
        """Return name → variable: the certificate of direct integration, and flips and attitude on request."""
        return variables.VARIABLES if definition is None else definition.integration.table

    def columns(self, points: Mapping[str, np.ndarray], integration: "RigidBodyIntegration") -> dict[str, np.ndarray]:
        """Return linear theory beside what is measured; see `kernels.survey`."""
        from kernels import in_space, survey  # noqa: F401  (what a map's fingerprint covers is imported with it)

        settings = integration.rotations, integration.samples_per_rotation, integration.tolerance
        options = {"propagator": integration.propagator, "nonlinear": integration.flips, "wanted": integration.table}
        columns = survey.survey(points, *settings, collapse=integration.collapse, **options)
        if integration.collapse and "omega_squared" in columns:
            _compare_with_some_in_full(columns, points, settings, options)
        if integration.attitude:
            columns |= _in_space(points, settings, columns, integration.table)
        return columns

    def motion(self, point: Point, duration: float | None, samples: int | None, tolerance: float) -> Dataset:
        """Return ω(t) and q(t) of a point, in closed form and by direct integration; see `Dynamics.motion`."""
        import xarray as xr

        from sweeps.systems.motion import columns, instants, time
        from sweeps.systems.rigid_body.motion import span_of, start

        moments, omega = start(point)
        rotation = 2 * np.pi / np.abs(omega).max()
        times = instants(span_of(moments, omega, rotation) if duration is None else duration, samples, rotation)
        return xr.Dataset(columns(moments, omega, times, tolerance), {"time": time(times, "the perturbation")})

    def motions(self, points: Mapping[str, np.ndarray], integration: "RigidBodyIntegration") -> int:
        """Return the number of points, or with `collapse` of distinct motions."""
        from kernels import survey

        return survey.motions(points) if integration.collapse else super().motions(points, integration)

    def method(self, definition: "RigidBodyDefinition") -> str:
        """Return the method of computation."""
        if definition.integration.propagator == "exact":
            return "exact steps of the closed-form rotation"
        return "direct integration of Euler's equations, certified by the closed form"


def _in_space(points, settings, columns, wanted) -> dict[str, np.ndarray]:
    """Return the columns of the body seen from space.

    The rate of the spin axis is that of psi and of the wobble together; its error is theirs, and what the part of a
    wobble that the run does not show may change. Both are missing where the motion does not encircle the axis.
    """
    from kernels import in_space, linear, survey

    of_space = in_space.survey(points, *settings)
    needed = {"frequency", "frequency_error", "regime"}
    wobble = columns if needed <= columns.keys() else survey.measured(points, *settings, wanted=needed)
    senses = {linear.STABLE_MAJOR: 1.0, linear.STABLE_MINOR: -1.0}
    sense = np.select([wobble["regime"] == flag for flag in senses], list(senses.values()), np.nan)
    moments, first = np.stack([points[name] for name in MOMENTS]), points["axis"] - 1
    Ia, Ib, Ic = (np.take_along_axis(moments, (first + k)[None] % 3, axis=0)[0] for k in range(3))
    b, c = (points["epsilon"] * f(points["phase"]) for f in (np.cos, np.sin))
    spin = np.abs(points["omega0"])
    psi_spread, spin_spread = in_space.wandering(Ia, Ib, Ic, b, c)
    sense[np.isnan(spin_spread)] = np.nan
    slow, off = wobble["frequency"], wobble["frequency_error"]
    of_space["space_rate"] = of_space.pop("psi_rate") + sense * slow
    error = np.abs(sense) * (psi_spread * spin + off + (slow + off) * spin_spread)
    of_space["space_rate_error"] = of_space.pop("psi_rate_error") + error
    return {name: values for name, values in of_space.items() if name in wanted}


def _compare_with_some_in_full(columns, points, settings, options):
    """Integrate a few points as themselves and hold what was collapsed against them.

    Every column is compared, bit for bit, with that of the same motion at the point's own spin rate; and Ω² with that
    of the body's own moments. Raise an ArithmeticError where a column is another, or Ω² by more than both errors and
    1e-12 of ω0² (times the square of the moments' ratio, by which the rounding of a needle's moments grows): the
    collapse is wrong, and no map is written.
    """
    from kernels import survey

    size = next(iter(points.values())).size
    some = np.random.default_rng(size).integers(0, size, min(size, COMPARED))
    sample = {name: values[some] for name, values in points.items()}
    both = {"wanted": {*options["wanted"], "omega_squared_error"}}
    at_their_spin = survey.measured(survey.as_motions(sample), *settings, rounded=True, **options | both)
    for name in columns.keys() & at_their_spin.keys():
        if not np.array_equal(at_their_spin[name], columns[name][some], equal_nan=True):
            raise ArithmeticError(f"{name}: collapsed, it does not go with the spin rate as it is integrated")
    if "omega_squared" not in columns:
        return
    wanted = {"omega_squared", "omega_squared_error"}
    full = survey.measured(sample, *settings, **options | {"nonlinear": False, "wanted": wanted})
    moments = np.stack([sample[name] for name in MOMENTS])
    with np.errstate(over="ignore"):  # an infinite ratio allows anything: nothing of such a body is a number
        allowed = 1e-12 * np.square(moments.max(axis=0) / moments.min(axis=0))
    spin = np.abs(sample["omega0"])
    ours, theirs = columns["omega_squared"][some], full["omega_squared"]
    same = (ours == theirs) | (np.isnan(ours) & np.isnan(theirs))  # infinite or missing in both
    apart = np.abs(np.subtract(ours, theirs, out=np.zeros_like(ours), where=~same)) / spin / spin
    errors = full["omega_squared_error"] + at_their_spin["omega_squared_error"]
    allowed += np.nan_to_num(errors) / spin / spin
    if not (apart <= allowed).all():
        raise ArithmeticError(f"collapsed and integrated points differ by {(apart / allowed).max():.2g}e-12")


SYSTEM = RigidBody()
