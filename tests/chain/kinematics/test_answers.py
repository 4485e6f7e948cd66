"""Answers of closed chains about loops, poses, freedoms and singular poses, as they are stored."""

from answers import changes, each_of
from asked_chains import kinematics_of
from asked_digits import rounded_files, tilted, tilted_files
from asked_poses import assembled, branches, rounded, singular, steps
from moving_chains import moving
from singular_poses import POSES, REGULAR


def asked(name):
    case = moving(name, seed=3)
    return kinematics_of(case.chain, case.q, case.independent)


ASKED = {
    name.replace(" ", "_"): lambda name=name: asked(name)
    for name in (
        "four-bar",
        "3RRR",
        "agile eye",
        "delta with rods",
        "Stewart platform",
        "parallelogram",
        "rigid loop",
        "revolute loop",
        "universal loop",
        "prismatic loop",
        "cylindrical loop",
        "distance loop",
        "coupling loop",
        "heavy wrist of both kinds of limbs",
        "prototype",
    )
}
ASKED |= {"branches": branches, "assembled": assembled, "steps": steps, "tilted": tilted, "tilted_files": tilted_files}
ASKED |= {
    f"rounded_to_{digits}": lambda digits=digits: rounded(
        digits, ("planar", "spherical", "bennett", "sarrus", "cranks")
    )
    for digits in (None, 4, 6, 9)
}
ASKED |= {f"delta_to_{digits}": lambda digits=digits: rounded(digits, ("delta",)) for digits in (5, 8)}
ASKED |= {
    f"singular_to_{digits}": lambda digits=digits: singular(digits, [*POSES, *REGULAR]) for digits in (None, 5, 8)
}
ASKED |= {
    f"{name}_of_{digits}_digits": lambda name=name, digits=digits: rounded_files(name, digits, seed=5)
    for name, digits in (("planar", 5), ("sarrus", 5), ("bennett", 4), ("spherical", 7), ("planar", 9))
}

#: Those that take longer than 0.15 s.
LONGER = {
    "tilted_files",
    "tilted",
    "heavy_wrist_of_both_kinds_of_limbs",
    "assembled",
    "singular_to_None",
    "singular_to_5",
    "singular_to_8",
}


@each_of(ASKED, LONGER)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
