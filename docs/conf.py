"""Sphinx settings of the documentation: ``make docs``. What is generated is written before Sphinx reads the pages."""

from __future__ import annotations

import posixpath
import sys
from pathlib import Path
from urllib.parse import quote

sys.path[:0] = [str(Path(__file__).resolve().parent), str(Path(__file__).resolve().parent.parent)]

import generate
from pygments.lexers.special import TextLexer
from sphinx.addnodes import download_reference
from sphinx.application import Sphinx
from sphinx.writers.html5 import HTML5Translator

import postproc

project = "postproc"
release = version = postproc.__version__
extensions = ["myst_parser", "sphinx_copybutton"]
copybutton_selector = "div:not(.highlight-text) > div.highlight > pre"  # commands and files, not what is printed
root_doc = "index"
exclude_patterns = ["_build", "template"]
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


def open_page(self: HTML5Translator, node: download_reference) -> None:
    """A link to a page of a report opens it: Sphinx would have the browser save it."""
    target = posixpath.join(self.builder.dlpath, quote(node["filename"]))
    self.body.append(self.starttag(node, "a", "", CLASS="reference internal", HREF=target))


def close_page(self: HTML5Translator, _node: download_reference) -> None:
    self.body.append("</a>")


def setup(app: Sphinx) -> None:
    """RAPID is shown as it is: Pygments does not know it."""
    app.add_lexer("rapid", TextLexer)
    app.add_node(download_reference, override=True, html=(open_page, close_page))
