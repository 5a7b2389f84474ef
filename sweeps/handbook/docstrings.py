"""Docstrings, written for people who read code, as reStructuredText."""

import re

CODE = re.compile(r"``.+?``|:[a-z]+:`[^`]+`|`[^`]+`")
SIGNS = re.compile(r"\|(?=\S)|(?<=\S)\||(?<=\w)_(?=\W|$)|(?<![\w*])\*(?![\w*][^*]*\*(?!\w))")


def as_restructured(lines: list[str]) -> list[str]:
    """Lines in which a bar begins no substitution and a name that ends in _ no link; formulas and code stay."""
    made, inside = [], None
    for line in lines:
        indent = len(line) - len(line.lstrip())
        if inside is not None and line.strip() and indent <= inside:
            inside = None
        made.append(line if inside is not None else _line(line))
        if line.rstrip().endswith("::") or line.lstrip().startswith(".. math::"):
            inside = indent
    return made


def _line(line: str) -> str:
    parts, last = [], 0
    for code in CODE.finditer(line):
        parts += [_escaped(line[last : code.start()]), _as_code(code[0])]
        last = code.end()
    return "".join([*parts, _escaped(line[last:])])


def _escaped(text: str) -> str:
    return SIGNS.sub(lambda sign: "\\" + sign[0], text)


def _as_code(text: str) -> str:
    return text if text.startswith(("``", ":")) else f"`{text}`"
