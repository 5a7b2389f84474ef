"""Sphinx's settings. Where the evidence lies is told on the command line (`handbook_work`)."""

import sweeps

project = "Polhode"
author = "Polhode"
version = release = sweeps.__version__
html_title = f"Polhode {release}"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sweeps.handbook.directives"]
exclude_patterns = ["included/**"]
myst_enable_extensions = ["dollarmath", "amsmath", "deflist", "colon_fence"]
myst_heading_anchors = 3
myst_links_external_new_tab = True
nitpicky = False
suppress_warnings = ["ref.python"]  # words of docstrings' types, "shape (n,)", that happen to be attributes' names too
smartquotes = False
autodoc_typehints = "none"
autodoc_member_order = "bysource"
napoleon_use_ivar = True
napoleon_use_rtype = False
html_theme = "furo"
html_static_path = ["static"]
html_css_files = ["handbook.css"]
html_math_renderer = "mathml"
html_show_sphinx = False
html_show_copyright = False
html_copy_source = False
html_theme_options = {"navigation_with_keys": True}
highlight_language = "text"
