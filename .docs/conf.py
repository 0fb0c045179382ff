"""The site: pages in Markdown, notebooks as stored, Python from its docstrings."""

import tolstat

project = "tolstat"
copyright = "the authors of tolstat"
version = release = tolstat.__version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.mathjax",
    "sphinx.ext.napoleon",
    "sphinx_click",
    "sphinx_copybutton",
]
include_patterns = [
    "*.md",
    "runs/*.md",
    "runs/**/*.md",
    "runs/**/*.ipynb",
    "tolstat/**/index.md",
    "tests/studies/benchmarks/index.md",
    "tests/studies/coverage/index.md",
    "tests/studies/coverage/rare.md",
    "tests/studies/deciding.md",
    "tests/studies/remedies/index.md",
    "tests/studies/isolation/index.md",
    "tests/studies/fmus/index.md",
    ".github/*.md",
]
exclude_patterns = [
    "contents.md",
    ".github/PULL_REQUEST_TEMPLATE.md",
    ".github/SECURITY.md",
]

nb_execution_mode = "off"  # the suite runs them; their outputs are stored
myst_heading_anchors = 4
myst_enable_extensions = ["attrs_block", "colon_fence"]
smartquotes = False  # --check is an option, no dash
suppress_warnings = ["myst.header", "misc.highlighting_failure"]

autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
napoleon_numpy_docstring = True
napoleon_google_docstring = False
napoleon_use_rtype = False

html_theme = "pydata_sphinx_theme"
html_title = "tolstat"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_js_files = ["site.js"]
html_show_sourcelink = False
html_theme_options = {"navigation_with_keys": False, "show_toc_level": 2}
