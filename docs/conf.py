"""Build of the pages: `sphinx-build -W --keep-going -b html docs build/docs`."""

import pathlib
import re
import sys

from sphinx.application import Sphinx

sys.path.insert(0, str(pathlib.Path(__file__).parent))
sys.path.insert(0, str(pathlib.Path(__file__).parent / "_extension"))

import reference

import simbrake

project = "simbrake"
author = "The simbrake authors"
copyright = "the simbrake authors, Apache-2.0"
version = release = simbrake.__version__

extensions = [
    *(
        "myst_parser",
        "sphinx.ext.autodoc",
        "sphinx.ext.autosummary",
        "sphinx.ext.linkcode",
    ),
    *("math_ml", "source_links", "reference"),
]
autodoc_default_options = {"members": True}
autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
autodoc_docstring_signature = False
autosummary_generate = False
linkcode_resolve = reference.source_of
default_role = "name"  # of docstrings
python_maximum_signature_line_length = 120
smartquotes = False  # examples are to be copied
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
myst_links_external_new_tab = True
exclude_patterns = ["_extension"]

html_theme = "furo"
html_title = f"simbrake {version}"
html_math_renderer = "mathml"
html_static_path = ["_static"]
html_css_files = ["simbrake.css"]
html_copy_source = False
html_show_sphinx = False
highlight_language = "none"  # formulas are in indented blocks
pygments_style = "default"


def add_table_of_contents(app: Sphinx, page: str, source: list[str]) -> None:
    """Add a hidden table of contents per section to pages that list others: Sphinx
    builds its navigation from it."""
    if page not in ("index", "api/index", "theory/index"):
        return
    for section in re.split(r"^## ", source[0], flags=re.M)[1:]:
        items = "".join(re.findall(r"^- .*$", section, re.M))
        names = dict.fromkeys(re.findall(r"\]\(([\w/]+)\.md[)#]", items))
        caption = section.partition("\n")[0]
        if names:
            source[0] += "\n".join(
                [
                    "",
                    "```{toctree}",
                    ":hidden:",
                    f":caption: {caption}",
                    "",
                    *names,
                    "```",
                    "",
                ]
            )


def setup(app: Sphinx) -> None:
    app.connect("source-read", add_table_of_contents)
