# SPDX-License-Identifier: Apache-2.0
"""Settings of Sphinx for the guide. build.py gives the version and the folder of the Python package in the environment."""
import os
import sys

from pygments.lexers.special import TextLexer

sys.path.insert(0, os.environ["ABSENC_PYTHON"])

project = "absenc"
version = release = os.environ["ABSENC_VERSION"]
copyright = "absenc developers, Apache-2.0"  # noqa: A001: the name is Sphinx's
extensions = ["myst_parser", "sphinx.ext.autodoc"]
# Sphinx does not report references without a target, because types of Python's library and of NumPy have no page here
nitpicky = False
myst_heading_anchors = 4
autodoc_typehints = "signature"
autodoc_member_order = "groupwise"
autodoc_preserve_defaults = True
python_use_unqualified_type_names = True
add_module_names = False

html_theme = "furo"
html_title = f"absenc {version}"
html_static_path = ["_static"]
html_css_files = ["guide.css"]
html_copy_source = False
html_show_sphinx = False
html_theme_options = {
    "light_css_variables": {"font-stack": "system-ui, sans-serif", "font-stack--monospace": "ui-monospace, monospace"},
}
pygments_style = "friendly"
pygments_dark_style = "monokai"


def setup(app):
    app.add_lexer("caddy", TextLexer)  # Pygments has no lexer for the language caddy
