"""Docstrings, written for people who read code, as reStructuredText."""

import re

CODE = re.compile(r"``.+?``|:[a-z]+:`[^`]+`|`[^`]+`")
SIGNS = re.compile(r"\|(?=\S)|(?<=\S)\||(?<=\w)_(?=\W|$)")


def as_restructured(lines: list[str]) -> list[str]:
    """Return lines of a docstring as reStructuredText, with bars and trailing underscores escaped."""
    made, words, inside = [], [], None
    for line in lines:
        indent = len(line) - len(line.lstrip())
        if inside is not None and line.strip() and indent <= inside:
            inside = None
        if line.rstrip().endswith("::") or line.lstrip().startswith(".. "):
            inside = indent
        if inside is None:
            words.append(line)
        else:
            made += [*_words(words), line]
            words = []
    return made + _words(words)


def _words(lines: list[str]) -> list[str]:
    """Lines of prose, in which a formula may go on from one line to the next."""
    text, parts, last = "\n".join(lines), [], 0
    for code in CODE.finditer(text):
        parts += [_escaped(text[last : code.start()]), _as_code(code[0])]
        last = code.end()
    return "".join([*parts, _escaped(text[last:])]).split("\n") if lines else []


def _escaped(text: str) -> str:
    return SIGNS.sub(lambda sign: "\\" + sign[0], text)


def _as_code(text: str) -> str:
    return text if text.startswith(("``", ":")) else f"`{text}`"
