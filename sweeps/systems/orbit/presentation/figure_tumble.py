"""Animation of a body that leaves its attitude: seen from the orbit's frame, above the tilt out of the plane.

The body begins a hundredth of a radian beside the reference motion of a point with fast growth out of the plane, the
nearest to `start_at` of the definition, and obeys the full equations. The vertical line is the orbit's normal; the
trail is that of axis 1.
"""

import math
from collections.abc import Iterator, Mapping

import numpy as np
import xarray as xr

from sweeps.figure import colors, sheets, wording
from sweeps.reading.definitions import definition_of
from sweeps.systems.bodies.solid import solid
from sweeps.systems.motion import multiply, rotate_vectors
from sweeps.systems.orbit import motion
from sweeps.systems.orbit.shapes import inertia_ratios
from sweeps.systems.presentation import animation
from sweeps.systems.rigid_body.presentation.figure_flip import FINER, TRAIL, FilmStage

FRAMES = 120
INCHES = (5.0, 5.4)
DOTS = 90  # pixels per inch
NUM_ORBITS = 12.0  # shown orbits: a growth of 0.5 e-folds an orbit then reaches large tilts
MIN_GROWTH = 0.3  # e-folds an orbit; a slower growth would show nothing within these orbits
DISTANCE_WEIGHT = 1e3  # e-folds an orbit; weight of the distance from `start_at`, over the range, against the growth
MAX_GROWTH = 1.0  # e-folds an orbit; a faster growth would show little of the reference motion


def frames(ds: xr.Dataset, title: str, symbols: Mapping) -> Iterator[np.ndarray]:
    """Yield the frames of the animation, shape (height, width, 4); none if no point of the map grows fast enough.

    `symbols` has the symbols of parameters by name.
    """
    growth = ds["growth_per_orbit"]
    merit = growth.where((ds["plane"] == "out_of_plane") & (ds["triangle_margin"] >= 0.0))
    merit = merit.where((growth > MIN_GROWTH) & (growth < MAX_GROWTH))
    if not merit.notnull().any():
        return
    for name, value in (definition_of(ds.attrs).get("start_at") or {}).items():
        if ds.sizes.get(name, 1) > 1:
            merit = merit - DISTANCE_WEIGHT * abs(ds[name] - float(value)) / np.ptp(ds[name].values)
    point = {str(name): merit[name].values[index] for name, index in merit.argmax(...).items()}
    factor = FINER * sheets.current_film.get().frame_factor
    rate = math.sqrt(float(point["mu"]) / float(point["semi_major_axis"])) / float(point["semi_major_axis"])
    end = 2.0 * math.pi * NUM_ORBITS / rate
    moved = motion.motion_of(point, end, FRAMES * factor + 1, 1e-10)
    anomaly = motion.true_anomaly(rate * moved["time"].values, float(point.get("eccentricity", 0.0)))
    attitude = np.column_stack([moved[f"q{part}"] for part in range(4)])
    unturn = np.zeros_like(attitude)
    unturn[:, 0], unturn[:, 3] = np.cos(0.5 * anomaly), -np.sin(0.5 * anomaly)
    relative = multiply(unturn, attitude)
    axes = np.stack([rotate_vectors(relative, np.tile(unit, (len(relative), 1))) for unit in np.eye(3)], axis=2)
    tilt, orbits = np.degrees(np.arccos(np.clip(axes[:, 2, 2], -1.0, 1.0))), moved["time"].values * rate / (2 * np.pi)
    if not np.isfinite(tilt).all():  # a tilt of 90 degrees about axis 2, at which the angles are singular
        return
    names = [name for name in point if ds.sizes[name] > 1 and name != "plane"]
    words = ", ".join(wording.format_coordinate(ds, name, point[name], symbols) for name in names)
    figure = animation.empty_stage(INCHES, DOTS, title, f"{words}; seen from the orbit's frame", (11.0, 8.0))
    trace, place = figure.add_axes((0.12, 0.1, 0.84, 0.2)), figure.add_axes((0.1, 0.34, 0.8, 0.52))
    ratio, asymmetry = inertia_ratios({name: np.array(value) for name, value in point.items()})
    moments = np.array([ratio, ratio + asymmetry, 1.0], dtype=float)
    scene = FilmStage(place, 1.6, solid(moments), 1, "orbit's normal")
    trace.plot(orbits, tilt, color=colors.UNSTABLE, linewidth=1.2)
    (dot,) = trace.plot([], [], "o", color=colors.UNSTABLE, markersize=5, animated=True)
    trace.set(xlim=(0.0, NUM_ORBITS), ylim=(0.0, 185.0), xlabel="orbits", ylabel="tilt (°)", yticks=[0, 90, 180])
    rates = np.column_stack([moved[f"omega{axis}"] for axis in (1, 2, 3)])

    def steps():
        """Yield the artists of each frame, set to its instant."""
        for index in range(0, tilt.size, FINER):
            dot.set_data([orbits[index]], [tilt[index]])
            trail = axes[max(0, index - TRAIL * factor) : index + 1, :, 0]
            yield [*scene.set_attitude(axes[index], rates[index], trail), dot]

    yield from animation.draw_frames(figure, steps())
