"""The handbook: pages, the maps behind its numbers and figures, and the HTML build.

`text/` contains the pages (MyST Markdown), `maps/` the definitions of its own maps. No number of a page is typed:
`python -m sweeps.handbook --numbers` measures it and writes it there, before a comment with its name (`numbers`). The
build measures it again, and makes the pictures of maps and the output of commands (`evidence`).
"""
