"""The language of texts for readers: docstrings begin with a verb, and no text uses the listed phrases."""

import ast
import re
from pathlib import Path

import legibility
import pytest

ROOT = Path(__file__).parents[1]
VERBS = frozenset(
    """Add Advance Announce Answer Append Apply Bound Break Broadcast Check Claim Close Collect Compare Compile
    Compute Convert Copy Count Cut Define Delete Derive Diagonalise Do Draw Embed Enclose End Estimate Exchange Feed
    Fill Find Fit Flush Follow Force Forget Format Give Handle Hatch Have Integrate Join Keep Leave Let Look
    Lock Make Mark Measure Merge Narrow Note Open Overwrite Pack Parse Pickle Predict Prepare Print Project Put Raise
    Rasterise,
    Read Read, Reduce Reflect Refuse Register Relabel Remove Replace Report Return Rewrite Rotate Run Sample
    Seal Search Select Separate Set Show Silence Simplify Sort Start Step Store Submit Subtract Summarise Take
    Touch Turn Widen Work, Write Yield""".split()  # noqa: SIM905
)
PHRASES = re.compile(
    r"as theory has it|as theory has them|as it is known|not sure|is no body|can exist|cannot exist|what was given is"
    r" wrong|\bnudg(e|ed|es)\b|seen from space|goes round|square of the rate|reduced to zero|the finite amplitude adds"
    r"|share of the start|kind of body|room of|share of the way|lacks of half|and said\b|what was finished stays"
    r"|under an unknown key|\(nothing\)|denormal|free fall|where it rests|its motion, followed|what moves|by room"
    r"|where it comes from|nobody else|what becomes|the error told|told apart|as it was asked|grid's nearest"
    r"|its least axis|distance of the direct solution|what the twist lacks|\bDoors\b|^## (Two lines|Your own)$",
    re.IGNORECASE | re.MULTILINE,
)

SOURCES = {  # figure of `legibility` → (number by which its share is multiplied, largest value)
    "participles": (100, 1.0),  # % of names
    "vague": (100, 0.3),  # % of names
    "single": (100, 50.0),  # % of functions
    "constants": (1, 0.0),
    "modules": (1, 0.0),
    "parameters": (100, 10.0),  # % of public functions of three and more parameters
    "what": (1000, 1.0),  # from here on for 1,000 words
    "where": (1000, 2.0),
    "whose": (1000, 0.3),
    "pronoun": (1000, 1.6),
    "beside": (1000, 0.1),
    "hold": (1000, 0.6),
    "say": (1000, 1.0),
}
TESTS = SOURCES | {"participles": (100, 2.0), "vague": (100, 2.0), "single": (100, 50.0), "parameters": (100, 100.0)}
MAX_SHORT_NAMES = 2654  # names of one and two letters outside kernels; this number may only fall


def docstrings():
    """Yield (module, name, docstring) of each function."""
    for path in sorted(p for tree in ("kernels", "sweeps") for p in (ROOT / tree).rglob("*.py")):
        module = str(path.relative_to(ROOT).with_suffix(""))
        for node in legibility.nodes_of(path):
            if isinstance(node, ast.FunctionDef) and (text := ast.get_docstring(node)):
                is_property = any("property" in ast.unparse(decorator) for decorator in node.decorator_list)
                yield from [] if is_property else [(module, node.name, text)]


def texts():
    """Yield (file, text) of texts for readers: documents, pages, definitions, and texts in the code."""
    for path in (*ROOT.glob("*.md"), ROOT / "results/README.md", *(ROOT / "sweeps").rglob("*")):
        if path.suffix in (".md", ".html", ".yaml", ".ipynb") and path.name != "glossary.md":
            yield path, re.sub(r'(id|for|by|describedby)="[^"]*"', "", path.read_text(encoding="utf-8"))
        elif path.suffix == ".py":
            nodes = legibility.nodes_of(path)
            quiet = {id(node.value) for node in nodes if isinstance(node, ast.Expr)}
            strings = (n.value for n in nodes if isinstance(n, ast.Constant) and id(n) not in quiet)
            yield path, "\n".join(text for text in strings if isinstance(text, str) and " " in text)


@pytest.mark.parametrize(
    ("tops", "bars"), [(("kernels", "sweeps"), SOURCES), (("tests",), TESTS)], ids=["sources", "tests"]
)
def test_names_and_prose_are_within_the_habits_of_packages_that_read_well(tops, bars):
    figures = legibility.measure(tops)
    beyond = {name: figures[name].places for name, (base, bar) in bars.items() if figures[name].share(base) > bar}
    assert not beyond, "\n".join(f"{name}: {place}" for name, places in beyond.items() for place in places)
    if "sweeps" in tops:
        assert len(figures["short"].places) <= MAX_SHORT_NAMES


def test_allowed_names_are_few_and_have_reasons():
    lines = (ROOT / "tests/language_allowed.txt").read_text(encoding="utf-8").splitlines()
    assert len(lines) <= 60
    assert all(len(line.split()) > 2 for line in lines)


def test_docstrings_begin_with_an_imperative_sentence():
    first_lines = [(module, name, text.splitlines()[0]) for module, name, text in docstrings()]
    assert len(first_lines) > 1500
    assert [each for each in first_lines if each[2].split()[0] not in VERBS or len(each[2].split()) < 3] == []


def test_no_listed_phrase_is_used():
    phrases = {(str(path.relative_to(ROOT)), hit[0]) for path, text in texts() for hit in PHRASES.finditer(text)}
    assert phrases == set()
