"""Answers that follow a hand on a slider: the newest question is answered at once, and in full when it rests."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace

from ..core.errors import ExoPinError
from ..core.records import OneProcess, Record
from ..exo.first_answer import AnswerParts, answer_in_parts
from ..exo.pose_report import PoseReport
from ..view import Scene
from .asked import Asked

__all__: list[str] = []

#: How long a question stands before it is answered in full, s.
_RESTS = 0.3


@dataclass(frozen=True, eq=False)
class Shown(Record):
    """An answer for the page.

    Attributes
    ----------
    asked : Asked
        The question.
    parts : AnswerParts or None
        The first answer; None of a question that was refused.
    report : PoseReport or None
        What it is of.
    moving : bool
        Whether it is the short one, of a moving arm.
    refusal : str
        Why there is no answer.
    """

    asked: Asked
    parts: AnswerParts | None = None
    report: PoseReport | None = None
    moving: bool = False
    refusal: str = ""


def answered(asked: Asked, moving: bool = False) -> Shown:
    """The answer to a question, or why it was refused."""
    try:
        report = asked.report(moving)
        return Shown(asked, answer_in_parts(report, moving), report, moving)
    except (ExoPinError, OSError) as error:
        return Shown(asked, moving=moving, refusal=str(error))


class Following(OneProcess):
    """Two threads: one answers shortly and draws, the other in full; of questions that wait the newest counts.

    Parameters
    ----------
    show : callable
        Gets each answer, in the thread that made it.
    draw : callable
        Gets each new scene.
    """

    def __init__(self, show: Callable[[Shown], None], draw: Callable[[Scene], None]) -> None:
        self._show, self._draw = show, draw
        self._asked, self._changed, self._ends = Asked(), threading.Event(), False
        self._scene: Scene | None = None
        self._drawn = Asked()
        self._whole, self._working = ThreadPoolExecutor(1, "exo_pin answers"), Future[None]()
        self._thread = threading.Thread(target=self._run, name="exo_pin app", daemon=True)
        self._thread.start()

    def ask(self, asked: Asked) -> None:
        """Answer a question, and return at once."""
        self._asked = asked
        self._changed.set()

    def close(self) -> None:
        """End the threads."""
        self._ends = True
        self._changed.set()
        self._whole.shutdown(wait=False, cancel_futures=True)

    def _run(self) -> None:
        self._changed.wait()
        while not self._ends:
            self._changed.clear()
            self._working.cancel()
            asked = self._asked
            self._show(answered(asked, moving=True))
            self._picture(asked)
            if not self._changed.wait(_RESTS) and not self._ends:
                self._working = self._whole.submit(self._in_full, asked)
                self._changed.wait()

    def _in_full(self, asked: Asked) -> None:
        shown = answered(asked)
        # Somebody has moved on meanwhile.
        if asked == self._asked and not self._ends:
            self._show(shown)

    def _picture(self, asked: Asked) -> None:
        try:
            scene, body = self._scene, replace(asked.anywhere, design="", changes=())
            if scene is None or body != replace(self._drawn.anywhere, design="", changes=()):
                scene = Scene(asked.exo)
            elif asked.anywhere != self._drawn.anywhere:
                scene.replace_exo(asked.exo)
            scene.show(asked.pose)
            scene.offer(hand=asked.pose.apply(asked.hand))
            if scene is not self._scene:
                self._draw(scene)
            self._scene, self._drawn = scene, asked
        except (ExoPinError, OSError):
            # The answer says what is wrong; the picture stays as it was.
            return
