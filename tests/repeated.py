"""Cases of a test: quick cases, and slow cases that repeat them."""

import os

import pytest


def but(quick, cases):
    """Return the cases; those that are not in `quick` are marked slow."""
    return [case if case in quick else pytest.param(case, marks=pytest.mark.slow) for case in cases]


def number(some, every):
    """Return how often a test repeats its statement: `every` with POLHODE_ALL_CASES=1, else `some`."""
    return every if os.environ.get("POLHODE_ALL_CASES") else some
