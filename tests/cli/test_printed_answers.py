"""What the first answer says, of every kind of device: the words as they are stored, each number to its last digit.

``python tests/cli/test_printed_answers.py`` stores what is printed now; read it before.
"""

import contextlib
import io
import re
from pathlib import Path

import pytest

from exo_pin.cli import main

ROOT, FOLDER = Path(__file__).parents[2], Path(__file__).parent / "printed"
POSE = "--flexion 60 --abduction 30"
#: Command of each answer, by the name of its file.
ASKED = {
    "worn": POSE,
    "person": f"{POSE} --person 1.75,75,male",
    "explained": f"{POSE} --person 1.75,75,male --explain",
    "payload_and_push": f"{POSE} --person 1.62,58,female --elbow-flexion 60 --payload 1.5 --hand-force 5,0,-10",
    "clothing_and_offset": f"{POSE} --person 1.75,75,male --clothing 8 --offset 5 0 -10",
    "prototype": f"prototype {POSE} --side right",
    "muscles_cannot_hold": "prototype --flexion 120 --abduction 10",
    "cables": "four-cables --flexion 40 --abduction 20 --internal-rotation -20",
    "three_actuators": f"three-linear-actuators {POSE} --explain",
    "without_limits": f"four-linear-actuators {POSE} --limits none",
    "serial": f"urdf/serial-y-x-z.urdf {POSE}",
    "serial_person": f"urdf/serial-y-x-z.urdf {POSE} --person 1.75,75,male",
    "nesm": f"urdf/nesm.urdf {POSE} --explain",
    "spherical_3rrr": f"urdf/spherical-3rrr.urdf {POSE}",
    "springs": f"urdf/spring-support.urdf {POSE}",
    "springs_person": f"urdf/spring-support.urdf {POSE} --person 1.75,75,male",
    "six_cables": f"urdf/six-cables.urdf {POSE}",
    "through_the_body": "--flexion -60 --abduction 120",
}
#: Those that take longer: with muscles of a person, or with all that is known.
LONGER = {name for name, words in ASKED.items() if "--person" in words or "--explain" in words}
NUMBER = re.compile(r"-?\d+(?:\.\d+)?")


def printed(name):
    """What the command says, with its code."""
    out = io.StringIO()
    with contextlib.chdir(ROOT), contextlib.redirect_stdout(out):
        code = main(["reaction", *ASKED[name].split()])
    return f"exo-pin reaction {ASKED[name]}\n{out.getvalue()}ends with {code}\n"


def as_words(text):
    """Words with the places of numbers; blanks that only align columns do not count."""
    return NUMBER.sub("#", re.sub(r"[ \n]+", " ", text))


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.full] if name in LONGER else []) for name in ASKED]
)
def test_an_answer_says_what_it_said(name):
    if "--person" in ASKED[name]:
        pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")
    before, now = (FOLDER / f"{name}.txt").read_text(encoding="utf-8"), printed(name)
    assert as_words(now) == as_words(before)
    for old, new in zip(NUMBER.findall(before), NUMBER.findall(now), strict=True):
        # Platforms round differently.
        last = 10.0 ** -len(old.partition(".")[2])
        assert abs(float(new) - float(old)) <= 1.01 * last, (old, new)


if __name__ == "__main__":
    for each in ASKED:
        (FOLDER / f"{each}.txt").write_text(printed(each), encoding="utf-8")
