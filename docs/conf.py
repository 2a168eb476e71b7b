"""Settings of the documentation site; `make docs` builds it, from the root of the repository."""

from go1_mtl_gym import __version__

REPOSITORY_URL = ""
"""Where the project is published; "" while it has no public address. The only place on the site that knows it."""

project = "go1-mtl-gym"
author = "go1-mtl-gym developers"
copyright = f"{author}, MIT license"
release = version = __version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
    "docs._ext.code_table",
    "docs._ext.command_help",
    "docs._ext.docstrings",
    "docs._ext.mathml",
]
exclude_patterns = ["_build"]
source_suffix = {".md": "markdown"}

# Docstrings are Google's, with names between single backticks; those that the site knows become links.
default_role = "py:obj"
napoleon_numpy_docstring = False
napoleon_use_ivar = True
autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented_params"
autodoc_inherit_docstrings = False
autodoc_preserve_defaults = True
python_display_short_literal_types = True
add_module_names = False

myst_enable_extensions = ["colon_fence", "deflist", "dollarmath", "fieldlist"]
myst_heading_anchors = 3

html_theme = "furo"
pygments_dark_style = "monokai"
html_title = f"go1-mtl-gym {version}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_sphinx = False
html_theme_options = {
    "navigation_with_keys": True,
    **({"source_repository": REPOSITORY_URL, "source_branch": "main"} if REPOSITORY_URL else {}),
}
html_last_updated_fmt = ""
