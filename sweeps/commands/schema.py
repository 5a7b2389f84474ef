"""`schema`: what a definition may say, as JSON Schema, for editors."""

import json
from pathlib import Path

from sweeps.commands import parser

EPILOG = """\
Editors with a YAML language server complete keys and mark mistakes from it:

  polhode schema -o polhode.schema.json
  # yaml-language-server: $schema=polhode.schema.json      (the first line of my.yaml)

For a system described in a Python file, give its name or file: its grid has its own parameters.
"""


def add(commands) -> None:
    """Add the command to the parser."""
    command = parser.add(commands, "schema", "print the JSON Schema of definitions, for editors", _run, EPILOG)
    text = "a shipped system, or the path of a Python file that describes one"
    command.add_argument("systems", metavar="SYSTEM", nargs="*", help=text)
    command.add_argument("-o", "--output", metavar="FILE", help="write the schema to FILE")


def _run(args):
    from sweeps.points import editors
    from sweeps.process.files import replaced

    text = json.dumps(editors.schema(args.systems), indent=1)
    if not args.output:
        print(text)
        return
    with replaced(args.output) as temporary:
        Path(temporary).write_text(text + "\n", encoding="utf-8")
