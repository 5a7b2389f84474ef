"""Every number of the pages, by name: what it is, and how it is read from which map.

A page says 1.9<!--name .2g-->: the number as it was measured, and a comment, which Markdown hides, with a name of
NUMBERS and a format. Its meaning is what readers of the HTML see under the pointer.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import xarray as xr

DAY = 86_400.0  # s


@dataclass(frozen=True)
class Number:
    """A number of the pages."""

    source: str  #: name of the map
    meaning: str  #: what it is
    value: Callable[[xr.Dataset], float]  #: a function of that map


def shown(value: float, form: str = ".3g") -> str:
    """Return a number as the pages write it: 1e-13 becomes 1 × 10⁻¹³.

    Args:
        value: the number.
        form: of Python's format language; "e" for its order of magnitude alone.
    """
    if form == "e":
        return "10" + _raised(round(float(np.log10(abs(value)))))
    text = f"{round(value):{form}}" if form.endswith("d") else f"{value:{form}}"
    mantissa, e, exponent = text.replace("-", "−", text.startswith("-")).partition("e")
    return f"{mantissa}\u202f×\u202f10{_raised(int(exponent))}" if e else mantissa


def _raised(exponent: int) -> str:
    return str(exponent).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))


def _earth(ds: xr.Dataset) -> xr.Dataset:
    return ds.sel(ratio=306 / 305, omega3=7.292115e-5, method="nearest").isel(half_angle=0)


def _disc(ds: xr.Dataset) -> xr.Dataset:
    return ds.sel(ratio=2.0, omega3=1.0).sel(half_angle=45.0, method="nearest")


def _racket(ds: xr.Dataset, axis: int) -> xr.Dataset:
    return ds.sel(I1=0.00121, I2=0.01638, axis=axis, method="nearest")


def _word(flags: xr.DataArray, word: str) -> xr.DataArray:
    """Where flags mean a word; nowhere for a word that they do not have."""
    codes = dict(zip(flags.attrs["flag_meanings"].split(), flags.attrs["flag_values"], strict=True))
    return (flags == codes[word]) if word in codes else xr.zeros_like(flags, bool)


def _otherwise(ds: xr.Dataset) -> xr.DataArray:
    """Where a regime was measured, and it is not theory's."""
    told = ~(_word(ds.regime, "undetermined") | _word(ds.regime, "marginal"))
    same = [_word(ds.regime, word) & _word(ds.regime_theory, word) for word in ds.regime.attrs["flag_meanings"].split()]
    return told & ~xr.concat(same, "word").any("word")


def _about(ds: xr.Dataset, body: str, axis: int) -> xr.Dataset:
    return ds.sel(body=body, axis=axis)


def _brick(ds: xr.Dataset) -> xr.Dataset:
    return _about(ds, "Brick", 2).sel(epsilon=1e-2, method="nearest")


def _brick_shift(ds: xr.Dataset) -> xr.DataArray:
    one = _brick(ds)
    return abs(one.omega_squared - one.omega_squared_theory) / one.omega0**2


def _throw(ds: xr.Dataset, body: str) -> xr.Dataset:
    return ds.sel(body=body).sel(chi=0.1, method="nearest")


def _pendulum(ds: xr.Dataset) -> xr.Dataset:
    return ds.sel(equilibrium="hanging", gravity=9.80665).sel(length=1.0, method="nearest")


def _orbit_ratio(ds: xr.Dataset) -> xr.DataArray:
    """Rate of the radial mode over that of the tilting one: modes are sorted, and which is which depends on s."""
    ratio = ds.frequency.max("mode") / ds.frequency.min("mode")
    return xr.where(ds.exponent < -1.0, 1.0 / ratio, ratio)


def _motions(ds: xr.Dataset) -> xr.Dataset:
    """One eigenvalue of each motion: what belongs to the whole motion is repeated along them."""
    return ds.isel(eigenvalue=0)


def _off(ds: xr.Dataset, part: str) -> xr.DataArray:
    return abs(ds[f"eigenvalue_{part}"] - ds[f"eigenvalue_{part}_theory"])


def _is_stable(ds: xr.Dataset) -> xr.DataArray:
    return _word(_motions(ds).regime, "stable")


def _slug(ds: xr.Dataset, about: str) -> xr.Dataset:
    """Bodies that spin about the axis of the lesser, or of the greater, moment; equal ones are neither."""
    one = _motions(ds)
    return one.where((one.axial_moment < 0.99) if about == "lesser" else (one.axial_moment > 1.01), drop=True)


def _earth_days(ds: xr.Dataset) -> float:
    earth = _earth(ds)
    return earth.period * earth.omega3 / (2 * np.pi)


def _racket_flip_delay(ds: xr.Dataset) -> float:
    flips = _about(ds, "Racket", 2).isel(epsilon=slice(0, 2))
    return -flips.flip_period.diff("epsilon").item() / np.log10(flips.epsilon[1] / flips.epsilon[0])


def _tumbler_worst(ds: xr.Dataset) -> float:
    names = ("period_psi", "period_phi_long_axis", "period_phi_encircled")
    return max(float(abs(ds[name] / ds[f"{name}_exact"] - 1.0).max()) for name in names)


def _hoop_worst(ds: xr.Dataset) -> float:
    scale = np.maximum(ds.gravity / ds.radius, ds.spin_rate**2)
    return (abs(ds.omega_squared - ds.omega_squared_theory) / scale).max()


def _well_worst(ds: xr.Dataset) -> float:
    ratio = ds.frequency.sel(equilibrium="right") / ds.growth_rate.sel(equilibrium="hill")
    return abs(ratio / np.sqrt(2.0) - 1.0).max()


def _top_inside(ds: xr.Dataset) -> float:
    inside = [_off(ds, part) <= ds[f"eigenvalue_{part}_error"] for part in ("real", "imag")]
    measured = ds.eigenvalue_real.notnull()
    return (inside[0] & inside[1] & measured).sum() / measured.sum()


NUMBERS = {
    # The symmetric top
    "wobble_points": Number("wobble", "Points of the map of symmetric tops.", lambda ds: ds.precession_rate.size),
    "wobble_ratios": Number("wobble", "Ratios of moments in the map of symmetric tops.", lambda ds: ds.sizes["ratio"]),
    "wobble_angles": Number("wobble", "Half-angles in the map of symmetric tops.", lambda ds: ds.sizes["half_angle"]),
    "wobble_least_angle": Number(
        "wobble", "Least angle of the angular velocity to the figure axis, degrees.", lambda ds: ds.half_angle.min()
    ),
    "wobble_greatest_angle": Number(
        "wobble", "Greatest angle of the angular velocity to the figure axis, degrees.", lambda ds: ds.half_angle.max()
    ),
    "earth_ratio": Number("wobble", "I3/I1 of the Earth as a symmetric top.", lambda ds: _earth(ds).ratio),
    "earth_days": Number("wobble", "Measured period of the Earth's wobble, in turns of the Earth.", _earth_days),
    "earth_solar_days": Number(
        "wobble", "Measured period of the Earth's wobble, days of 86,400 s.", lambda ds: _earth(ds).period / DAY
    ),
    "wobble_worst": Number(
        "wobble",
        "Largest distance of a measured precession rate from the closed form, over the spin.",
        lambda ds: (abs(ds.precession_rate - ds.precession_rate_theory) / abs(ds.omega3)).max(),
    ),
    "wobble_worst_bar": Number(
        "wobble",
        "Largest distance of a measured precession rate from the closed form, over its error bar.",
        lambda ds: (abs(ds.precession_rate - ds.precession_rate_theory) / ds.precession_rate_error).max(),
    ),
    "least_epsilon": Number("bodies", "Smallest perturbation, relative to the spin.", lambda ds: ds.epsilon.min()),
    "earth_three_days": Number(
        "bodies",
        "Measured period of the wobble of an Earth with three moments, days of 86,400 s.",
        lambda ds: ds.euler_period.sel(body="Earth", axis=3).isel(epsilon=0) / DAY,
    ),
    "coplanarity_worst": Number(
        "wobble",
        "Largest share of the angular momentum out of the plane of angular velocity and figure axis.",
        lambda ds: ds.coplanarity.max(),
    ),
    "cones_rates_apart": Number(
        "wobble",
        "Largest difference of the rates at which angular velocity and momentum turn in the body, over the spin.",
        lambda ds: (abs(ds.precession_rate - ds.momentum_precession_rate) / abs(ds.omega3)).max(),
    ),
    "disc_ratio": Number("wobble", "I3/I1 of a disc.", lambda ds: _disc(ds).ratio),
    "disc_angle": Number(
        "wobble", "Angle of the disc's angular velocity to its axis, degrees.", lambda ds: _disc(ds).half_angle
    ),
    "disc_momentum_cone": Number("wobble", "Momentum cone of the disc, degrees.", lambda ds: _disc(ds).momentum_cone),
    "disc_momentum_cone_theory": Number(
        "wobble",
        "Angle of the disc's angular momentum to its axis, closed form, degrees.",
        lambda ds: _disc(ds).momentum_cone_theory,
    ),
    "half_angle_drift": Number(
        "wobble",
        "Largest change of the angle of the angular velocity to the figure axis in a run, degrees.",
        lambda ds: ds.half_angle_drift.max(),
    ),
    # The racket and its neighbours
    "racket_points": Number("racket", "Points of the map around the racket.", lambda ds: ds.regime.size),
    "racket_side": Number("racket", "Values of each moment in the map around the racket.", lambda ds: ds.sizes["I1"]),
    "racket_spin": Number("racket", "Spin rate, rad/s.", lambda ds: ds.omega0),
    "racket_epsilon": Number("racket", "Size of the perturbation over the spin.", lambda ds: ds.epsilon),
    "racket_epsilon_squared": Number("racket", "Square of the size of the perturbation.", lambda ds: ds.epsilon**2),
    "energy_drift_worst": Number(
        "racket", "Largest relative change of the energy in a run.", lambda ds: ds.energy_drift.max()
    ),
    "momentum_drift_worst": Number(
        "racket",
        "Largest relative change of the squared angular momentum in a run.",
        lambda ds: ds.momentum_drift.max(),
    ),
    "perturbation_drift_worst": Number(
        "racket",
        "Largest relative change of the perturbation's own invariant in a run.",
        lambda ds: ds.perturbation_drift.max(),
    ),
    "racket_growth": Number(
        "racket",
        "Measured growth rate of the racket about the axis across its handle, s-1.",
        lambda ds: _racket(ds, 2).growth_rate,
    ),
    "racket_tenfold": Number(
        "racket",
        "Time in which the racket's perturbation grows tenfold, s.",
        lambda ds: np.log(10.0) / _racket(ds, 2).growth_rate,
    ),
    "racket_frequency_1": Number(
        "racket", "Measured wobble of the racket about its handle, rad/s.", lambda ds: _racket(ds, 1).frequency
    ),
    "racket_frequency_3": Number(
        "racket",
        "Measured wobble of the racket about the normal of its face, rad/s.",
        lambda ds: _racket(ds, 3).frequency,
    ),
    "racket_worst": Number(
        "racket",
        "Largest distance of the measured squared rate from theory, over the spin's square.",
        lambda ds: (abs(ds.omega_squared - ds.omega_squared_theory) / ds.omega0**2).max(),
    ),
    "racket_worst_bar": Number(
        "racket",
        "Largest distance of the measured squared rate from theory, over its error bar.",
        lambda ds: (abs(ds.omega_squared - ds.omega_squared_theory) / ds.omega_squared_error).max(),
    ),
    "racket_wrong": Number("racket", "Points whose measured regime is not theory's.", lambda ds: _otherwise(ds).sum()),
    "racket_marginal": Number(
        "racket", "Points that are called marginal.", lambda ds: _word(ds.regime, "marginal").sum()
    ),
    # The three bodies with larger and larger perturbations
    "bodies_points": Number("bodies", "Motions of the three bodies.", lambda ds: ds.regime.size),
    "greatest_epsilon": Number("bodies", "Largest perturbation, relative to the spin.", lambda ds: ds.epsilon.max()),
    "certificate_worst": Number(
        "bodies",
        "Largest distance of the direct integration from the closed form, relative to the perturbation.",
        lambda ds: ds.propagation_error.max(),
    ),
    "racket_flip_small": Number(
        "bodies",
        "Time between two flips of the racket after the smallest perturbation, s.",
        lambda ds: _about(ds, "Racket", 2).flip_period.isel(epsilon=0),
    ),
    "racket_flip_large": Number(
        "bodies",
        "Time between two flips of the racket after the largest perturbation, s.",
        lambda ds: _about(ds, "Racket", 2).flip_period.isel(epsilon=-1),
    ),
    "racket_flip_delay": Number(
        "bodies",
        "What a ten times smaller perturbation adds to the time between two flips of the racket, s, at the small end.",
        _racket_flip_delay,
    ),
    "racket_flip_delay_theory": Number(
        "bodies",
        "The same by linear theory: 2 ln 10 over the growth rate, s.",
        lambda ds: 2.0 * np.log(10.0) / _about(ds, "Racket", 2).growth_rate_theory.isel(epsilon=0),
    ),
    "flip_worst": Number(
        "bodies",
        "Largest relative distance of a measured time between two flips from the closed form.",
        lambda ds: abs(ds.flip_period / ds.flip_period_exact - 1.0).max(),
    ),
    "racket_tilt": Number(
        "bodies",
        "Largest tilt of the racket about its middle axis after the smallest perturbation, degrees.",
        lambda ds: np.degrees(_about(ds, "Racket", 2).max_tilt.isel(epsilon=0)),
    ),
    "earth_tilt": Number(
        "bodies",
        "Largest tilt of the Earth about its axis of greatest moment after the smallest perturbation, degrees.",
        lambda ds: np.degrees(_about(ds, "Earth", 3).max_tilt.isel(epsilon=0)),
    ),
    "brick_epsilon": Number(
        "bodies", "A perturbation of the brick, relative to the spin.", lambda ds: _brick(ds).epsilon
    ),
    "brick_shift": Number(
        "bodies",
        "Distance of the brick's measured squared rate from linear theory there, over the spin's square.",
        _brick_shift,
    ),
    "brick_shift_scaled": Number(
        "bodies",
        "The same in units of the perturbation's square.",
        lambda ds: _brick_shift(ds) / _brick(ds).epsilon ** 2,
    ),
    "brick_shift_left": Number(
        "bodies",
        "Distance of the brick's reduced squared rate from linear theory at that perturbation, over the spin's square.",
        lambda ds: abs(_brick(ds).omega_squared_reduced - _brick(ds).omega_squared_theory) / _brick(ds).omega0 ** 2,
    ),
    "attitude_worst": Number(
        "bodies",
        "Largest angle between the attitude integrated step by step and the closed form's, rad.",
        lambda ds: ds.attitude_error.max(),
    ),
    # Throws and tumblers
    "throws_points": Number("throws", "Throws in the map.", lambda ds: ds.twist.size),
    "throw_chi": Number(
        "throws",
        "Angle of the momentum to the middle axis at the start of the throw, rad.",
        lambda ds: _throw(ds, "Racket").chi,
    ),
    "throw_twist": Number(
        "throws",
        "Measured twist of the racket in that throw, in half turns.",
        lambda ds: abs(_throw(ds, "Racket").twist) / np.pi,
    ),
    "careful_chi": Number(
        "throws",
        "Angle of the momentum to the middle axis in the most careful throw of the map, rad.",
        lambda ds: ds.chi.min(),
    ),
    "careful_twist": Number(
        "throws",
        "Measured twist of the racket in the most careful throw, in half turns.",
        lambda ds: abs(ds.sel(body="Racket").isel(chi=0).twist) / np.pi,
    ),
    "throw_seconds": Number(
        "throws",
        "Time in which the racket's handle comes round once in that throw, s.",
        lambda ds: _throw(ds, "Racket").time_of_turn,
    ),
    "phone_defect": Number(
        "throws",
        "Shortfall of the telephone's twist from a half turn in the same throw, rad.",
        lambda ds: abs(_throw(ds, "Telephone").twist_defect),
    ),
    "poor_defect": Number(
        "throws",
        "Shortfall of the twist of a body of moments 1, 2, 3 from a half turn in the same throw, rad.",
        lambda ds: abs(_throw(ds, "Moments 1, 2, 3").twist_defect),
    ),
    "twist_worst": Number(
        "throws",
        "Largest distance of a measured twist from the exact one, rad.",
        lambda ds: abs(ds.twist - ds.twist_exact).max(),
    ),
    "throws_reversed": Number(
        "throws",
        "Share of the throws that end with the momentum on the other side.",
        lambda ds: _word(ds.ends_reversed, "reversed").mean(),
    ),
    "tumbler_psi": Number(
        "tumblers",
        "P_psi of the tumbling body at the least energy of the map, h.",
        lambda ds: ds.period_psi.isel(energy=0) / 3600.0,
    ),
    "tumbler_phi": Number(
        "tumblers",
        "P_phi of the tumbling body at the least energy of the map, h.",
        lambda ds: ds.period_phi_long_axis.isel(energy=0) / 3600.0,
    ),
    "sam_share": Number(
        "tumblers",
        "Share of the energies at which the body tumbles in short-axis mode.",
        lambda ds: _word(ds.mode, "sam").mean(),
    ),
    "tumbler_separatrix": Number(
        "tumblers", "Energy of the separatrix over the least that the momentum allows.", lambda ds: ds.I3 / ds.I2
    ),
    "tumbler_longest": Number("tumblers", "Longest P_psi of the map, h.", lambda ds: ds.period_psi.max() / 3600.0),
    "tumbler_worst": Number(
        "tumblers", "Largest relative distance of a measured period from the closed form.", _tumbler_worst
    ),
    # Small oscillations and runaway
    "pendulum_length": Number("pendulums", "Length of a pendulum, m.", lambda ds: _pendulum(ds).length),
    "pendulum_frequency": Number(
        "pendulums", "Measured angular frequency on the Earth, rad/s.", lambda ds: _pendulum(ds).frequency
    ),
    "pendulum_theory": Number(
        "pendulums", "The same by linear theory, rad/s.", lambda ds: _pendulum(ds).frequency_theory
    ),
    "pendulum_worst": Number(
        "pendulums",
        "Largest relative distance of a measured squared rate from g/l.",
        lambda ds: (abs(ds.omega_squared - ds.omega_squared_theory) / (ds.gravity / ds.length)).max(),
    ),
    "kepler_exponent": Number(
        "orbits", "Exponent of Kepler's potential.", lambda ds: ds.exponent.sel(exponent=-1.0, method="nearest")
    ),
    "harmonic_exponent": Number(
        "orbits", "Exponent of the harmonic well.", lambda ds: ds.exponent.sel(exponent=2.0, method="nearest")
    ),
    "kepler_ratio": Number(
        "orbits",
        "Radial over orbital rate in Kepler's potential, measured.",
        lambda ds: _orbit_ratio(ds).sel(exponent=-1.0, method="nearest").isel(angular_momentum=0),
    ),
    "harmonic_ratio": Number(
        "orbits",
        "Radial over orbital rate in the harmonic well, measured.",
        lambda ds: _orbit_ratio(ds).sel(exponent=2.0, method="nearest").isel(angular_momentum=0),
    ),
    "orbit_worst": Number(
        "orbits",
        "Largest relative distance of the ratio of the two rates from the root of s + 2.",
        lambda ds: abs(_orbit_ratio(ds) / np.sqrt(ds.exponent + 2.0) - 1.0).max(),
    ),
    "orbit_points": Number("orbits", "Orbits in the map, a mode each.", lambda ds: ds.frequency.size),
    "hoop_points": Number("hoop", "Points of the hoop's map.", lambda ds: ds.regime.size),
    "hoop_missing": Number(
        "hoop",
        "Points of the hoop's map without an equilibrium of that name.",
        lambda ds: _word(ds.status, "no_equilibrium").sum(),
    ),
    "hoop_marginal": Number(
        "hoop", "Points of the hoop's map that are called marginal.", lambda ds: _word(ds.regime, "marginal").sum()
    ),
    "hoop_wrong": Number(
        "hoop", "Points of the hoop's map whose measured regime is not theory's.", lambda ds: _otherwise(ds).sum()
    ),
    "hoop_worst": Number(
        "hoop",
        "Largest distance of a measured squared rate from theory, over the larger of g/R and the hoop's rate squared.",
        _hoop_worst,
    ),
    "well_worst": Number(
        "wells",
        "Largest relative distance from the root of 2 of the swing in the well over the runaway from the hill.",
        _well_worst,
    ),
    "well_decades": Number(
        "wells", "Decades of alpha in the map of the wells.", lambda ds: np.log10(ds.alpha.max() / ds.alpha.min())
    ),
    # Relative equilibria
    "top_points": Number("top", "Tops in the map.", lambda ds: _motions(ds).regime.size),
    "top_sleeps": Number(
        "top", "Tops that are stable, measured.", lambda ds: _word(_motions(ds).regime, "stable").sum()
    ),
    "top_flutters": Number(
        "top", "Tops that flutter, measured.", lambda ds: _word(_motions(ds).regime, "flutter").sum()
    ),
    "top_wrong": Number(
        "top", "Tops whose measured regime is not theory's.", lambda ds: _otherwise(_motions(ds)).sum()
    ),
    "top_open": Number(
        "top",
        "Tops whose regime the measurement leaves open.",
        lambda ds: (_word(_motions(ds).regime, "marginal") | _word(_motions(ds).regime, "undetermined")).sum(),
    ),
    "top_worst": Number(
        "top",
        "Largest distance of a measured eigenvalue from theory, over the rate scale.",
        lambda ds: (np.hypot(_off(ds, "real"), _off(ds, "imag")) / ds.rate_scale).max(),
    ),
    "top_inside": Number(
        "top", "Share of the eigenvalues whose two parts are both within their error bars.", _top_inside
    ),
    "satellite_points": Number("satellite", "Satellites in the map.", lambda ds: _motions(ds).regime.size),
    "satellite_stable": Number("satellite", "Satellites that are stable, measured.", lambda ds: _is_stable(ds).sum()),
    "satellite_lagrange": Number(
        "satellite",
        "Stable satellites in Lagrange's region, 0 < k3 < k1.",
        lambda ds: (_is_stable(ds) & (ds.k3 > 0) & (ds.k3 < ds.k1)).sum(),
    ),
    "satellite_debra": Number(
        "satellite",
        "Stable satellites in DeBra and Delp's region, k3 < k1 < 0.",
        lambda ds: (_is_stable(ds) & (ds.k3 < ds.k1) & (ds.k1 < 0)).sum(),
    ),
    "slug_grows": Number(
        "slug",
        "Share of the bodies spinning about the lesser moment whose nutation grows, measured.",
        lambda ds: (_slug(ds, "lesser").growth_rate > 0).mean(),
    ),
    "slug_decays": Number(
        "slug",
        "Share of the bodies spinning about the greater moment whose nutation decays, measured.",
        lambda ds: (_slug(ds, "greater").growth_rate < 0).mean(),
    ),
    "slug_fastest": Number(
        "slug",
        "Time in which the fastest nutation of the map grows by a factor e, s.",
        lambda ds: 1.0 / _motions(ds).growth_rate.max(),
    ),
    # Parametric resonance
    "mathieu_points": Number("mathieu", "Points of Mathieu's chart.", lambda ds: ds.regime.size),
    "mathieu_wrong": Number(
        "mathieu", "Points of Mathieu's chart whose measured regime is not theory's.", lambda ds: _otherwise(ds).sum()
    ),
    "mathieu_worst": Number(
        "mathieu",
        "Largest distance of a measured trace from that of the variational flow.",
        lambda ds: abs(ds.trace - ds.trace_theory).max(),
    ),
    "pumped_wrong": Number(
        "kapitza", "Pumped spins whose measured regime is not theory's.", lambda ds: _otherwise(ds).sum()
    ),
    "pumped_tongues": Number(
        "kapitza",
        "Share of the modulations under which the spin about the stable axis grows.",
        lambda ds: (_word(ds.isel(I2=0).regime, "unstable") | _word(ds.isel(I2=0).regime, "period_doubling")).mean(),
    ),
    "pumped_island": Number(
        "kapitza",
        "Share of the modulations under which the spin about the intermediate axis is stable.",
        lambda ds: _word(ds.isel(I2=1).regime, "stable").mean(),
    ),
    "upright_stands": Number(
        "upright",
        "Share of the motions of the pivot on which the inverted pendulum stands.",
        lambda ds: _word(ds.regime.sel(equilibrium="inverted"), "stable").mean(),
    ),
}
