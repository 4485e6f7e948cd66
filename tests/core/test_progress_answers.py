"""What bars of progress say, as it is stored."""

from __future__ import annotations

import contextlib
import io
from concurrent.futures import ThreadPoolExecutor

from answers import changes, each_of
from asked_in_turn import in_turn

from exo_pin.core.progress import mapped, track


class Loses:
    """An executor that loses a task."""

    def map(self, function, blocks):
        return [function(block) for block in blocks][:-1]


def drawn(question):
    """What is gone through, and whether a bar with the number of all is drawn."""
    with contextlib.redirect_stderr(io.StringIO()) as bar:
        return list(question()), [each in bar.getvalue() for each in ("numbers", "0/2")]


def asked_of_progress():
    def squares(count, executor=None, block=1, progress=False):
        return mapped(lambda x: x * x, list(range(count)), executor, "numbers", progress, block)

    with ThreadPoolExecutor(2) as pool:
        return in_turn(
            {
                f"{count} by {block}": lambda count=count, block=block: squares(count, pool, block)
                for count, block in ((0, 1), (5, 1), (5, 2))
            },
            alone=lambda: squares(4),
            loses=lambda: squares(4, Loses(), 2),
            no_executor=lambda: squares(2, 3),
            tracked=lambda: [
                *map(
                    drawn,
                    (
                        lambda: track([1, 2], "numbers", False),
                        lambda: track(iter([1, 2]), "numbers", True, 2),
                        lambda: squares(2, progress=True),
                        lambda: squares(2, pool, progress=True),
                        lambda: squares(2, pool),
                    ),
                )
            ],
        )


ASKED = {
    "progress": asked_of_progress,
}


@each_of(ASKED)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
