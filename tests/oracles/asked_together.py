"""Questions that are asked together, with the answer or the error of each; and those about files, in a new folder."""

import contextlib
import tempfile
from pathlib import Path

from answers import answer


def each(questions=(), /, **more):
    """Answers of questions by name; an error is the answer of one and not of all."""
    return {name: answer(question) for name, question in {**dict(questions), **more}.items()}


def tried(question, *values):
    """Answers of one question for several values, by their text where it is short, else by their place."""
    texts = [str(value) if len(str(value)) <= 40 else f"value {k}" for k, value in enumerate(values)]
    return {text: answer(lambda value=value: question(value)) for text, value in zip(texts, values, strict=True)}


def with_files(question, **contents):
    """The answer of a question that is asked in a new folder with files of these texts, "_" for the dot of a name."""
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        for name, content in contents.items():
            Path(".".join(name.rsplit("_", 1))).write_text(content, encoding="utf-8")
        return answer(question)
