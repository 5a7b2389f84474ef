"""Every number of the pages, by name: what it is, and how it is read from which map.

A page says 1.9<!--name .2g-->: the number as it was measured, and a comment, which Markdown hides, with the name of a
function here and a format. The function's docstring is what readers of the HTML see under the pointer.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import xarray as xr

NUMBERS: "dict[str, Number]" = {}
DAY = 86_400.0  # s


@dataclass(frozen=True)
class Number:
    """A number of the pages.

    Attributes:
        source: name of the map.
        meaning: what it is.
        value: a function of that map.
    """

    source: str
    meaning: str
    value: Callable[[xr.Dataset], float]


def of(source: str) -> Callable:
    """Enters a function of a map among the numbers, by its own name."""

    def enter(function: Callable[[xr.Dataset], float]) -> Callable[[xr.Dataset], float]:
        NUMBERS[function.__name__] = Number(source, (function.__doc__ or "").strip(), function)
        return function

    return enter


def shown(value: float, form: str = ".3g") -> str:
    """A number as the pages write it: 1e-13 becomes 1 × 10⁻¹³.

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


# ---------------------------------------------------------------------------------------------------------
# The symmetric top


def _earth(ds: xr.Dataset) -> xr.Dataset:
    return ds.sel(ratio=306 / 305, omega3=7.292115e-5, method="nearest").isel(half_angle=0)


@of("wobble")
def wobble_points(ds):
    """Points of the map of symmetric tops."""
    return ds.precession_rate.size


@of("wobble")
def wobble_ratios(ds):
    """Ratios of moments in the map of symmetric tops."""
    return ds.sizes["ratio"]


@of("wobble")
def wobble_angles(ds):
    """Half-angles in the map of symmetric tops."""
    return ds.sizes["half_angle"]


@of("wobble")
def wobble_least_angle(ds):
    """Least angle of the angular velocity to the figure axis, degrees."""
    return ds.half_angle.min()


@of("wobble")
def wobble_greatest_angle(ds):
    """Greatest angle of the angular velocity to the figure axis, degrees."""
    return ds.half_angle.max()


@of("wobble")
def earth_ratio(ds):
    """I3/I1 of the Earth as a symmetric top."""
    return _earth(ds).ratio


@of("wobble")
def earth_days(ds):
    """Measured period of the Earth's wobble, in turns of the Earth."""
    earth = _earth(ds)
    return earth.period * earth.omega3 / (2 * np.pi)


@of("wobble")
def earth_solar_days(ds):
    """Measured period of the Earth's wobble, days of 86,400 s."""
    return _earth(ds).period / DAY


@of("wobble")
def wobble_worst(ds):
    """Largest distance of a measured precession rate from the closed form, over the spin."""
    return (abs(ds.precession_rate - ds.precession_rate_theory) / abs(ds.omega3)).max()


@of("wobble")
def wobble_worst_bar(ds):
    """Largest distance of a measured precession rate from the closed form, over its error bar."""
    return (abs(ds.precession_rate - ds.precession_rate_theory) / ds.precession_rate_error).max()


@of("bodies")
def least_epsilon(ds):
    """Smallest nudge, relative to the spin."""
    return ds.epsilon.min()


@of("bodies")
def earth_three_days(ds):
    """Measured period of the wobble of an Earth with three moments, days of 86,400 s."""
    return ds.euler_period.sel(body="Earth", axis=3).isel(epsilon=0) / DAY


@of("wobble")
def coplanarity_worst(ds):
    """Largest share of the angular momentum out of the plane of angular velocity and figure axis."""
    return ds.coplanarity.max()


@of("wobble")
def cones_rates_apart(ds):
    """Largest difference of the rates at which angular velocity and momentum turn in the body, over the spin."""
    return (abs(ds.precession_rate - ds.momentum_precession_rate) / abs(ds.omega3)).max()


def _disc(ds: xr.Dataset) -> xr.Dataset:
    return ds.sel(ratio=2.0, omega3=1.0).sel(half_angle=45.0, method="nearest")


@of("wobble")
def disc_ratio(ds):
    """I3/I1 of a disc."""
    return _disc(ds).ratio


@of("wobble")
def disc_angle(ds):
    """Angle of the disc's angular velocity to its axis, degrees."""
    return _disc(ds).half_angle


@of("wobble")
def disc_momentum_cone(ds):
    """Angle of the disc's angular momentum to its axis, measured, degrees."""
    return _disc(ds).momentum_cone


@of("wobble")
def disc_momentum_cone_theory(ds):
    """Angle of the disc's angular momentum to its axis, closed form, degrees."""
    return _disc(ds).momentum_cone_theory


@of("wobble")
def half_angle_drift(ds):
    """Largest change of the angle of the angular velocity to the figure axis in a run, degrees."""
    return ds.half_angle_drift.max()


# ---------------------------------------------------------------------------------------------------------
# The racket and its neighbours


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


@of("racket")
def racket_points(ds):
    """Points of the map around the racket."""
    return ds.regime.size


@of("racket")
def racket_side(ds):
    """Values of each moment in the map around the racket."""
    return ds.sizes["I1"]


@of("racket")
def racket_spin(ds):
    """Spin rate, rad/s."""
    return ds.omega0


@of("racket")
def racket_epsilon(ds):
    """Size of the nudge over the spin."""
    return ds.epsilon


@of("racket")
def racket_epsilon_squared(ds):
    """Square of the size of the nudge."""
    return ds.epsilon**2


@of("racket")
def energy_drift_worst(ds):
    """Largest relative change of the energy in a run."""
    return ds.energy_drift.max()


@of("racket")
def momentum_drift_worst(ds):
    """Largest relative change of the squared angular momentum in a run."""
    return ds.momentum_drift.max()


@of("racket")
def perturbation_drift_worst(ds):
    """Largest relative change of the perturbation's own invariant in a run."""
    return ds.perturbation_drift.max()


@of("racket")
def racket_growth(ds):
    """Measured growth rate of the racket about the axis across its handle, s-1."""
    return _racket(ds, 2).growth_rate


@of("racket")
def racket_tenfold(ds):
    """Time in which the racket's nudge grows tenfold, s."""
    return np.log(10.0) / _racket(ds, 2).growth_rate


@of("racket")
def racket_frequency_1(ds):
    """Measured wobble of the racket about its handle, rad/s."""
    return _racket(ds, 1).frequency


@of("racket")
def racket_frequency_3(ds):
    """Measured wobble of the racket about the normal of its face, rad/s."""
    return _racket(ds, 3).frequency


@of("racket")
def racket_worst(ds):
    """Largest distance of the measured squared rate from theory, over the spin's square."""
    return (abs(ds.omega_squared - ds.omega_squared_theory) / ds.omega0**2).max()


@of("racket")
def racket_worst_bar(ds):
    """Largest distance of the measured squared rate from theory, over its error bar."""
    return (abs(ds.omega_squared - ds.omega_squared_theory) / ds.omega_squared_error).max()


@of("racket")
def racket_wrong(ds):
    """Points whose measured regime is not theory's."""
    return _otherwise(ds).sum()


@of("racket")
def racket_marginal(ds):
    """Points that are called marginal."""
    return _word(ds.regime, "marginal").sum()


# ---------------------------------------------------------------------------------------------------------
# The three bodies that are nudged harder and harder


def _nudged(ds: xr.Dataset, body: str, axis: int) -> xr.Dataset:
    return ds.sel(body=body, axis=axis)


@of("bodies")
def bodies_points(ds):
    """Motions of the three bodies."""
    return ds.regime.size


@of("bodies")
def greatest_epsilon(ds):
    """Largest nudge, relative to the spin."""
    return ds.epsilon.max()


@of("bodies")
def certificate_worst(ds):
    """Largest distance of the direct integration from the closed form, relative to the perturbation."""
    return ds.propagation_error.max()


@of("bodies")
def racket_flip_small(ds):
    """Time between two flips of the racket after the smallest nudge, s."""
    return _nudged(ds, "Racket", 2).flip_period.isel(epsilon=0)


@of("bodies")
def racket_flip_large(ds):
    """Time between two flips of the racket after the largest nudge, s."""
    return _nudged(ds, "Racket", 2).flip_period.isel(epsilon=-1)


@of("bodies")
def racket_flip_delay(ds):
    """What a ten times smaller nudge adds to the time between two flips of the racket, s, at the small end."""
    flips = _nudged(ds, "Racket", 2).isel(epsilon=slice(0, 2))
    return -flips.flip_period.diff("epsilon").item() / np.log10(flips.epsilon[1] / flips.epsilon[0])


@of("bodies")
def racket_flip_delay_theory(ds):
    """The same by linear theory: 2 ln 10 over the growth rate, s."""
    return 2.0 * np.log(10.0) / _nudged(ds, "Racket", 2).growth_rate_theory.isel(epsilon=0)


@of("bodies")
def flip_worst(ds):
    """Largest relative distance of a measured time between two flips from the closed form."""
    return abs(ds.flip_period / ds.flip_period_exact - 1.0).max()


@of("bodies")
def racket_tilt(ds):
    """Largest tilt of the racket about its middle axis after the smallest nudge, degrees."""
    return np.degrees(_nudged(ds, "Racket", 2).max_tilt.isel(epsilon=0))


@of("bodies")
def earth_tilt(ds):
    """Largest tilt of the Earth about its axis of greatest moment after the smallest nudge, degrees."""
    return np.degrees(_nudged(ds, "Earth", 3).max_tilt.isel(epsilon=0))


def _brick(ds: xr.Dataset) -> xr.Dataset:
    return _nudged(ds, "Brick", 2).sel(epsilon=1e-2, method="nearest")


@of("bodies")
def brick_epsilon(ds):
    """A nudge of the brick, relative to the spin."""
    return _brick(ds).epsilon


@of("bodies")
def brick_shift(ds):
    """Distance of the brick's measured squared rate from linear theory at that nudge, over the spin's square."""
    return abs(_brick(ds).omega_squared - _brick(ds).omega_squared_theory) / _brick(ds).omega0 ** 2


@of("bodies")
def brick_shift_scaled(ds):
    """The same in units of the nudge's square."""
    return brick_shift(ds) / _brick(ds).epsilon ** 2


@of("bodies")
def brick_shift_left(ds):
    """Distance of the brick's reduced squared rate from linear theory at that nudge, over the spin's square."""
    return abs(_brick(ds).omega_squared_reduced - _brick(ds).omega_squared_theory) / _brick(ds).omega0 ** 2


@of("bodies")
def attitude_worst(ds):
    """Largest angle between the attitude integrated step by step and the closed form's, rad."""
    return ds.attitude_error.max()


# ---------------------------------------------------------------------------------------------------------
# Throws and tumblers


def _throw(ds: xr.Dataset, body: str) -> xr.Dataset:
    return ds.sel(body=body).sel(chi=0.1, method="nearest")


@of("throws")
def throws_points(ds):
    """Throws in the map."""
    return ds.twist.size


@of("throws")
def throw_chi(ds):
    """Angle of the momentum to the middle axis at the start of the throw, rad."""
    return _throw(ds, "Racket").chi


@of("throws")
def throw_twist(ds):
    """Measured twist of the racket in that throw, in half turns."""
    return abs(_throw(ds, "Racket").twist) / np.pi


@of("throws")
def careful_chi(ds):
    """Angle of the momentum to the middle axis in the most careful throw of the map, rad."""
    return ds.chi.min()


@of("throws")
def careful_twist(ds):
    """Measured twist of the racket in the most careful throw, in half turns."""
    return abs(ds.sel(body="Racket").isel(chi=0).twist) / np.pi


@of("throws")
def throw_seconds(ds):
    """Time in which the racket's handle comes round once in that throw, s."""
    return _throw(ds, "Racket").time_of_turn


@of("throws")
def phone_defect(ds):
    """What the telephone's twist lacks of half a turn in the same throw, rad."""
    return abs(_throw(ds, "Telephone").twist_defect)


@of("throws")
def poor_defect(ds):
    """What the twist of a body of moments 1, 2, 3 lacks of half a turn in the same throw, rad."""
    return abs(_throw(ds, "Moments 1, 2, 3").twist_defect)


@of("throws")
def twist_worst(ds):
    """Largest distance of a measured twist from the exact one, rad."""
    return abs(ds.twist - ds.twist_exact).max()


@of("throws")
def throws_reversed(ds):
    """Share of the throws that end with the momentum on the other side."""
    return _word(ds.ends_reversed, "reversed").mean()


@of("tumblers")
def tumbler_psi(ds):
    """P_psi of the tumbling body at the least energy of the map, h."""
    return ds.period_psi.isel(energy=0) / 3600.0


@of("tumblers")
def tumbler_phi(ds):
    """P_phi of the tumbling body at the least energy of the map, h."""
    return ds.period_phi_long_axis.isel(energy=0) / 3600.0


@of("tumblers")
def sam_share(ds):
    """Share of the energies at which the body tumbles in short-axis mode."""
    return _word(ds.mode, "sam").mean()


@of("tumblers")
def tumbler_separatrix(ds):
    """Energy of the separatrix over the least that the momentum allows."""
    return ds.I3 / ds.I2


@of("tumblers")
def tumbler_longest(ds):
    """Longest P_psi of the map, h."""
    return ds.period_psi.max() / 3600.0


@of("tumblers")
def tumbler_worst(ds):
    """Largest relative distance of a measured period from the closed form."""
    names = ("period_psi", "period_phi_long_axis", "period_phi_encircled")
    return max(float(abs(ds[name] / ds[f"{name}_exact"] - 1.0).max()) for name in names)


# ---------------------------------------------------------------------------------------------------------
# Small oscillations and runaway


def _pendulum(ds: xr.Dataset) -> xr.Dataset:
    return ds.sel(equilibrium="hanging", gravity=9.80665).sel(length=1.0, method="nearest")


@of("pendulums")
def pendulum_length(ds):
    """Length of a pendulum, m."""
    return _pendulum(ds).length


@of("pendulums")
def pendulum_frequency(ds):
    """Measured angular frequency of that pendulum on the Earth, rad/s."""
    return _pendulum(ds).frequency


@of("pendulums")
def pendulum_theory(ds):
    """Angular frequency of that pendulum by linear theory, rad/s."""
    return _pendulum(ds).frequency_theory


@of("pendulums")
def pendulum_worst(ds):
    """Largest relative distance of a measured squared rate from g/l."""
    return (abs(ds.omega_squared - ds.omega_squared_theory) / (ds.gravity / ds.length)).max()


def _orbit_ratio(ds: xr.Dataset) -> xr.DataArray:
    """Rate of the radial mode over that of the tilting one: modes are sorted, and which is which depends on s."""
    ratio = ds.frequency.max("mode") / ds.frequency.min("mode")
    return xr.where(ds.exponent < -1.0, 1.0 / ratio, ratio)


@of("orbits")
def kepler_exponent(ds):
    """Exponent of Kepler's potential."""
    return ds.exponent.sel(exponent=-1.0, method="nearest")


@of("orbits")
def harmonic_exponent(ds):
    """Exponent of the harmonic well."""
    return ds.exponent.sel(exponent=2.0, method="nearest")


@of("orbits")
def kepler_ratio(ds):
    """Radial over orbital rate in Kepler's potential, measured."""
    return _orbit_ratio(ds).sel(exponent=-1.0, method="nearest").isel(angular_momentum=0)


@of("orbits")
def harmonic_ratio(ds):
    """Radial over orbital rate in the harmonic well, measured."""
    return _orbit_ratio(ds).sel(exponent=2.0, method="nearest").isel(angular_momentum=0)


@of("orbits")
def orbit_worst(ds):
    """Largest relative distance of the ratio of the two rates from the root of s + 2."""
    return abs(_orbit_ratio(ds) / np.sqrt(ds.exponent + 2.0) - 1.0).max()


@of("orbits")
def orbit_points(ds):
    """Orbits in the map, a mode each."""
    return ds.frequency.size


@of("hoop")
def hoop_points(ds):
    """Points of the hoop's map."""
    return ds.regime.size


@of("hoop")
def hoop_missing(ds):
    """Points of the hoop's map without an equilibrium of that name."""
    return _word(ds.status, "no_equilibrium").sum()


@of("hoop")
def hoop_marginal(ds):
    """Points of the hoop's map that are called marginal."""
    return _word(ds.regime, "marginal").sum()


@of("hoop")
def hoop_wrong(ds):
    """Points of the hoop's map whose measured regime is not theory's."""
    return _otherwise(ds).sum()


@of("hoop")
def hoop_worst(ds):
    """Largest distance of a measured squared rate from theory, over the larger of g/R and the hoop's rate squared."""
    scale = np.maximum(ds.gravity / ds.radius, ds.spin_rate**2)
    return (abs(ds.omega_squared - ds.omega_squared_theory) / scale).max()


@of("wells")
def well_worst(ds):
    """Largest relative distance from the root of 2 of the swing in the well over the runaway from the hill."""
    ratio = ds.frequency.sel(equilibrium="right") / ds.growth_rate.sel(equilibrium="hill")
    return abs(ratio / np.sqrt(2.0) - 1.0).max()


@of("wells")
def well_decades(ds):
    """Decades of alpha in the map of the wells."""
    return np.log10(ds.alpha.max() / ds.alpha.min())


# ---------------------------------------------------------------------------------------------------------
# Relative equilibria


def _motions(ds: xr.Dataset) -> xr.Dataset:
    """One eigenvalue of each motion: what belongs to the whole motion is repeated along them."""
    return ds.isel(eigenvalue=0)


@of("top")
def top_points(ds):
    """Tops in the map."""
    return _motions(ds).regime.size


@of("top")
def top_sleeps(ds):
    """Tops that are stable, measured."""
    return _word(_motions(ds).regime, "stable").sum()


@of("top")
def top_flutters(ds):
    """Tops that flutter, measured."""
    return _word(_motions(ds).regime, "flutter").sum()


@of("top")
def top_wrong(ds):
    """Tops whose measured regime is not theory's."""
    return _otherwise(_motions(ds)).sum()


@of("top")
def top_open(ds):
    """Tops whose regime the measurement leaves open."""
    return (_word(_motions(ds).regime, "marginal") | _word(_motions(ds).regime, "undetermined")).sum()


def _off(ds: xr.Dataset, part: str) -> xr.DataArray:
    return abs(ds[f"eigenvalue_{part}"] - ds[f"eigenvalue_{part}_theory"])


@of("top")
def top_worst(ds):
    """Largest distance of a measured eigenvalue from theory, over the rate scale."""
    return (np.hypot(_off(ds, "real"), _off(ds, "imag")) / ds.rate_scale).max()


@of("top")
def top_inside(ds):
    """Share of the eigenvalues whose two parts are both within their error bars."""
    inside = [_off(ds, part) <= ds[f"eigenvalue_{part}_error"] for part in ("real", "imag")]
    measured = ds.eigenvalue_real.notnull()
    return (inside[0] & inside[1] & measured).sum() / measured.sum()


def _is_stable(ds: xr.Dataset) -> xr.DataArray:
    return _word(_motions(ds).regime, "stable")


@of("satellite")
def satellite_points(ds):
    """Satellites in the map."""
    return _motions(ds).regime.size


@of("satellite")
def satellite_stable(ds):
    """Satellites that are stable, measured."""
    return _is_stable(ds).sum()


@of("satellite")
def satellite_lagrange(ds):
    """Stable satellites in Lagrange's region, 0 < k3 < k1."""
    return (_is_stable(ds) & (ds.k3 > 0) & (ds.k3 < ds.k1)).sum()


@of("satellite")
def satellite_debra(ds):
    """Stable satellites in DeBra and Delp's region, k3 < k1 < 0."""
    return (_is_stable(ds) & (ds.k3 < ds.k1) & (ds.k1 < 0)).sum()


def _slug(ds: xr.Dataset, about: str) -> xr.Dataset:
    """Bodies that spin about the axis of the lesser, or of the greater, moment; equal ones are neither."""
    one = _motions(ds)
    return one.where((one.axial_moment < 0.99) if about == "lesser" else (one.axial_moment > 1.01), drop=True)


@of("slug")
def slug_grows(ds):
    """Share of the bodies spinning about the lesser moment whose nutation grows, measured."""
    return (_slug(ds, "lesser").growth_rate > 0).mean()


@of("slug")
def slug_decays(ds):
    """Share of the bodies spinning about the greater moment whose nutation decays, measured."""
    return (_slug(ds, "greater").growth_rate < 0).mean()


@of("slug")
def slug_fastest(ds):
    """Time in which the fastest nutation of the map grows by a factor e, s."""
    return 1.0 / _motions(ds).growth_rate.max()
