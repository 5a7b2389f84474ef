r"""A body's three axes: which spins last, how fast the others are lost, how long their flips and wobbles take.

Linear theory gives the e-folding time :math:`1/\sqrt{-\Omega^2}` and the Euler period :math:`2\pi/\sqrt{\Omega^2}` of a
small perturbation; the closed form gives the time between flips, 2K/p, and the largest tilt of a perturbation of given
size.

Source: Landau and Lifshitz, Mechanics, section 37; see `kernels.linear` and `kernels.exact`.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from kernels import exact, linear, twist
from sweeps.systems.rigid_body import motion

Axes, AXES = tuple[int, ...], (1, 2, 3)
REGIMES = ("stable_minor", "stable_major", "unstable", "marginal", "sphere")


@dataclass(frozen=True)
class Spin:
    """A spin about one principal axis, perturbed."""

    axis: int  #: 1, 2 or 3
    moment: float  #: moment about it, kg m2 (or the unit of the ratios)
    regime: str  #: one of `REGIMES`
    e_folding_time: float | None  #: s, in which a small perturbation grows by a factor e; None where it does not
    flip_period: float | None  #: s between two changes of sign of the spin; None where it keeps its sign
    euler_period: float | None  #: s in which a small perturbation turns about the axis; None where it does not
    max_tilt: float  #: degrees, largest angle of the angular velocity from the axis
    #: s in which the axis goes round the angular momentum, seen from space, at a small perturbation: the spin rate and
    #: that of the perturbation's turn in the body add about the greatest moment and subtract about the least; None
    #: where it does not.
    space_period: float | None = None
    space_turns: float | None = None  #: that period in turns of the spin
    #: largest share of half a turn that the body twists about its least axis while that comes round once, thrown on the
    #: separatrix; None about the other axes.
    twist: float | None = None


@np.errstate(all="ignore")  # plain kernels say what compiled ones leave unsaid: infinities are known here
def spins(
    moments: tuple[float, float, float], omega0: float, epsilon: float, phase: float, axes: Axes = AXES
) -> list[Spin]:
    """Return the perturbed spins of a body about some of its axes."""
    return [_spin(moments, axis, omega0, epsilon, phase) for axis in axes]


def _spin(moments, axis: int, omega0: float, epsilon: float, phase: float) -> Spin:
    regime = REGIMES[int(linear.regime(*moments, axis))]
    rate = math.sqrt(abs(float(linear.omega_squared(*moments, omega0, axis))))
    point = dict(zip(("I1", "I2", "I3"), moments, strict=True), axis=axis, omega0=omega0, epsilon=epsilon, phase=phase)
    top = exact.set_up(*moments, *motion.start(point)[1])
    tilt = math.degrees(exact.max_tilt(top, axis))
    slow = rate if regime == "stable_major" else -rate  # of the wobble, in space
    space = abs(abs(omega0) + slow) if regime.startswith("stable") and rate > 0 else 0.0
    return Spin(
        axis=axis,
        moment=moments[axis - 1],
        regime=regime,
        e_folding_time=1 / rate if regime == "unstable" and rate > 0 else None,
        flip_period=float(exact.flip_period(top)) if tilt > 90 else None,
        euler_period=2 * math.pi / rate if regime.startswith("stable") and rate > 0 else None,
        max_tilt=tilt,
        space_period=2 * math.pi / space if space else None,
        space_turns=abs(omega0) / space if space else None,
        twist=1 - twist.defect_theory(*map(float, sorted(moments))) / math.pi if regime == "unstable" else None,
    )


@np.errstate(all="ignore")
def twist_of(moments: tuple[float, float, float], axis: int, spun: Mapping[str, float]) -> float | None:
    """Return the twist about the handle per revolution of the handle about L, rad, in closed form.

    The body is spun about `axis` and perturbed as `spun` says. None about the axis of least moment, the handle, whose
    direction stays near L: nobody counts its revolutions; and where another moment is as small: no axis is the handle.
    """
    order = np.argsort(moments, kind="stable")
    if order[0] == axis - 1 or moments[order[0]] == moments[order[1]]:
        return None
    body = dict(zip(("I1", "I2", "I3"), moments, strict=True))
    values, omega = motion.start({**spun, **body, "axis": axis, "omega0": 1.0})
    along, second, third = (values / values.max() * omega)[order]
    angles = {"chi": math.atan2(third, second), "theta": math.atan2(math.hypot(second, third), along)}
    points = body | angles | {"omega0": 1.0}
    return abs(float(twist.survey(points, 1e-10, measured=False)["twist_exact"][0]))


def _in_space(spin: Spin, duration) -> str:
    if spin.space_period is None:
        return ""
    turns = f"{spin.space_turns:.4g} of a turn" if spin.space_turns < 1.5 else f"{spin.space_turns:.4g} turns"
    return f"; precession period about L {duration(spin.space_period)} (inertial frame; {turns})"


def in_words(spin: Spin, duration) -> str:
    """Return the outcome of a perturbed spin in one sentence or two; `duration` formats seconds."""
    if spin.regime == "unstable":
        text = f"unstable: perturbations grow e-fold in {duration(spin.e_folding_time)}"
        if spin.flip_period is None:
            return f"{text}, but the body never flips (separatrix)"
        twist = f"up to {180 * spin.twist:.3g}°" if spin.twist >= 1e-3 else "less than 0.2°"
        seen = f"; thrown at the best ε, it twists by {twist} per revolution of its handle"
        return f"{text}, and the body flips every {duration(spin.flip_period)}{seen}"
    if spin.euler_period is not None:
        end = "least" if spin.regime == "stable_minor" else "greatest"
        text = f"stable ({end} inertia): wobble period {duration(spin.euler_period)} (body frame)"
        if spin.flip_period is not None:
            return f"{text}; this perturbation is too large, and the body flips every {duration(spin.flip_period)}"
        return f"{text}, tilt at most {spin.max_tilt:.2g}°{_in_space(spin, duration)}"
    if spin.regime == "sphere":
        return "neutral (I1 = I2 = I3): perturbations neither grow nor oscillate"
    return "marginal: two moments are equal, and perturbations grow in proportion to time, not exponentially"
