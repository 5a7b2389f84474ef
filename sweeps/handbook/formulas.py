"""Sphinx's part: formulas as MathML by docutils, without scripts and fonts, and pictures described in words."""

import html
import re
from typing import TYPE_CHECKING
from xml.etree import ElementTree

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml

if TYPE_CHECKING:
    from sphinx.application import Sphinx

LARGE = re.compile(r"\\([bB]ig)(?![a-zA-Z])")
SHORT_FRACTION = re.compile(r"\\[td]?frac\s*(\d)\s*(\d)")
NAMED_BY_HTML = re.compile(r"&(?!(?:lt|gt|amp|quot|apos);)\w+;")  # XML itself defines the five
MATHML = "http://www.w3.org/1998/Math/MathML"
ElementTree.register_namespace("", MATHML)


def mathml(tex: str, block: bool = False) -> str:
    """Return a TeX formula as MathML, in a line or as a block; raise a MathError if docutils cannot parse it."""
    normal_tex = SHORT_FRACTION.sub(r"\\frac{\1}{\2}", tex)  # docutils requires the braces
    normal_tex = LARGE.sub(r"\\\1l", normal_tex)  # docutils has large signs as \bigl or \bigr only
    text = NAMED_BY_HTML.sub(lambda name: html.unescape(name[0]), tex2mathml(normal_tex, as_block=block))
    root = ElementTree.fromstring(text)
    for element in root.iter(f"{{{MATHML}}}munderover"):
        base, index, over = element
        if over.get("stretchy") == "false":  # `\\dot q_i` is q̇ with an index; docutils writes the index below the q
            accent = ElementTree.Element(f"{{{MATHML}}}mover", accent="true")
            accent.extend((base, over))
            element.tag, element[:] = f"{{{MATHML}}}msub", (accent, index)
    return ElementTree.tostring(root, encoding="unicode")


def _mathml(tex: str, block: bool, where: nodes.Node) -> str:
    """Return a formula as MathML, or as code with a warning of Sphinx if docutils cannot parse it."""
    try:
        return mathml(tex, block)
    except MathError as error:
        from sphinx.util import logging

        logging.getLogger(__name__).warning("%s: %s", error, tex, location=where)
        return f"<code>{html.escape(tex)}</code>"


def _inline(translator, node: nodes.math) -> None:
    translator.body.append(_mathml(node.astext(), False, node))
    raise nodes.SkipNode


def _block(translator, node: nodes.math_block) -> None:
    """Write a displayed formula with its number to the page."""
    number = f'<span class="eqno">({node["number"]})</span>' if node.get("number") else ""
    tag = translator.starttag(node, "div", CLASS="math")
    translator.body.append(tag + number + _mathml(node.astext(), True, node) + "</div>\n")
    raise nodes.SkipNode


def _describe_pictures(app: "Sphinx", tree: nodes.document) -> None:
    for caption in tree.findall(nodes.caption):
        for image in caption.parent.findall(nodes.image):
            image["alt"] = caption.astext()


def setup(app: "Sphinx") -> dict:
    """Register the renderer of formulas."""
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
    app.connect("doctree-read", _describe_pictures)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
