"""The handbook's pages against the code, without building them; a slow test builds them."""

import importlib.util
import inspect
import io
import re
import shutil
import subprocess
import sys
from functools import partial
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from docutils import nodes
from docutils.frontend import get_default_settings
from docutils.parsers import rst
from docutils.parsers.rst import roles
from docutils.utils import new_document

import sweeps
from sweeps import plot, systems
from sweeps.figure import sheets
from sweeps.handbook import __main__ as making
from sweeps.handbook import cards, evidence, formulas, gallery, generated, lecture, numbers, pages
from sweeps.points import catalogue
from sweeps.schema.refusals import DefinitionError

ROOT = Path(__file__).parents[1]
PAGES = pages.texts()
# patterns of text that is no prose: fenced blocks, code, formulas, roles, targets of links, comments
NO_PROSE = (
    r"^[ ]*(`{3,}|:{3,}).*?^[ ]*\1[ ]*$",
    pages.NUMBER.pattern,
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
def test_no_number_of_a_page_is_typed_and_it_reads_as_plain_markdown(page):
    assert TYPED.findall(prose(PAGES[page])) == []
    assert "{measured}" not in PAGES[page]
    assert all(re.search(r"\d", number) for number, _, _ in pages.numbers(PAGES[page]))


def test_every_number_of_a_page_is_there_and_says_what_it_is_and_none_waits_for_a_page():
    assert all(meaning and formula for table in numbers.NUMBERS.values() for meaning, formula in table.values())
    assert set(numbers.NUMBERS) <= set(evidence.definitions())
    names_on_pages = {name for text in PAGES.values() for _, name, _ in pages.numbers(text)}
    names = [name for table in numbers.NUMBERS.values() for name in table]
    assert sorted(names) == sorted(names_on_pages)  # each once


def differences(facts):
    """(name, text on the page, measured) of each number on the pages that is not as measured.

    Distances that are rounding, and the share of an error bar that the worst one uses, are another processor's too.
    """
    for text in PAGES.values():
        for text_of_number, name, form in pages.numbers(text):
            if fact := facts.get(name):
                measured = numbers.format_number(fact["value"], form)
                exact = not name.endswith("_bar") and not (0 < fact["value"] < 1e-9)
                if text_of_number != measured if exact else not (text_of_number and fact["value"] <= 1.0):
                    yield name, text_of_number, measured


def test_numbers_on_the_pages_are_those_measured(tmp_path):
    """Numbers of the two maps that take less than a second; the slow build checks all maps."""
    definitions = evidence.definitions()
    maps = {n: evidence.measure_map(n, definitions[n], tmp_path, print) for n in ("racket", "wobble")}
    facts = evidence.measure_numbers(maps, print)
    assert len(facts) > 20
    assert list(differences(facts)) == []
    facts["racket_points"]["value"] += 1
    assert list(differences(facts))


def test_a_number_is_written_beside_its_name_and_read_again():
    facts = {"growth": {"value": 1.2e-13, "meaning": "<rate>", "map": "x", "content_hash": "0" * 64}}
    markdown = pages.with_numbers("is <!--growth .1g-->.", partial(evidence.as_markdown, facts))
    assert markdown == "is 1\u202f×\u202f10⁻¹³<!--growth .1g-->."
    assert pages.with_numbers(markdown, partial(evidence.as_markdown, facts)) == markdown
    html = pages.with_numbers(markdown, partial(evidence.as_html, facts))
    assert html.startswith('is <span class="measured" title="&lt;rate&gt; (map x,')
    assert html.endswith(">1\u202f×\u202f10⁻¹³</span>.")


def test_pictures_are_of_maps_that_there_are():
    pictures = [path for text in PAGES.values() for path in pages.PICTURE.findall(text)]
    assert {name for name, _ in pictures} == set(evidence.definitions()) & {name for name, _ in pictures}
    assert len(pictures) == sum(text.count("(/pictures/") + text.count(" /pictures/") for text in PAGES.values())


PUBLIC = [f"sweeps.{name}" for name in sweeps.__all__ if name != "plot"]
PUBLIC += [f"sweeps.plot.{name}" for name in (*plot.NAMES, "draw") if name != "deviations"]


def reference_names():
    """Qualified names of the functions and classes of the reference."""
    for page, text in PAGES.items():
        if page.startswith("reference/api-"):
            module = ""
            for kind, name in re.findall(r"^\.\. (currentmodule|autofunction|autoclass):: (\S+)$", text, re.MULTILINE):
                module = name if kind == "currentmodule" else module
                if kind != "currentmodule":
                    yield name if "." in name else f"{module}.{name}"


def test_every_public_function_stands_in_the_reference():
    assert set(PUBLIC) | {"sweeps.plot.Polhode", "sweeps.mechanics.System"} <= set(reference_names())


def test_the_index_leads_to_every_page():
    """`toctree` entries of all pages in the repository."""
    entries = set()
    for page, text in PAGES.items():
        for block in re.findall(r"```\{toctree\}\n(.*?)```", text, re.DOTALL):
            folder = page.rpartition("/")[0]
            entries |= {f"{folder}/{line}".strip("/") for line in block.split() if not line.startswith(":")}
    assert set(PAGES) - entries == {"index"}


def test_words_that_people_search_for_stand_on_a_page_to_learn_from():
    texts = {page: text.lower() for page, text in PAGES.items() if page.startswith(("lecture/", "tutorials/"))}
    for words in ("dzhanibekov", "tennis racket theorem", "chandler", "parametric resonance", "flat spin"):
        assert any(words in text.replace("\n", " ") for text in texts.values()), words


@pytest.mark.parametrize(
    "names", [(*systems.MODULES, "pendulum"), pytest.param(systems.system_names(), marks=pytest.mark.slow)], ids=len
)
def test_every_key_and_every_variable_stands_on_the_page_of_its_system(names, monkeypatch):
    monkeypatch.setattr(systems, "system_names", lambda: names)
    texts = generated._systems()
    for name in names:
        system, page = systems.resolve(name), texts[f"reference/systems/{name}"]
        assert all(f"| `{key}` |" in page for key in (*system.model.model_fields, *system.variables()))
        assert f"(systems/{name}.md)" in texts["reference/systems"]


def test_no_sweep_takes_the_folder_of_the_handbook(tmp_path):
    path = tmp_path / "handbook.yaml"
    path.write_text("grid: {I1: 1.0, I2: 2.0, I3: 3.0, omega0: 1.0}\n")
    with pytest.raises(DefinitionError, match="the handbook's"):
        catalogue.plan_sweep(path)


CONTENTS = {name: (f"{name}.png", "") for name in gallery.names()}
CONTENTS["gyrostat"] = ("gyrostat.gif", "A rotor of h/W > 1 holds it")


def test_the_gallery_has_every_sweep_that_ships():
    assert sorted(gallery.names()) == sorted(catalogue.shipped_files())
    texts = gallery.pages(CONTENTS)
    for name in gallery.names():
        page = texts[f"gallery/{name}"]
        assert len(gallery.story(catalogue.shipped_files()[name].read_text(encoding="utf-8"))) > 20
        assert f":link: gallery/{name}\n" in texts["gallery"]
        assert all(link in page for link in (f"polhode run {name}\n", f" {name}.png", f"/{name}.yaml", f"/{name}.html"))


def test_a_card_has_its_film_and_its_sentence():
    texts = gallery.pages(CONTENTS)
    card = texts["gallery"].partition(":link: gallery/gyrostat\n")
    assert card[0].endswith(":img-top: /gallery/gyrostat.gif\n:img-alt: A rotor stabilises the intermediate axis\n")
    assert card[2].split("\n")[2] == r"A rotor of h/W \> 1 holds it."
    assert r"**A rotor of h/W \> 1 holds it.**" in texts["gallery/gyrostat"]


@pytest.mark.parametrize(
    "values",
    [
        {"system": "pendulum"},
        {"system": "mathieu", "a": 1.0, "q": [0.5, 1.0]},
        {"I1": 1.0, "I2": 2.0, "I3": 2.5, "omega0": 1.0},
    ],
)
def test_a_film_of_a_card_moves_for_two_seconds(values):
    pictures = list(cards.frames(sweeps.survey(**values)))
    assert len(pictures) / sheets.GIF.rate == pytest.approx(2.0, abs=0.05)  # a frame
    changes = [np.any(before != after) for before, after in pairwise(pictures)]
    assert all(changes)
    edges = np.array(pictures)[:, [0, -1], :, :3]
    assert (edges == edges[0, 0, 0]).all()  # no axes at the edges


def test_a_reduced_sweep_is_small_and_else_the_same():
    sides = {name: {"start": 0, "stop": 1, "num": num} for name, num in (("x", 500), ("y", 300))}
    grid = gallery.reduce_points({"system": "pendulum", "grid": sides | {"z": 1.0}})["grid"]
    assert grid["x"]["num"] * grid["y"]["num"] <= gallery.MAX_GRID_POINTS
    assert (grid["x"]["start"], grid["x"]["stop"], grid["z"]) == (0, 1, 1.0)


def test_accents_limits_functions_and_signs_of_xml_in_formulas():
    mathml = "".join(formulas.mathml(r"\dot q_i = \sum_k^n x_k").split())
    assert '<msub><moveraccent="true"><mi>q</mi><mostretchy="false">˙</mo></mover><mi>i</mi></msub>' in mathml
    assert '<munderover><momovablelimits="true">∑</mo><mi>k</mi><mi>n</mi></munderover>' in mathml
    # docutils writes an entity of HTML between a function and its argument
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
    page_formulas_ = [formula for text in texts for formula in page_formulas(text)]
    assert len(page_formulas_) > 250
    for tex, block in page_formulas_:
        formulas.mathml(tex, block)


def without_sections(lines):
    """Return lines as Napoleon converts them for docutils' parser: each entry of "Args:" and so on is a paragraph."""
    paragraphs, section = [], ""
    for line in lines:
        indent = len(line) - len(line.lstrip())
        if re.fullmatch("Args|Attributes|Raises|Returns|Yields", line.rstrip().rstrip(":")) and line.endswith(":"):
            section = line
        elif section and (indent or not line.strip()):
            entry = indent == 4 and section[:-1] in ("Args", "Attributes", "Raises")
            paragraphs += ["", line[4:]] if entry else [line[4 if section[:-1] in ("Returns", "Yields") else 8 :]]
        else:
            paragraphs += ["", line] if section else [line]
            section = ""
    return paragraphs


def complaints(text):
    """Return docutils' complaints about a docstring and its formulas."""
    stream = io.StringIO()
    settings = SETTINGS.copy()
    settings.warning_stream = stream
    document = new_document("docstring", settings)
    rst.Parser().parse("\n".join(without_sections(text.splitlines())), document)
    for node in [*document.findall(nodes.math), *document.findall(nodes.math_block)]:
        formulas.mathml(node.astext(), isinstance(node, nodes.math_block))
    return stream.getvalue()


SETTINGS = get_default_settings(rst.Parser)
SETTINGS.report_level = 2
for role in ("attr", "class", "data", "func", "meth", "mod"):  # Sphinx's own
    roles.register_generic_role(role, nodes.literal)


@pytest.mark.parametrize("name", list(reference_names()))
def test_docutils_understands_every_docstring_of_the_reference(name):
    module, _, member = name.rpartition(".")
    member = getattr(importlib.import_module(module), member)
    members = vars(member).values() if isinstance(member, type) else ()
    texts = [each.__doc__ for each in (member, *members) if callable(each) and each.__doc__]
    assert [complaint for text in texts if (complaint := complaints(inspect.cleandoc(text)))] == []


def test_links_between_pages_lead_somewhere():
    """Sphinx checks whole links; this test checks pages and files without Sphinx."""
    names = {*PAGES, *(f"reference/systems/{name}" for name in systems.system_names()), *gallery.pages(CONTENTS)}
    names |= {"reference/commands", "reference/systems"}
    for page, text in PAGES.items():
        for target in re.findall(r"\]\((?!https?:|#)([^)#]+)[^)]*\)", text):
            path = (ROOT / "x" / page).parent.joinpath(target).resolve().relative_to(ROOT / "x")
            assert str(path.with_suffix("")) in names, (page, target)


def test_the_lecture_in_one_file_has_its_chapters_in_order_and_its_outputs_open(tmp_path, monkeypatch):
    (tmp_path / "lecture").mkdir()
    for name in ("one", "two"):
        text = f"<html><head><title>{name}</title></head><article><h1>{name}</h1><details>4</details></article></html>"
        (tmp_path / f"lecture/{name}.html").write_text(text)
    links = [f'<a href="lecture/{name}.html">' for name in ("two", "one", "all", "two")]
    (tmp_path / "index.html").write_text("".join(links))
    monkeypatch.setattr(lecture, "BROWSERS", ())
    assert lecture.write(tmp_path) == tmp_path / "lecture/all.html"
    page = (tmp_path / "lecture/all.html").read_text()
    assert re.findall("<h1>(.*?)</h1>", page) == ["two", "one"]
    assert page.count("<details open>") == 2
    monkeypatch.undo()
    if not any(map(shutil.which, lecture.BROWSERS)):
        pytest.skip("no Chromium")
    assert lecture.write(tmp_path).read_bytes()[:5] == b"%PDF-"
    assert "lecture/lecture.pdf" in (tmp_path / "index.html").read_text()


def test_without_sphinx_one_message_names_the_extra(monkeypatch, capsys):
    find_spec = importlib.util.find_spec
    monkeypatch.setattr(making, "find_spec", lambda name: None if name == "sphinx" else find_spec(name))
    assert making.main(["-o", "x"]) == 2
    message = capsys.readouterr().err
    assert message.count("\n") == 1
    assert "'.[docs]'" in message


@pytest.mark.handbook
def test_the_handbook_is_built_without_a_warning(tmp_path):
    """Whole, from its maps: its own checks are Sphinx's -W, and that every public name is in the index."""
    pytest.importorskip("sphinx")
    pytest.importorskip("furo")
    command = [sys.executable, "-m", "sweeps.handbook", "-o", tmp_path / "handbook", "--work", tmp_path / "work"]
    answer = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert answer.returncode == 0, answer.stderr[-3000:]
    facts = evidence.measure_numbers(evidence.measure_maps(tmp_path / "work", print), print)
    assert list(differences(facts)) == []


def test_what_is_included_from_other_pages_is_there():
    """Each part of a page of the repository, between two lines that it has."""
    pattern = r"```\{include\} (?:\.\./)?included/(\S+)\n:start-after: \"(.*?)\"\n(?::end-before: \"(.*?)\"\n)?```"
    inclusions = [inclusion for text in PAGES.values() for inclusion in re.findall(pattern, text)]
    assert len(inclusions) == sum(text.count("{include}") for text in PAGES.values())
    for name, start, end in inclusions:
        _, _, text_after = (ROOT / generated.INCLUDED[name]).read_text(encoding="utf-8").partition(start)
        assert len(text_after.partition(end)[0] if end else text_after) > 200, (name, start, end)
        assert not end or end in text_after
