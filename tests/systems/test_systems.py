"""Properties of every system, each on a small definition of its own."""

import json
import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import repeated
from calls import python
from small_maps import SMALL

import sweeps
from kernels.compile.fingerprint import sources
from kernels.events import flips
from kernels.near_axis import survey
from sweeps import systems
from sweeps.maps import dataset, storage, verify
from sweeps.points import catalogue
from sweeps.points.loading import read_sweep
from sweeps.schema.definition import Definition
from sweeps.schema.refusals import DefinitionError
from sweeps.schema.variables import Role, Variable
from sweeps.shards import content_hash, merging
from sweeps.shards import shard as shards
from sweeps.systems import shared_variables

TOP = SMALL["symmetric_top"]["grid"]


def small(name):
    return read_sweep({"system": name} | SMALL[name])


# described systems: test_oscillator.py; those that derive their equations take seconds
@pytest.mark.parametrize("name", repeated.but({*systems.MODULES} - {"orbit", "pumped_body"}, systems.MODULES))
def test_a_system_says_all_that_its_map_holds(name):
    sweep, system = small(name), systems.resolve(name)
    definition = sweep.definition
    ds = sweeps.survey({"system": name} | SMALL[name])
    assert isinstance(definition, Definition)
    assert definition.system == system.name == ds.attrs["system"] == name
    assert set(ds.data_vars) == set(system.variables(definition)) >= set(system.variables())
    assert tuple(system.dimensions(definition)) == sweep.grid.dims
    assert {*ds.sizes} == {*sweep.grid.dims, *system.extra_dimensions(definition)}
    assert set(ds.coords) <= set(system.coordinates(definition))
    for variable in system.variables(definition).values():
        assert ds[variable.name].dtype == np.dtype(variable.dtype)
        assert ds[variable.name].dims == (*sweep.grid.dims, *variable.over)
    assert ds.attrs["references"] == system.references
    assert ds.attrs["source"].endswith(system.method(definition))


@pytest.mark.slow
@pytest.mark.parametrize("name", catalogue.shipped_files())
def test_a_definition_travels_between_processes(name):
    sweep = read_sweep(catalogue.shipped_files()[name])
    twin = pickle.loads(pickle.dumps(sweep))
    assert twin.definition == sweep.definition
    assert hash(twin.definition) == hash(sweep.definition)
    assert (twin.name, twin.definition.text) == (sweep.name, sweep.definition.text)
    assert twin.variables == sweep.variables
    assert twin.grid.shape == sweep.grid.shape


CUT = {
    **{name: SMALL[name] for name in ("symmetric_top", "uncertain_bodies", "dissipative_body")},
    "sleeping_top": {"grid": {"spin_rate": [3.0, 4.7, 4.8, 6.0], "moment_of_weight": [0.0, 2.0]}},
}


@pytest.mark.parametrize("name", repeated.but(("symmetric_top",), CUT))
def test_shards_threads_and_chunks_make_the_same_map_bit_for_bit(name, tmp_path):
    sweep = read_sweep({"system": name} | CUT[name])
    expected = content_hash.content_hash(dataset.survey_grid(sweep, threads=2))
    paths = [tmp_path / f"{number}.nc" for number in (1, 2, 3)]
    for number, path in enumerate(paths, 1):
        shards.write_shard(sweep, number, 3, path, threads=2)
    assert merging.merge_shards(sweep, paths, tmp_path / "map.nc") == expected
    with sweeps.open_map(tmp_path / "map.nc") as ds:
        assert content_hash.content_hash(ds) == expected
        assert ds.attrs["kernel_fingerprint"] == sweep.system.fingerprint()
    assert content_hash.content_hash(dataset.survey_grid(sweep, chunks=5)) == expected


@pytest.mark.parametrize("name", repeated.but(("twist", "uncertain_bodies", "observed_periods", "orbit"), SMALL))
def test_verify_finds_nothing_and_compares_all(name, tmp_path):
    """Points again, SciPy or the normal distribution, closed forms, and attitudes of motions where there are some."""
    storage.write_map(sweeps.survey({"system": name} | SMALL[name]), tmp_path / "map.nc")
    checks = {check.name: check for check in verify.verify(tmp_path / "map.nc", points=6)}
    assert [check for check in checks.values() if check.findings or check.skip_reason] == []
    assert name not in ("twist", "tumbling") or {"SciPy DOP853", "closed form", "attitude"} <= {*checks}


@pytest.mark.parametrize("order", ["in turn", "shuffled", "one after the other"])
def test_points_of_several_axes_are_each_what_they_are_alone(order):
    rng = np.random.default_rng(1)
    second = rng.uniform(0.1, 1.0, (3, 40))
    points = dict(zip(("I1", "I2", "I3"), second.sum(axis=0) - second, strict=True))
    points |= {"omega0": rng.uniform(1.0, 2.0, 40), "epsilon": np.full(40, 1e-6), "phase": np.full(40, 0.6)}
    axis = np.arange(40) % 3 + 1
    points["axis"] = {"in turn": axis, "shuffled": rng.permutation(axis), "one after the other": np.sort(axis)}[order]
    system, integration = systems.resolve("rigid_body"), read_sweep(SMALL["rigid_body"]).definition.integration
    columns = system.columns(points, integration)
    for k in (0, 1, 2, 13, 39):
        alone = system.columns({name: values[k : k + 1] for name, values in points.items()}, integration)
        assert {name: values[0].tobytes() for name, values in alone.items()} == {
            n: columns[n][k].tobytes() for n in alone
        }


RACKET = {"name": "racket", "I1": 0.00121, "I2": 0.01638, "I3": 0.01748}
THROWS = {"system": "twist", "bodies": [RACKET]}
TUMBLES = {"system": "tumbling", "grid": {"I1": [0.3, 0.5], "I2": 0.8, "I3": 1.0, "energy": [1.1, 1.4, 2.5]}}
BODY = {"name": "A", "I1": 1.0, "I2": 2.0, "I3": 2.5, "omega0": 1.0}
REFUSED_TOPS = [  # values of a symmetric top's grid → words of the refusal
    ({"ratio": 0.0}, "grid.ratio: 0.0 is out of range; allowed: a number > 0"),
    ({"ratio": [0.5, -1.0]}, "grid.ratio[1]: -1.0 is out of range; allowed: a number > 0"),
    ({"omega3": 0.0}, "grid.omega3: 0.0 is out of range; allowed: a number with 1e-150 ≤ |omega3| ≤ 1e150"),
    ({"omega3": {"start": -1.0, "stop": 1.0, "num": 3}}, "holds the spin rate about the figure axis 0"),
    ({"half_angle": 90.0}, "grid.half_angle: 90.0 is out of range; allowed: a number with 0 < half_angle < 90"),
    ({"half_angle": 0.0}, "at 0 nothing precesses"),
    ({"half_angle": {"start": 1.0, "stop": 90.0, "num": 3}}, "grid.half_angle.stop: 90.0 is out of range"),
    ({"halfangle": 3.0}, "is an unknown key (did you mean half_angle?); allowed: the keys ratio, omega3"),
    ({"epsilon": 1e-6}, "grid.epsilon: is an unknown key; allowed: the keys ratio, omega3, half_angle"),
]
REFUSED_UNCERTAINTIES = [  # with one body
    ({"uncertainty": "100 %"}, "uncertainty: '100 %' is 100 %; allowed: a fraction from 0 to below 1"),
    ({"uncertainty": 5}, "uncertainty: 5 is 500 %"),
    ({"uncertainty": {"moment": "5 %"}}, "uncertainty.moment: is an unknown key (did you mean moments?)"),
    ({"uncertainty": {"covariance": np.diag([1, -1, 1]).tolist()}}, "is not positive"),
    ({"uncertainty": {"covariance": [[1, 0.5, 0], [0, 1, 0], [0, 0, 1]]}}, "is not symmetric"),
    ({"uncertainty": {"covariance": np.diag([1.1, 0, 0]).tolist()}}, "uncertainty of 104.9 %, entry 1"),
    ({"uncertainty": {"tensor": "5 %"}}, "for a body without a tensor"),
    ({"uncertainty": "5 %", "draws": 10}, "draws: 10 is out of range"),
    ({"uncertainty": "5 %", "method": "halton"}, "method: 'halton' is not available"),
    ({"uncertainty": "5 %", "bodies": [BODY | {"I3": 3.5}]}, "of any rigid body: I3 = 3.5 > I1 + I2 = 3"),
    ({"bodies": [BODY | {"uncertainty": "5 %"}, BODY | {"name": "B"}]}, "bodies[1] (B).uncertainty: is missing"),
]
ORBIT = {"system": "orbit", "grid": {"K": 1.0}}
REFUSED_ORBITS = [
    ({"grid": {"I1": 1.0, "K": 1.0}}, "does not give a body"),
    ({"grid": {"K": 1.0, "amplitude": 0.1}}, "grid.amplitude: 0.1 is no parameter of synchronous"),
    ({"motion": "libration"}, "grid.amplitude: (nothing) is missing for libration"),
    ({"motion": "spin_normal", "grid": {"k1": 0.1, "k3": 0.2, "spin": 1.0}}, "has bodies without I1 = I2"),
    ({"motion": "libration", "planes": ["in_plane"], "grid": {"K": 1.0, "amplitude": 0.1}}, "has no dynamics"),
    ({"grid": {"asymmetry": 0.1}}, "does not determine"),
    ({"grid": {"K": 1.0, "eccentricity": 0.99}}, "out of range"),
]
PUMPED = {"I1": 1.0, "I2": 1.9, "I3": 2.0, "frequency": 0.3, "omega0": 0.5}
REFUSED_PUMPING = [
    ({"grid": PUMPED | {"depth1": 1.0}}, "grid.depth1: 1.0 is out of range; allowed: a number from -0.99 to 0.99: no"),
    ({"grid": PUMPED | {"depth2": [0.1, -1.5]}}, "grid.depth2[1]: -1.5 is out of range"),
    ({"grid": PUMPED | {"frequency": 0.0}}, "grid.frequency: 0.0 is out of range"),
    ({"grid": PUMPED | {"omega0": 0.0}}, "grid.omega0: 0.0 is out of range"),
    ({"modulation": "speed"}, "modulation: 'speed' is not available; allowed: moment, inverse"),
]
REFUSED_PENDULUMS = [
    ({"length": 0.0}, "grid.length: 0.0 is out of range"),
    ({"lenght": 1.0}, "unknown key"),
    ({"length": [1.0, True]}, "not a number"),
    ({"epsilon": 1.5}, "epsilon"),
]
DIRECTION = "integration.direction: "
REFUSED_RUNS = [  # Each is a run of a double pendulum.
    ({"direction": [1.0]}, DIRECTION + "[1.0] has 1 numbers; allowed: 2, of theta1, theta2"),
    ({"direction": [0.0, 0.0]}, DIRECTION + "[0.0, 0.0] has no direction"),
    ({"direction": [1.0, "x"]}, "integration.direction[1]: "),
    ({"direction": 1.0}, DIRECTION + "1.0 is not a list; allowed: direction of the perturbation"),
    ({"degenerate": True}, "degenerate: true is given for 2 coordinates; allowed: false, or a system"),
]
REFUSED = [
    *(({"system": "symmetric_top", "grid": TOP | grid}, message) for grid, message in REFUSED_TOPS),
    *(({"bodies": [BODY]} | changes, message) for changes, message in REFUSED_UNCERTAINTIES),
    (THROWS | {"grid": {"chi": 0.1, "theta": 4.0}}, "theta"),
    (THROWS | {"grid": {"chi": 0.1, "omega0": 0.0}}, "omega0"),
    (THROWS | {"grid": {"chi": 0.1, "I1": 1.0}}, "moments in bodies or in grid, not both"),
    (TUMBLES | {"grid": TUMBLES["grid"] | {"energy": 0.9}}, "a number from 1 to I_max/I_min"),
    (TUMBLES | {"grid": TUMBLES["grid"] | {"energy": [1.1, 9.0]}}, "above the maximum of every body of the sweep"),
    (TUMBLES | {"grid": {"energy": 1.1}}, "I1"),
    ({"system": "tumbling", "bodies": [RACKET | {"energy": 20.0}]}, "1 to I_max/I_min = 14.4"),
    (TUMBLES | {"integration": {"rotations": 3}}, "rotations"),
    *((ORBIT | changes, message) for changes, message in REFUSED_ORBITS),
    *(({"system": "pumped_body", "grid": PUMPED} | changes, message) for changes, message in REFUSED_PUMPING),
    *(({"system": "pendulum", "grid": grid}, message) for grid, message in REFUSED_PENDULUMS),
    *(({"system": "double_pendulum", "integration": run}, message) for run, message in REFUSED_RUNS),
    ({"system": "sleeping_top", "grid": {"spin": 1.0}}, "grid.spin: is an unknown key (did you mean spin_rate?)"),
    ({"system": "sleeping_top", "grid": {"epsilon": 2.0}}, "grid.epsilon: 2.0 is out of range"),
    ({"system": "sleeping_top", "integration": {"runs": 9}}, "integration.runs: 9 is out of range"),
]


@pytest.mark.parametrize(("definition", "message"), REFUSED)
def test_definitions_that_are_refused(definition, message):
    with pytest.raises(DefinitionError) as error:
        read_sweep(definition)
    assert message in str(error.value)


MEASURE = """
import json, multiprocessing, sys
import dask, numba, scipy.optimize, sympy, xarray  # whatever measuring may import but kernels, once for all
from sweeps import systems
from sweeps.maps import dataset
from sweeps.points.loading import read_sweep

def compiled():
    modules = [vars(m).values() for name, m in sys.modules.items() if name.startswith("kernels.")]
    functions = [f for m in modules for f in m if getattr(f, "signatures", ())]
    return {f"{f.__module__}.{f.__name__}": [*f.signatures] for f in functions}

def measure(name):
    "Return the files of kernels that measuring imports."
    dataset.survey_grid(read_sweep({"system": name} | json.loads(sys.argv[1])[name]))
    return [sys.modules[m].__file__ for m in sys.modules if m.split(".")[0] == "kernels"]

def uncompiled(name):
    "Return the kernels that the examples of a sweep do not compile, and measuring it does."
    from sweeps.points import compile_kernels, compile_worker
    compile_kernels.compile_examples = lambda examples: None
    sweep = read_sweep({"system": name} | json.loads(sys.argv[1])[name])
    for example in sweep.system.examples(sweep.definition):
        compile_worker.call_example(example)
    before = compiled()
    dataset.survey_grid(sweep)
    assert any(before.values())
    return [function for function, signatures in compiled().items() if signatures != before.get(function)]

with multiprocessing.get_context("fork").Pool(1, maxtasksperchild=1) as pool:  # a process for each call
    files = {name: pool.apply(measure, (name,)) for name in json.loads(sys.argv[1])}
    print(json.dumps([files, {name: pool.apply(uncompiled, (name,)) for name in sys.argv[2:]}]))
"""


@pytest.mark.slow
def test_a_system_names_the_kernels_that_make_its_columns_and_compiles_all_that_it_runs():
    """In processes of their own: the fingerprint covers exactly the modules that measuring a sweep imports."""
    definitions = SMALL | {"pendulum": {"grid": {}}}
    files, uncompiled = json.loads(python(MEASURE, json.dumps(definitions), "rigid_body", "tumbling", "pumped_body"))
    assert uncompiled == {"rigid_body": [], "tumbling": [], "pumped_body": []}
    for name in definitions:
        assert set(sources(*systems.resolve(name).kernels)) == {Path(file) for file in files[name]}, name


@pytest.mark.parametrize("column", [*survey.COLUMNS, *flips.COLUMNS], ids=lambda column: column.name)
def test_collapsed_columns_are_those_of_the_motions_at_their_own_spin_rates(column, monkeypatch):
    # a body that is no number about two axes has a status that is not 0: a wrong power changes each column
    values = [1.0] if column in flips.COLUMNS else [1.0, 1e-300]
    bodies = np.array([(I1, 1.5, 3.0, axis, rate) for I1 in values for axis in (1, 2, 3) for rate in (1.7, -2.3)]).T
    points = dict(zip(("I1", "I2", "I3", "axis", "omega0"), bodies, strict=True))
    points |= {"axis": points["axis"].astype(np.int64), "epsilon": np.full(bodies.shape[1], 1e-6)}
    points["phase"] = np.full(bodies.shape[1], 0.6)
    settings, options = (4.0, 16, 1e-10), {"nonlinear": column in flips.COLUMNS}
    motions = survey.measure_points(survey.as_motions(points), *settings, rounded=True, **options)
    for power in (column.power, *({-1, 0, 1, 2} - {column.power})):
        monkeypatch.setitem(survey.POWERS, column.name, power)
        columns = survey.measure_collapsed(points, *settings, **options)
        is_equal = np.array_equal(columns[column.name], motions[column.name], equal_nan=True)
        assert is_equal == (power == column.power), power


def test_rows_of_a_table_in_text_are_variables():
    variables = shared_variables.parse_rows(
        """
        rate        rad s-1  rate of the thing,
            measured
            comment: from samples,
            and from them alone
        rate_exact  rad s-1  rate of the thing, closed form
        """,
        shared_variables.STEPS,
        "drift  1  f4  largest change [check]",
    )
    rate = Variable("rate", "rad s-1", "rate of the thing, measured", comment="from samples, and from them alone")
    assert list(variables) == ["rate", "rate_exact", "steps_per_sample", "drift"]
    assert variables["rate"] == replace(rate, exact="rate_exact")
    assert variables["drift"] == Variable("drift", "1", "largest change", "f4", role=Role.CHECK)
    assert variables["steps_per_sample"] is shared_variables.STEPS
