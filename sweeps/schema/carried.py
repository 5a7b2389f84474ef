"""What maps and definitions have in common."""

import re

CONTRACT_VERSION = "3.0"


def is_readable(version: str) -> bool:
    """Return whether a map of this version of the contract can be read: one of the same major version."""
    return bool(re.fullmatch(rf"{CONTRACT_VERSION.split('.')[0]}\.\d+", version))


DEFAULT_SYSTEM = "rigid_body"  # of a definition, or a map, that names none
