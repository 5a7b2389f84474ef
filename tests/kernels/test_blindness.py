"""Measured columns know no theory: with false closed forms in its place no bit of them changes, and theory's do."""

import naive
import numpy as np
import pytest

from kernels.events import symmetric_top, tumbling, twist
from kernels.free import linear
from kernels.near_axis import survey

SIZE, ONES = naive.bodies(300, seed=6)["I1"].size, np.ones(20)
RACKET = {"I1": 0.3 * ONES, "I2": 0.8, "I3": 1.0, "omega0": 1.0}
FALSE_RATES = {"omega_squared_theory": np.full(SIZE, -7.0)}
CASES = {  # survey, points, settings, replacements of functions of a module, columns of theory
    "near an axis": (survey, naive.bodies(300, seed=6), (4.0, 16, 1e-10), {
        (linear, "omega_squared"): lambda *a: FALSE_RATES["omega_squared_theory"],
        (linear, "regime"): lambda *a: np.full(SIZE, 3, np.int8),
        (linear, "predict_columns"): lambda *a: FALSE_RATES,
    }, ("omega_squared_theory",)),
    "tops": (symmetric_top, {"ratio": np.linspace(0.1, 2.0, 40), "omega3": -3.0, "half_angle": 9.0}, (4.0, 16, 1e-12), {
        (symmetric_top, "precession_rate"): lambda ratio, omega3: 7.0 * omega3,
        (symmetric_top, "cones"): lambda ratio, half_angle: (half_angle, half_angle),
    }, ("precession_rate_theory", "momentum_cone_theory", "space_cone_theory")),
    "tumbling": (tumbling, RACKET | {"energy": np.linspace(1.0, 3.3, 20)}, (1e-10,), {
        (tumbling, "fill_exact"): lambda *a: (a[-2].fill(1), a[-1].fill(7.0)),
    }, ("mode_exact", *(f"{name}_exact" for name in tumbling.PERIODS))),
    "twist": (twist, RACKET | {"chi": np.linspace(-3.0, 3.0, 20), "theta": 1.5}, (1e-10,), {
        (twist, "fill_exact"): lambda *a: a[-1].fill(7.0),
    }, ("twist_exact", "time_of_turn_exact", "twist_defect_theory")),
}  # fmt: skip


@pytest.mark.compiled
@pytest.mark.parametrize("name", CASES)
def test_no_measured_bit_depends_on_the_theory(name, monkeypatch):
    system, points, settings, replacements, theory = CASES[name]
    honest = system.survey(points, *settings)
    for place, function in replacements.items():
        monkeypatch.setattr(*place, function)
    disturbed = system.survey(points, *settings)
    changed = [column for column in disturbed if honest[column].tobytes() != disturbed[column].tobytes()]
    assert sorted(changed) == sorted(theory)
