"""Contents of definitions and maps: values, parameters, variables, messages about invalid input."""
