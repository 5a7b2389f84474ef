"""What maps and definitions have in common."""

CONTRACT_VERSION = "2.0"
DEFAULT_SYSTEM = "rigid_body"  # of a definition, or a map, that names none
