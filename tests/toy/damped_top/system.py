"""ω̇ = −ω/τ: the spin of a top in a viscous fluid, stepped by Runge and Kutta's rule of order four.

Linear theory is the whole theory here: the spin decays at the rate 1/τ (Landau and Lifshitz, Mechanics, section 25).
"""

import hashlib
import math
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field

from sweeps.schema.definition import Definition, Integration
from sweeps.schema.parameters import grid_model
from sweeps.schema.refusals import keys_of
from sweeps.schema.values import number
from sweeps.schema.variables import Layout, Parameter, Quantity, Role, Variable, coordinates_of, table
from sweeps.systems.motion import angular_velocity, sample_times, time_axis
from sweeps.systems.system import Dynamics, Reference

FATES = ("slows", "lasts")
ABOVE_ZERO = Annotated[float, number(lambda x: 1e-9 <= x <= 1e9, "a number from 1e-9 to 1e9")]
PARAMETERS = (
    Parameter("spin", Quantity("spin", "rad s-1", "1e-9 to 1e9", ABOVE_ZERO), "spin rate at the start", required=True),
    Parameter("tau", Quantity("time", "s", "1e-9 to 1e9", ABOVE_ZERO), "time constant of the drag", required=True),
)
ARGUMENTS = tuple(parameter.name for parameter in PARAMETERS)
VARIABLES = table(
    Variable("decay_theory", "s-1", "rate at which the spin decays, in theory"),
    Variable(
        "decay",
        "s-1",
        "rate at which the spin decays, measured",
        theory="decay_theory",
        error="decay_bound",
        role=Role.MEASUREMENT,
    ),
    Variable("decay_bound", "s-1", "how far the measured rate may be off"),
    Variable("fate_theory", None, "what becomes of the spin, in theory", "i1", FATES),
    Variable("fate", None, "what becomes of the spin", "i1", FATES, theory="fate_theory", role=Role.HEADLINE),
    Variable("stray", "1", "largest distance from the closed form, relative", role=Role.CERTIFICATE),
    Variable("quality", None, "whether the measurement can be trusted", "i1", ("ok", "coarse"), role=Role.STATUS),
)
LAYOUT = Layout(coordinates_of(PARAMETERS), VARIABLES, tuple(VARIABLES))
DampedTopGrid = grid_model("DampedTopGrid", PARAMETERS, __name__)


class DampedTopDefinition(Definition):
    """A sweep of damped tops."""

    grid: DampedTopGrid = Field(description="what is varied: a mapping with " + keys_of(DampedTopGrid))


def integrate(spin, tau, times):
    """ω at times that are evenly spaced, by one Runge-Kutta step between two of them; shape (times, points)."""
    h = times[1] / tau
    factor = 1 - h + h**2 / 2 - h**3 / 6 + h**4 / 24
    return spin * factor ** np.arange(times.size)[:, None]


class DampedTop(Dynamics):
    """The damped top."""

    name = "damped_top"
    model = DampedTopDefinition
    references = "Landau and Lifshitz, Mechanics, section 25"
    caption = "measured decay of a damped top's spin"

    def columns(self, points, integration: Integration):
        spin, tau = points["spin"], points["tau"]
        x = np.linspace(0.0, 1.0, integration.samples + 1)
        path, true = integrate(spin, 1.0, x), spin * np.exp(-x[:, None])
        rate = -np.log(path[-1] / path[0]) / tau
        return {
            "decay_theory": 1 / tau,
            "decay": rate,
            "decay_bound": np.full(spin.size, 10 * x[1] ** 4) / tau,
            "fate_theory": np.where(tau < 100.0, 0, 1),
            "fate": np.where(rate > 0.01, 0, 1),
            "stray": np.abs(path / true - 1).max(axis=0),
            "quality": np.zeros(spin.size),
        }

    def fingerprint(self):
        return hashlib.sha256(Path(__file__).read_bytes()).hexdigest()

    def method(self, definition):
        return "Runge and Kutta's steps"

    def reference(self):
        def by_scipy(point, integration):
            from scipy.integrate import solve_ivp

            solution = solve_ivp(lambda t, w: -w / point["tau"], (0, point["tau"]), [1.0], rtol=1e-12, atol=1e-14)
            return -math.log(solution.y[0, -1]) / point["tau"]

        def allowed(point, integration):
            return 10 / integration.samples**4 / point["tau"]

        ways = {"SciPy": by_scipy, "closed form": lambda point, integration: 1 / point["tau"]}
        return Reference("decay", ways, allowed)

    def motion(self, point, duration, samples, tolerance):
        import xarray as xr

        times = sample_times(duration or 3 * point["tau"], samples, point["tau"])
        values = point["spin"] * np.exp(-times / point["tau"])
        return xr.Dataset(
            {"omega": ("time", values, angular_velocity(3, "closed form"))}, {"time": time_axis(times, "the start")}
        )


SYSTEM = DampedTop()
