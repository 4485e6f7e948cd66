"""Several questions in one stored answer: what each returns or refuses, and all that a run of a plant says."""

import contextlib
import functools
import io
import os
import re
import tempfile
from dataclasses import replace
from pathlib import Path
from unittest import mock

import exo_pin as ep
from exo_pin.cli import main

#: A number of a text, with its exponent.
_NUMBER = re.compile(r"-?\d+\.\d+(?:e[+-]?\d+)?|-?\d+e-\d+")


def in_digits(text):
    """A text whose numbers have six digits, and are zero where they are rounding."""

    def written(found):
        value = float(found[0])
        return "0" if abs(value) < 1e-9 else f"{value:.6g}" if len(found[0].strip("-0.")) > 7 else found[0]

    return _NUMBER.sub(written, text)


@contextlib.contextmanager
def folder():
    """An empty folder that is the current one, so that messages name files alone."""
    with tempfile.TemporaryDirectory() as name, contextlib.chdir(name):
        yield Path()


def in_a_folder(question):
    """The question, asked in an empty folder, so that what it says of files has no path."""

    @functools.wraps(question)
    def asked():
        with folder():
            return question()

    return asked


def in_turn(asked=(), /, **more):
    """Answers by name; of a question that is refused the kind of error and its words."""
    return {name: _answered(question) for name, question in {**dict(asked), **more}.items()}


def refused(*questions):
    """The same of questions without names."""
    return [*map(_answered, questions)]


def tried(question, *values):
    """Answers of one question for several values, by their text where it is short, else by their place."""
    texts = [str(value) if len(str(value)) <= 40 else f"value {k}" for k, value in enumerate(values)]
    return {text: _answered(lambda value=value: question(value)) for text, value in zip(texts, values, strict=True)}


def with_files(question, **contents):
    """The answer of a question that is asked in a new folder with files of these texts, "_" for the dot of a name."""
    with folder():
        for name, content in contents.items():
            Path(".".join(name.rsplit("_", 1))).write_text(content, encoding="utf-8")
        return _answered(question)


def _answered(question):
    try:
        return question()
    except (ep.ExoPinError, NotImplementedError) as error:
        return f"{type(error).__name__}: {error}"


def of_run(run, *more):
    """A run, the state at its end, and what it says when it is asked."""
    said = in_turn(**{name: getattr(run, name) for name in ("summary", *more)})
    # How many steps an integration takes hangs on how a machine rounds.
    end = replace(run.state(run.times[-1]), step=1.0)
    return {"run": replace(run, snapshots=(), steps=0), "end": end} | said


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
