"""Values read from JSON and from YAML: their maximum depth, mappings as written, whole numbers."""

from sweeps.schema.refusals import UnreadableError, cut_text

MAX_DEPTH = 20
MAX_FILE_BYTES = 2**20  # bytes of a definition's file, and of an attribute


class Pairs(tuple):
    """A mapping as it was written: (key, value) pairs, any key, perhaps twice."""


def whole_number(text: str, where: tuple = ()) -> int:
    """Parse a whole number, refusing one with too many digits."""
    if len(text) > 1000:  # int() refuses beyond 4,300 digits, and no double reaches 1,000
        problem = f"is a number of {len(text):,} digits"
        raise UnreadableError(where, cut_text(text), problem, "numbers up to 1.8e308")
    return int(text)
