"""Commands of `polhode`, one module each. Heavy modules are imported only when a command runs.

Each module has `add(commands)`, which describes the command to argparse, and the function that runs it.
"""

NAMES = ("check", "run", "show", "point", "slice", "body", "motion", "tumbler", "compile", "shard", "merge", "figures")
NAMES += ("report", "verify", "schema")
