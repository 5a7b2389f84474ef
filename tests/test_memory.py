import platform

import pytest
from calls import python

ASKED = """
import resource, sys
import numpy as np
from sweeps.process import machine
if sys.argv[1] == "kept":
    machine.keep_freed_memory()
def block():
    for column in [np.empty(2**17) for _ in range(16)]:
        column.fill(1.0)
block()
before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
for _ in range(20):
    block()
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
held = int(open("/proc/self/statm").read().split()[1])
machine.return_freed_memory()
print(held - int(open("/proc/self/statm").read().split()[1]))
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="the setting is glibc's")
def test_what_is_kept_is_not_asked_for_again_and_is_given_back_at_the_end():
    faults, pages_returned = {}, {}
    for how in ("kept", "given back"):
        faults[how], pages_returned[how] = map(int, python(ASKED, how).split())
    # 20 blocks of 16 MiB are 81,920 pages
    assert faults["given back"] > 10_000
    assert faults["kept"] < 500
    assert pages_returned["kept"] > 4000  # most of the last block's 4,096


def test_another_c_library_is_left_alone(monkeypatch):
    from sweeps.process import machine

    monkeypatch.setattr(machine.ctypes, "CDLL", lambda _: object())
    machine.keep_freed_memory()
    machine.return_freed_memory()
