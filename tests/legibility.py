"""Counts of what makes code and prose hard to read, with every place: names, constants, docstrings, sentences.

    PYTHONPATH=tests python tests/legibility.py               # each figure of kernels and sweeps
    PYTHONPATH=tests python tests/legibility.py vague         # every place of one figure

The bars in tests/test_language.py are the habits of scientific packages that are known to read well.
"""

import ast
import re
import sys
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[1]
ALLOWED = {line.split()[0] for line in (ROOT / "tests/language_allowed.txt").read_text(encoding="utf-8").splitlines()}
PARTICIPLES = frozenset(
    """been begun bent broken brought built bought caught chosen done drawn driven eaten fallen felt fought found flown
    forgotten given gone grown heard held hidden kept known laid led lent lost made meant met paid risen said seen sent
    shown shut sold spent spread stood struck sworn swept taken taught thought thrown told understood woken worn written
    wound left""".split()  # noqa: SIM905
)
ADJECTIVES = frozenset(  # terms of the field and plain words with the endings of participles
    """allowed bound measured compiled fixed scaled perturbed compared reduced undecided rounded varied certified
    requested derived fitted parsed coupled averaged spread nothing bounded seed need feed speed embed bed red unsigned
    shared exceed shed string ring thing spacing spring king rounding setting mapping loading timing drawing padding
    missing warning ordering encoding scaling logging parsing damping coupling sampling heading testing wing swing
    bearing opening binning meaning fitting bounding stopping smoothing ceiling reading writing""".split()  # noqa: SIM905
)
VAGUE = frozenset(
    """one ones some other others another rest part parts piece thing things most least wrong whole beside besides apart
    within both few many much own same such else then there here again once twice further farther furthest away off
    beyond wide alike sound turn look room""".split()  # noqa: SIM905
)
HABITS = {  # figure → words of prose that hide their noun or their verb
    "what": r"\bwhat\b",
    "where": r"\bwhere\b(?!\s+[`:$]*\S{1,8}[`)]?\s+(?:is|are|denotes?)\b)",
    "whose": r"\bof (?:which|whom|whose)\b|\bwhose\b",
    "pronoun": r"\bone (?:that|of|which|whose|by|and|for)\b|\bthe one\b|\bones\b|\bothers?\b(?! than)|\bthe rest\b",
    "beside": r"\bbesides?\b",
    "hold": r"\b(?:held|holds?|stands?)\b"
    r"|\bl(?:ies|ie)\b(?! (?:in|inside|between|outside|on|within|at|series|group|algebra)\b)",
    "say": r"\b(?:asks?|asked|tells?|told|said|says?|knows?|looks?|looked|sees|seen)\b",
}
FRAGMENT = re.compile(
    r"(of|in|at|to|by|from|over|beside|about|times|per|with|where|what|whose|beyond|that|which|who|whether|and|or|as|so"
    r"|for)\b"
)
STRING_OR_COMMENT = re.compile(r"(\"\"\"|''')(?s:\\.|.)*?\1|([\"'])(?:\\.|.)*?\2|#.*")
QUESTION = re.compile(r"(What|Whether|How|Where|Who|Whose|Which|In what|Of what)\b")


@cache
def nodes_of(path):
    """Return all nodes of the syntax tree of a file, the module first."""
    return [*ast.walk(ast.parse(path.read_text(encoding="utf-8")))]


@dataclass
class Figure:
    """Places of one habit, and how many places there could be."""

    places: list[str] = field(default_factory=list)
    total: int = 0

    def share(self, base: int) -> float:
        """Return the number of places among so many."""
        return base * len(self.places) / max(self.total, 1)


def is_participle(name):
    """Return True for a name that consists of participles, with vague or short words at most."""
    words = name.strip("_").split("_")
    if len(words) > 1:
        return any(map(is_participle, words)) and all(len(w) < 4 or is_participle(w) or w in VAGUE for w in words)
    (word,) = words
    if len(word) < 4 or not word.isalpha() or not word.islower() or word in ADJECTIVES:
        return False
    return word in PARTICIPLES or word.endswith(("ed", "ing"))


def names_of(node):
    """Yield the names that a node of a syntax tree defines: functions, parameters, variables, attributes."""
    if isinstance(node, ast.FunctionDef):
        yield node.name
        yield from (argument.arg for argument in (*node.args.args, *node.args.kwonlyargs))
    elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
        yield node.id
    elif isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
        yield node.attr


def prose_of(text, nodes):
    """Yield (line, text) of each docstring and each comment."""
    for node in nodes:
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and ast.get_docstring(node):
            yield node.body[0].lineno, ast.get_docstring(node)
    for match in STRING_OR_COMMENT.finditer(text):
        if match[0].startswith("#"):
            yield text.count("\n", 0, match.start()) + 1, match[0].lstrip("#: ")


def constants_of(tree, lines):
    """Yield (line, name, comment) of the constants of a module and its classes."""
    for body in (tree.body, *(node.body for node in tree.body if isinstance(node, ast.ClassDef))):
        for node in body:
            if isinstance(node, ast.Assign | ast.AnnAssign):
                target = ast.unparse(node.target if isinstance(node, ast.AnnAssign) else node.targets[0]).strip("()")
                comment = re.search(r"#:?\s*(.*)$", lines[node.end_lineno - 1])
                above = lines[max(0, node.lineno - 3) : node.lineno - 1]
                if not comment and [line.strip()[:1] == "#" for line in above] in ([True], [False, True]):
                    comment = re.match(r"\s*#:?\s*(.*)$", above[-1])
                if target.replace("_", "").replace(", ", "").isupper():
                    yield node.lineno, target, comment[1] if comment else ""


def lacks_parameters(function):
    """Return True if the docstring of a function does not name each parameter; a short name counts in backquotes."""
    doc = ast.get_docstring(function) or ""
    arguments = [a.arg for a in (*function.args.posonlyargs, *function.args.args, *function.args.kwonlyargs)]
    patterns = [
        rf"\b{name}\b" if len(name) > 2 else rf"`{name}`|\b{name}\s*[:,]"
        for name in arguments
        if name not in ("self", "cls")
    ]
    return not all(re.search(pattern, doc) for pattern in patterns)


def has_to_name_parameters(function):
    """Return True for public functions of three and more parameters that do not override or overload another."""
    arguments = [*function.args.posonlyargs, *function.args.args, *function.args.kwonlyargs]
    count = sum(argument.arg not in ("self", "cls") for argument in arguments)
    decorators = " ".join(ast.unparse(decorator) for decorator in function.decorator_list)
    return count >= 3 and not function.name.startswith("_") and "over" not in decorators


def measure(tops=("kernels", "sweeps")):
    """Return figure → `Figure` of the Python files below some folders."""
    names = ("participles", "vague", "single", "constants", "modules", "parameters", "short", *HABITS)
    figures = {name: Figure() for name in names}
    for path in sorted(path for top in tops for path in (ROOT / top).rglob("*.py")):
        _add_file(figures, path)
    return figures


def _add_file(figures, path):
    text, place = path.read_text(encoding="utf-8"), str(path.relative_to(ROOT))
    nodes, lines = nodes_of(path), text.splitlines()
    tree = nodes[0]

    def add(name, line, found, is_bad):
        figures[name].total += 1
        if is_bad:
            figures[name].places.append(f"{place}:{line}: {found}")

    outer = [node for node in nodes if isinstance(node, ast.Module | ast.ClassDef)]
    outer_functions = [f for node in outer for f in node.body if isinstance(f, ast.FunctionDef)]
    for function in filter(has_to_name_parameters, outer_functions):
        add("parameters", function.lineno, function.name, lacks_parameters(function))
    for node in nodes:
        for name in names_of(node):
            is_checked = name not in ALLOWED
            add("participles", node.lineno, name, is_checked and is_participle(name))
            add("vague", node.lineno, name, is_checked and name.strip("_").lower() in VAGUE)
            add("short", node.lineno, name, len(name.strip("_")) <= 2 and "kernels" not in path.parts)
        if isinstance(node, ast.FunctionDef) and not node.name.startswith("__"):
            add("single", node.lineno, node.name, "_" not in node.name.strip("_"))
    for line, name, comment in constants_of(tree, lines):
        is_bad = re.search(r"(^|[, _])(MOST|LEAST)(_|,|$)", name) or FRAGMENT.match(comment)
        add("constants", line, name, is_bad)
    head = ast.get_docstring(tree) or ""
    add("modules", 1, head.partition("\n")[0], QUESTION.match(head))
    for line, prose in prose_of(text, nodes):
        words = len(re.findall(r"[A-Za-z']+", prose))
        for name, pattern in HABITS.items():
            figures[name].total += words
            for found in re.finditer(pattern, prose, re.IGNORECASE):
                around = prose[max(0, found.start() - 40) : found.end() + 40]
                figures[name].places.append(f"{place}:{line}: {around!r}")


if __name__ == "__main__":
    for name, figure in measure().items():
        if name in sys.argv[1:]:
            print(*figure.places, sep="\n")
        elif len(sys.argv) == 1:
            print(f"{name:12s} {len(figure.places):5d} of {figure.total:6d}")
