"""Many small questions as one: the answers by name, errors as words, in a folder of their own."""

import contextlib
import re
import tempfile
from pathlib import Path

import exo_pin as ep


def each(questions):
    """Answers by name; of a question that fails, the error's kind and message."""
    return {name: _of(question) for name, question in questions.items()}


def _of(question):
    try:
        return question()
    except (ep.ExoPinError, NotImplementedError) as error:
        return f"{type(error).__name__}: {error}"


@contextlib.contextmanager
def folder():
    """An empty folder that is the current one, so that messages name files alone."""
    with tempfile.TemporaryDirectory() as name, contextlib.chdir(name):
        yield Path()


def words_and_numbers(text):
    """Lines of a text without its numbers, each line once and in order, and the numbers."""
    number = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?(?![\w.])")
    lines = dict.fromkeys(number.sub("#", line) for line in text.splitlines())
    return {"words": list(lines), "numbers": [float(each) for each in number.findall(text)]}
