"""Sphinx's part: formulas as MathML, and descriptions of pictures for screen readers."""

import html

from docutils import nodes
from docutils.utils.math import MathError
from sphinx.application import Sphinx
from sphinx.util import logging

from sweeps.handbook.formulas import mathml

LOGGER = logging.getLogger(__name__)


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


def _describe_pictures(app: Sphinx, tree: nodes.document) -> None:
    for caption in tree.findall(nodes.caption):
        for image in caption.parent.findall(nodes.image):
            image["alt"] = caption.astext()


def setup(app: Sphinx) -> dict:
    """Register the renderer of formulas."""
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
    app.connect("doctree-read", _describe_pictures)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
