"""Write docs/howto/clinicians.md: ten questions of clinicians and designers, each with its command and answer.

::

    python docs/scripts/ten_questions.py
"""

from __future__ import annotations

import contextlib
import io
import shlex
import textwrap
from pathlib import Path
from typing import NamedTuple

from exo_pin.cli import main

PAGE = Path(__file__).parents[1] / "howto" / "clinicians.md"
HEAD = """\
# Ten questions of clinicians and designers

Each is one command. The answers are printed by `python docs/scripts/ten_questions.py`, which writes this page; where an
answer is long, `...` stands for the rest. The design is `four-linear-actuators-worn`, which commands take without a
name; a `.toml` file or a robot may stand in its place. Words of the answers are explained in
[Which number](../concepts/which_number.md).
"""


class Question(NamedTuple):
    """A question, its command, which lines of the answer are shown, and how to read it."""

    question: str
    command: str
    lines: slice
    reading: str


QUESTIONS = (
    Question(
        "Which way does the device push the head in its socket?",
        "exo-pin reaction --person 1.75,75,male --flexion 60 --abduction 30",
        slice(0, 5),
        "The line *Without muscles* names the parts along the socket of this person in this pose. With "
        "muscles the head is pressed into the socket; its force is the line *In the joint*.",
    ),
    Question(
        "The shoulder is subluxed, and no muscle holds it. What pulls on it?",
        "exo-pin reaction --person 1.70,60,female --strength 0",
        slice(0, 5),
        "The weight of arm and device hangs on capsule and ligaments. No source says how much they bear without harm.",
    ),
    Question(
        "The device sits 10 mm too high. What changes?",
        "exo-pin reaction --person 1.75,75,male --flexion 60 --offset 0 0 10",
        slice(0, 5),
        "Compare it with the same command without `--offset`. `exo-pin uncertainty --flexion 60` searches the "
        "worst direction.",
    ),
    Question(
        "What if one drive fails?",
        "exo-pin workspace --step 20 --person 1.75,75,male --limb-loss --no-muscles",
        slice(-9, None),
        "`held` is the share of the poses that the others hold; `missing_Nm` the moment that they then lack "
        "at worst. How fast the arm sinks, and what control does, is not computed.",
    ),
    Question(
        "A therapist pulls the hand down with 20 N. What does the joint carry?",
        "exo-pin reaction --person 1.75,75,male --flexion 60 --hand-force 0,0,-20",
        slice(0, 5),
        "The force is forward, left and up, N, at the third knuckle. A weight in the hand is `--payload`, kg.",
    ),
    Question(
        "Can I use a recording of my own sensors?",
        "exo-pin record examples/lift.csv",
        slice(0, 7),
        "The first line says whether an arm can have moved so. `exo-pin person --trajectory FILE` has the "
        "force in the joint along it.",
    ),
    Question(
        "Does it fit a person who sits in a chair?",
        "exo-pin workspace --step 20 --person 1.75,75,male --obstacle chair --no-muscles",
        slice(0, 10),
        "`clearance` counts the chair: compare it with the same command without `--obstacle`. `wheelchair` "
        "and `bed` are others.",
    ),
    Question(
        "How much work does it take from the muscles?",
        "exo-pin reaction --person 1.75,75,male --payload 2 --flexion 90",
        slice(0, 3),
        "The relief is of the force in the joint, at most, and of people who keep tension. EMG was measured "
        "on other devices, on healthy wearers: no number here is a promise.",
    ),
    Question(
        "Does it suit a patient of 45 kg, with a bent elbow?",
        "exo-pin reaction --person 1.60,45,female --elbow-flexion 90 --flexion 60",
        slice(0, 12),
        "Forces follow the weight of the arm; the last lines say how near the device comes to her and what "
        "the cuff does.",
    ),
    Question(
        "What do I have to buy?",
        "exo-pin parts --person 1.75,75,male",
        slice(0, 12),
        "`exo-pin report --person 1.75,75,male --out report.pdf` has it on [two pages](report.md) with all the rest.",
    ),
)


def answer_of(each: Question) -> str:
    """What is printed, in the folder of the sources."""
    printed = io.StringIO()
    quiet = contextlib.redirect_stderr(io.StringIO())
    with contextlib.redirect_stdout(printed), quiet, contextlib.chdir(PAGE.parents[2]):
        main(shlex.split(each.command)[1:])
    lines = [line.rstrip() for line in printed.getvalue().rstrip().split("\n")]
    shown = lines[each.lines]
    before = ["..."] if (each.lines.start or 0) < 0 else []
    after = ["..."] if not before and len(shown) < len(lines) else []
    return "\n".join([*before, *shown, *after])


def block(each: Question) -> str:
    """A question as a part of the page."""
    fence = "```"
    return (
        f"## {each.question}\n\n{fence}bash\n{each.command}\n{fence}\n\n<!-- output: answer -->\n{fence}text\n"
        f"{answer_of(each)}\n{fence}\n\n{textwrap.fill(each.reading, 138, break_on_hyphens=False)}\n"
    )


if __name__ == "__main__":
    PAGE.write_text("\n".join([HEAD, *map(block, QUESTIONS)]), encoding="utf-8")
