"""The site: ``sphinx-build -W -b html docs build/site``, then open ``build/site/index.html``.

Notebooks are shown with their stored output. Pages of the API, the command line, the design file and the closures file
are made from the code when the site is built.
"""

import base64
import json
import re
import shutil
import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE / "scripts"), str(HERE.parent)]

import exo_pin  # noqa: E402

project = "exo_pin"
author = "the exo_pin developers"
copyright = f"{author}, BSD-2-Clause licence. Tests run the code on these pages."
release = exo_pin.__version__
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx_design"]
exclude_patterns = ["scripts"]
html_theme = "furo"
html_title = f"exo_pin {release}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_theme_options = {"light_logo": "logo-light.svg", "dark_logo": "logo-dark.svg"}
html_favicon = "_static/logo-light.svg"
html_copy_source = False
smartquotes = False
# Pages open from a folder, without a server and without a network.
html_use_index = True

myst_enable_extensions = ["colon_fence"]
myst_heading_anchors = 4
nb_execution_mode = "off"
nb_merge_streams = True
# Tables among the outputs: the default, CommonMark, has none.
nb_render_markdown_format = "myst"
# Rich output of widgets and data frames has text beside it.
suppress_warnings = ["mystnb.unknown_mime_type", "misc.highlighting_failure", "ref.python"]

# A reference that leads nowhere is a warning, but for:
nitpicky = True
nitpick_ignore_regex = [
    # words of a type, such as "array_like";
    ("py:class", r"(?!exo_pin\.).*"),
    # modules, constants and fields of records, which have no entry of their own, and inner functions;
    # tests/test_references.py finds them.
    ("py:(mod|data|attr)", ".*"),
    ("py:func", r"exo_pin\.\w+\.\w+\..*"),
]

autodoc_member_order = "bysource"
autodoc_typehints = "none"
autoclass_content = "class"
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_use_ivar = True

GALLERY = HERE / "notebooks"
API = HERE / "reference" / "api"
_PLACE = re.compile(r"<!-- made: ([\w ]+) -->")
#: A public name without its module, which a leading dot finds in any module.
_BARE = re.compile(r"(:(?:class|exc|meth|attr|func):`~?)(?=[A-Z])")
_LITERAL = re.compile(r"(``.+?``|:[a-z:]+:`[^`]*`|`[^`]*`)")


def make_pages(app):
    """Write the pages of the API, and copy the notebooks with a thumbnail each."""
    from reference_pages import write_api

    write_api(API)
    GALLERY.mkdir(exist_ok=True)
    cards = []
    for path in sorted((HERE.parent / "notebooks").glob("*.ipynb")):
        shutil.copyfile(path, GALLERY / path.name)
        cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
        title, about = first_words(cells)
        picture = largest_picture(cells)
        if picture:
            (GALLERY / f"{path.stem}.png").write_bytes(picture)
        cards.append(
            f":::{{grid-item-card}} {title}\n:link: {path.stem}\n:link-type: doc\n"
            + (f":img-top: {path.stem}.png\n" if picture else "")
            + f"\n{about}\n:::\n"
        )
    names = "\n".join(path.stem for path in sorted(GALLERY.glob("*.ipynb")))
    text = (
        "# Notebooks\n\nEach answers one question and keeps its output. The files are in the folder `notebooks` of the "
        "sources;\n`pip install '.[notebooks]'` installs what they need, and `python notebooks/run.py "
        "notebooks/NAME.ipynb` runs one.\n\n::::{grid} 1 2 2 3\n:gutter: 3\n\n"
        + "\n".join(cards)
        + f"::::\n\n```{{toctree}}\n:hidden:\n\n{names}\n```\n"
    )
    (GALLERY / "index.md").write_text(text, encoding="utf-8")


def first_words(cells):
    """Title of a notebook, and its first sentence."""
    lines = [line.strip() for line in "".join(cells[0]["source"]).splitlines() if line.strip()]
    rest = lines[1:] or ["".join(cell["source"]) for cell in cells[1:2] if cell["cell_type"] == "markdown"]
    text = " ".join(rest)
    # A sentence may begin or end within bold text.
    return lines[0].lstrip("# "), re.split(r"(?<=[.?!])\s", text.replace("**", ""))[0] if text else ""


def largest_picture(cells):
    """The largest picture among the outputs, as PNG; None where there is none."""
    found = [
        base64.b64decode("".join(output["data"]["image/png"]))
        for cell in cells
        for output in cell.get("outputs", [])
        if "image/png" in output.get("data", {})
    ]
    return max(found, key=len, default=None)


def fill_in(app, name, source):
    """Put in what is made from the code, and lead links to notebooks to their pages."""
    from reference_pages import MADE

    text = _PLACE.sub(lambda place: MADE[place[1]](), source[0])
    source[0] = re.sub(r"\((?:\.\./)+notebooks/(\w+)\.ipynb\)", r"(/notebooks/\1.ipynb)", text)


def offline_search(app, name, template, context, doctree):
    """A browser lets no page that was opened from a folder fetch others: excerpts come from a script."""
    if name == "search":
        app.add_js_file("excerpts.js")
        app.add_js_file("offline_search.js")


def write_excerpts(app, error):
    """Text of all pages, for excerpts of the search."""
    if not error:
        text = {f"{name}.html": app.env.get_doctree(name).astext() for name in sorted(app.env.found_docs)}
        script = f"window.EXCERPTS = {json.dumps(text, ensure_ascii=False)};\n"
        (Path(app.outdir) / "_static" / "excerpts.js").write_text(script, encoding="utf-8")


def escape(app, what, name, item, options, lines):
    """Docstrings write |x| and names that end in _, which reStructuredText reads as references."""
    for k, line in enumerate(lines):
        line = _BARE.sub(r"\1.", line)
        parts = _LITERAL.split(line)
        parts[::2] = [re.sub(r"(?<!\\)\|", r"\\|", part) for part in parts[::2]]
        parts[::2] = [re.sub(r"(\w)_(?=[\s,.;:)\]}]|$)", r"\1\\_", part) for part in parts[::2]]
        lines[k] = "".join(parts)


def setup(app):
    """Tell Sphinx what is made when."""
    app.connect("builder-inited", make_pages)
    app.connect("source-read", fill_in)
    app.connect("autodoc-process-docstring", escape, priority=400)
    app.connect("html-page-context", offline_search)
    app.connect("build-finished", write_excerpts)
