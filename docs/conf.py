"""The site: `sphinx-build -W docs build/site`, then open build/site/index.html. Neither needs a network."""

from __future__ import annotations

import os
import re
import sys
from functools import partialmethod
from html import escape
from pathlib import Path
from typing import Any

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml
from nbclient import NotebookClient
from sphinx.application import Sphinx

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))
os.environ["PYTHONPATH"] = str(ROOT)  # for the kernels that run the examples of the pages
os.environ["PYTHONSTARTUP"] = str(ROOT / "docs" / "quiet.py")
os.environ["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"

import vibrodrive  # noqa: E402

project = "vibrodrive"
author = "the authors of vibrodrive"
version = release = vibrodrive.__version__
html_title = f"vibrodrive {version}"
html_theme = "furo"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_copyright = html_show_sphinx = html_copy_source = html_show_sourcelink = False

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]

myst_enable_extensions = ["dollarmath"]
myst_fence_as_directive = ["math"]  # as on GitHub
myst_heading_anchors = 3
html_math_renderer = "mathml"
# Quotation marks remain straight, because readers copy quoted text. The prime of ξ' is not a quotation mark.
smartquotes = False

nb_execution_mode = "force"
nb_execution_timeout = 900  # a cell may have to compile kernels
nb_execution_raise_on_error = True
nb_execution_in_temp = True
nb_render_markdown_format = "myst"
nb_output_stderr = "remove-warn"  # a warning of an example is an error

# The output of a command comes in pieces of 100 bytes; nb_merge_streams of myst-nb would end a line after each.
NotebookClient.__init__ = partialmethod(NotebookClient.__init__, coalesce_streams=True)

autodoc_member_order = "bysource"
toc_object_entries_show_parents = "hide"
autodoc_typehints = "none"  # the docstrings have types, with shapes
napoleon_numpy_docstring = True
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_preprocess_types = False

README = "../README.md"
"""Included by the first page, index.md."""

LINK = re.compile(r"\]\((?!\w+:|#)([^)#\s]+)")

OUTSIDE = re.compile(r"\]\((\.\./[^)#\s]+\.(?:md|ipynb))(?:#[^)]*)?\)")
"""Link to a document that is not a page of the site."""


def read_page(app: Sphinx, docname: str, source: list[str]) -> None:
    """Make links to the README lead to the page that includes it, and other documents of the repository downloads."""
    text = LINK.sub(lambda m: f"]({'index.md' if m[1] == README else m[1]}", source[0])
    source[0] = OUTSIDE.sub(r"](path:\1)", text)


def read_included(app: Sphinx, path: Path, docname: str, source: list[str]) -> None:
    """Rewrite the links of the README relative to this folder."""
    if path.as_posix() == README:
        source[0] = LINK.sub(lambda m: f"]({os.path.relpath(m[1], 'docs').replace(os.sep, '/')}", source[0])
        read_page(app, docname, source)


APPLIED = re.compile(r"<mo>&ApplyFunction;</mo>(?!\s*<mo[^>]*>[(\[])")
"""A function name without a bracket after it; docutils leaves no space there."""

NUMBER = re.compile(r"[\d.]*\de[-\d]\d*×?")
"""A number with an exponent; browsers would break the line at its minus sign."""


def formula(tex: str, block: bool) -> str:
    """Return a formula as MathML, which browsers draw without scripts, with its number to the right."""
    tag = re.search(r"\\tag\{(.*?)\}", tex)
    drawn = tex2mathml(tex.replace(tag[0], "") if tag else tex, as_block=block)
    drawn = APPLIED.sub('<mspace width="0.17em"/>', drawn)
    return f'<div class="numbered">{drawn}<span>({escape(tag[1])})</span></div>' if tag else drawn


def visit_inline(page: Any, node: nodes.math) -> None:
    page.body.append(formula(node.astext(), block=False))
    raise nodes.SkipNode


def visit_block(page: Any, node: nodes.math_block) -> None:
    page.body.append(formula(node.astext(), block=True))
    raise nodes.SkipNode


def keep_numbers_whole(app: Sphinx, page: nodes.document) -> None:
    """Give table cells that contain only a number the class "number"."""
    for cell in page.findall(nodes.entry):
        if NUMBER.fullmatch(cell.astext()):
            cell["classes"].append("number")


def setup(app: Sphinx) -> None:
    app.connect("doctree-read", keep_numbers_whole)
    app.connect("source-read", read_page)
    app.connect("include-read", read_included)
    app.add_html_math_renderer("mathml", (visit_inline, None), (visit_block, None))
