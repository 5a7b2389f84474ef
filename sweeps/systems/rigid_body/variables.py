"""What a map of rigid bodies holds: its variables, its coordinates, and the parameters that they vary."""

from typing import NamedTuple

from kernels import statuses
from sweeps.schema.variables import Parameter, Variable
from sweeps.systems import rates
from sweeps.systems.bodies import variables as bodies
from sweeps.systems.bodies.variables import MOMENTS
from sweeps.systems.shared_variables import STEPS, regime, rows, status

SHAREABLE = ("omega0", "epsilon", "phase")  # what a body may give, and the grid gives where it does not
ARGUMENTS = ("axis", *MOMENTS, *SHAREABLE)

STATUSES = statuses.STATUSES[: statuses.NON_FINITE + 1]


class Verdict(NamedTuple):
    """What is said of a spin about a principal axis, by the command, `show`, figures and the page."""

    words: str  #: the regime
    more: str = ""  #: what a reader of the words alone would miss


VERDICTS = {  # regime → its verdict
    "stable_minor": Verdict(
        "stable, least inertia", "with any loss of energy it ends in a flat spin (major-axis rule)"
    ),
    "stable_major": Verdict("stable, greatest inertia"),
    "unstable": Verdict("unstable"),
    "marginal": Verdict(
        "marginal", "two moments are equal, and the axis drifts away in proportion to time, not exponentially"
    ),
    "sphere": Verdict("sphere", "all moments are equal, and perturbations neither grow nor oscillate"),
}
REGIMES = ("undetermined", *VERDICTS)

VARIABLES = rates.columns(
    reduced="the variation of the spin is removed, from the samples",
    by="correction",
    size="the transverse size",
    window="omega0",
    sparse=True,
) | rows(
    """
    e_folds       1  f4  e-folds of growth within the window of the log slope
    euler_period  s      wobble period in the body frame, measured; missing where not stable
    """,
    *regime(REGIMES, is_determined=True),
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
    status(statuses.NON_FINITE),
    bodies.TRIANGLE_MARGIN,
    """
    energy_drift        1  f4  largest relative change of twice the kinetic energy [check]
    momentum_drift      1  f4  largest relative change of the squared angular momentum [check]
    perturbation_drift  1  f4  largest change of the invariant of the perturbation, relative to the sum of its absolute
        terms [check]
        comment: Ib (Ib - Ia) wb^2 + Ic (Ic - Ia) wc^2: sensitive to errors that energy and momentum hide
    """,
)

TERMS = rows(
    """
    omega_squared_error_scatter      s-2  term of omega_squared_error: scatter of the corrected samples
    omega_squared_error_integration  s-2  term of omega_squared_error: integration error
    omega_squared_error_amplitude    s-2  term of omega_squared_error: bias of the finite amplitude
    omega_squared_error_rounding     s-2  term of omega_squared_error: rounding
    """
)

CERTIFICATE = rows(
    """
    propagation_error  1  f4  maximum integration error, relative to the running maximum of the perturbation
        [certificate]
        comment: certificate: distance from the exact solution at the samples used, by an exact step that shares no code
        with the direct integrator
    """
)

FLIPS = rows(
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

IN_SPACE = rows(
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

LAYOUT = bodies.layout(PARAMETERS, VARIABLES | CERTIFICATE | FLIPS | IN_SPACE, VARIABLES, spun=True)
