"""Configuration of Sphinx: nothing is fetched, neither while it builds nor when it is read."""

import fsmkit

project = "fsmkit"
author = "the developers of fsmkit"
copyright = "the developers of fsmkit"  # noqa: A001  (the name that Sphinx reads)
version = release = fsmkit.__version__
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
html_theme = "furo"
html_title = f"fsmkit {fsmkit.__version__}"
templates_path = ["templates"]
html_sidebars = {
    "**": [
        "sidebar/brand.html",
        "sidebar/search.html",
        "sidebar/scroll-start.html",
        "sidebar/navigation.html",
        "versions.html",
        "sidebar/scroll-end.html",
    ]
}
html_show_sourcelink = False
html_copy_source = False
myst_heading_anchors = 4
autodoc_typehints = "signature"
autodoc_member_order = "bysource"
highlight_language = "text"
suppress_warnings = ["misc.highlighting_failure"]  # blocks of `yaml` that show a part of a file
