"""Cases of a test: quick cases, and slow cases that repeat them."""

import pytest


def but(quick, cases):
    """Return the cases; those that are not in `quick` are marked slow."""
    return [case if case in quick else pytest.param(case, marks=pytest.mark.slow) for case in cases]
