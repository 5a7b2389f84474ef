"""Lazy maps on processes of a Dask cluster."""

import os
import signal

import pytest

import sweeps
from sweeps.maps import storage

DEFINITION = {
    "title": "On a cluster",
    "grid": {
        "I1": {"start": 0.5, "stop": 1.5, "num": 12},
        "I2": {"start": 0.5, "stop": 1.5, "num": 12},
        "I3": [0.8, 1.0],
        "omega0": [1.0, -10.0],
    },
}


def kill_this_worker_once(mark):
    """Kills the worker that runs it, the first time."""
    if not mark.exists():
        mark.write_text("killed")
        os.kill(os.getpid(), signal.SIGKILL)
    return True


@pytest.mark.slow
def test_a_worker_killed_in_the_middle_changes_no_bit(tmp_path):
    dask_distributed = pytest.importorskip(
        "distributed", reason="distributed is not here: pip install -e . --group slow"
    )
    expected = sweeps.survey(DEFINITION).attrs["content_hash"]
    local = {"n_workers": 2, "threads_per_worker": 1, "processes": True, "dashboard_address": None}
    with dask_distributed.LocalCluster(**local) as cluster, dask_distributed.Client(cluster) as client:
        before = set(client.scheduler_info(n_workers=-1)["workers"])
        lazy = sweeps.survey(DEFINITION, chunks={"I1": 3, "axis": 1}).persist()
        death = client.submit(kill_this_worker_once, tmp_path / "killed", priority=10)
        content_hash = storage.write_map(lazy, tmp_path / "stability_map.nc")
        assert death.result()
        assert set(client.scheduler_info(n_workers=-1)["workers"]) != before
    assert (tmp_path / "killed").exists()
    assert content_hash == expected
