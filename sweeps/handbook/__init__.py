"""The handbook: its pages, the maps that its numbers and pictures come from, and what makes HTML of them.

`text/` holds the pages (MyST Markdown), `maps/` the definitions of its own maps. No number is typed in a page: it asks
for one by name (`numbers`), for a picture of a map, or for what a command prints, and `evidence` makes what was asked.
"""
