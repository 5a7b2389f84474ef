"""`--completion SHELL`: a script with which a shell completes commands, options and files."""

import argparse

SHELLS = ("bash", "zsh", "tcsh")


def add(parser: argparse.ArgumentParser) -> None:
    """Add the option to the parser."""
    text = "print a script that completes commands and options in this shell, and stop (needs the extra `completion`)"
    parser.add_argument("--completion", choices=SHELLS, action=_Completion, help=text)


class _Completion(argparse.Action):
    def __call__(self, parser, namespace, shell, option_string=None):
        """Print the script of one shell."""
        try:
            import shtab
        except ImportError:
            parser.error("--completion: needs shtab, which is not here; allowed: pip install -e '.[completion]'")
        _mark_files(parser, shtab.FILE)
        parser.prog = "polhode"
        print(shtab.complete(parser, shell))
        parser.exit()


def _mark_files(parser: argparse.ArgumentParser, file: dict) -> None:
    """Mark the arguments that are files."""
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for command in action.choices.values():
                _mark_files(command, file)
        elif action.metavar in ("FILE", "MAP", "DEFINITION", "SHARD"):
            action.complete = file
