"""Several questions in one stored answer: what each returns or refuses, and all that a run of a plant says."""

import contextlib
import functools
import re
import tempfile
from dataclasses import replace

import exo_pin as ep

#: A number of a text, with its exponent.
_NUMBER = re.compile(r"-?\d+\.\d+(?:e[+-]?\d+)?|-?\d+e-\d+")


def in_digits(text):
    """A text whose numbers have six digits, and are zero where they are rounding."""

    def written(found):
        value = float(found[0])
        return "0" if abs(value) < 1e-9 else f"{value:.6g}" if len(found[0].strip("-0.")) > 7 else found[0]

    return _NUMBER.sub(written, text)


def in_a_folder(question):
    """The question, asked in an empty folder, so that what it says of files has no path."""

    @functools.wraps(question)
    def asked():
        with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
            return question()

    return asked


def in_turn(**asked):
    """Answers by name; of a question that is refused the kind of error and its words."""
    found = {}
    for name, question in asked.items():
        try:
            found[name] = question()
        except ep.ExoPinError as error:
            found[name] = f"{type(error).__name__}: {error}"
    return found


def of_run(run, *more):
    """A run, the state at its end, and what it says when it is asked."""
    said = in_turn(**{name: getattr(run, name) for name in ("summary", *more)})
    return {"run": replace(run, snapshots=()), "end": run.state(run.times[-1])} | said
