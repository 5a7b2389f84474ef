"""What kernels alone call is compiled as a part of them, found there again, and made whole when Python calls it."""

import importlib.util
import itertools
import os
import subprocess
import sys
from pathlib import Path

import numba
import numpy as np
import pytest
from numba.core.codegen import CPUCodeLibrary
from numba.core.dispatcher import Dispatcher

from sweeps.run import linked_parts
from sweeps.run.linked_parts import FOLDER, parts_for_the_linker

ROOT = Path(linked_parts.__file__).parents[2]
SOURCE = """\
import numpy as np
from numba import njit

@njit(cache=True, no_cfunc_wrapper=True)
def square(x):
    if not x == x:
        raise ValueError("no number")
    return x * x

@njit(cache=True, no_cfunc_wrapper=True)
def squares(n):
    out = np.empty(n)
    for i in range(n):
        out[i] = square(i + 0.5)
    return out
"""
DECLARED = """
@njit("float64(float64)", cache=True, no_cfunc_wrapper=True)
def cube(x):
    return x * square(x)
"""
SUMMED = """
@njit(cache=True, no_cfunc_wrapper=True)
def total(n):
    return squares(n).sum()
"""
COUNT = itertools.count()


@pytest.fixture
def compiling(tmp_path, monkeypatch):
    """Imports the functions afresh, as another process would, and returns them and the names of what is stored."""
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path / "cache"))
    (tmp_path / "squared.py").write_text(SOURCE)

    def again():
        spec = importlib.util.spec_from_file_location("squared", tmp_path / "squared.py")
        module = importlib.util.module_from_spec(spec)
        monkeypatch.setitem(sys.modules, "squared", module)
        spec.loader.exec_module(module)
        return module

    def found():
        files = (tmp_path / "cache").rglob("*.nbc")
        return sorted((file.name.split("-")[0].split(".")[1], file.parent.name == FOLDER) for file in files)

    return again, found


@pytest.mark.compiled
def test_what_python_calls_is_whole_and_the_rest_a_part_until_python_calls_it(compiling):
    again, stored = compiling
    first = again()
    with parts_for_the_linker():
        np.testing.assert_array_equal(first.squares(3), [0.25, 2.25, 6.25])
    assert stored() == [("square", True), ("squares", False)]
    assert first.square(1.5) == 2.25  # compiled now
    assert stored() == [("square", False), ("square", True), ("squares", False)]
    with pytest.raises(ValueError, match="no number"):
        first.square(np.nan)


@pytest.mark.compiled
def test_what_is_declared_with_its_signature_is_whole(compiling, tmp_path):
    again, stored = compiling
    (tmp_path / "squared.py").write_text(SOURCE + DECLARED)
    with parts_for_the_linker():
        first = again()
    assert stored() == [("cube", False), ("square", True)]
    assert first.cube(2.0) == 8.0


@pytest.mark.compiled
def test_a_part_is_found_where_it_is_stored(compiling):
    again, stored = compiling
    with parts_for_the_linker():
        again().square.compile((numba.float64,))
    assert stored() == [("square", True)]
    second = again()
    with parts_for_the_linker():
        np.testing.assert_array_equal(second.squares(2), [0.25, 2.25])
        assert second.square(3.0) == 9.0  # by Python, with its part at hand
    assert stored() == [("square", False), ("square", True), ("squares", False)]
    third = again()
    np.testing.assert_array_equal(third.squares(2), [0.25, 2.25])
    assert sum(third.squares.stats.cache_hits.values()) == 1


@pytest.mark.compiled
def test_a_part_that_calls_another_is_optimised_where_it_is_linked_alone(compiling, monkeypatch, tmp_path):
    (tmp_path / "squared.py").write_text(SOURCE + SUMMED)
    key, optimised = (CPUCodeLibrary, "_optimize_final_module"), []
    optimise = linked_parts._original[key]
    monkeypatch.setitem(
        linked_parts._original, key, lambda library: (optimised.append(library.name), optimise(library))
    )
    with parts_for_the_linker():
        assert compiling[0]().total(3) == 8.75
    assert [name for name in optimised if name in {"square", "squares", "total"}] == ["square", "total"]


@pytest.mark.compiled
def test_what_is_stored_whole_is_a_part_too(compiling):
    again, stored = compiling
    assert again().square(1.5) == 2.25
    second = again()
    with parts_for_the_linker():
        np.testing.assert_array_equal(second.squares(2), [0.25, 2.25])
        assert second.square(3.0) == 9.0
    assert second.square(2.0) == 4.0
    assert stored() == [("square", False), ("squares", False)]


@pytest.mark.slow
@pytest.mark.compiled
def test_what_another_process_stored_whole_is_linked(tmp_path):
    """Its address is asked for when it is loaded: it must be there."""
    (tmp_path / "squared.py").write_text(SOURCE)
    environment = {
        **os.environ,
        "NUMBA_CACHE_DIR": str(tmp_path / "cache"),
        "PYTHONPATH": os.pathsep.join([str(tmp_path), str(ROOT)]),
    }
    linked = (
        "from sweeps.run.linked_parts import parts_for_the_linker as parts\nwith parts(): print(squared.squares(2))"
    )
    for code, told in (("print(squared.square(1.5))", "2.25"), (linked, "[0.25 2.25]")):
        command = [sys.executable, "-c", f"import squared\n{code}"]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
        assert (done.returncode, done.stdout.strip()) == (0, told), done.stderr


@pytest.mark.compiled
def test_kernels_are_whole_where_tests_are_to_call_them(compiling):
    again, stored = compiling
    with parts_for_the_linker(ours=False):
        again().squares(2)
    assert stored() == [("square", False), ("squares", False)]


@pytest.mark.compiled
@pytest.mark.parametrize("known", [(0, 1), linked_parts.KNOWN])
def test_another_numba_is_left_alone_and_this_one_as_it_was(compiling, monkeypatch, known):
    monkeypatch.setattr(linked_parts, "KNOWN", known)
    compile_, finalize = Dispatcher.compile, CPUCodeLibrary._finalize_final_module
    again, stored = compiling
    with parts_for_the_linker():
        assert (Dispatcher.compile is compile_) == (known == (0, 1))
        again().squares(2)
    assert stored()[0] == ("square", known != (0, 1))
    assert (Dispatcher.compile, CPUCodeLibrary._finalize_final_module) == (compile_, finalize)


@pytest.mark.compiled
def test_the_numba_that_is_here_is_known():
    assert numba.version_info.short == linked_parts.KNOWN
