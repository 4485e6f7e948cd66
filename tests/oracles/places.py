"""Where the repository and its robots are."""

from pathlib import Path

REPOSITORY = Path(__file__).parents[2]
URDF = REPOSITORY / "urdf"
DOCS = REPOSITORY / "docs"
#: Pages by name, without those that a build makes. A name occurs once, whatever the folder, but for "index".
PAGES = {
    path.stem if path.stem != "index" else f"{path.parent.name}/index": path
    for path in sorted(DOCS.rglob("*.md"))
    if path.parent.name not in ("api", "notebooks")
}
SCRIPTS = DOCS / "scripts"


def page(name: str) -> str:
    """The text of a page of the site."""
    return PAGES[name].read_text(encoding="utf-8")
