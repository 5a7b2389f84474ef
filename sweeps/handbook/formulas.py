"""Formulas as MathML, by docutils. MathML needs no script and no font from elsewhere."""

import html
import re
from xml.etree import ElementTree

from docutils.utils.math.latex2mathml import tex2mathml

LARGE = re.compile(r"\\([bB]ig)(?![a-zA-Z])")
SHORT_FRACTION = re.compile(r"\\[td]?frac\s*(\d)\s*(\d)")
NAMED_BY_HTML = re.compile(r"&(?!(?:lt|gt|amp|quot|apos);)\w+;")  # XML itself defines the five
MATHML = "http://www.w3.org/1998/Math/MathML"
ElementTree.register_namespace("", MATHML)


def mathml(tex: str, block: bool = False) -> str:
    """Return a TeX formula as MathML, in a line or as a block; raise a MathError where docutils does not know it."""
    braced = SHORT_FRACTION.sub(r"\\frac{\1}{\2}", tex)  # docutils asks for the braces
    braced = LARGE.sub(r"\\\1l", braced)  # and knows large signs as left or right ones
    text = NAMED_BY_HTML.sub(lambda name: html.unescape(name[0]), tex2mathml(braced, as_block=block))
    root = ElementTree.fromstring(text)
    for both in root.iter(f"{{{MATHML}}}munderover"):
        base, index, over = both
        if over.get("stretchy") == "false":  # `\\dot q_i` is q̇ with an index; docutils writes the index below the q
            accented = ElementTree.Element(f"{{{MATHML}}}mover", accent="true")
            accented.extend((base, over))
            both.tag, both[:] = f"{{{MATHML}}}msub", (accented, index)
    return ElementTree.tostring(root, encoding="unicode")
