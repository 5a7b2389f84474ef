"""Critical values: published ones and closed forms, each found between the points of a coarse grid."""

import json
from math import sqrt

import numpy as np
import pytest
import sympy as sp
from scipy.special import mathieu_a, mathieu_b

import sweeps
from sweeps.__main__ import main
from sweeps.maps import critical_values
from sweeps.mechanics import System
from sweeps.schema.refusals import RefusedError

GRAVITY = 9.80665


def linear_system(title, M, C, K, **parameters):
    """Return a system of two coordinates with M q″ + C q′ + K q = 0, from functions of its parameters."""
    system = System(title)
    symbols = {name: system.parameter(name, default=value) for name, value in parameters.items()}
    system.matrices(*(matrix(**symbols) for matrix in (M, K)), C=C(**symbols))
    return system


def bicycle():
    """Return the benchmark bicycle of Meijaard et al., Proc. R. Soc. A 463 (2007) 1955, appendix A."""
    K0 = sp.Matrix([[-80.95, -2.59951685249872], [-2.59951685249872, -0.80329488458618]])
    K2 = sp.Matrix([[0, 76.59734589573222], [0, 2.65431523794604]])
    C1 = sp.Matrix([[0, 33.86641391492494], [-0.85035641456978, 1.68540397397560]])
    M = [[80.81722, 2.31941332208709], [2.31941332208709, 0.29784188199686]]
    return linear_system("Bicycle", lambda v: M, lambda v: v * C1, lambda v: 9.81 * K0 + v**2 * K2, v=5.0)


def column():
    """Return Ziegler's column (Z. angew. Math. Mech. 4 (1952) 49): masses 2 m and m, equal springs and dampers."""
    D = sp.Matrix([[2, -1], [-1, 1]])
    K = {"K": lambda P, c: D - P * sp.Matrix([[1, -1], [0, 0]])}
    return linear_system("Column", lambda P, c: [[3, 1], [1, 1]], lambda P, c: c * D, P=1.0, c=0.0, **K)


def spread(start, stop, num):
    return {"start": start, "stop": stop, "num": num}


MATHIEU = [mathieu_a(0, 5.0), *(f(k, 5.0) for k in (1, 2, 3) for f in (mathieu_b, mathieu_a))][:6]  # below a = 10
CASES = {  # definition, parameter, changes by rising value: value, printed digits, kind
    "bicycle": (
        {"system": bicycle, "v": spread(0.0, 10.0, 12)},
        "v",
        [(0.6843, 4, "flutter"), (4.2924, 4, "restabilised"), (6.0243, 4, "divergence")],
    ),
    "column": ({"system": column, "P": spread(1.0, 3.0, 8)}, "P", [(3.5 - sqrt(2.0), 13, "flutter")]),
    # equal dampers c, with unit masses, springs and lengths: 41/28 + c²/2 (Herrmann and Jong, J. Appl. Mech. 1965)
    "damped column": (
        {"system": column, "P": spread(1.0, 2.0, 8), "c": 1e-3},
        "P",
        [(41.0 / 28.0 + 5e-7, 11, "flutter")],
    ),
    "trap": (
        {"system": "paul_trap", "a": 0.0, "q": spread(0.1, 1.2, 9)},
        "q",
        [(0.908046333735, 12, "period_doubling")],
    ),
    "top": (
        {"system": "sleeping_top", "I1": 1.0, "I3": 0.6, "moment_of_weight": 2.0, "spin_rate": spread(0.5, 8.0, 9)},
        "spin_rate",
        [(2.0 * sqrt(2.0) / 0.6, 12, "restabilised")],
    ),
    "Foucault": ({"system": "foucault", "spin_rate": spread(0.5, 6.0, 12)}, "spin_rate", []),
    "rotor": (
        {"system": "rotor", "internal_damping": 0.02, "spin_rate": spread(0.1, 6.0, 9)},
        "spin_rate",
        [(3.5, 10, "flutter")],
    ),
    "hoop": (
        {"system": "bead_on_hoop", "spin_rate": spread(1.0, 6.0, 9)},
        "spin_rate",
        [(sqrt(GRAVITY), 9, "divergence")],
    ),
    # √(k(1 ∓ d)/m): both edges of the tongue, 0.002 wide, are between two points
    "shaft": (
        {"system": "asymmetric_shaft", "asymmetry": 0.002, "spin_rate": spread(0.83, 1.23, 5)},
        "spin_rate",
        [(sqrt(0.998), 9, "period_doubling"), (sqrt(1.002), 9, "restabilised")],
    ),
    "Mathieu": (
        {"system": "mathieu", "q": 5.0, "a": spread(-6.5, 10.0, 45)},
        "a",
        [
            (value, 10, "restabilised" if k % 2 == 0 else ("period_doubling", "positive_multiplier")[k // 2 % 2])
            for k, value in enumerate(MATHIEU)
        ],
    ),
}


def changes(name):
    definition, along, right = CASES[name]
    system = definition["system"]
    system = system if isinstance(system, str) else system()
    return sweeps.critical(sweeps.survey(**definition | {"system": system}), along), right


QUICK = ("column", "damped column", "Mathieu")  # one of each kind; systems that ship compile for seconds


@pytest.mark.parametrize("name", [pytest.param(k, marks=() if k in QUICK else pytest.mark.slow) for k in CASES])
def test_critical_values_are_those_that_are_published_or_closed_forms(name):
    found, right = changes(name)
    found = found.isel(change=(found.equilibrium != "top").values)
    assert [*found.kind.values] == [kind for _, _, kind in right]
    for (value, digits, _), change in zip(right, range(len(right)), strict=True):
        at = found.isel(change=change)
        # half a unit of the last digit, which for a closed form allows for the terms that it omits
        rounding = 0.5001 * 10.0**-digits
        assert abs(at.critical_value - value) <= at.critical_value_error + rounding
        assert abs(at.critical_value_theory - at.critical_value) <= at.critical_value_error
        assert at.critical_value_error < 1e-10 * max(1.0, abs(value))


@pytest.mark.slow
def test_values_do_not_depend_on_the_grid_or_its_direction():
    grids = ([1.0, 3.0, 4.4, 6.0, 8.0], [8.0, 7.0, 3.5, 0.5])
    maps = [sweeps.survey(system="sleeping_top", spin_rate=values, moment_of_weight=[2.0, 3.0]) for values in grids]
    first, second = (sweeps.critical(ds, "spin_rate") for ds in maps)
    np.testing.assert_allclose(first.critical_value, second.critical_value, rtol=1e-12)  # a hundred times the error
    assert [*first.moment_of_weight.values] == [2.0, 3.0]
    one_line = sweeps.critical(maps[0], "spin_rate", moment_of_weight=2.9)
    np.testing.assert_array_equal(one_line.critical_value, first.critical_value[1:])


@pytest.mark.slow
def test_growth_that_passes_to_another_mode_has_a_predicted_value_only():
    """Both planes of the trap are unstable there: the exponents of Mathieu's equations at (a, q) and (-a, q) agree."""
    changes = sweeps.critical(sweeps.survey(system="paul_trap", a=-0.3, q=spread(0.6, 0.9, 4)), "q")
    assert changes.kind.values.tolist() == ["period_doubling"]
    assert np.isnan(changes.critical_value).all()
    q = changes.critical_value_theory.item() + np.array([-1e-9, 1e-9])
    traces = sweeps.survey(system="mathieu", a=[-0.3, 0.3], q=q).growth_rate_theory.squeeze()
    difference = traces.isel(a=0) - traces.isel(a=1)
    assert difference[0] > 0.0 > difference[1]


@pytest.mark.slow
def test_a_change_that_is_not_measured_as_predicted_is_undecided(monkeypatch):
    """The bicycle, which is stable from 4.3 to 6.0 m/s, is here measured as unstable there."""
    measure = critical_values.measure_points

    def measure_otherwise(points, sweep):
        columns, flags = measure(points, sweep), sweep.variables["regime"]
        is_stable = (points["v"] > 4.2924) & (points["v"] < 6.0243)
        columns["regime"][is_stable] = flags.flags.index("unstable") + flags.first_flag
        return columns

    ds = sweeps.survey(system=bicycle(), v=spread(0.0, 10.0, 12))
    monkeypatch.setattr(critical_values, "measure_points", measure_otherwise)
    assert sweeps.critical(ds, "v").kind.values.tolist() == ["flutter", "undecided", "undecided"]


def test_a_measured_invariant_that_is_off_moves_the_critical_value_by_its_slope(monkeypatch):
    ds = sweeps.survey(system="mathieu", q=1.0, a=[1.0, 1.5, 2.0, 2.5])
    measure, offset = critical_values.measure_points, 1e-6
    monkeypatch.setattr(
        critical_values,
        "measure_points",
        lambda *setting: (found := measure(*setting)) | {"trace": found["trace"] + offset},
    )
    (value,), (theory,) = (
        sweeps.critical(ds, "a")[name].values for name in ("critical_value", "critical_value_theory")
    )
    traces = sweeps.survey(system="mathieu", q=1.0, a=theory + np.array([-1e-4, 1e-4])).trace_theory.values.ravel()
    np.testing.assert_allclose(value - theory, -offset * 2e-4 / np.diff(traces)[0], rtol=1e-2)  # a slope over a cell


def test_the_command_prints_changes_and_refuses_what_it_cannot_follow(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    sweeps.survey(system="sleeping_top", spin_rate=[3.0, 4.0, 5.0, 6.0]).to_netcdf("top.nc")
    assert main(["critical", "top.nc", "--along", "spin_rate"]) == 0
    assert "4.71404520791" in (text := capsys.readouterr().out)
    assert "restabilised" in text
    assert "1 change of the regime along spin_rate" in text
    assert main(["critical", "top.nc", "--along", "spin_rate", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["kind"] == ["restabilised"]
    assert main(["critical", "top.nc", "--along", "spn_rate"]) == 2
    assert "did you mean spin_rate?" in capsys.readouterr().err
    with pytest.raises(RefusedError, match="has none along a grid"):
        sweeps.critical(sweeps.survey(I1=1.0, I2=2.0, I3=[2.5, 3.0], omega0=1.0), "I3")
    own_map = sweeps.open_map("top.nc").assign_attrs(system="mine.py")
    with pytest.raises(RefusedError, match="--definition"):
        sweeps.critical(own_map, "spin_rate")
