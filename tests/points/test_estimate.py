import re
from types import SimpleNamespace

import numpy as np
import pytest
import repeated

import sweeps
from sweeps.maps import storage
from sweeps.points import catalogue
from sweeps.points import estimate as module
from sweeps.points.estimate import estimate_needs, refuse_if_too_large
from sweeps.points.loading import read_sweep
from sweeps.schema.refusals import DefinitionError
from sweeps.systems.rigid_body import system as rigid_body

AMPLE = 10**30


def sweep_of(num, **more):
    entries = {name: {"start": 1.0, "stop": 2.0, "num": num} for name in ("I1", "I2", "I3")}
    return read_sweep({"axes": [1, 2], "grid": entries | {"omega0": 1.0}} | more)


def test_an_estimate_counts_points_bytes_and_seconds(monkeypatch):
    monkeypatch.setattr(module, "_bytes_per_point", lambda sweep: 200)
    needs = estimate_needs(sweep_of(100, integration={"rotations": 8}))
    coordinates = 8 * (2 + 300 + 3)
    assert needs.points == 2_000_000
    assert needs.shards == 1
    sweep = sweep_of(100)
    names = sweep.variables | sweep.system.coordinates(sweep.definition)
    headers = module.FILE_BYTES + module.VARIABLE_BYTES * len(names)
    assert needs.disk_bytes == 2 * (2_000_000 * 200 + coordinates) + 2 * headers  # of one shard and the map
    assert needs.memory_bytes == 400_000_000 + 6 * 131_072 * 200 + coordinates
    assert needs.seconds == 4.0  # 2e6 runs of 128 samples at 64e6 samples/s


def test_a_small_sweep_holds_no_full_block():
    columns = (rigid_body.VARIABLES | rigid_body.CERTIFICATE).values()
    point = sum(np.dtype(variable.dtype).itemsize for variable in columns)
    assert estimate_needs(sweep_of(2)).memory_bytes == 400_000_000 + 6 * 16 * point + 8 * (2 + 6 + 3)


def test_any_size_is_estimated_without_making_the_grid():
    needs = estimate_needs(sweep_of(10**15))
    assert needs.points == 2 * 10**45
    assert needs.disk_bytes > 4 * 10**45 * 100  # shards and map, a hundred bytes a point at least
    assert needs.seconds == pytest.approx(2e39, rel=1e-15)  # one rounding of a double


@pytest.mark.parametrize("name", repeated.but(["tiny"], ["tiny", "bodies", "symmetric"]))
def test_no_map_that_ships_is_larger_than_said(name, tmp_path):
    storage.write_map(sweeps.survey(name), tmp_path / "map.nc")
    needs = estimate_needs(read_sweep(catalogue.find_definition(name)))
    assert (tmp_path / "map.nc").stat().st_size <= needs.disk_bytes / 2


def test_the_wait_holds_more_than_the_integration(monkeypatch):
    sweep, compile_time = sweep_of(100, integration={"flips": True}), [0.0]
    monkeypatch.setattr(module.compile_kernels, "compile_seconds", lambda sweep: compile_time[0])
    needs = estimate_needs(sweep)
    assert needs.wait_seconds > module.MEASURE_FACTOR * needs.seconds + 5  # start, pictures and report
    assert needs.compile_seconds == 0.0
    compile_time[0] = 2.0
    cold = estimate_needs(sweep)
    assert cold.compile_seconds == 2.0
    assert cold.wait_seconds - needs.wait_seconds == pytest.approx(cold.compile_seconds, rel=1e-12)  # sums, rounded


@pytest.mark.parametrize("short", ["disk", "memory"])
def test_what_does_not_fit_is_refused_with_both_sizes(monkeypatch, tmp_path, short):
    sweep = sweep_of(10)
    num_bytes = getattr(estimate_needs(sweep), f"{short}_bytes")
    room = {"disk": AMPLE, "memory": AMPLE, short: num_bytes - 1}
    monkeypatch.setattr(module.shutil, "disk_usage", lambda path: SimpleNamespace(free=room["disk"]))
    monkeypatch.setattr(module.psutil, "virtual_memory", lambda: SimpleNamespace(available=room["memory"]))
    with pytest.raises(DefinitionError) as error:
        refuse_if_too_large(sweep, estimate_needs(sweep), tmp_path)
    needed, free = rf"\({num_bytes:,} bytes\) of {short}", rf"\({num_bytes - 1:,} bytes\)"
    assert re.fullmatch(rf"sweep: grid: 2,000 points need .*{needed}; allowed: .*{free}.*", str(error.value))


def test_runs_whose_samples_do_not_fit_are_refused(tmp_path):
    """A spectrum needs all samples of a run at once: it filled the memory until the process was killed."""
    grid, runs = {"spin_rate": [1.0]}, {"rotations": 5e7, "samples_per_rotation": 20}
    sweep = read_sweep({"system": "gyrostat", "grid": grid, "integration": runs})
    with pytest.raises(DefinitionError, match=r"samples or draws of the points in work need .* of memory; allowed"):
        refuse_if_too_large(sweep, estimate_needs(sweep), tmp_path)


@pytest.mark.parametrize(
    ("size", "words"),
    [(999, "999 bytes"), (1500, "1.5 kB (1,500 bytes)"), (2_500_000_000, "2.5 GB (2,500,000,000 bytes)")],
)
def test_sizes_in_words(size, words):
    assert module.in_words(size) == words
