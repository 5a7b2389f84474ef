"""argparse as the commands need it: negative numbers of any spelling, and `--COORDINATE VALUE` of any map."""

import argparse
import re
from pathlib import Path
from typing import Any

from sweeps.schema.refusals import DefinitionError, cut_text, hint

_NEGATIVE = re.compile(r"-(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?\s*[^\s\d-]?.*")


class Parser(argparse.ArgumentParser):
    """A parser of one command, or of the choice between them.

    With `takes_coordinates`, whatever option is not the command's own counts as a coordinate's name: `--I1 0.5` and
    `--I1=0.5` come out in `coordinates`, {"I1": "0.5"}. The map determines which names exist.
    """

    takes_coordinates = False

    def parse_known_args(self, args=None, namespace=None):
        """Parse arguments as argparse does, with options `--DIMENSION VALUE` in `namespace.coordinates`."""
        arguments, coordinates = self._without_coordinates(list(args or ()))
        # a blank in front keeps argparse from taking -1e-3 for an option
        arguments = [f" {text}" if _NEGATIVE.fullmatch(text) else text for text in arguments]
        namespace, unknown = super().parse_known_args(arguments, namespace)
        if self.takes_coordinates:
            namespace.coordinates = coordinates
        return namespace, unknown

    def parse_args(self, args=None, namespace=None):
        """Parse arguments as argparse does; refuse an unknown option with the nearest known one."""
        namespace, unknown = self.parse_known_args(args, namespace)
        if unknown:
            options = getattr(namespace, "options", self._option_string_actions)
            near = hint(unknown[0].strip().partition("=")[0], options)
            self.error(f"{cut_text(unknown[0].strip())} is an unknown option{near}; allowed: {', '.join(options)}")
        return namespace

    def _check_value(self, action, value):
        """Refuse a value that is not among the choices of an option, with the nearest choice."""
        if action.choices is None or value in action.choices:
            return
        what = f"{cut_text(repr(value))} is unknown{hint(value, action.choices)}"
        raise argparse.ArgumentError(action, f"{what}; allowed: {', '.join(action.choices)}")

    def _without_coordinates(self, arguments: list[str]) -> tuple[list[str], dict[str, str]]:
        """Return (other arguments, coordinates): options unknown to the command are taken for coordinates."""
        command_words, coordinates = [], {}
        while self.takes_coordinates and arguments:
            name, equals, value = (text := arguments.pop(0)).partition("=")
            if not name.startswith("--") or len(name) < 3 or name in self._option_string_actions:
                command_words.append(text)
                continue
            if not equals and not arguments:
                self.error(f"{name}: a value is missing")
            coordinates[name[2:]] = value if equals else arguments.pop(0)
        return command_words + arguments, coordinates


def add(commands, name: str, help_text: str, run, epilog: str | None = None, coordinates: bool = False) -> Parser:
    """Add a command and return its parser.

    Args:
        commands: subparsers of the program.
        name: name of the command.
        help_text: effect of the command, a phrase that begins in lower case.
        run: function that takes the parsed arguments and returns the exit status, or None for 0.
        epilog: text below the options in the help.
        coordinates: True to accept `--DIMENSION VALUE`; see `Parser`.
    """
    texts: dict[str, Any] = {
        "help": help_text,
        "description": help_text[0].upper() + help_text[1:] + ".",
        "epilog": epilog,
    }
    raw = argparse.RawDescriptionHelpFormatter
    parser = commands.add_parser(name, formatter_class=raw, allow_abbrev=False, **texts)
    parser.set_defaults(run=run, options=parser._option_string_actions)
    parser.takes_coordinates = coordinates
    return parser


def number(text: str) -> int | float | str:
    """Return a whole number ("1e6" too) or a number; any further text without blanks around it, for later checks."""
    try:
        value = float(text)
    except ValueError:
        return text.strip()
    return int(value) if value.is_integer() else value


def setting(text: str) -> tuple[str, int | float | str]:
    """Return name and value of NAME=VALUE."""
    name, _, value = text.partition("=")
    return name, number(value)


# arguments that several commands have
SHARED: dict[str, dict[str, Any]] = {
    "definition": {"metavar": "DEFINITION", "help": "name of a shipped sweep, or path of a YAML file"},
    "map": {"metavar": "MAP", "help": "a map, or the folder it lies in, results/<sweep>"},
    "--digest": {"metavar": "SHA256", "help": "refuse a definition whose text and files have another SHA-256"},
    "--duration": {"type": number, "metavar": "T", "help": 'length of the motion, s ("2 min")'},
    "--samples": {"type": int, "metavar": "N", "help": "number of instants, both ends included"},
    "--json": {"action": "store_true", "help": "print JSON (a missing number is null)"},
}


def share(parser: Parser, *names: str, **options: Any) -> None:
    """Add arguments that several commands have."""
    for name in names:
        parser.add_argument(name, **SHARED[name] | options)


def add_output(parser: Parser, text: str, required: bool = True) -> None:
    """Add the option -o or --output FILE to a `parser`, with the help `text`, `required` or not."""
    parser.add_argument("-o", "--output", metavar="FILE", required=required, help=text)


def add_body(parser: Parser) -> None:
    """Add the argument NAME and the options that give a body and its spin."""
    quantities: dict[str, Any] = {"type": number, "metavar": "X"}
    parser.add_argument(
        "name", metavar="NAME", nargs="?", help="a body of the sweep `bodies` or of --definition, or a file"
    )
    parser.add_argument("--definition", metavar="DEFINITION", default="bodies", help="the definition that lists NAME")
    add_moments(parser)
    text = 'spin rate, rad s-1 ("30 rpm"; default the body\'s own, or 1)'
    parser.add_argument("--omega0", help=text, **quantities)
    parser.add_argument("--epsilon", help="relative size of the perturbation (default 1e-6)", **quantities)
    text = "direction of the perturbation in the transverse plane, rad (default 0.6)"
    parser.add_argument("--phase", help=text, **quantities)


def add_omega(parser: Parser, when: str) -> None:
    """Add the option for an angular velocity in any direction, `when` it is."""
    text = f"angular velocity {when}, rad s-1, in place of --axis and --omega0: in the axes of the tensor or the mesh, "
    text += "otherwise about axes 1, 2, 3"
    parser.add_argument("--omega", nargs=3, type=number, metavar="W", help=text)


BODY_FORMS = ("moments", "ratios", "tensor", "mesh", "rotational")  # options that give a body


def add_moments(parser: Parser) -> None:
    """Add the options that give the moments of inertia of a body."""
    quantities: dict[str, Any] = {"type": number, "metavar": "X"}
    parser.add_argument("--moments", nargs=3, help='I1 I2 I3, kg m2 ("12 kg cm2")', **quantities)
    parser.add_argument("--ratios", nargs=3, help="I1 I2 I3 in any one unit", **quantities)
    parser.add_argument("--tensor", nargs=9, help="tensor of inertia, row by row, kg m2", **quantities)
    parser.add_argument("--rotational", nargs=3, help='rotational constants A B C, MHz ("27.88 cm-1")', **quantities)
    text = "link of a robot file, or state of a file of parts, in place of FILE:NAME"
    parser.add_argument("--link", "--state", metavar="NAME", help=text)
    parser.add_argument("--mesh", metavar="FILE", help="a closed surface: STL, OBJ, PLY, OFF, GLB, DAE, TAB or TXT")
    parser.add_argument("--density", help="density of the mesh, kg m-3", **quantities)
    parser.add_argument("--mass", help="mass of the mesh, kg, in place of its density, or of the tensor", **quantities)
    text = "of the tensor's axes, m, for the check of a tensor"
    parser.add_argument(
        "--size", nargs=3, help=f"edges of the box around the body in the directions {text}", **quantities
    )
    parser.add_argument(
        "--centre", nargs=3, help=f"centre of mass from the link's origin, components {text}", **quantities
    )
    parser.add_argument("--unit", default="m", help="unit of length of the mesh: m (default), cm, mm, um, km, in, ft")


def body(args: argparse.Namespace) -> str | dict | None:
    """Return the body of `add_body`: its name, or its entry in a definition; None if no body is given."""
    from sweeps.reading.mesh import SUFFIXES

    if args.name and args.mesh is None and Path(args.name).suffix.lower() in SUFFIXES:
        args.name, args.mesh = None, args.name
    ways = {way: getattr(args, way) for way in BODY_FORMS if getattr(args, way)}
    if len(ways) + (args.name is not None) > 1:
        allowed = "NAME, --moments, --ratios, --tensor, --mesh or --rotational, one of them"
        raise DefinitionError(f"body: more than one is given; allowed: {allowed}")
    moments = ("I1", "I2", "I3")
    mesh = {"file": args.mesh, "density": args.density, "mass": args.mass, "unit": args.unit}
    evidence = {key: value for key in ("mass", "size", "centre") if (value := getattr(args, key)) is not None}
    if {"size", "centre"} & set(evidence) and not args.tensor:
        raise DefinitionError("body: --size and --centre are for the check of a tensor; allowed: with --tensor")
    entries = {
        "moments": lambda values: dict(zip(moments, values, strict=True)),
        "ratios": lambda values: {"ratios": dict(zip(moments, values, strict=True))},
        "tensor": lambda values: {"tensor": [values[i : i + 3] for i in (0, 3, 6)], **evidence},
        "rotational": lambda values: {"rotational": values},
        "mesh": lambda file: {"name": file, "mesh": {key: value for key, value in mesh.items() if value is not None}},
    }
    name = args.name if args.link is None else f"{args.name}:{args.link}"
    return next((entries[way](value) for way, value in ways.items()), name)
