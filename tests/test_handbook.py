"""The handbook's pages against the code, without building them; the build itself is slow, and tells what is left."""

import ast
import importlib.util
import io
import re
import subprocess
import sys
import zlib
from functools import partial
from pathlib import Path
from xml.etree import ElementTree

import pytest
from docutils import nodes
from docutils.frontend import get_default_settings
from docutils.parsers import rst
from docutils.parsers.rst import roles
from docutils.utils import new_document

from sweeps import systems
from sweeps.handbook import __main__ as making
from sweeps.handbook import asked, evidence, formulas, gallery, generated, numbers
from sweeps.handbook.docstrings import as_restructured
from sweeps.points import catalogue
from sweeps.schema.refusals import DefinitionError

ROOT = Path(__file__).parents[1]
PAGES = asked.pages()
# what is no prose: fenced blocks, code, formulas, roles, targets of links, comments
NO_PROSE = (
    r"^[ ]*(`{3,}|:{3,}).*?^[ ]*\1[ ]*$",
    asked.NUMBER.pattern,
    r"`[^`]*`",
    r"\$\$.*?\$\$",
    r"\$[^$]*\$",
    r"\]\([^)]*\)",
    r"<!--.*?-->",
)
UNIT = r"(?:[%°]|(?:rad|s⁻¹|s|m|seconds?|minutes?|ms|kg|h|days?|Hz|[kMG]B)\b)"
TYPED = re.compile(rf"\d+[.,]\d+|\d+e-?\d+|10[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+|\b\d+\s?{UNIT}")
ALLOWED = re.compile(r"Python 3\.\d+|version \d+\.\d+(\.\d+)?|\bmoments \d(, \d)+|\b\d(, \d)+\b")


def prose(text):
    for pattern in NO_PROSE:
        text = re.sub(pattern, " ", text, flags=re.MULTILINE | re.DOTALL)
    return ALLOWED.sub(" ", text)


@pytest.mark.parametrize("page", PAGES)
def test_no_number_of_a_page_is_typed(page):
    assert TYPED.findall(prose(PAGES[page])) == []


@pytest.mark.parametrize(
    "text", ["within 3.2 of it", "at 5 rad/s", "1e-9 of it", "10⁻¹³", "takes 12 s", "99 % of them"]
)
def test_a_typed_number_is_seen(text):
    assert TYPED.search(prose(text))


@pytest.mark.parametrize("text", ["at 5.12<!--x .3g--> s", "`epsilon: 1e-6`", "$x = 0.5$", "chapter 3", "Python 3.11"])
def test_what_is_no_typed_number_passes(text):
    assert not TYPED.search(prose(text))


def test_every_number_that_is_asked_for_is_there_and_says_what_it_is():
    wanted = {name for text in PAGES.values() for _, name, _ in asked.numbers(text)}
    assert wanted - set(numbers.NUMBERS) == set()
    assert all(number.meaning for number in numbers.NUMBERS.values())
    assert {number.source for number in numbers.NUMBERS.values()} <= set(evidence.definitions())


def test_no_number_waits_for_a_page():
    wanted = {name for text in PAGES.values() for _, name, _ in asked.numbers(text)}
    assert set(numbers.NUMBERS) - wanted == set()


@pytest.mark.parametrize(
    ("value", "form", "text"),
    [(305.0, ".3g", "305"), (1.2e-13, ".1g", "1\u202f×\u202f10⁻¹³"), (-0.5, ".2f", "−0.50"), (1728.4, ",d", "1,728")],
)
def test_numbers_as_people_write_them(value, form, text):
    assert numbers.shown(value, form) == text


def differing(facts):
    """(name, text on the page, measured) of each number on the pages that is not as measured.

    Distances that are rounding, and the share of an error bar that the worst one uses, are another processor's too.
    """
    for text in PAGES.values():
        for shown, name, form in asked.numbers(text):
            if fact := facts.get(name):
                measured = numbers.shown(fact["value"], form)
                exact = not name.endswith("_bar") and not (0 < fact["value"] < 1e-9)
                if shown != measured if exact else not (shown and fact["value"] <= 1.0):
                    yield name, shown, measured


def test_numbers_on_the_pages_are_those_measured(tmp_path):
    """Of the two maps that take less than a second; the others with the slow build."""
    maps = {name: evidence.measured(evidence.definitions()[name], tmp_path, print) for name in ("racket", "wobble")}
    facts = evidence.measured_numbers(maps, print)
    assert len(facts) > 20
    assert list(differing(facts)) == []
    facts["racket_points"]["value"] += 1
    assert list(differing(facts))


@pytest.mark.parametrize("page", PAGES)
def test_a_page_reads_as_plain_markdown(page):
    assert "{measured}" not in PAGES[page]
    assert all(re.search(r"\d", shown) for shown, _, _ in asked.numbers(PAGES[page]))


def test_a_number_is_written_beside_its_name_and_read_again():
    facts = {"growth": {"value": 1.2e-13, "meaning": "<rate>", "map": "x", "content_hash": "0" * 64}}
    written = asked.with_numbers("is <!--growth .1g-->.", partial(evidence.as_markdown, facts))
    assert written == "is 1\u202f×\u202f10⁻¹³<!--growth .1g-->."
    assert asked.with_numbers(written, partial(evidence.as_markdown, facts)) == written
    shown = asked.with_numbers(written, partial(evidence.as_html, facts))
    assert shown.startswith('is <span class="measured" title="&lt;rate&gt; (map x,')
    assert shown.endswith(">1\u202f×\u202f10⁻¹³</span>.")


def test_pictures_are_of_maps_that_there_are():
    pictures = [
        block.argument for text in PAGES.values() for block in asked.asked_blocks(text) if block.kind == "picture"
    ]
    assert pictures
    assert {picture.split()[0] for picture in pictures} <= set(evidence.definitions())


def test_a_block_within_a_list_is_read_like_any_other():
    text = "1. Ask.\n\n   ```{python}\n   :answer:\n   a = 1\n   a\n   ```\n"
    assert list(asked.asked_blocks(text)) == [asked.Wanted("python", "", "a = 1\na")]


def test_every_public_name_stands_in_the_reference():
    """Modules by an independent walk; within one, automodule takes every name whose docstring ruff asks for."""
    found = {str(path.relative_to(ROOT)) for path in generated.modules().values()}
    there = {
        str(path.relative_to(ROOT))
        for package in ("kernels", "sweeps")
        for path in (ROOT / package).rglob("*.py")
        if path.name != "__main__.py"
    }
    assert found == there
    listed = "\n".join(generated._api(package) for package in generated.PACKAGES)
    assert sorted(re.findall(r"automodule:: (\S+)", listed)) == sorted(generated.modules())


@pytest.mark.slow
def test_a_name_that_the_built_reference_lacks_is_told():
    names = [f"{module}.{name}" for module, path in generated.modules().items() for name in generated.public(path)]
    assert len(names) > 900
    left_out = "kernels.exact.rotation"
    lines = "".join(f"{name} py:function 1 reference/api.html#$ -\n" for name in names if name != left_out)
    head = b"# Sphinx inventory version 2\n# Project: x\n# Version: y\n# compressed\n"
    assert generated.unlisted(head + zlib.compress(lines.encode())) == [left_out]


def test_every_key_and_every_variable_stands_in_the_reference():
    keys = generated._definitions()
    variables = generated._variables()
    for name in systems.MODULES:
        system = systems.resolve(name)
        section = keys.split(f"## `{name}`")[1].split("\n## ")[0]
        assert all(f"| `{key}` |" in section for key in system.model.model_fields)
        section = variables.split(f"## `{name}`")[1].split("\n## ")[0]
        assert all(f"| `{key}` |" in section for key in system.variables())
    assert all(f"## `{name}`" in keys for name in systems.names())


def test_no_sweep_takes_the_folder_of_the_handbook(tmp_path):
    path = tmp_path / "handbook.yaml"
    path.write_text("grid: {I1: 1.0, I2: 2.0, I3: 3.0, omega0: 1.0}\n")
    with pytest.raises(DefinitionError, match="the handbook's"):
        catalogue.plan(path)


def test_the_gallery_has_every_sweep_that_ships():
    assert sorted(gallery.names()) == sorted(catalogue.shipped())


@pytest.mark.parametrize("name", catalogue.shipped())
def test_every_sweep_that_ships_tells_its_story(name):
    assert len(gallery.story(catalogue.shipped()[name].read_text(encoding="utf-8"))) > 20


def test_a_reduced_sweep_is_small_and_else_the_same():
    values = {
        "system": "pendulum",
        "grid": {"x": {"start": 0, "stop": 1, "num": 500}, "y": {"start": 0, "stop": 1, "num": 300}, "z": 1.0},
    }
    grid = gallery.reduced(values)["grid"]
    assert grid["x"]["num"] * grid["y"]["num"] <= gallery.MOST
    assert (grid["x"]["start"], grid["x"]["stop"], grid["z"]) == (0, 1, 1.0)


@pytest.mark.parametrize(
    ("line", "made"),
    [
        ("abs(L) is |L|", r"abs(L) is \|L\|"),
        ("a name_ and `code_`", r"a name\_ and ``code_``"),
        (":math:`|x|` and ``|y|``", ":math:`|x|` and ``|y|``"),
        ("*not* so, **very**", "*not* so, **very**"),
    ],
)
def test_docstrings_for_readers_of_code_become_restructured_text(line, made):
    assert as_restructured([line]) == [made]


def test_an_accent_stands_over_its_letter_and_the_index_beside_both():
    dotted = "".join(formulas.mathml(r"\dot q_i = \sum_k^n x_k").split())
    assert '<msub><moveraccent="true"><mi>q</mi><mostretchy="false">˙</mo></mover><mi>i</mi></msub>' in dotted
    assert '<munderover><momovablelimits="true">∑</mo><mi>k</mi><mi>n</mi></munderover>' in dotted


def test_functions_and_signs_of_xml_in_formulas():
    """docutils writes an entity of HTML between a function and its argument."""
    text = "".join(ElementTree.fromstring(formulas.mathml(r"\cos x < 1")).itertext())
    assert "".join(text.split()) == "cos\u2061x<1"


def page_formulas(text):
    """(formula, True if on lines of its own) of a page."""
    for pattern in (r"^[ ]*(`{3,}).*?^[ ]*\1[ ]*$", r"`[^`\n]*`", r"<!--.*?-->"):
        text = re.sub(pattern, " ", text, flags=re.MULTILINE | re.DOTALL)
    yield from ((tex, True) for tex in re.findall(r"\$\$(.*?)\$\$", text, re.DOTALL))
    text = re.sub(r"\$\$.*?\$\$", " ", text, flags=re.DOTALL)
    yield from ((tex, False) for tex in re.findall(r"(?<!\\)\$([^$]+)\$", text))


def test_every_formula_of_the_pages_is_known():
    texts = [*PAGES.values(), *((ROOT / source).read_text(encoding="utf-8") for source in generated.INCLUDED.values())]
    found = [formula for text in texts for formula in page_formulas(text)]
    assert len(found) > 250
    for tex, block in found:
        formulas.mathml(tex, block)


def shown_docstrings(module, path):
    """(name, docstring) of a module, its public functions and classes, and their public methods."""

    def visit(node, name):
        if (text := ast.get_docstring(node)) is not None:
            yield name, text
        if not isinstance(node, ast.FunctionDef):
            for inner in node.body:
                if isinstance(inner, (ast.FunctionDef, ast.ClassDef)) and not inner.name.startswith("_"):
                    yield from visit(inner, f"{name}.{inner.name}")

    yield from visit(ast.parse(path.read_text(encoding="utf-8")), module)


def without_sections(lines):
    """What Napoleon does, as far as docutils' parser cares: each entry of "Args:" and so on is a paragraph."""
    made, section = [], ""
    for line in lines:
        indent = len(line) - len(line.lstrip())
        if re.fullmatch("Args|Attributes|Raises|Returns|Yields", line.rstrip().rstrip(":")) and line.endswith(":"):
            section = line
        elif section and (indent or not line.strip()):
            entry = indent == 4 and section[:-1] in ("Args", "Attributes", "Raises")
            made += ["", line[4:]] if entry else [line[4 if section[:-1] in ("Returns", "Yields") else 8 :]]
        else:
            made += ["", line] if section else [line]
            section = ""
    return made


def complaints(text):
    """What docutils says of a docstring, and of its formulas."""
    stream = io.StringIO()
    settings = SETTINGS.copy()
    settings.warning_stream = stream
    document = new_document("docstring", settings)
    rst.Parser().parse("\n".join(without_sections(as_restructured(text.splitlines()))), document)
    for node in [*document.findall(nodes.math), *document.findall(nodes.math_block)]:
        formulas.mathml(node.astext(), isinstance(node, nodes.math_block))
    return stream.getvalue()


SETTINGS = get_default_settings(rst.Parser)
SETTINGS.report_level = 2
for role in ("attr", "class", "data", "func", "meth", "mod"):  # Sphinx's own
    roles.register_generic_role(role, nodes.literal)


def test_docutils_understands_every_docstring_of_the_reference():
    found = [pair for module, path in generated.modules().items() for pair in shown_docstrings(module, path)]
    assert len(found) > 1_000
    assert [(name, said) for name, text in found if (said := complaints(text))] == []


@pytest.mark.parametrize(
    "text",
    [
        "Return *half.",
        "Assignments of +, -, *, /, abs.",
        "Args:\n    x: ``unclosed\n    y: fine",
        "Has\n    an indent\nout.",
    ],
)
def test_a_docstring_that_stops_the_build_is_seen(text):
    assert complaints(text)


def test_links_between_pages_lead_somewhere():
    """Sphinx says the same of whole links; this says it without Sphinx, of pages and files."""
    names = {*PAGES, "gallery", "reference/definitions", "reference/variables", "reference/commands", "reference/api"}
    for page, text in PAGES.items():
        for target in re.findall(r"\]\((?!https?:|#)([^)#]+)[^)]*\)", text):
            path = (ROOT / "x" / page).parent.joinpath(target).resolve().relative_to(ROOT / "x")
            assert str(path.with_suffix("")) in names, (page, target)


def test_without_sphinx_one_message_names_the_extra(monkeypatch, capsys):
    found = importlib.util.find_spec
    monkeypatch.setattr(making, "find_spec", lambda name: None if name == "sphinx" else found(name))
    assert making.main(["-o", "x"]) == 2
    told = capsys.readouterr().err
    assert told.count("\n") == 1
    assert "'.[docs]'" in told


@pytest.mark.slow
def test_the_handbook_is_built_without_a_warning(tmp_path):
    """Whole, from its maps: its own checks are Sphinx's -W, and that every public name is in the index."""
    pytest.importorskip("sphinx")
    pytest.importorskip("furo")
    command = [sys.executable, "-m", "sweeps.handbook", "-o", tmp_path / "handbook", "--work", tmp_path / "work"]
    answer = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert answer.returncode == 0, answer.stderr[-3000:]
    assert "WARNING" not in answer.stderr
    facts = evidence.measured_numbers(evidence.measured_maps(tmp_path / "work", print), print)
    assert list(differing(facts)) == []


def test_what_a_block_prints_is_the_last_lines_value_without_the_folder_of_the_repository():
    block = asked.Wanted("python", "", f"x = 2\nprint('{ROOT}/sweeps/a.yaml')\nx + 1")
    assert evidence._run(block, {}) == "sweeps/a.yaml\n3"


def test_a_command_of_a_page_that_fails_stops_the_handbook(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ValueError, match="exit status 2"):
        evidence._run(asked.Wanted("run", "", "polhode check missing.yaml"), {})


def test_what_is_included_from_other_pages_is_there():
    """Each part of a page of the repository, between two lines that it has."""
    parts = r"```\{include\} \.\./included/(\S+)\n:start-after: \"(.*?)\"\n(?::end-before: \"(.*?)\"\n)?```"
    found = [part for text in PAGES.values() for part in re.findall(parts, text)]
    assert len(found) == sum(text.count("{include}") for text in PAGES.values())
    for name, start, end in found:
        _, _, rest = (ROOT / generated.INCLUDED[name]).read_text(encoding="utf-8").partition(start)
        assert len(rest.partition(end)[0] if end else rest) > 200, (name, start, end)
        assert not end or end in rest
