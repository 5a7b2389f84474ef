"""What a map of rigid bodies holds: its variables, its coordinates, and the parameters that they vary."""

from collections.abc import Mapping

from kernels import statuses
from sweeps.schema import quantities
from sweeps.schema.layout import Layout
from sweeps.schema.quantities import Parameter, Quantity
from sweeps.schema.values import MIN_SPIN_RATE, Axis, Epsilon, Moment, Phase, spin_rate
from sweeps.schema.variables import Role, Variable, table
from sweeps.systems import shape_coordinates
from sweeps.systems.rates import variables as rates

MOMENTS = ("I1", "I2", "I3")
SHAREABLE = ("omega0", "epsilon", "phase")  # what a body may give, and the grid gives where it does not
ARGUMENTS = ("axis", *MOMENTS, *SHAREABLE)

MOMENTS_ARE_RATIOS = Variable(
    "moments_are_ratios",
    None,
    "whether the moments are known as ratios only",
    "i1",
    ("kilogram_square_metres", "ratios"),
    "where 1, I1, I2 and I3 of the body are in a unit of their own",
)

REGIMES = ("undetermined", "stable_minor", "stable_major", "unstable", "marginal", "sphere")
ENCIRCLED = ("none", "least_axis", "greatest_axis", "separatrix")
SHAPES = ("asymmetric", "oblate", "prolate", "sphere")
STATUSES = statuses.STATUSES[: statuses.NON_FINITE + 1]

VARIABLES = rates.columns(
    reduced="the spin's wandering taken off, from the samples",
    by="reduction",
    size="the transverse size",
    window="omega0",
    sparse=True,
) | table(
    Variable("e_folds", "1", "e-folds of growth inside the window of the log slope", "f4"),
    Variable("euler_period", "s", "period of the nudge's turn about the spin axis, measured; missing where not stable"),
    Variable("regime_theory", None, "regime, linear theory", "i1", REGIMES[1:]),
    Variable(
        "regime", None, "regime, measured", "i1", REGIMES, first_flag=-1, theory="regime_theory", role=Role.HEADLINE
    ),
    Variable("shape", None, "kind of body by its moments", "i1", SHAPES),
    Variable("growing_fraction", "1", "share of the start that lies on the growing mode", "f4"),
    Variable(
        "encircles",
        None,
        "axis of the body that the angular momentum encircles at the motion's own amplitude, exact",
        "i1",
        ENCIRCLED,
        comment="by the sign of L^2 - 2T Imid of the start: that axis keeps its component's sign; separatrix where "
        "rounding hides the sign, none where the spin is steady (a sphere, or in the plane of two equal moments)",
    ),
    Variable("samples_used", "1", "number of samples inside the measurement window", "i4"),
    Variable("window_end", "s", "time of the last sample inside the measurement window", sparse=True),
    Variable("steps_per_sample", "1", "integration steps between two samples", "i4"),
    Variable("status", None, "whether the measurement can be trusted", "i1", STATUSES, role=Role.STATUS),
    Variable(
        "triangle_margin",
        "1",
        "least of (Ib + Ic - Ia)/(I1 + I2 + I3) over the axes; negative where no body can exist",
        "f4",
        role=Role.EXISTENCE,
    ),
    Variable("energy_drift", "1", "largest relative change of twice the kinetic energy", "f4", role=Role.CHECK),
    Variable("momentum_drift", "1", "largest relative change of the squared angular momentum", "f4", role=Role.CHECK),
    Variable(
        "perturbation_drift",
        "1",
        "largest change of the perturbation's own invariant, relative to its absolute terms",
        "f4",
        comment="Ib (Ib - Ia) wb^2 + Ic (Ic - Ia) wc^2, which sees errors that energy and momentum do not",
        role=Role.CHECK,
    ),
)

TERMS = table(
    Variable("omega_squared_error_scatter", "s-2", "term of omega_squared_error: scatter of the reduced samples"),
    Variable("omega_squared_error_integration", "s-2", "term of omega_squared_error: error of the integration"),
    Variable("omega_squared_error_amplitude", "s-2", "term of omega_squared_error: bias of the finite amplitude"),
    Variable("omega_squared_error_rounding", "s-2", "term of omega_squared_error: rounding"),
)

CERTIFICATE = table(
    Variable(
        "propagation_error",
        "1",
        "largest distance of the direct solution from the exact one, relative to the largest transverse size so far",
        "f4",
        comment="the certificate: over the samples used, across the spin axis, by an exact step that shares no code "
        "with the direct integrator",
        role=Role.CERTIFICATE,
    )
)

FLIPS = table(
    Variable(
        "flip_period",
        "s",
        "time between two changes of sign of the spin, measured; missing where it keeps its sign",
        comment="from the start forward to the first change and backward to the last one",
        exact="flip_period_exact",
    ),
    Variable("flip_period_exact", "s", "time between two changes of sign of the spin, closed form: 2 K/p"),
    Variable(
        "max_tilt",
        "rad",
        "largest angle of the angular velocity from the end of the axis it starts near, measured",
        exact="max_tilt_exact",
    ),
    Variable("max_tilt_exact", "rad", "largest angle of the angular velocity from that end, closed form"),
    Variable(
        "frequency_exact",
        "rad s-1",
        "angular frequency of the motion at its own amplitude, closed form: pi p/(2 K)",
        comment="tends to frequency_theory about a stable axis as the nudge gets small",
    ),
)

IN_SPACE = table(
    Variable(
        "attitude_error",
        "rad",
        "largest angle between the direct integration's attitude and the exact one",
        "f4",
        comment="the attitude's certificate: over the samples used, by an exact step that shares no code with the "
        "direct integrator",
        role=Role.CERTIFICATE,
    ),
    Variable(
        "space_rate",
        "rad s-1",
        "mean rate at which the spin axis goes round the angular momentum in space, measured; missing where not stable",
        exact="space_rate_exact",
        error="space_rate_error",
    ),
    Variable("space_rate_error", "rad s-1", "error of the measured rate of the spin axis in space"),
    Variable(
        "space_rate_exact",
        "rad s-1",
        "mean rate at which the spin axis goes round the angular momentum in space, closed form; missing where the "
        "polhode does not encircle it",
    ),
    Variable(
        "geometric_phase_residual",
        "rad",
        "distance of the turn about the angular momentum in one polhode period from what its solid angle makes of it",
        "f4",
        comment="Montgomery's theorem: 2T P/L less the signed solid angle, by the trapezoidal rule",
        role=Role.CHECK,
    ),
)

SpinRate = spin_rate("omega0")
MOMENT = Quantity("moment", "kg m2", "finite, > 0", Moment)
SPIN = Quantity("spin rate", "rad s-1", "1e-150 ≤ |omega0| ≤ 1e150", SpinRate, least=MIN_SPIN_RATE)
SIZE = Quantity("size", "1", "0 < epsilon < 1", Epsilon)
DIRECTION = Quantity("direction", "rad", "finite", Phase)

PARAMETERS = (
    *(
        Parameter(
            f"I{i}",
            MOMENT,
            f"principal moment of inertia about axis {i}",
            description=f"moment of inertia about axis {i}, kg m2, > 0",
        )
        for i in (1, 2, 3)
    ),
    Parameter(
        "omega0",
        SPIN,
        "spin rate",
        description="spin rate, rad s-1, 1e-150 ≤ |omega0| ≤ 1e150, negative spins the other way",
    ),
    Parameter(
        "epsilon",
        SIZE,
        "size of the nudge relative to the spin rate",
        1e-6,
        "size of the nudge relative to omega0, 0 < epsilon < 1",
    ),
    Parameter(
        "phase",
        DIRECTION,
        "direction of the nudge in the (b, c) plane",
        0.6,
        "direction of the nudge in the (b, c) plane, rad, from b towards c",
    ),
)

COORDINATES = (
    table(Variable("axis", "1", "spin axis (1, 2 or 3)", "i1"), Variable("body", None, "body", "str"))
    | shape_coordinates.COORDINATES
    | quantities.coordinates(PARAMETERS)
    | table(MOMENTS_ARE_RATIOS)
)

LAYOUT = Layout(
    {"body": COORDINATES["body"], **COORDINATES},  # in storage order
    VARIABLES | CERTIFICATE | FLIPS | IN_SPACE,
    tuple(VARIABLES),
    {"axis": Axis} | shape_coordinates.VALUES | {parameter.name: parameter.quantity.item for parameter in PARAMETERS},
    along="body",
    beside=("moments_are_ratios",),
    spare=tuple(shape_coordinates.COORDINATES),
    over=shape_coordinates.OVER,
)


def layout_of_bodies(parameters: tuple[Parameter, ...], variables: Mapping[str, Variable], needed: tuple) -> Layout:
    """Return the description of maps whose points are bodies, from a grid of moments or shapes or from a list.

    Args:
        parameters: what the definition varies.
        variables: as of `Layout`.
        needed: likewise.
    """
    coordinates = table(Variable("body", None, "body", "str")) | shape_coordinates.COORDINATES
    return Layout(
        coordinates | quantities.coordinates(parameters) | table(MOMENTS_ARE_RATIOS),
        variables,
        needed,
        shape_coordinates.VALUES | {parameter.name: parameter.quantity.item for parameter in parameters},
        along="body",
        beside=("moments_are_ratios",),
        spare=tuple(shape_coordinates.COORDINATES),
        over=shape_coordinates.OVER,
    )
