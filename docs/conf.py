"""Sphinx settings of the documentation: ``make docs``. What is generated is written before Sphinx reads the pages."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parent), str(Path(__file__).resolve().parent.parent)]

import generate

import postproc

project = "postproc"
release = version = postproc.__version__
extensions = ["myst_parser"]
root_doc = "index"
exclude_patterns = ["_build", "_generated/report_*"]
html_theme = "furo"
html_title = "postproc"
html_copy_source = False

myst_enable_extensions = ["colon_fence"]
myst_heading_anchors = 4
nitpicky = True
suppress_warnings = ["myst.header"]

generate.write_all(Path(__file__).resolve().parent / "_generated")
