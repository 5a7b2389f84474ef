"""The part of a page for systems with a signed square of a rate: the signed rate, and where linear theory ends."""

from pathlib import Path

FILES = tuple(Path(__file__).parent / name for name in ("nudges.html", "rates.js"))
