"""Contents of definitions and maps: values, parameters, variables, messages about invalid input."""

DEFAULT_SYSTEM = "rigid_body"  # system of a definition or a map that names none
