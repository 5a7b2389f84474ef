"""Diagnose what is wrong with a trajectory."""


def diagnose(judgement):
    """Return the words of the diagnosis, each with its evidence."""
    return [("none" if judgement.verdict == "pass" else "unknown", "")]
