"""Definitions that are no files, and numbers with units, against the same definition spelled out."""

import ctypes.util
import math
import platform
import re

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import sweeps
from sweeps import systems
from sweeps.points.loading import read_definition
from sweeps.schema.refusals import DefinitionError

GRID = {"I1": 1.0, "I2": [1.5, 2.0], "I3": 2.5, "omega0": math.pi}
PLAIN = {"axes": [2], "grid": GRID}
SPRING = """
from sweeps.mechanics import System

system = System("Spring")
k = system.parameter("stiffness", "s-2", default=1.0, positive=True)
x = system.coordinate("x", "m", bounds=(-1, 1))
system.kinetic_energy(system.velocity(x) ** 2 / 2)
system.potential(k * x**2 / 2)
system.equilibrium("rest", {x: 0})
"""


def test_every_form_of_a_grid_gives_the_same_map():
    expected = sweeps.survey(PLAIN).content_hash
    spun = xr.Dataset(coords={**GRID, "axis": [2]})
    turns = xr.Dataset(coords={**GRID, "omega0": ((), 0.5, {"units": "turn s-1"}), "axis": [2]})
    forms = [sweeps.survey(axes=[2], **GRID), sweeps.survey({"axes": [2]}, **GRID), sweeps.survey(spun)]
    forms += [sweeps.survey(axes=[2], **GRID | {"omega0": "30 rpm"}), sweeps.survey(turns), sweeps.survey(forms[0])]
    forms += [sweeps.survey(axes=[2], **GRID | {"I2": spun.I2, "omega0": turns.omega0})]
    assert [form.content_hash for form in forms] == [expected] * len(forms)


def test_rows_of_a_frame_are_points():
    rows = pd.DataFrame({"I1": [1.0, 1.1], "I2": [2.0, 2.1], "omega0 (rpm)": [30.0, 60.0]})
    of_frame = sweeps.survey(rows, I3=2.5, axes=[2])
    assert of_frame.sizes["point"] == 2
    np.testing.assert_allclose(of_frame.omega0, [math.pi, 2 * math.pi], rtol=1e-15)
    dataset = xr.Dataset({name: ("point", rows[name]) for name in ("I1", "I2")})
    dataset["omega0"] = ("point", [30.0, 60.0], {"units": "rpm"})
    of_dataset = sweeps.survey(dataset, I3=2.5, axes=[2])
    np.testing.assert_array_equal(of_dataset.growth_rate, of_frame.growth_rate)


def test_keywords_are_all_keys_of_all_definitions():
    models = {systems.resolve(name).model for name in systems.system_names()}
    assert set(systems.KEYS) == {key for model in models for key in model.model_fields}


@pytest.mark.parametrize(
    ("arguments", "keywords", "words"),
    [
        (("tiny",), {"I1": 1.0}, "'tiny' is given beside I1; allowed: a file, or keywords"),
        ((3,), {}, "3 is no definition; allowed: a path"),
        ((), GRID | {"I1": "2 furlong"}, "grid.I1: '2 furlong' has the unit 'furlong'; allowed: kg m2, g m2"),
        # radians or turns
        ((), GRID | {"omega0": "3000 1/min"}, "grid.omega0: '3000 1/min' has the unit '1/min'; allowed: rad s-1, s-1"),
        ((), {"grid": None, "I1": 1.0}, "grid: null is not a mapping"),
        ((), GRID | {"omega0": "fast"}, "grid.omega0: 'fast' is text, not a number"),
    ],
)
def test_what_is_none_is_refused(arguments, keywords, words):
    with pytest.raises(DefinitionError, match=re.escape(words)):
        sweeps.survey(*arguments, **keywords)


def test_every_number_of_a_definition_takes_a_unit():
    body = {
        "name": "a",
        "tensor": [["10 kg cm2", 0, 0], [0, "2e3 g mm2", 0], [0, 0, "10.01 kg cm2"]],
        "phase": "90 deg",
    }
    values = {
        "bodies": [body, {"name": "b", "I1": "1 g m2", "I2": 1e-3, "I3": 1e-3, "omega0": "1 deg/s", "phase": 0.0}],
        "grid": {"omega0": "-30 rpm", "epsilon": "5 %"},
    }
    first, second = read_definition(values).bodies
    assert first.moments == pytest.approx((2e-6, 1e-3, 1.001e-3), rel=1e-15)
    assert (first.phase, second.omega0, second.I1) == (math.pi / 2, math.pi / 180, 1e-3)
    definition = read_definition(
        {"grid": {"I1": {"start": "1 g m2", "stop": "2 g m2", "num": 3}, "I2": 1.0, "I3": 1.0, "omega0": 1.0}}
    )
    assert (definition.grid.I1.start, definition.grid.I1.stop) == (1e-3, 2e-3)
    shapes = {"ratios": {"I1_over_I3": {"start": "50 %", "stop": "60 %", "num": 2}, "thickness": 0.5}, "I3": "1 g m2"}
    assert read_definition({"grid": {**shapes, "omega0": 1.0}}).grid.I1.stop == 0.6e-3


@pytest.mark.compiled
@pytest.mark.parametrize("form", ["duff.py", "./duff.py", "below/duff.py", "absolute"])
def test_a_python_file_beside_a_frame_is_relative_to_the_current_folder(folder, form):
    path = folder / (form if form != "absolute" else "duff.py")
    path.parent.mkdir(exist_ok=True)
    path.write_text(SPRING)
    frame = pd.DataFrame({"stiffness": [1.0, 4.0]})
    ds = sweeps.survey(frame, system=str(path) if form == "absolute" else form)
    np.testing.assert_allclose(ds.frequency.values.ravel(), [1.0, 2.0], rtol=1e-6)  # epsilon² of the amplitude


NEAREST = 0  # number of the usual rounding mode in fesetround
OTHER_MODES = {"downward": 0x400, "upward": 0x800, "toward zero": 0xC00}  # numbers of fesetround on x86-64


@pytest.mark.skipif(platform.machine() != "x86_64", reason="the numbers of the modes are those of x86-64")
@pytest.mark.parametrize("mode", OTHER_MODES)
def test_another_rounding_mode_is_refused(mode):
    library = ctypes.CDLL(ctypes.util.find_library("m"))
    library.fesetround(OTHER_MODES[mode])
    try:
        with pytest.raises(DefinitionError) as error:
            sweeps.survey(**GRID)
    finally:
        library.fesetround(NEAREST)
    words = "arithmetic: another program in this process has set the processor's rounding mode"
    assert str(error.value).startswith(words)
