"""Answers that follow a hand on a slider: the newest question is answered at once, and in full when it rests."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, replace

from ..core.errors import ExoPinError
from ..exo.first_answer import AnswerParts, answer_in_parts
from ..exo.pose_report import PoseReport
from ..view import Scene
from .asked import Asked

_LOG = logging.getLogger("exo_pin.app")
#: How long a question stands before it is answered in full, s.
_RESTS = 0.3


@dataclass(frozen=True, eq=False)
class Shown:
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
    except Exception:
        # The thread goes on: later questions have answers of their own.
        _LOG.exception("a question had no answer: %s", asked)
        return Shown(asked, moving=moving, refusal="A fault of exo_pin, which its log describes.")


class Following:
    """Two threads: one answers shortly and draws, the other in full; of questions that wait the newest counts.

    Parameters
    ----------
    show : callable
        Gets the place of a question and its answer, in the thread that made it.
    draw : callable
        Gets the place of a question and each new scene.
    """

    def __init__(self, show: Callable[[int, Shown], None], draw: Callable[[int, Scene], None]) -> None:
        self._show, self._draw = show, draw
        self._asked: tuple[Asked, ...] = ()
        self._changed, self._ends = threading.Event(), False
        #: Whether joint centres of the first design can be dragged.
        self.joints = False
        self._drawn: dict[int, tuple[Scene, Asked]]
        self._beside: tuple[Asked, ...] | None = None
        self._scale: float | None = None
        self._whole, self._working = ThreadPoolExecutor(1, "exo_pin answers"), Future[None]()
        self._thread = threading.Thread(target=self._run, name="exo_pin app", daemon=True)
        self._thread.start()

    def ask(self, *asked: Asked) -> None:
        """Answer the questions about one pose of one or more designs, and return at once."""
        self._asked = asked
        self._changed.set()

    def draw_anew(self) -> None:
        """Draw new scenes with the next answers."""
        self._beside = None

    def close(self, wait: bool = False) -> None:
        """End the threads; ``wait`` until they have ended."""
        self._ends = True
        self._changed.set()
        self._whole.shutdown(wait, cancel_futures=True)
        if wait:
            self._thread.join()

    def _run(self) -> None:
        self._changed.wait()
        while not self._ends:
            self._changed.clear()
            self._working.cancel()
            asked = self._asked
            self._arrange(asked)
            for place, each in enumerate(asked):
                self._show(place, answered(each, moving=True))
                self._picture(place, each)
            if not self._changed.wait(_RESTS) and not self._ends:
                self._working = self._whole.submit(self._in_full, asked)
                self._changed.wait()

    def _in_full(self, asked: tuple[Asked, ...]) -> None:
        for place, each in enumerate(asked):
            shown = answered(each)
            # Somebody has moved on meanwhile.
            if asked != self._asked or self._ends:
                return
            self._show(place, shown)

    def _arrange(self, asked: tuple[Asked, ...]) -> None:
        """Draw several designs, or one after several, in new scenes, whose arrows have one scale."""
        beside = tuple(replace(each.anywhere, changes=()) for each in asked) if len(asked) > 1 else ()
        if beside != self._beside:
            self._beside, self._drawn, scales = beside, {}, list[float]()
            for each in asked if beside else ():
                with suppress(ExoPinError, OSError):
                    scene = Scene(each.exo, human=False)
                    scene.show(each.pose)
                    scales.append(scene.metres_per_newton)
            self._scale = min(scales, default=None)

    def _picture(self, place: int, asked: Asked) -> None:
        try:
            scene, drawn = self._drawn.get(place, (None, None))
            body = replace(asked.anywhere, design="", changes=())
            if scene is None or drawn is None or body != replace(drawn.anywhere, design="", changes=()):
                scene, drawn = Scene(asked.exo, metres_per_newton=self._scale), None
            elif asked.anywhere != drawn.anywhere:
                scene.replace_exo(asked.exo)
            scene.show(asked.pose, motion=asked.motion)
            joints = asked.joints if self.joints and not place else {}
            scene.offer(joints, hand=asked.pose.apply(asked.hand))
            if drawn is None:
                self._draw(place, scene)
            self._drawn[place] = scene, asked
        except (ExoPinError, OSError):
            # The answer says what is wrong; the picture stays as it was.
            return
        except Exception:
            _LOG.exception("a question had no picture: %s", asked)
