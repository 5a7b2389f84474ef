"""A map of observed periods: its variables, its coordinates, and the parameters that they vary."""

from typing import Annotated

from kernels import statuses
from sweeps.schema.values import number
from sweeps.schema.variables import Parameter, Quantity
from sweeps.systems.bodies import variables as bodies
from sweeps.systems.bodies.variables import MOMENTS
from sweeps.systems.shared_variables import rows, status

ARGUMENTS = (*MOMENTS, "P_psi", "P_phi", "sigma_psi", "sigma_phi")
EXCLUDED = 3.0  # standard errors beyond which a mode counts as excluded

WORDS = {"sam": "short-axis mode", "lam": "long-axis mode"}


def _mode(mode: str) -> str:
    words = WORDS[mode]
    return f"""
    exclusion_{mode}      1  standard errors by which the observed ratio of periods is below the minimum of the {words}
        comment: 0 where not below; infinite where the body has no such mode, or the periods have no errors
    energy_{mode}         1  energy that gives both periods in the {words}, 2T I3/L^2
        comment: missing where no motion of that mode has the observed ratio of periods
    energy_{mode}_stderr  1  standard error of energy_{mode}, from those of the periods
        comment: the larger deviation of the energies at one standard error of the ratio either way; of one alone where
        the other ratio is below the minimum of the mode
    parameter_{mode}      1  parameter m of the elliptic functions of that motion in the {words}
        comment: 0 in the limit of small wobbles and for symmetric bodies, 1 on the separatrix
    momentum_rate_{mode}  rad s-1  L/I3 that gives P_psi in the {words}
        comment: missing also where the separatrix is so near that the energy, a double, does not fix it to 1e-6
    """


VARIABLES = rows(
    f"""
    modes  -  modes that allow both observed periods [headline]
        flags: 0 none sam lam both
        comment: a mode is listed unless it is excluded by more than {EXCLUDED:g} standard errors; sam: short-axis mode;
        lam: long-axis mode
    """,
    status(
        statuses.NOT_CONVERGED,
        "whether the closed form reproduces the observed ratio from each energy",
        "not_converged: so near the separatrix that the energy, a double, fixes the ratio only to 1e-6 or worse",
    ),
    _mode("sam"),
    _mode("lam"),
    bodies.TRIANGLE_MARGIN,
)

SHORTEST, LONGEST = 1e-150, 1e150  # of periods, s
_PERIOD, _ERROR = f"{SHORTEST:g} to {LONGEST:g}", f"0 to {LONGEST:g}"
PERIOD = Quantity(
    "period", "s", _PERIOD, Annotated[float, number(lambda x: SHORTEST <= x <= LONGEST, f"{_PERIOD}, in s")]
)
ERROR = Quantity("error", "s", _ERROR, Annotated[float, number(lambda x: 0.0 <= x <= LONGEST, f"{_ERROR}, in s")])

PARAMETERS = (
    *bodies.PRINCIPAL,
    Parameter("P_psi", PERIOD, "observed period of the angular velocity in the body", required=True),
    Parameter(
        "P_phi",
        PERIOD,
        "observed mean precession period of the axis of least inertia about L (long-axis convention)",
        required=True,
    ),
    Parameter("sigma_psi", ERROR, "standard error of P_psi", 0.0),
    Parameter("sigma_phi", ERROR, "standard error of P_phi", 0.0),
)

LAYOUT = bodies.layout(PARAMETERS, VARIABLES, VARIABLES)
