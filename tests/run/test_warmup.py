import json

import pytest

from kernels import stored
from sweeps.run import warmup


class System:
    """One that counts how often it is compiled."""

    def __init__(self, folder):
        self.mark = folder / "compiled"
        self.times = 0

    def compiled(self):
        return self.mark

    def compile(self):
        self.times += 1


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setattr(warmup, "cache_folder", lambda: tmp_path)
    return tmp_path


@pytest.fixture
def system(folder):
    return System(folder)


def test_what_is_compiled_and_whole_is_not_compiled_again(system):
    warmup.compile_system(system)
    assert system.times == 1
    warmup.compile_missing(system)
    assert system.times == 1


@pytest.mark.parametrize("said", [None, "another fingerprint\n", b"\xff"])
def test_what_is_missing_or_of_another_version_or_processor_is_compiled(system, said):
    if said is not None:
        system.mark.write_bytes(said if isinstance(said, bytes) else said.encode())
    warmup.compile_missing(system)
    assert system.times == 1


def test_what_was_damaged_is_compiled_once(system, folder):
    warmup.compile_system(system)
    (folder / stored.LEDGER).write_text(json.dumps({"kernels/f.1.nbc": stored.GONE}))
    warmup.compile_missing(system)
    warmup.compile_missing(system)
    assert system.times == 2
    assert stored.is_whole(folder)
