"""Pages, words, examples and long sentences of the documentation, now or at a revision.

::

    python docs/scripts/count_words.py                      # the working tree
    python docs/scripts/count_words.py REVISION             # as it stood there
    python docs/scripts/count_words.py --long               # the sentences over 30 words, by page

A page is a Markdown file of ``docs`` or ``README.md``. Words and sentences are those of running text and lists: code
blocks, tables and headings are left out of sentences, and code blocks out of words. An example is a block of Python or
of commands, or a docstring with ``>>>``.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
#: Words in a sentence that a reader takes in at once.
LONGEST = 30
_BLOCK = re.compile(r"^(?P<fence>```|~~~)(?P<kind>\w*).*?^(?P=fence)", re.MULTILINE | re.DOTALL)
_ASIDE = re.compile(r"<!--[^>]*-->|^#[^\n]*$|^\s*\|[^\n]*$|^:[^\n]*$|^!\[[^\n]*$", re.MULTILINE)


def git(*words: str) -> str:
    """What a Git command prints."""
    return subprocess.run(["git", "-C", str(ROOT), *words], check=True, capture_output=True, text=True).stdout


def files(revision: str | None) -> Iterator[tuple[str, str]]:
    """Path and text of every page and module."""
    listed = git("ls-tree", "-r", "--name-only", revision) if revision else git("ls-files")
    for path in listed.splitlines():
        page = path.endswith(".md") and (path.startswith("docs/") or path == "README.md")
        if page or (path.startswith("exo_pin/") and path.endswith(".py")):
            if revision:
                yield path, git("show", f"{revision}:{path}")
            elif (ROOT / path).exists():
                yield path, (ROOT / path).read_text(encoding="utf-8")


def sentences(text: str) -> Iterator[str]:
    """Sentences of running text; an item of a list is one at least."""
    plain = re.sub(r"\]\([^)]*\)", "]", _ASIDE.sub("\n\n", _BLOCK.sub("\n\n", text)))
    for part in re.split(r"\n\s*\n|\n\s*(?:[-*]|\d+\.) ", plain):
        for sentence in re.split(r"(?<=[.!?])[*)]*\s+(?=[^a-z])", " ".join(part.split())):
            if sentence:
                yield sentence


def words(text: str) -> int:
    """Words that hold a letter or digit."""
    return sum(bool(re.search(r"\w", word)) for word in text.split())


def count(revision: str | None = None) -> dict[str, int]:
    """Pages, words, examples and long sentences."""
    pages = dict(files(revision))
    modules = {path: pages.pop(path) for path in list(pages) if path.endswith(".py")}
    blocks = [block["kind"] for text in pages.values() for block in _BLOCK.finditer(text)]
    return {
        "pages": len(pages),
        "words": sum(words(_BLOCK.sub("", text)) for text in pages.values()),
        "longest page, words": max(words(_BLOCK.sub("", text)) for text in pages.values()),
        "blocks of Python and commands": sum(kind in ("python", "bash") for kind in blocks),
        "docstrings with an example": sum(
            ">>>" in part for text in modules.values() for part in text.split('"""')[1::2]
        ),
        f"sentences over {LONGEST} words": sum(
            words(sentence) > LONGEST for text in pages.values() for sentence in sentences(text)
        ),
    }


def main() -> None:
    """Print the counts, or the long sentences."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("revision", nargs="?", help="a commit; the working tree if left out")
    parser.add_argument("--long", action="store_true", help="list the sentences over 30 words")
    options = parser.parse_args()
    if options.long:
        for path, text in files(options.revision):
            if path.endswith(".md"):
                for sentence in sentences(text):
                    if words(sentence) > LONGEST:
                        sys.stdout.write(f"{path}: {words(sentence)}: {sentence}\n")
        return
    for name, number in count(options.revision).items():
        sys.stdout.write(f"{name:30} {number:6}\n")


if __name__ == "__main__":
    main()
