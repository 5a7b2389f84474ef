"""The commands of `polhode`, one module each; a module imports what is heavy only when its command runs.

Each module has `add(commands)`, which describes the command to argparse, and the function that runs it.
"""

NAMES = (
    "check",
    "run",
    "show",
    "point",
    "slice",
    "body",
    "tumbler",
    "compile",
    "shard",
    "merge",
    "figures",
    "report",
    "verify",
    "schema",
)
