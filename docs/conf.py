"""Build of the pages: `sphinx-build -W --keep-going -b html docs build/docs`."""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parent / "_extension"))

import simbrake

project = "simbrake"
author = "The simbrake authors"
copyright = "the simbrake authors, Apache-2.0"
version = release = simbrake.__version__

extensions = ["myst_parser", "math_ml", "source_pages", "api_reference", "code_tables", "notebook_list"]
myst_enable_extensions = ["dollarmath", "amsmath", "deflist"]
myst_heading_anchors = 3
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
python_maximum_signature_line_length = 88
python_display_short_literal_types = True
add_module_names = False
toc_object_entries_show_parents = "hide"
