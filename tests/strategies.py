"""hypothesis strategies: for sweeps' definitions, as plain mappings; for bodies and points, as floats and arrays."""

import numpy as np
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

NAMES = ("omega0", "epsilon", "phase")
MOMENT = st.floats(1e-60, 1e60)
QUANTITIES = {
    "omega0": st.floats(1e-150, 1e150) | st.floats(-1e150, -1e-150),
    "epsilon": st.floats(1e-12, 0.99),
    "phase": st.floats(-1e3, 1e3),
}


@st.composite
def ranges(draw, low, high, max_num=6):
    """A linear or logarithmic range with ends of one sign, a factor of two or more apart."""
    start = draw(st.floats(low, high / 2))
    stop = draw(st.floats(2 * start, high))
    start, stop = (stop, start) if draw(st.booleans()) else (start, stop)
    spacing = draw(st.sampled_from(["linear", "log"]))
    return {"start": start, "stop": stop, "num": draw(st.integers(2, max_num)), "spacing": spacing}


def entries(quantity, low, high):
    """A number, a list of up to three different numbers, or a range."""
    lists = st.lists(quantity, min_size=1, max_size=3, unique=True)
    return quantity | lists | ranges(low, high)


@st.composite
def grid_sweeps(draw):
    """A definition with moments as grid dimensions."""
    grid = {name: draw(entries(MOMENT, 1e-60, 1e60)) for name in ("I1", "I2", "I3")}
    grid["omega0"] = draw(entries(QUANTITIES["omega0"], 1e-100, 1e100))
    for name, low, high in (("epsilon", 1e-12, 0.99), ("phase", 1e-3, 3.0)):
        if draw(st.booleans()):
            grid[name] = draw(entries(QUANTITIES[name], low, high))
    axes = draw(st.lists(st.integers(1, 3), min_size=1, max_size=3, unique=True))
    return {"axes": axes, "grid": grid}


@st.composite
def body_sweeps(draw):
    """A definition with bodies; all, none or some of them give each of omega0, epsilon and phase."""
    bodies = []
    for number in range(draw(st.integers(1, 4))):
        moments = {name: draw(MOMENT) for name in ("I1", "I2", "I3")}
        bodies.append({"name": f"body {number}"} | ({"ratios": moments} if draw(st.booleans()) else moments))
    grid = {}
    for name, low, high in (("omega0", 1e-100, 1e100), ("epsilon", 1e-12, 0.99), ("phase", 1e-3, 3.0)):
        num_with_value = draw(st.integers(0, len(bodies)))
        for body in bodies[:num_with_value]:
            body[name] = draw(QUANTITIES[name])
        if num_with_value == 0:
            grid[name] = draw(entries(QUANTITIES[name], low, high))
        elif num_with_value < len(bodies):
            grid[name] = draw(QUANTITIES[name])
    axes = draw(st.lists(st.integers(1, 3), min_size=1, max_size=3, unique=True))
    return {"axes": axes, "bodies": bodies, "grid": grid}


sweeps = grid_sweeps() | body_sweeps()

LANES = 12  # points of one example: one batch, whatever hypothesis draws


def moment_triples(low=1e-3, high=1e3):
    """Three positive moments, ties and neighbouring floats often among them."""
    near = st.builds(lambda x, k: (x, float(x + k * np.spacing(x))), st.floats(low, high), st.integers(-2, 2))
    with_ties = st.builds(
        lambda pair, z, turn: tuple(np.roll([*pair, z], turn)), near, st.floats(low, high), st.integers(0, 2)
    )
    return st.tuples(*[st.floats(low, high)] * 3) | with_ties


@st.composite
def point_batches(draw, lanes=LANES):
    """Points of any bodies, existing or not, with every axis, sense of spin, size and direction of nudge."""
    ratios = draw(arrays(np.float64, (3, lanes), elements=st.floats(0.05, 1.0)))
    signs = draw(arrays(np.bool_, lanes))
    exponents = draw(arrays(np.float64, lanes, elements=st.floats(-8.0, -0.6)))
    spins = draw(arrays(np.float64, lanes, elements=st.floats(1e-3, 1e3)))
    return {
        "I1": ratios[0],
        "I2": ratios[1],
        "I3": ratios[2],
        "axis": draw(arrays(np.int64, lanes, elements=st.integers(1, 3))),
        "omega0": np.where(signs, spins, -spins),
        "epsilon": 10.0**exponents,
        "phase": draw(arrays(np.float64, lanes, elements=st.floats(0.0, 6.3))),
    }
