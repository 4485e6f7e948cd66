"""Many small questions as one: the answers by name, errors as words, in a folder of their own."""

import contextlib
import io
import os
import re
import tempfile
from pathlib import Path
from unittest import mock

import exo_pin as ep
from exo_pin.cli import main


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


def printed(*words):
    """Lines that a command prints on a screen of 100 columns."""
    out = io.StringIO()
    # What is compiled for the first time is said on the other stream.
    streams = contextlib.redirect_stdout(out), contextlib.redirect_stderr(io.StringIO())
    with mock.patch.dict(os.environ, {"COLUMNS": "100"}), streams[0], streams[1]:
        main([str(word) for word in words])
    return out.getvalue().splitlines()


def words_and_numbers(text):
    """Lines of a text without its numbers, each line once and in order, and the numbers."""
    number = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?(?![\w.])")
    lines = dict.fromkeys(number.sub("#", line) for line in text.splitlines())
    return {"words": list(lines), "numbers": [float(each) for each in number.findall(text)]}
