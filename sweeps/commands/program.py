"""The program `polhode`: all of its commands, `--version` and `--completion`."""

import argparse
from collections.abc import Callable

import sweeps
from sweeps.commands import bodies, certifying, definitions, maps, modes
from sweeps.commands.parser import Parser

DESCRIPTION = """\
Stability maps of rotating rigid bodies, measured from integrated motion.

A DEFINITION is the name of a shipped sweep (see `check --list`) or the path of a YAML file. A MAP is the file that
`run` writes, results/<sweep>/stability_map.nc.
"""

EPILOG = """\
your own sweep:
  polhode check my.yaml                      validate it, and predict its size and time
  polhode run my.yaml                        write its map, figures and report to results/my
  polhode show results/my/stability_map.nc   summarise the map
  polhode verify results/my                  compare the map with its definition
the same with the workflow:
  snakemake --cores 2 --config definition=my.yaml
and by hand:
  polhode compile                            compile the kernels, once per machine
  polhode shard my.yaml 1 2 -o a.nc          first half of the points
  polhode shard my.yaml 2 2 -o b.nc          second half
  polhode merge my.yaml a.nc b.nc -o map.nc
  polhode figures map.nc -o figures
  polhode report map.nc -o report.html

exit status: 0 done; 2 invalid input, or not enough memory or disk (see message; no file is half-written); 3 the verdict
`fail` of `certify`, or a spin that is not as `body --require` needs it; 130 interrupted; 1 anything else (of `verify`:
the map differs)
"""

# each adds its command to the parser, in the order of the help
COMMANDS: tuple[Callable, ...] = (definitions.add_check, definitions.add_run, maps.add_show, maps.add_point)
COMMANDS += (
    modes.add_critical,
    modes.add_modes,
    modes.add_response,
    maps.add_slice,
    bodies.add_body,
    bodies.add_motion,
    certifying.add_certify,
)
COMMANDS += (
    bodies.add_page,
    bodies.add_cases,
    bodies.add_tumbler,
    definitions.add_compile,
    definitions.add_shard,
    definitions.add_merge,
)
COMMANDS += (maps.add_figures, maps.add_report, maps.add_verify, definitions.add_schema)


def build() -> tuple[Parser, dict[str, Parser]]:
    """Return the parser of the program, and that of each command."""
    raw = argparse.RawDescriptionHelpFormatter
    program = Parser("polhode", description=DESCRIPTION, epilog=EPILOG, formatter_class=raw, allow_abbrev=False)
    program.add_argument("--version", action=_Version, nargs=0, help="show program's version number and exit")
    text = "print a script that completes commands and options in this shell, and stop (needs the extra `completion`)"
    program.add_argument("--completion", choices=("bash", "zsh", "tcsh"), action=_Completion, help=text)
    commands = program.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for add in COMMANDS:
        add(commands)
    return program, commands.choices


class _Version(argparse.Action):
    """Print the version; argparse's own action would hide that there is no room for it."""

    def __call__(self, parser, namespace, values, option_string=None):
        print(f"Polhode {sweeps.__version__}")
        parser.exit()


class _Completion(argparse.Action):
    """Print a script with which a shell completes commands, options and files."""

    def __call__(self, parser, namespace, shell, option_string=None):
        try:
            import shtab
        except ImportError:
            parser.error("--completion: needs shtab, which is not here; allowed: pip install -e '.[completion]'")
        program, commands = build()
        for action in (action for parser in (program, *commands.values()) for action in parser._actions):
            if action.metavar in ("FILE", "MAP", "DEFINITION", "SHARD"):
                action.complete = shtab.FILE
        print(shtab.complete(program, shell))
        parser.exit()
