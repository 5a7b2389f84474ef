"""Time, memory and output of a child process that reads a file from outside."""

import mmap
import resource

import pytest

from sweeps.reading import sandbox


def test_a_look_has_seconds_of_its_own_and_more_for_a_large_file():
    def read_limits():
        return {
            "seconds": resource.getrlimit(resource.RLIMIT_CPU)[0],
            "core": resource.getrlimit(resource.RLIMIT_CORE)[0],
        }

    assert sandbox.run_in_child(read_limits, 2**20) == {"seconds": 9, "core": 0}  # eight and the first
    assert sandbox.run_in_child(read_limits, 3 * 2**30)["seconds"] == 11


def test_what_is_told_is_read_to_its_end_whatever_its_length():
    text = "x" * 300_000  # a pipe buffers 65,536 bytes
    assert sandbox.run_in_child(lambda: {"text": text}, 0) == {"text": text}


def test_a_look_has_room_beside_what_its_parent_has_mapped():
    """Mapped is more than used: the child's limit counts from the former."""
    with mmap.mmap(-1, 2**31):
        assert sandbox.run_in_child(lambda: {"taken": len(bytearray(2**27))}, 0) == {"taken": 2**27}
    with pytest.raises(sandbox.ChildError, match=r"^$"):
        sandbox.run_in_child(lambda: {"taken": len(bytearray(2**30))}, 0)
