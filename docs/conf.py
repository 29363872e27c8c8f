"""Sphinx settings of the documentation: ``make docs``. What is generated is written before Sphinx reads the pages."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parent), str(Path(__file__).resolve().parent.parent)]

import generate
from pygments.lexers.special import TextLexer
from sphinx.application import Sphinx

import postproc

project = "postproc"
release = version = postproc.__version__
extensions = ["myst_parser"]
root_doc = "index"
exclude_patterns = ["_build"]
html_theme = "furo"
html_title = "postproc"
html_copy_source = html_show_copyright = False
html_static_path = ["_static"]
html_css_files = ["site.css"]
smartquotes = False  # `--json` keeps its hyphens
myst_enable_extensions = ["colon_fence"]
myst_heading_anchors = 4
nitpicky = True

generate.write_all(Path(__file__).resolve().parent / "_generated")


def setup(app: Sphinx) -> None:
    """RAPID is shown as it is: Pygments does not know it."""
    app.add_lexer("rapid", TextLexer)
