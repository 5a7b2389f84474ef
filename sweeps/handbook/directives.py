"""Sphinx's part: the blocks by which pages show what was made for them, and formulas as MathML."""

import html
import json
from pathlib import Path

from docutils import nodes
from docutils.utils.math import MathError
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.util.docutils import SphinxDirective

from sweeps.handbook import asked
from sweeps.handbook.evidence import picture_file
from sweeps.handbook.formulas import mathml

LOGGER = logging.getLogger(__name__)


class Picture(SphinxDirective):
    """A picture of a map, with its caption."""

    required_arguments, optional_arguments, has_content = 2, 0, True

    def run(self) -> list[nodes.Node]:
        """Return the figure, with its text as caption and as description for screen readers."""
        name = " ".join(self.arguments)
        image = nodes.image(uri="/pictures/" + picture_file(name), alt=" ".join(self.content), classes=["map"])
        figure = nodes.figure("", image)
        caption = nodes.caption("", "")
        words, messages = self.parse_inline(" ".join(self.content))
        caption += words
        figure += caption
        return [figure, *messages]


class File(SphinxDirective):
    """A file of the reader's, under its name."""

    required_arguments, has_content = 1, True

    def run(self) -> list[nodes.Node]:
        """Return the text of the file, with its name above."""
        language = {".yaml": "yaml", ".py": "python", ".csv": "text"}[Path(self.arguments[0]).suffix]
        block = nodes.literal_block("\n".join(self.content), "\n".join(self.content), language=language)
        outside = nodes.container("", literal_block=True, classes=["literal-block-wrapper"])
        outside += [nodes.caption("", self.arguments[0]), block]
        return [outside]


class Printed(SphinxDirective):
    """Lines to type, and what they print."""

    has_content = True
    option_spec = {"answer": lambda _: True, "quiet": lambda _: True}  # noqa: RUF012 (docutils' own way)

    def run(self) -> list[nodes.Node]:
        """Return the lines with their output below, folded if it is an answer."""
        body = "\n".join(self.content)
        kind = self.name
        block = asked.Wanted(kind, "", body)
        facts = json.loads((Path(self.config.handbook_work) / "printed.json").read_text(encoding="utf-8"))
        printed = facts.get(asked.key(self.env.docname, block))
        if printed is None:
            return [self.state.document.reporter.error(f"was not run: {body}", line=self.lineno)]
        lines = nodes.literal_block(body, body, language="python" if kind == "python" else "sh")
        if "quiet" in self.options or not printed:
            return [lines]
        output = nodes.literal_block(printed, printed, language="text", classes=["printed"])
        if "answer" not in self.options:
            return [lines, output]
        opened = nodes.raw("", "<details><summary>What it prints</summary>", format="html")
        return [lines, opened, output, nodes.raw("", "</details>", format="html")]


def _mathml(tex: str, block: bool, where: nodes.Node) -> str:
    try:
        return mathml(tex, block)
    except MathError as error:
        LOGGER.warning("%s: %s", error, tex, location=where)
        return f"<code>{html.escape(tex)}</code>"


def _inline(translator, node: nodes.math) -> None:
    translator.body.append(_mathml(node.astext(), False, node))
    raise nodes.SkipNode


def _block(translator, node: nodes.math_block) -> None:
    number = f'<span class="eqno">({node["number"]})</span>' if node.get("number") else ""
    tag = translator.starttag(node, "div", CLASS="math")
    translator.body.append(tag + number + _mathml(node.astext(), True, node) + "</div>\n")
    raise nodes.SkipNode


def _plain_docstring(app, what, name, thing, options, lines: list[str]) -> None:
    """Makes a docstring that is plain text into reStructuredText: a bar begins no substitution, a star no emphasis."""
    from sweeps.handbook.docstrings import as_restructured

    lines[:] = as_restructured(lines)


def setup(app: Sphinx) -> dict:
    """Register the directives."""
    app.add_config_value("handbook_work", "", "env")
    app.add_directive("picture", Picture)
    app.add_directive("file", File)
    app.add_directive("run", Printed)
    app.add_directive("python", Printed)
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
    app.connect("autodoc-process-docstring", _plain_docstring, priority=100)  # before Napoleon
    return {"parallel_read_safe": True, "parallel_write_safe": True}
