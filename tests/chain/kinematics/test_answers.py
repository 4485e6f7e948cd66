"""Answers of closed chains about loops, poses, freedoms and singular poses, as they are stored."""

import pytest
from answers import changes
from asked_chains import kinematics_of
from moving_chains import moving


def asked(name):
    case = moving(name, seed=3)
    return kinematics_of(case.chain, case.q, case.independent)


ASKED = {
    name.replace(" ", "_"): lambda name=name: asked(name)
    for name in (
        "four-bar", "3RRR", "agile eye", "delta with rods", "Stewart platform", "parallelogram", "rigid loop",
        "revolute loop", "universal loop", "prismatic loop", "cylindrical loop", "distance loop", "coupling loop",
        "heavy wrist of both kinds of limbs", "prototype",
    )
}  # fmt: skip

#: Those that take longer than 0.15 s.
LONGER = {}


@pytest.mark.parametrize("name", [pytest.param(name, marks=[pytest.mark.full] * (name in LONGER)) for name in ASKED])
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
