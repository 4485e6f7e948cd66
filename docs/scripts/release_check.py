"""What has to be so before a release; prints what is not, and ends with 1 then.

::

    python docs/scripts/release_check.py build/site

- Package, citation and the changelog's newest version agree, and "Unreleased" is empty.
- No package is newer than the one with which a table was measured: ``<!-- measured: mujoco 3.17.0 -->`` on its page.
- The documentation has at most :data:`WORDS` words.
- Every public name stands in a page, a notebook or a command.
- Links of the built site lead somewhere.
"""

from __future__ import annotations

import re
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from check_links import broken_links
from count_words import ROOT, count
from public_names import without_place

#: Words that the documentation may have.
WORDS = 30_000


def version_faults(package: str, changelog: str, citation: str) -> list[str]:
    """What is wrong with three texts: version of the package, changelog and citation."""
    unreleased, *released = re.split(r"^## \[", changelog.partition("## [Unreleased]\n")[2], flags=re.MULTILINE)
    found = ["CHANGELOG.md: Unreleased is not empty"] if unreleased.strip() else []
    named = {
        "CHANGELOG.md": released[0].partition("]")[0],
        "CITATION.cff": re.findall(r"^version: (.*)$", citation, re.MULTILINE)[0],
    }
    return found + [
        f"{name}: {other}, but the package is {package}" for name, other in named.items() if other != package
    ]


def stale_tables(page: str, installed: dict[str, str]) -> list[str]:
    """Packages that are newer than a page's measurements; ``installed`` has versions by name."""
    found = []
    for name, measured in re.findall(r"([\w-]+) ([\d.]+)", " ".join(re.findall(r"<!-- measured: (.*?) -->", page))):
        now = installed.get(name, "0")
        if _numbers(now) > _numbers(measured):
            found.append(f"measured with {name} {measured}, now {now}")
    return found


def _numbers(text: str) -> list[int]:
    """Numbers of a version, for comparison."""
    return [int(part) for part in re.findall(r"\d+", text)]


def _installed(package: str) -> dict[str, str]:
    """Versions of this package and of those that tables compare it with."""
    found = {"exo_pin": package}
    for name in ("pin", "mujoco", "scipy", "proxsuite", "drake", "opensim", "toolbox-parallel-robots"):
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            sys.stderr.write(f"{name} is not installed: tables with it were not checked\n")
    return found


def main() -> None:
    """Print what is not ready."""
    package = re.findall(r'__version__ = "(.*)"', (ROOT / "exo_pin" / "__init__.py").read_text(encoding="utf-8"))[0]
    texts = [(ROOT / name).read_text(encoding="utf-8") for name in ("CHANGELOG.md", "CITATION.cff")]
    found, installed = version_faults(package, *texts), _installed(package)
    for path in sorted((ROOT / "docs").rglob("*.md")):
        found += [
            f"{path.relative_to(ROOT)}: {text}" for text in stale_tables(path.read_text(encoding="utf-8"), installed)
        ]
    words = count()["words"]
    found += [f"{words} words of documentation, at most {WORDS}"] if words > WORDS else []
    found += [f"{name} stands in no page, notebook or command" for name in without_place()]
    found += [f"broken link: {text}" for text in broken_links(Path(sys.argv[1]))] if len(sys.argv) > 1 else []
    sys.stdout.write("".join(f"{line}\n" for line in found) or "Ready for a release.\n")
    sys.exit(bool(found))


if __name__ == "__main__":
    main()
