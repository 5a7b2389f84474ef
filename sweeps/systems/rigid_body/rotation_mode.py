r"""Rotation of a free body from any angular velocity, in closed form: mode, periods and largest tilts.

With moments I_min ≤ I_mid ≤ I_max and the sign of

.. math:: N = L^2 - 2 T I_\mathrm{mid}
    = I_\mathrm{max}(I_\mathrm{max} - I_\mathrm{mid})\,\omega_\mathrm{max}^2
    - I_\mathrm{min}(I_\mathrm{mid} - I_\mathrm{min})\,\omega_\mathrm{min}^2

the polhode encircles the axis of greatest inertia (N > 0, short-axis mode) or of least inertia (N < 0, long-axis mode).
On the separatrix, N = 0, the body has no period.

Source: Landau and Lifshitz, Mechanics, section 37; Samarasinha and A'Hearn, Icarus 93 (1991) 194, for names and
conventions; see `kernels.events.tumbling`.
"""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from kernels.events import tumbling
from kernels.free import elliptic_constants, exact
from sweeps.schema.refusals import DefinitionError, display
from sweeps.schema.variables import parse_amount
from sweeps.systems.bodies import inertia
from sweeps.systems.motion import format_span
from sweeps.systems.rigid_body.motion import FRAMES, frame_of
from sweeps.systems.rigid_body.system import SpunBody

MODES = {
    "short_axis": "short-axis mode",
    "long_axis": "long-axis mode",
    "separatrix": "on the separatrix",
    "principal": "steady rotation",
}


@dataclass(frozen=True)
class Rotation:
    """A free rotation from a given angular velocity."""

    omega: tuple[float, float, float]  #: angular velocity at time 0, rad s-1, in the axes of `frame`
    frame: str  #: "body" for the principal axes, "tensor" or "mesh"
    mode: str  #: one of `MODES`
    axis: (
        int  #: principal axis that the polhode encircles; of a steady rotation its axis; of the separatrix, the middle
    )
    max_tilt: float | None  #: rad, largest angle between the angular velocity and this axis; None on the separatrix
    max_nutation: float | None  #: rad, largest angle between the angular momentum and this axis; None likewise
    period_psi: float | None = None  #: s, period of the angular velocity in the body; None if it has none
    period_phi_long_axis: float | None = None  #: s, mean precession period about L of the axis of least inertia
    period_phi_encircled: float | None = None  #: s, mean precession period about L of `axis`

    @property
    def facts(self) -> dict[str, Any]:
        """All values by name."""
        return asdict(self)


def parse_omega(value: Any) -> tuple[float, float, float]:
    """Return three angular velocities, rad s-1, not all zero, from numbers or texts with a unit."""
    parts = tuple(parse_amount("body: omega", part, "rad s-1") for part in (value if np.shape(value) == (3,) else ()))
    if not any(parts):
        raise DefinitionError(f"body: omega: {display(value)}; allowed: three angular velocities (rad s-1), not all 0")
    return parts


@np.errstate(all="ignore")  # plain kernels warn of infinities
def predict_rotation(body: SpunBody, omega: Sequence[float]) -> Rotation:
    """Return the rotation of a body from an angular velocity in the axes of its tensor or mesh, or its principal axes.

    Components across a principal axis below the rounding of the body's axes, relative to the largest component, count
    as zero, and so does N relative to its greater term.
    """
    rounding = inertia.MESH_ROUNDING if body.solid is not None else inertia.TENSOR_ROUNDING
    w = frame_of(body).principal_axes @ np.array(omega)
    speed = float(np.abs(w).max())
    w = np.where(np.abs(w) > rounding * speed, w, 0.0) / speed
    moments = np.array(body.moments) / max(body.moments)
    top = exact.set_up(*moments.tolist(), *w.tolist())
    omega_fields = {"omega": tuple(map(float, omega)), "frame": body.frame}
    if elliptic_constants.is_stationary(top.c, top.w):
        return Rotation(
            **omega_fields, mode="principal", axis=int(np.abs(w).argmax()) + 1, max_tilt=0.0, max_nutation=0.0
        )
    s, c, d = (axis - 1 for axis in top.axes)
    least, greatest = (c, d) if moments[c] <= moments[d] else (d, c)
    terms = [moments[k] * abs(moments[k] - moments[s]) * w[k] ** 2 for k in (greatest, least)]
    if abs(terms[0] - terms[1]) <= rounding * max(terms):
        return Rotation(**omega_fields, mode="separatrix", axis=s + 1, max_tilt=None, max_nutation=None)
    period, rate, sigma = (float(value) for value in tumbling.periods(*moments.tolist(), *w.tolist()))
    encircled_rate = abs(rate + sigma * 2 * math.pi / period)
    long_axis_rate = abs(rate) if d == greatest else encircled_rate
    return Rotation(
        **omega_fields,
        mode="short_axis" if d == greatest else "long_axis",
        axis=d + 1,
        max_tilt=_max_angle(top, np.ones(3)),
        max_nutation=_max_angle(top, moments),
        period_psi=period / speed,
        period_phi_long_axis=2 * math.pi / (long_axis_rate * speed),
        period_phi_encircled=2 * math.pi / (encircled_rate * speed),
    )


def _max_angle(top, weights: np.ndarray) -> float:
    """Return the largest angle, rad, of the vector (weight_i ω_i) to the encircled axis: at sn = 0 or at cn = 0."""
    across, over, along = (weights[axis - 1] * abs(A) for axis, A in zip(top.axes, exact.amplitudes(top), strict=True))
    return max(math.atan2(over, along), math.atan2(across, math.sqrt(top.m1) * along))


def describe_rotation(rotation: Rotation) -> tuple[str, str]:
    """Return the angular velocity with its axes, and the outcome, in words."""
    omega = ", ".join(f"{value:.4g}" for value in rotation.omega)
    title = f"ω = ({omega}) rad s⁻¹, {FRAMES[rotation.frame]}"
    words, axis = MODES[rotation.mode], f"axis {rotation.axis}"
    if rotation.mode == "principal":
        return title, f"{words} about principal {axis}; its stability is that of a spin about {axis}"
    if rotation.mode == "separatrix":
        return title, f"{words}: ω tends to principal {axis} and comes back never, no period"
    tilts = (
        f"ω at most {_degrees(rotation.max_tilt)} and L at most {_degrees(rotation.max_nutation)} from principal {axis}"
    )
    psi, phi, encircled = (
        format_span(value)
        for value in (rotation.period_psi, rotation.period_phi_long_axis, rotation.period_phi_encircled)
    )
    of_axis = f"P_phi {phi} (mean precession about L of the axis of least inertia"
    of_axis += f"; {encircled} of {axis})" if rotation.mode == "short_axis" else ")"
    return title, f"{words}: {tilts}; P_psi {psi} (body frame), {of_axis}"


def _degrees(angle: float) -> str:
    return f"{math.degrees(angle):.3g}°"
