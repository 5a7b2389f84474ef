"""The second process begins when it is to, and not after its end."""

import multiprocessing

from sweeps.views import helper


def test_it_begins_when_it_is_told_to_and_once(tmp_path):
    with helper.helping(tmp_path / "map.nc", at_once=False) as waiting:
        assert not multiprocessing.active_children()
        waiting.begin()
        (begun,) = multiprocessing.active_children()
        waiting.begin()
        assert multiprocessing.active_children() == [begun]
    assert not multiprocessing.active_children()


def test_told_too_late_it_does_not_begin(tmp_path):
    with helper.helping(tmp_path / "map.nc", at_once=False) as waiting:
        pass
    waiting.begin()
    assert not multiprocessing.active_children()
