"""How Sphinx builds the manual: `sphinx-build -W docs site` fails on a link that leads nowhere."""

from importlib.metadata import version as version_of

from latex2mathml.converter import convert
from sphinx.application import Sphinx
from sphinx.util import docutils

project = "physid_drake"
version = release = version_of("physid_drake")
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx_copybutton"]
exclude_patterns = ["archive"]

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3  # links to `page.md#a-heading` work as they do on GitHub

autodoc_typehints = "signature"
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True}
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_use_ivar = True
napoleon_custom_sections = [("Source", "notes_style")]
default_role = "code"  # `x` in a docstring
copybutton_prompt_text = ">>> "

html_theme = "furo"
html_title = "physid_drake"
html_copy_source = False
html_static_path = ["manual.css"]
html_css_files = ["manual.css"]
html_math_renderer = "mathml"


def inline_formula(self, node):
    """A formula in a line, as MathML: every browser draws it, without a script or a network."""
    self.body.append(convert(node.astext()))
    raise docutils.nodes.SkipNode


def block_formula(self, node):
    """A formula on lines of its own."""
    self.body.append(f'<div class="formula">{convert(node.astext(), display="block")}</div>')
    raise docutils.nodes.SkipNode


def setup(app: Sphinx) -> None:
    """Called by Sphinx."""
    app.add_html_math_renderer("mathml", (inline_formula, None), (block_formula, None))
