"""Answers of closed chains about forces and motion, as they are stored."""

from answers import changes, each_of
from asked_chains import all_tried
from asked_dynamics import forces_of, loaded, motion_of, shown
from asked_events import blocks, contacts, crossings, loops
from senseless_questions import UNKNOWN, WRONG

NAMES = (
    "four-bar",
    "delta with rods",
    "Stewart platform",
    "parallelogram",
    "universal loop",
    "coupling loop",
    "heavy wrist",
)
ASKED = {
    f"{what}_{name.replace(' ', '_')}": lambda name=name, ask=ask: ask(loaded(name))
    for what, ask in (("forces", forces_of), ("motion", motion_of))
    for name in NAMES
}
ASKED |= {
    f"rubbing_{what}_{name.replace(' ', '_')}": lambda name=name, ask=ask: ask(loaded(name, friction=0.8))
    for what, ask in (("forces", forces_of), ("motion", motion_of))
    for name in ("four-bar", "cylindrical loop")
}
ASKED |= {
    "shown": shown,
    "blocks": blocks,
    "loops": loops,
    "crossings": crossings,
    "senseless": lambda: all_tried(**WRONG, **UNKNOWN),
}
ASKED |= {
    f"contacts_{name.replace(' ', '_')}": lambda name=name, seeds=seeds: contacts(name, seeds)
    for name, seeds in {
        "four-bar": range(6),
        "five-bar": range(8),
        "universal loop": range(4),
        "delta with rods": range(3),
    }.items()
}

#: Those that take longer than 0.15 s.
LONGER = {
    "contacts_five-bar",
    "contacts_universal_loop",
    "contacts_delta_with_rods",
    "forces_Stewart_platform",
    "forces_heavy_wrist",
    "rubbing_forces_cylindrical_loop",
    "motion_delta_with_rods",
}


@each_of(ASKED, LONGER)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
