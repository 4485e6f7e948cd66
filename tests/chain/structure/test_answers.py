"""Answers about the parts of closed chains, as they are stored."""

import several_coordinates
from answers import changes, each_of
from asked_dynamics import loaded
from asked_structure import flying, geared_arms, limited, moves, parts_of, refused, unfit


def of(name):
    case = loaded(name, 0.4)
    return parts_of(case.chain, case.q)


ASKED = {"refused": refused, "unfit": unfit, "geared_arms": geared_arms}
ASKED |= {
    name.replace(" ", "_"): lambda name=name: of(name)
    for name in (
        "Stewart platform",
        "rigid loop",
        "revolute loop",
        "universal loop",
        "prismatic loop",
        "cylindrical loop",
        "distance loop",
        "coupling loop",
        "heavy wrist of both kinds of limbs",
    )
}
ASKED |= {
    kind: lambda kind=kind: parts_of(*several_coordinates.chain(kind, passive=True)) for kind in ("spherical", "planar")
}
ASKED |= {
    f"moves_{name.replace(' ', '_')}": lambda name=name: moves(loaded(name).chain, loaded(name).q)
    for name in ("rigid loop", "revolute loop", "universal loop", "prismatic loop", "cylindrical loop", "coupling loop")
}
ASKED |= {
    f"moves_{kind}_{loop}": lambda kind=kind, loop=loop: moves(*several_coordinates.chain(kind, loop, passive=True))
    for kind, loop in (("spherical", "rigid"), ("spherical", "distance"), ("planar", "revolute"))
}
ASKED |= {"flying": flying, "limited": limited}

#: Those that take longer than 0.15 s.
LONGER = {"heavy_wrist_of_both_kinds_of_limbs"}


@each_of(ASKED, LONGER)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
