"""Sphinx's settings."""

import hashlib
from pathlib import Path

from jupyter_cache import get_cache

import sweeps

ROOT = Path(sweeps.__file__).parents[1]
CODE = [path for name in ("kernels", "sweeps") for end in ("py", "yaml") for path in (ROOT / name).rglob(f"*.{end}")]

project = "Polhode"
author = "Polhode"
version = release = sweeps.__version__
html_title = f"Polhode {release}"
extensions = [*("myst_nb", "sphinx_design", "sphinx.ext.autodoc", "sphinx.ext.napoleon"), "sweeps.handbook.formulas"]
exclude_patterns = ["included/**"]
myst_enable_extensions = ["dollarmath", "amsmath", "deflist", "colon_fence"]
myst_heading_anchors = 3
myst_links_external_new_tab = True
nb_execution_mode = "cache"  # pages run again after a change of their code or of this package
_DIGEST = hashlib.sha256(b"".join(map(Path.read_bytes, sorted(CODE)))).hexdigest()
nb_execution_cache_path = str(Path(__file__).parents[1] / "executed" / _DIGEST[:16])
get_cache(nb_execution_cache_path).list_cache_records()  # made before several processes do it at once
nb_execution_in_temp = True
nb_execution_raise_on_error = True
nb_execution_timeout = 300
nb_output_stderr = "remove"
nb_merge_streams = True  # all that a cell prints is one box
nb_code_prompt_show = "What it prints"
nb_code_prompt_hide = "What it prints"
suppress_warnings = [
    "ref.python",  # words of docstrings' types, "shape (n,)", that happen to be attributes' names too
    "misc.highlighting_failure",  # Pygments has no lexer for CSV
]
smartquotes = False
default_role = "code"
autodoc_typehints = "none"
autodoc_member_order = "bysource"
napoleon_use_ivar = True
napoleon_use_rtype = False
html_theme = "furo"
html_static_path = ["static"]
html_css_files = ["handbook.css"]
html_extra_path = ["extra"]  # the live reports
html_search_scorer = str(Path(__file__).parent / "static/scorer.js")
html_math_renderer = "mathml"
html_show_sphinx = False
html_show_copyright = False
html_copy_source = False
html_theme_options = {"navigation_with_keys": True}
highlight_language = "text"
