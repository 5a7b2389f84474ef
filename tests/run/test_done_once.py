"""Compiled code is the same where Numba's repeated work is spared, and all is as it was afterwards."""

import gc
import re

import numba
import numpy as np
import pytest
from numba import njit
from numba.core import analysis
from numba.core.cpu import CPUContext
from numba.core.postproc import PostProcessor
from numba.core.typing.context import Context
from numba.extending import overload

from sweeps.run import done_once

PATCHED = ((PostProcessor, "run"), (CPUContext, "load_additional_registries"), (Context, "load_additional_registries"))


def sums(n):
    """Loops, branches, arrays that live and die, and a function inside."""
    out = np.zeros(n)
    for i in range(n):
        part = np.arange(i + 1.0)
        if i % 2:
            part = part * 2.0
        out[i] = part.sum() if i > 1 else sum([x + 1.0 for x in part])
    return out


def text(compiled):
    """Its operations on floating point numbers, in order."""
    (code,) = compiled.inspect_asm().values()
    return re.findall(r"^\tv?\w+[ps]d\b", code, re.M)


@pytest.mark.compiled
def test_the_same_code_with_less_work(monkeypatch):
    live, found = analysis.compute_live_variables, []
    monkeypatch.setattr(analysis, "compute_live_variables", lambda *given: found.append(1) or live(*given))
    before = [getattr(*place) for place in PATCHED], gc.get_threshold()
    usual = njit(sums)
    np.testing.assert_array_equal(usual(5), [1, 4, 3, 12, 10])
    often = len(found)
    with done_once.done_once():
        spared = njit(sums)
        np.testing.assert_array_equal(spared(5), [1, 4, 3, 12, 10])
        assert gc.get_threshold()[0] == done_once.OBJECTS
    assert len(found) - often < often / 2
    assert len(text(spared)) > 20
    assert text(spared) == text(usual)
    assert ([getattr(*place) for place in PATCHED], gc.get_threshold()) == before


@pytest.mark.compiled
def test_what_somebody_adds_meanwhile_is_found():
    def added():
        """Python's own."""

    with done_once.done_once():
        assert njit(lambda: 1)() == 1
        overload(added)(lambda: lambda: 7)
        assert njit(lambda: added())() == 7


@pytest.mark.compiled
def test_generators_have_their_variables():
    with done_once.done_once():

        @njit
        def counted(n):
            for i in range(n):
                x = i * 2
                yield x

        assert list(counted(3)) == [0, 2, 4]


def test_another_numba_is_left_alone(monkeypatch):
    monkeypatch.setattr(done_once, "KNOWN", (0, 1))
    run = PostProcessor.run
    with done_once.done_once():
        assert PostProcessor.run is run
    assert numba.version_info.short != done_once.KNOWN
