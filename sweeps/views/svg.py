"""Fonts inside an SVG: a viewer without them shows the same letters, and the text stays text."""

import base64
import re
from io import BytesIO
from pathlib import Path

FACES = {  # (bold, slanting) → file among those that come with matplotlib
    (False, False): "DejaVuSans.ttf",
    (True, False): "DejaVuSans-Bold.ttf",
    (False, True): "DejaVuSans-Oblique.ttf",
    (True, True): "DejaVuSans-BoldOblique.ttf",
}
_FONT = re.compile(r'style="([^"]*font-family:[^"]*)"')
_SIZE = re.compile(r'(<svg[^>]*?) width="([\d.]+)pt" height="([\d.]+)pt"', re.DOTALL)


def embed(path: Path, scale: float = 1.0) -> None:
    """Embed the letters that a figure needs from each font into its file, and scale it."""
    text = path.read_text(encoding="utf-8")
    letters = "".join(sorted(set("".join(re.findall(r">([^<>]+)</t(?:ext|span)>", text)))))
    rules = "".join(_rule(face, letters) for face in FACES if face in _used(text))
    text = text.replace("<defs>", f"<defs>\n  <style>{rules}</style>", 1) if rules else text
    if scale != 1.0:
        larger = lambda m: f'{m[1]} width="{float(m[2]) * scale:g}pt" height="{float(m[3]) * scale:g}pt"'  # noqa: E731
        text = _SIZE.sub(larger, text, count=1)
    path.write_text(text, encoding="utf-8")


def _used(text: str) -> set[tuple[bool, bool]]:
    """Return faces that a picture writes with."""
    said = _FONT.findall(text)
    return {("font-weight: 700" in one or "bold" in one, "oblique" in one or "italic" in one) for one in said}


def _rule(face: tuple[bool, bool], letters: str) -> str:
    """Return a rule of CSS that holds a font of those letters."""
    import matplotlib
    from fontTools import subset

    options = subset.Options(flavor="woff", layout_features=[], notdef_outline=True, drop_tables=["FFTM", "GPOS"])
    font = subset.load_font(Path(matplotlib.get_data_path()) / "fonts" / "ttf" / FACES[face], options)
    subsetter = subset.Subsetter(options)
    subsetter.populate(text=letters.replace("&amp;", "&").replace("&lt;", "<").replace("&gt;", ">"))
    subsetter.subset(font)
    held = BytesIO()
    subset.save_font(font, held, options)
    data = base64.b64encode(held.getvalue()).decode("ascii")
    look = f"font-weight:{'bold' if face[0] else 'normal'};font-style:{'oblique' if face[1] else 'normal'}"
    return f"@font-face{{font-family:'DejaVu Sans';{look};src:url(data:font/woff;base64,{data})}}"
