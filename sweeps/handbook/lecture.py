"""The lecture's chapters in one page and in one PDF if a Chromium is installed."""

import re
import shutil
import subprocess
import tempfile
from pathlib import Path

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome", "msedge")
STYLE = """<style>
@page { size: A4; margin: 18mm 16mm 20mm; @bottom-center { content: counter(page); font: 9pt sans-serif; } }
body { max-width: 52rem; margin: auto; padding: 1rem; }
@media print { body { padding: 0; } article { break-before: page; } pre { white-space: pre-wrap; } }
* { animation: none !important; }
.math-wrapper, div.math { overflow: visible; }
.headerlink { display: none; }
</style>"""


def write(pages: Path) -> Path:
    """Write the chapters into `lecture/all.html` and print them to `lecture/lecture.pdf`. Return the last file written.

    In the folder of the handbook's HTML, the index's link to `all.html` becomes one to the PDF.
    """
    index = (pages / "index.html").read_text(encoding="utf-8")
    chapters = [name for name in re.findall(r'href="(lecture/[\w-]+\.html)"', index) if name != "lecture/all.html"]
    texts = [(pages / name).read_text(encoding="utf-8") for name in dict.fromkeys(chapters)]
    head = re.sub("<title>.*?</title>", "<title>Lectures, checked numerically</title>", texts[0].split("</head>")[0])
    articles = "".join(re.search("<article.*?</article>", text, re.DOTALL)[0] for text in texts)
    body = f'<body data-theme="light">{articles.replace("<details", "<details open")}</body>'
    all_chapters = pages / "lecture" / "all.html"
    all_chapters.write_text(f"{head}{STYLE}</head>{body}</html>", encoding="utf-8")
    browser = next(filter(None, map(shutil.which, BROWSERS)), None)
    if browser is None:
        return all_chapters
    pdf = all_chapters.with_name("lecture.pdf")
    with tempfile.TemporaryDirectory() as profile:
        options = ("--headless", "--no-sandbox", f"--user-data-dir={profile}", "--no-pdf-header-footer")
        command = [browser, *options, f"--print-to-pdf={pdf}", all_chapters.as_uri()]
        subprocess.run(command, check=False, capture_output=True, timeout=300)
    if not pdf.exists():
        return all_chapters
    (pages / "index.html").write_text(index.replace("lecture/all.html", "lecture/lecture.pdf"), encoding="utf-8")
    return pdf
