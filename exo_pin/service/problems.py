"""Problem documents: why a request has no answer, after RFC 9457, and the answer of a body of a request."""

from __future__ import annotations

import logging
import warnings
from dataclasses import dataclass, field
from http import HTTPStatus
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import msgspec

from ..core.errors import ExoPinError, MissingExtra
from ..core.results import plain
from ..core.schema import document
from ..exo.questions import answer, answer_document, doubted, parsed, understood

#: What is wrong with the service itself, with tracebacks.
LOG = logging.getLogger("exo_pin.service")
#: Media type of problem documents, of documents, and of the pages of a report by their names.
MEDIA, JSON = "application/problem+json", "application/json"
PAGES = {"application/pdf": "pdf", "text/html": "html"}


@dataclass(frozen=True)
class Problem:
    """Why a request has no answer (RFC 9457).

    Attributes
    ----------
    type : str
        Name of the problem as a URI.
    title : str
        What the status means.
    status : int
        Status of the response.
    detail : str
        What is wrong, and what was expected.
    kind : str
        Name of the error.
    warnings : list of str
        What was doubted on the way.

    Examples
    --------
    >>> ep.service.Problem("urn:exo_pin:Busy", "Service Unavailable", 503, "try again", "Busy").kind
    'Busy'
    """

    type: str
    title: str
    status: int
    detail: str
    kind: str
    warnings: list[str] = field(default_factory=list)


def problem(status: int, kind: str, detail: str, warnings: list[str] | None = None) -> bytes:
    """The JSON of a problem document."""
    found = Problem(f"urn:exo_pin:{kind}", HTTPStatus(status).phrase, status, detail, kind, warnings or [])
    return encoded(document(Problem, vars(found)))


def encoded(body: object) -> bytes:
    """JSON of a document."""
    return msgspec.json.encode(plain(body))


def reply(question: str, body: bytes) -> tuple[int, bytes]:
    """Status and JSON of the answer of a request's body.

    Parameters
    ----------
    question : str
        Of :data:`exo_pin.exo.questions.QUESTIONS`; "report.pdf" and "report.html" for the pages in place of a document.
    body : bytes
        The question, as a line of ``exo-pin batch``; a design is a preset's name or stands in it, and no file is read.

    Raises
    ------
    MemoryError
        If the answer needs more memory than the process may take.
    """
    question, _, ending = question.partition(".")
    try:
        asked = parsed(body)
    except ExoPinError as error:
        return 400, problem(400, "NoJSON", str(error))
    except (ValueError, RecursionError) as error:
        return 400, problem(400, "NoJSON", f"expected JSON: {error}")
    try:
        if isinstance(asked, dict):
            asked.setdefault("question", question)
            if asked["question"] != question:
                detail = f"expected question {question!r} or none at this address"
                return 422, problem(422, "InvalidInput", detail)
        if ending:
            return 200, _pages(asked, ending)
        found, texts = doubted(lambda: answer(asked, files=False))
        return 200, encoded(answer_document(asked, 1, found, None, texts))
    except MissingExtra as error:
        return 501, problem(501, "MissingExtra", str(error))
    except ExoPinError as error:
        return 422, problem(422, type(error).__name__, str(error), getattr(error, "_doubts", []))
    except MemoryError:
        raise
    except Exception:
        LOG.exception("a question had no answer: %s", question)
        return 500, problem(500, "InternalFault", "a fault of exo_pin, which its log describes")


def _pages(asked: Any, ending: str) -> bytes:
    """The pages of a report that is asked for, as ``exo-pin report`` writes them."""
    _, exo, arguments = understood(asked, files=False)
    with TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the pages have the cautions
        path = Path(folder, f"report.{ending}")
        exo.report(**arguments).save(path)
        return path.read_bytes()
