"""Sphinx's settings for the documentation site. Nothing is loaded from a network."""
from __future__ import annotations

from docsite.docstrings import to_rst

project = "gpgpu_rt"
extensions = ["myst_parser", "sphinx.ext.autodoc"]
myst_heading_anchors = 4    # headings down to this level have anchors, spelled as on GitHub
suppress_warnings = ["myst.header"]     # pages made of several texts may skip a level of headings
exclude_patterns = ["files"]
html_theme = "furo"
html_title = "gpgpu_rt"
html_show_sourcelink = False
html_copy_source = False
html_show_sphinx = False
html_show_copyright = False
html_static_path = ["static"]
html_css_files = ["site.css"]
pygments_style = "default"
pygments_dark_style = "github-dark"
python_maximum_signature_line_length = 72
python_use_unqualified_type_names = True
autodoc_typehints_format = "short"
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True}


def setup(app) -> None:
    app.connect("autodoc-process-docstring", lambda app, what, name, thing, options, lines:
                lines.__setitem__(slice(None), to_rst(lines)))
