r"""Outcome of the spins of one body, for `polhode body`: the body, and its perturbed spin about each axis.

Linear theory gives the e-folding time :math:`1/\sqrt{-\Omega^2}` and the Euler period :math:`2\pi/\sqrt{\Omega^2}` of a
small perturbation; the closed form gives, for a perturbation of given size, the time between flips, 2K/p, the wobble
period, 4K/p, the mean precession about L, and the largest tilt.

Source: Landau and Lifshitz, Mechanics, section 37; see `kernels.free.linear` and `kernels.free.exact`.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from kernels.events import tumbling, twist
from kernels.free import exact, linear
from sweeps.schema.definition import Definition
from sweeps.schema.refusals import DefinitionError, display, match_name
from sweeps.systems.bodies import body_files, molecules, shapes
from sweeps.systems.bodies.body import body_entry
from sweeps.systems.bodies.inertia import axis_lines
from sweeps.systems.bodies.variables import MOMENTS, VERDICTS
from sweeps.systems.motion import DAY, format_span
from sweeps.systems.rigid_body import presets
from sweeps.systems.rigid_body.system import NearAxisDefinition, SpunBody, initial_state

DEFAULTS = {"omega0": 1.0, "epsilon": 1e-6, "phase": 0.6}  # rad s-1, relative, rad
Axes = tuple[int, ...]
Moments = tuple[float, float, float]
AXES = (1, 2, 3)
PREDICTED_REGIMES = tuple(VERDICTS)  # ordered by the codes of `kernels.free.linear.regime`, from 0


@dataclass(frozen=True)
class Spin:
    """A perturbed spin about a principal axis."""

    axis: int  #: 1, 2 or 3
    moment: float  #: moment about the axis, kg m2 (or the unit of the ratios)
    regime: str  #: one of `REGIMES`
    e_folding_time: float | None  #: s, time in which a small perturbation grows by a factor e; None if it does not grow
    flip_period: float | None  #: s, time between two changes of sign of the spin; None if it keeps its sign
    euler_period: float | None  #: s, period of a small perturbation in the body; None if it does not oscillate
    max_tilt: float  #: degrees, largest angle of the angular velocity from the axis
    #: s, precession period of the axis about L in the inertial frame, for a small perturbation: the spin rate plus
    #: (greatest moment) or minus (least moment) the frequency of the perturbation in the body; None if unstable.
    space_period: float | None = None
    #: s, the Euler period and the space period at the given perturbation; None if the body flips.
    wobble_period: float | None = None
    precession_period: float | None = None
    precession_turns: float | None = None  #: precession period in turns of the spin
    #: largest twist about the axis of least inertia per revolution of this axis about L, thrown on the separatrix, as a
    #: fraction of a half turn; None for stable axes.
    twist: float | None = None


@np.errstate(all="ignore")  # plain kernels warn of infinities, which are treated here
def predict_spins(moments: Moments, omega0: float, epsilon: float, phase: float, axes: Axes = AXES) -> list[Spin]:
    """Return the perturbed spins of a body about some of its axes.

    Args:
        moments: principal moments, kg m2 (or ratios).
        omega0: spin rate, rad s-1.
        epsilon: size of the perturbation, relative.
        phase: direction of the perturbation, rad.
        axes: spin axes.
    """
    return [_predict_spin(moments, axis, omega0, epsilon, phase) for axis in axes]


def _predict_spin(moments, axis: int, omega0: float, epsilon: float, phase: float) -> Spin:
    """Return the outcome of a spin in closed form: regime, periods, largest tilt and twist; `moments` in kg m2."""
    I1, I2, I3 = moments
    regime = PREDICTED_REGIMES[int(linear.regime(I1, I2, I3, axis))]
    rate = math.sqrt(abs(float(linear.omega_squared(I1, I2, I3, omega0, axis))))
    point = dict(zip(MOMENTS, moments, strict=True), axis=axis, omega0=omega0, epsilon=epsilon, phase=phase)
    top = exact.set_up(*moments, *initial_state(point)[1])
    tilt = math.degrees(exact.max_tilt(top, axis))
    wobble_rate = rate if regime == "stable_major" else -rate  # contribution of the wobble to the precession, rad s-1
    space_rate = abs(abs(omega0) + wobble_rate) if regime.startswith("stable") and rate > 0 else 0.0
    euler = 2 * math.pi / rate if regime.startswith("stable") and rate > 0 else None
    wobble, precession = (
        (None, None) if tilt > 90 or not euler else _exact_periods(moments, axis, omega0, epsilon, phase)
    )
    return Spin(
        axis=axis,
        moment=moments[axis - 1],
        regime=regime,
        e_folding_time=1 / rate if regime == "unstable" and rate > 0 else None,
        flip_period=float(exact.flip_period(top)) if tilt > 90 else None,
        euler_period=euler,
        max_tilt=tilt,
        space_period=2 * math.pi / space_rate if space_rate else None,
        wobble_period=wobble,
        precession_period=precession,
        precession_turns=precession and abs(omega0) * precession / (2 * math.pi),
        twist=1 - twist.defect_theory(*map(float, sorted(moments))) / math.pi if regime == "unstable" else None,
    )


def _exact_periods(moments, axis: int, omega0: float, epsilon: float, phase: float) -> tuple[float, float | None]:
    """Return the wobble period of a motion that does not flip, and the mean period of its axis about L, s."""
    ratios = np.roll(moments, 1 - axis) / max(moments)  # from the axis, in cyclic order
    across = epsilon * math.cos(phase), epsilon * math.sin(phase)
    wobble, rate, sigma = tumbling.periods(*map(float, ratios), math.copysign(1.0, omega0), *across)
    rate = abs(rate + sigma * 2 * math.pi / wobble) * abs(omega0)
    return wobble / abs(omega0), 2 * math.pi / rate if rate > 0 else None


@np.errstate(all="ignore")
def twist_of(moments: Moments, axis: int, spun: Mapping[str, float]) -> float | None:
    """Return the twist about the handle per revolution of the handle about L, rad, in closed form.

    The result is None for a spin about the handle, the axis of least moment, as its direction then stays near L, and
    for two equal least moments, as no axis is the handle.

    Args:
        moments: principal moments, kg m2 (or ratios).
        axis: spin axis.
        spun: omega0, epsilon and phase.
    """
    order = np.argsort(moments, kind="stable")
    if order[0] == axis - 1 or moments[order[0]] == moments[order[1]]:
        return None
    body = dict(zip(MOMENTS, moments, strict=True))
    values, omega = initial_state({**spun, **body, "axis": axis, "omega0": 1.0})
    along, second, third = (values / values.max() * omega)[order]
    angles = {"chi": math.atan2(third, second), "theta": math.atan2(math.hypot(second, third), along)}
    points = body | angles | {"omega0": 1.0}
    return abs(float(twist.survey(points, 1e-10, measured=False)["twist_exact"][0]))


def describe_spin(spin: Spin) -> str:
    """Return the outcome of a perturbed spin in words."""
    if spin.regime == "unstable":
        text = f"unstable: perturbations grow e-fold in {format_span(spin.e_folding_time)}"
        if spin.flip_period is None:
            return f"{text}, but the body never flips (separatrix)"
        twist = f"up to {180 * spin.twist:.3g}°" if spin.twist >= 1e-3 else "less than 0.2°"
        throw = f"; thrown at the best ε, it twists by {twist} per revolution of its handle"
        return f"{text}, and the body flips every {format_span(spin.flip_period)}{throw}"
    verdict = VERDICTS[spin.regime]
    remark = f"; {verdict.more}" if verdict.more else ""
    if spin.euler_period is None:
        flips = f"; the body flips every {format_span(spin.flip_period)}" if spin.flip_period else ""
        return f"{verdict.words}: {verdict.more}{flips}"
    if spin.flip_period is not None:
        wobble = f"{verdict.words}: wobble period {format_span(spin.euler_period)} as ε → 0 (body frame)"
        flips = format_span(spin.flip_period)
        return f"{wobble}; this perturbation is too large, and the body flips every {flips}{remark}"
    wobble = f"wobble period {_format_period(spin.wobble_period, spin.euler_period, 'body frame')}"
    text = f"{verdict.words}: {wobble}, tilt at most {spin.max_tilt:.2g}°"
    if spin.precession_period is not None:
        turns = f"{spin.precession_turns:.4g} turns"
        turns = turns if spin.precession_turns >= 1.5 else turns.replace("turns", "of a turn")
        frame = f"inertial frame; {turns}"
        text += f"; precession period about L {_format_period(spin.precession_period, spin.space_period, frame)}"
    return text + remark


def _format_period(period: float, limit: float | None, frame: str) -> str:
    """Return a period in words, with its limit for small perturbations if that differs."""
    text, limit_text = format_span(period), format_span(limit) if limit else ""
    return f"{text} ({frame})" if limit_text in ("", text) else f"{text} ({frame}; {limit_text} as ε → 0)"


# -- the answer


def bodies_by_name(definition: Definition, path: object) -> dict[str, SpunBody]:
    """Return name → body of a definition, and the presets if its path (for messages) is the shipped `bodies`."""
    if not isinstance(definition, NearAxisDefinition) or not definition.bodies:
        raise DefinitionError(f"{path}: bodies: is missing; allowed: a definition of rigid bodies with bodies")
    bodies = {body.name: body for body in definition.bodies}
    if path == "bodies":
        for preset in presets.PRESETS:
            entry = {name: preset[name] for name in ("name", "omega0", "axis")}
            if not any(preset["name"].lower() in listed.lower() for listed in bodies):
                moments = dict(zip(MOMENTS, preset["moments"], strict=True))
                bodies[preset["name"]] = SpunBody.model_validate(entry | moments)
    return bodies


def load_body(values: Mapping, load: Callable[[Mapping], Definition]) -> Any:
    """Return the definition of one body; refusals name the body's key."""
    try:
        return load(values)
    except DefinitionError as refused:
        text = str(refused).replace("definition: bodies[0].", "body: ")
        raise DefinitionError(text.replace("definition: ", "body: ")) from None


def check_body(values: Mapping, spin: Mapping[str, object], load: Callable[[Mapping], Definition]) -> SpunBody:
    """Return a body checked by the rules of a definition.

    Args:
        values: the body's entry of a definition.
        spin: omega0, epsilon and phase, each None if not requested.
        load: makes a definition of a mapping.
    """
    rates = {name: spin[name] for name in DEFAULTS if spin.get(name) is not None}
    grid = {} if "omega0" in rates else {"omega0": 1.0}
    body = load_body({"bodies": [{**values, **rates}], "grid": grid}, load).bodies[0]
    shapes.refuse_impossible("body: moments", body.moments)
    return body


def spin_setting(requested: SpunBody, body: SpunBody) -> dict[str, float]:
    """Return spin rate and perturbation: as requested, else the body's own, else `DEFAULTS`."""
    candidates = {name: (getattr(requested, name), getattr(body, name), default) for name, default in DEFAULTS.items()}
    return {name: next(value for value in values if value is not None) for name, values in candidates.items()}


def body_of(body: object, source: object, spin: Mapping[str, object], load: Callable) -> tuple[SpunBody, dict]:
    """Return a body, and its spin rate and perturbation: as given, else the body's, else the defaults.

    Args:
        body: a name, or part of a name, of a body in the definition `source`; a file of one body; or a body's mapping
            as in a definition, three moments, or a tensor of inertia.
        source: a path, or the name of a shipped definition.
        spin: omega0, epsilon and phase, each None if not given.
        load: makes a definition of a mapping, a path or a name.
    """
    file_body = body_files.only_body(body)
    body, frame = file_body.entry, file_body.frame
    if isinstance(body, str):
        bodies = bodies_by_name(load(source), source)
        chosen_body = bodies[match_name(body, list(bodies), "body", DefinitionError)]
        requested = check_body({"name": chosen_body.name, "ratios": dict.fromkeys(MOMENTS, 1.0)}, spin, load)
    else:
        chosen_body = requested = check_body({"name": "your body"} | body_entry(body), spin, load)
        chosen_body.set_frame(frame)
    return chosen_body, spin_setting(requested, chosen_body)


def entry_of(body: SpunBody) -> dict:
    """Return the entry of a definition for a named body."""
    entry = {"name": body.name}
    if body.tensor is not None:
        return entry | {"tensor": [list(row) for row in body.tensor]}
    moments = dict(zip(MOMENTS, body.moments, strict=True))
    return entry | ({"ratios": moments} if body.ratios is not None else moments)


def predict_body(
    body: SpunBody, spun: Mapping[str, float], axes: Axes = AXES, with_throw: bool = False
) -> tuple[dict, list[str], list[tuple[str, str]], list[str]]:
    """Return the answer for machines and for people.

    Args:
        body: the body.
        spun: omega0, epsilon and phase.
        axes: spin axes.
        with_throw: True to add the twist of the throw.

    Returns:
        Facts in SI units, angles in rad; lines on the body; (axis, outcome) of each spin; lines on observations.
    """
    facts: dict[str, Any] = {"name": body.name, "moments": body.moments}
    facts |= {"moments_are_ratios": body.ratios is not None, **spun}
    if defect := molecules.inertial_defect(body.moments):
        facts["inertial_defect"] = defect
    if body.principal is not None:
        facts |= {
            "frame": body.frame,
            "principal_axes": body.principal.axes,
            **body.principal.rotation,
            "notes": body.principal.notes,
        }
    if body.solid is not None:
        facts |= {name: getattr(body.solid, name) for name in ("mass", "volume", "centre", "extents", "faces")}
    facts["axes"], rows = [], []
    rotation, size = format_span(2 * math.pi / abs(spun["omega0"])), f"{spun['epsilon']:.2g}"
    rate = f"spin {spun['omega0']:.6g} rad s⁻¹ (one turn in {rotation})"
    lines = [*_body_lines(body), f"{rate}, perturbed by ε = {size} (transverse ω over ω₀)"]
    about_axes = predict_spins(body.moments, **spun, axes=axes)
    if any(spin.flip_period is not None for spin in about_axes):
        lines.append(f"flip times are for ε = {size}; larger perturbations flip sooner")
    for spin in about_axes:
        text, twist = describe_spin(spin), twist_of(body.moments, spin.axis, spun) if with_throw else None
        facts["axes"].append(asdict(spin) | {"max_tilt": math.radians(spin.max_tilt)})
        if with_throw:
            facts["axes"][-1]["twist_thrown"] = twist
        if twist is not None:
            angle = f"{math.degrees(twist):.3g}°"
            text += f"; thrown with ε = {spun['epsilon']:.3g}, it twists by {angle} per revolution of its handle"
        rows.append((f"axis {spin.axis}" + (" (usual spin)" if body.axis == spin.axis else ""), text))
    return facts, lines, rows, list(_observation_lines(body))


def axes_of(value: object) -> Axes:
    """Return the requested axis, or all three."""
    if value not in (None, *AXES):
        raise DefinitionError(f"body: axis: {display(value)} is out of range; allowed: 1, 2 or 3")
    return AXES if value is None else (int(value),)


def _body_lines(body: SpunBody) -> Iterator[str]:
    """Yield lines on a body: mass and size of its mesh, its principal axes, or its moments, and if it is impossible."""
    if (solid := body.solid) is not None:
        size = " × ".join(f"{edge:.4g}" for edge in solid.extents)
        yield f"{solid.mass:.4g} kg, {solid.volume:.4g} m³, {size} m, {solid.faces:,} faces"
    if body.principal is not None:
        yield from axis_lines(body.principal)
        quaternion, rpy = (", ".join(f"{value:.6g}" for value in values) for values in body.principal.rotation.values())
        yield f"rotation from principal axes: quaternion (w, x, y, z) {quaternion}; roll, pitch, yaw {rpy} rad"
        yield f"principal axes 1, 2, 3 in the order of ascending moments, directions in the axes of the {body.frame}"
        return
    unit = "(ratios)" if body.ratios is not None else "kg m²"
    order = "" if list(body.moments) == sorted(body.moments) else "; axes 1, 2, 3 in the order given"
    yield f"{', '.join(MOMENTS)} = {', '.join(f'{moment:.6g}' for moment in body.moments)} {unit}{order}"
    if defect := molecules.inertial_defect(body.moments):
        amount = f"{defect / molecules.AMU_SQUARE_ANGSTROM:.4g} amu Å², {100 * defect / max(body.moments):.2g} %"
        yield f"inertial defect {amount} of the greatest moment: a flat molecule that vibrates, not quite a rigid body"
    if problem := shapes.violation(body.moments):
        yield f"no rigid body has these moments: {problem}"


def _observation_lines(body: SpunBody) -> Iterator[str]:
    """Yield lines with the observed period and the note of a body, as far as it has them."""
    if body.observed is not None:
        yield f"observed: {format_span(body.observed.period_days * DAY)}, {body.observed.what}"
    if body.note:
        yield f"note: {' '.join(body.note.split())}"
