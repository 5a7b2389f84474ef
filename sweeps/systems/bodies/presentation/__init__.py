"""Presentation that systems of bodies share."""

from pathlib import Path

from sweeps.systems.presentation import Page, turning

TRIANGLE = Path(__file__).parent / "triangle.js"
_NEEDED = frozenset({"I1", "I2", "I3", "omega0"})


def on_triangle(question: str, script: Path) -> Page:
    """Return a page that asks `question`, with the inertia triangle, the body turning and a script of the system."""
    return Page((*turning.FILES, TRIANGLE, script), question, "Space: play or pause.", needs=_NEEDED)
