"""Moving pictures of the gallery's cards: two seconds of the motion at one point of a map, without axes."""

from collections.abc import Iterator
from itertools import chain, islice

import numpy as np
import xarray as xr
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from kernels.free import exact
from sweeps import systems
from sweeps.figure import colors, sheets
from sweeps.reading.definitions import definition_of
from sweeps.systems import trajectories
from sweeps.systems.bodies.solid import solid
from sweeps.systems.presentation import animation
from sweeps.systems.presentation.moving import film
from sweeps.systems.presentation.moving.equations import picture, picture_points
from sweeps.systems.rigid_body.presentation import figure_flip
from sweeps.systems.rigid_body.system import initial_state

INCHES, DOTS = (2.8, 1.9), 90  # size of a card, and its pixels per inch
SECONDS = 2.0  # length of a card's film
TURNS = 3.0  # oscillations or rotations that it shows
DISPLACEMENT = 0.2  # initial distance of each state from the equilibrium, rad, m or rad/s
FREE_BODIES = ("rigid_body", "tumbling", "twist")  # systems of bodies whose start makes a motion in closed form
TOLERANCE = 1e-8  # relative, of the integration; pixels show a hundredth of the picture


def frames(dataset: xr.Dataset) -> Iterator[np.ndarray]:
    """Yield the frames of a map's card, shape (height, width, 4); none if its points have no motion or picture."""
    system, point = systems.of_map(dataset), _start_point(dataset)
    figure = Figure(figsize=INCHES, dpi=DOTS, facecolor=colors.PAPER)
    FigureCanvasAgg(figure)
    axes, count = figure.add_axes((0.0, 0.0, 1.0, 1.0)), round(SECONDS * sheets.GIF.rate)
    scenes = _system_scenes if system.name in systems.described_names() else _body_scenes
    artists = scenes(axes, system, point, count)
    first = list(islice(artists, 1))  # draws what rests, before the background is copied
    if first:
        yield from animation.draw_frames(figure, chain(first, artists))


def _start_point(dataset: xr.Dataset) -> xr.Dataset:
    """Return the map at its definition's `start_at`, otherwise at axis 2, the first name or the middle value."""
    start = definition_of(dataset.attrs).get("start_at") or {}
    for name, values in ((str(name), dataset[name].values) for name in dataset.dims if name in dataset.coords):
        usual = values[0] if values.dtype.kind in "OU" or name in ("epsilon", "mode") else values[values.size // 2]
        value = start.get(name, 2 if name == "axis" and 2 in values else usual)
        dataset = dataset.sel({name: value}, **{} if isinstance(value, str) else {"method": "nearest"})
    return dataset.load()


def _system_scenes(axes, system, point: xr.Dataset, count: int) -> Iterator[list]:
    """Yield the artists of a described system's picture, from a place near its equilibrium or base motion."""
    model = system.mechanism
    if model.system.attitude_equations or not picture(model.system, model.equations):
        return
    start = {}
    for name in map(str, model.equations.q):
        end = "equilibrium" if f"{name}_equilibrium" in point else "start"
        start[name] = point[f"{name}_{end}"].item() + DISPLACEMENT
    parameters = {name: point[name].item() for name in model.system.parameters}
    duration = 1.0
    for _step in range(2):  # the first step finds the duration of a few oscillations, the second has it
        if not np.isfinite(duration):
            return
        times = np.linspace(0.0, duration, count)
        run = trajectories.integrate_motions(system.name, start, times, parameters, TOLERANCE)
        places = np.concatenate([p.reshape(count, -1) for _, p in picture_points(model.equations, run)], axis=1)
        speeds = np.gradient(places, times, axis=0)
        duration = TURNS * 2.0 * np.pi * np.sqrt(places.var(axis=0).sum() / (speeds**2).mean(axis=0).sum())
    if np.isfinite(places).all():
        yield from map(film.draw_scene(axes, run, model.equations), range(count))


def _body_scenes(axes, system, point: xr.Dataset, count: int) -> Iterator[list]:
    """Yield the artists of a free body that rotates about its vertical angular momentum."""
    if system.name not in FREE_BODIES:
        return
    find_start = initial_state if system.name == "rigid_body" else system.start
    moments, omega = find_start({str(name): value.item() for name, value in point.coords.items()})
    times = np.linspace(0.0, TURNS * 2.0 * np.pi / np.linalg.norm(omega), count)
    matrices, omegas = figure_flip.attitudes(moments, omega, times), exact.rotation(moments, omega, times)
    stage = figure_flip.FilmStage(axes, 1.8, solid(moments), int(np.argmax(np.abs(omega))) + 1)
    handle = int(np.argmin(moments))
    for k, matrix in enumerate(matrices):
        yield stage.set_attitude(matrix, omegas[k], matrices[max(0, k - figure_flip.TRAIL) : k + 1, :, handle])
