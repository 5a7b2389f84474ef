import pickle
import uuid

import numpy as np
import pytest
import sympy as sp
from calls import python

import sweeps
from kernels.compile.cache import cache_folder
from kernels.estimator import statuses
from sweeps import systems
from sweeps.points.loading import read_sweep
from sweeps.schema.refusals import DefinitionError
from sweeps.systems.described import of_file, run_file
from sweeps.systems.oscillator import system as oscillator

SPRING = """
from sweeps.mechanics import System

system = System("Mass on a spring")
m = system.parameter("mass", "kg", default=1.0, positive=True)
k = system.parameter("stiffness", "N m-1", default=1.0)
x = system.coordinate("x", "m", bounds=(-1, 2))
system.particle(m, (x,))
system.potential({V})
"""


def write_description(folder, text):
    """Path of a file with this text, as a definition names it."""
    path = folder / "spring.py"
    path.write_text(text, encoding="utf-8")
    systems.resolve.cache_clear()
    of_file.cache_clear()
    run_file.cache_clear()
    return str(path)


@pytest.fixture
def spring(tmp_path):
    return write_description(tmp_path, SPRING.format(V="k * x**2 / 2"))


def small(name, **grid):
    return {"system": name, "grid": grid}


def test_map_has_the_contracts_names_and_dimensions():
    ds = sweeps.survey(small("pendulum", length=[0.5, 1.0, 2.0], epsilon=[1e-6, 1e-3]))
    assert ds["omega_squared"].dims == ("mass", "length", "gravity", "epsilon", "phase", "equilibrium", "mode")
    assert ds["omega_squared"].shape == (1, 3, 1, 2, 1, 2, 1)
    assert ds["equilibrium"].values.tolist() == ["hanging", "upright"]
    assert set(ds.data_vars) == {*oscillator.VARIABLES, "theta_equilibrium"}
    hanging_mode = ds.sel(equilibrium="hanging", mode=1).squeeze()
    assert hanging_mode["omega_squared"].sel(epsilon=1e-6).values == pytest.approx(
        9.80665 / ds["length"].values, rel=1e-9
    )
    assert ds["length"].attrs["units"] == "m"


def test_a_file_is_a_system_and_so_is_what_a_program_builds(spring):
    ds, namespace = sweeps.survey(small(spring, stiffness=[-2.0, 0.5, 3.0])), {}
    exec(SPRING.format(V="k * x**2 / 2"), namespace)
    for name, column in sweeps.survey(small(namespace["system"], stiffness=[-2.0, 0.5, 3.0])).items():
        np.testing.assert_array_equal(column, ds[name])
    assert ds["omega_squared"].values.ravel() == pytest.approx([-2.0, 0.5, 3.0], rel=1e-9)
    assert ds.attrs["system"] == spring
    assert ds.attrs["kernel_fingerprint"] == systems.resolve(spring).fingerprint()


def test_a_files_path_counts_from_the_definitions_folder(tmp_path, spring, monkeypatch):
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "mine.yaml").write_text("system: spring.py\ngrid: {stiffness: 2.0}\n")
    monkeypatch.chdir(tmp_path / "elsewhere")
    sweep = read_sweep("../mine.yaml")
    assert sweep.definition.system == "spring.py"
    for copy in (sweep, pickle.loads(pickle.dumps(sweep))):
        assert copy.system.description.title == "Mass on a spring"
    assert pickle.loads(pickle.dumps(sweep.system)).source == sweep.system.source
    (tmp_path / "mine.yaml").write_text("system: nowhere.py\n")
    with pytest.raises(DefinitionError, match=r"nowhere\.py: cannot be read .* from the definition's folder"):
        read_sweep("../mine.yaml")


def test_a_crowded_point_among_others_is_its_status_and_no_end_of_the_sweep(tmp_path):
    name = write_description(tmp_path, SPRING.format(V="x**4 / 4 - k * x**2 / 2"))  # three for k > 0, and `most` is 1
    ds = sweeps.survey(small(name, stiffness=[-1.0, 0.5])).squeeze()
    assert ds["status"].values.tolist() == [statuses.OK, statuses.TOO_MANY_EQUILIBRIA]
    assert ds["omega_squared_theory"].values == pytest.approx([1.0, np.nan], nan_ok=True)
    with pytest.raises(DefinitionError, match=r"there are 3, at mass=1, stiffness=0\.5; allowed: at most 1"):
        read_sweep(small(name, stiffness=0.5))


def test_fingerprint_changes_with_the_description(tmp_path):
    texts = (SPRING.format(V=V) for V in ("k * x**2 / 2", "k * x**2"))
    prints = {systems.resolve(write_description(tmp_path, text)).fingerprint() for text in texts}
    assert [len(text) for text in prints] == [64, 64]


@pytest.mark.parametrize(
    ("V", "message"),
    [
        ("k * x", "equilibria: none within the bounds"),
        ("1 / 0", r"cannot be run \(ZeroDivisionError: division by zero\)"),
        ("k * x**2)\nsystem = (3", r"defines no `system`"),
        ("k * __import__('numpy').cos(x)", r"line 9: cannot be run .*cos.*allowed: SymPy's functions"),
        ("k * x**2)\n__import__('sys').exit(0", "line 10: cannot be run .SystemExit"),
        ("k * x**2)\nsystem.coordinate('y', bounds=(-1, 1), size=0", "line 10: size of y: 0; allowed"),
        ("k * x**2)\n__import__('os')._exit(0", "ended without an answer"),
    ],
)
def test_what_is_wrong_with_a_description_is_said_before_any_work(tmp_path, V, message):
    name = write_description(tmp_path, SPRING.format(V=V))
    with pytest.raises(DefinitionError, match=message) as error:
        read_sweep(small(name, stiffness=2.0))
    assert "\n" not in str(error.value)
    assert name in str(error.value)


def test_a_file_that_does_not_end_is_ended(tmp_path, monkeypatch):
    monkeypatch.setattr("sweeps.systems.described.MAX_FILE_SECONDS", 1.0)
    name = write_description(tmp_path, "while True:\n    pass\n")
    with pytest.raises(DefinitionError, match="took more than 1 s"):
        read_sweep(small(name, stiffness=2.0))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("V", "curvature"),
    [("cot(x + pi/2)**2 + sec(x) - sech(x) + erf(x)**2", 4.0 + 8 / np.pi), ("coth(x + 3) + x**2", None)],
)
def test_functions_with_a_name_of_their_own_are_taken(tmp_path, V, curvature):
    """cot, sec, sech, erf, coth: one equilibrium, its rate² the curvature by hand over the mass."""
    x = sp.Symbol("x", real=True)
    e = sp.sympify(V, {"x": x})
    curvature = curvature or float(e.diff(x, 2).subs(x, sp.nsolve(e.diff(x), 0.0)))
    text = SPRING.format(V=f"k * __import__('sympy').sympify({V!r}, {{'x': x}})").replace("(-1, 2)", "(-1, 1.2)")
    ds = sweeps.survey(small(write_description(tmp_path, text), stiffness=2.0)).squeeze()
    assert ds["equilibria_certified"] == 0
    assert float(ds["omega_squared_reduced"]) == pytest.approx(2.0 * curvature, rel=1e-8)


def test_a_wide_swing_of_a_pendulum_is_stable_and_its_errors_hold():
    """The error covers the bias by the perturbation, not the scatter alone, up to 57°."""
    epsilon = np.array([0.1, 0.32, 0.5, 0.7, 0.99])
    ds = sweeps.survey(small("pendulum", length=1.0, epsilon=epsilon.tolist())).squeeze().sel(equilibrium="hanging")
    assert ds["regime"].values.tolist() == [0] * 5
    for name in ("omega_squared", "omega_squared_reduced", "frequency", "frequency_reduced"):
        theory = ds["omega_squared_theory"] if name.startswith("omega") else ds["frequency_theory"]
        deviation = np.abs(ds[name] - theory).values
        assert (deviation <= ds[f"{name}_error"].values).all()
        assert (deviation[:4] <= 0.05 * theory.values[:4]).all()
    assert (np.abs(ds["omega_squared_reduced"] / ds["omega_squared_theory"] - 1) < 2e-3).all()


def test_a_degenerate_place_has_the_frequency_of_its_amplitude_where_it_is_asked_for(tmp_path):
    """On the pitchfork of the hoop V = m R² Ω² θ⁴/8 + …: half the perturbation, half the frequency."""
    grid = {"radius": 9.80665, "spin_rate": [1.0, 1.5], "epsilon": [0.02, 0.01], "phase": 0.0}
    ds = sweeps.survey(small("bead_on_hoop", **grid) | {"integration": {"degenerate": True}}).squeeze()
    bottom = ds.sel(equilibrium="bottom")
    assert bottom["degenerate_order"].values.tolist() == [[4, 4], [0, 0]]
    frequency, error = (bottom[f"degenerate_frequency{end}"].values[0] for end in ("", "_error"))
    assert frequency[0] / frequency[1] == pytest.approx(2, rel=1e-3)
    assert (error <= 1e-3 * frequency).all()
    assert np.isnan(bottom["degenerate_frequency"].values[1]).all()
    assert bottom["degenerate_amplitude"].values[0] == pytest.approx([0.02, 0.01], rel=1e-3)


@pytest.mark.slow
def test_what_compile_was_told_of_is_compiled_for_good(tmp_path):
    """The title makes a system that is in no cache yet."""
    write_description(tmp_path, SPRING.format(V="k * x**2").replace("Mass on a spring", uuid.uuid4().hex))
    definition = tmp_path / "mine.yaml"
    definition.write_text(f"system: {tmp_path}/spring.py\ngrid: {{stiffness: 2.0}}\nshards: 1\n")
    name, dates = systems.resolve(f"{tmp_path}/spring.py")._code().name, []
    for arguments in (["compile", definition], ["shard", definition, "1", "1", "-o", tmp_path / "shard.nc"]):
        python("import sys; from sweeps.__main__ import main; sys.exit(main(sys.argv[1:]))", *arguments)
        dates.append([path.stat().st_mtime_ns for path in sorted(cache_folder().glob(f"code/{name}.*"))])
    assert len(dates[0]) == 2  # advance and energy
    assert dates[0] == dates[1]
