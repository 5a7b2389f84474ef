"""What a call of `snakemake` asks for, known before the workflow is built.

Snakemake tells a Snakefile its config but not its targets; its own parser reads them from the command line.
"""

import sys
from pathlib import Path

from snakemake.cli import get_argument_parser


def on_command_line() -> list[str]:
    """Targets of the running `snakemake` command; none where it was not started from a command line."""
    if not Path(sys.argv[0]).name.startswith(("snakemake", "__main__")):
        return []
    try:
        arguments, _ = get_argument_parser().parse_known_args(sys.argv[1:])
    except SystemExit:  # Snakemake itself has accepted these arguments, or will say what is wrong
        return []
    return [str(target) for target in arguments.targets or ()]
