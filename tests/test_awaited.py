import importlib
import sys
from types import SimpleNamespace
from unittest import mock

from sweeps import awaited, lean


def test_what_awaits_a_module_is_done_once_it_is_loaded(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "awaited_by_nobody_else.py").write_text("value = 1\n")
    before, seen = list(sys.meta_path), []
    for _ in range(2):  # who asks again asks for the same
        awaited.once_loaded("awaited_by_nobody_else", lambda module: seen.append(module.value))
    importlib.import_module("json")
    assert seen == []
    module = importlib.import_module("awaited_by_nobody_else")
    assert seen == [1]
    assert sys.meta_path == before
    importlib.reload(module)
    awaited.once_loaded("awaited_by_nobody_else", lambda module: seen.append("now"))
    assert seen == [1, "now"]
    awaited.once_loaded("awaited_that_is_not_there", seen.append)
    assert importlib.util.find_spec("awaited_that_is_not_there") is None
    assert sys.meta_path == before


def test_a_module_that_waits_is_loaded_when_it_is_asked(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "asked_by_nobody_else.py").write_text("import sys\nsys.asked_of = True\nvalue = 1\n")
    before = list(sys.meta_path)
    awaited.once_asked("asked_by_nobody_else")
    module = importlib.import_module("asked_by_nobody_else")
    assert not hasattr(sys, "asked_of")
    assert sys.meta_path == before
    assert module.value == 1
    assert sys.asked_of
    del sys.asked_of, sys.modules["asked_by_nobody_else"]


def test_a_module_is_loaded_within_a_context(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "loaded_within.py").write_text("import sys\nvalue = sys.told_within\n")
    before = list(sys.meta_path)
    for _ in range(2):  # who asks again asks for the same
        awaited.while_loaded("loaded_within", lambda: mock.patch.object(sys, "told_within", 1, create=True))
    assert len(sys.meta_path) == len(before) + 1
    assert importlib.import_module("loaded_within").value == 1
    assert not hasattr(sys, "told_within")
    assert sys.meta_path == before
    del sys.modules["loaded_within"]


def test_whoever_looks_for_blas_finds_it_and_does_not_load_it(monkeypatch):
    monkeypatch.delitem(sys.modules, lean.BLAS, raising=False)
    with lean._with_blas_unloaded():
        assert importlib.import_module(lean.BLAS).__spec__ is None
    assert lean.BLAS not in sys.modules
    monkeypatch.setitem(sys.modules, lean.BLAS, "the real one")
    with lean._with_blas_unloaded():
        assert sys.modules[lean.BLAS] == "the real one"
    assert sys.modules[lean.BLAS] == "the real one"
    monkeypatch.delitem(sys.modules, lean.BLAS)
    monkeypatch.setattr(lean, "find_spec", lambda name: None)  # where there is no SciPy nobody may think so
    with lean._with_blas_unloaded():
        assert lean.BLAS not in sys.modules


def test_pictures_do_without_matplotlibs_manual():
    artist = SimpleNamespace(kwdoc=None)
    lean._without_its_manual(artist)
    assert artist.kwdoc(object()) == ""
