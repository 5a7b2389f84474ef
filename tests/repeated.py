"""Cases of one test of which some are quick tests, and the others, which repeat them, slow ones."""

import pytest


def but(quick, cases):
    """The cases, those that are not among the quick ones marked slow."""
    return [case if case in quick else pytest.param(case, marks=pytest.mark.slow) for case in cases]
