"""Answers of closed chains about how their forces and accelerations change, as they are stored."""

from answers import changes, each_of
from asked_dynamics import changes_of, loaded

ASKED = {
    name.replace(" ", "_"): lambda name=name: changes_of(loaded(name))
    for name in (
        "five-bar",
        "delta with rods",
        "Stewart platform",
        "parallelogram",
        "rigid loop",
        "revolute loop",
        "universal loop",
        "prismatic loop",
        "distance loop",
        "coupling loop",
        "heavy wrist",
    )
}
ASKED["rubbing"] = lambda: changes_of(loaded("cylindrical loop", friction=0.8))

#: Those that take longer than 0.15 s.
LONGER = {"Stewart_platform", "heavy_wrist"}


@each_of(ASKED, LONGER)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
