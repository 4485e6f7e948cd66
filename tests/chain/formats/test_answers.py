"""Answers about robots' files that are read and written, as they are stored."""

import odd_files
import several_coordinates
from answers import changes, each_of
from asked_digits import of_words, right_angles, rounded_files
from asked_dynamics import loaded
from asked_files import read, written
from asked_rows import of_caspr, of_mjcf, of_sdf, of_toml, of_urdf, of_yaml, wrong_urdf
from massive_chains import HEAVY
from mjcf_chains import random_robot
from mjcf_mutations import PLANT, mutated
from sdf_mutations import mutated_sdf
from sdf_robots import LEG, random_sdf
from urdf_trees import random_tree

WRITTEN = ("four-bar", "delta with rods", "universal loop", "coupling loop", "distance loop", "heavy wrist")


def of_several(kind):
    chain, q = several_coordinates.chain(kind, passive=True)
    return written(chain, q)


ASKED = {f"written_{name.replace(' ', '_')}": lambda name=name: written(loaded(name).chain) for name in WRITTEN}
ASKED |= {
    f"even_{name.replace(' ', '_')}": lambda name=name: written(loaded(name, 0.6, even=True).chain)
    for name in (
        *WRITTEN,
        "Stewart platform",
        "revolute loop",
        "prismatic loop",
        "rigid loop",
        "heavy wrist of both kinds of limbs",
    )
}
ASKED |= {f"heavy_{part}": lambda part=part: written(HEAVY[part]) for part in ("whole", "floating")}
ASKED |= {f"written_{kind}": lambda kind=kind: of_several(kind) for kind in several_coordinates.KINDS}
ASKED |= {
    "mjcf": lambda: [read("xml", PLANT), *(read("xml", random_robot(seed).text) for seed in range(6))],
    "sdf": lambda: [read("sdf", LEG), *(read("sdf", random_sdf(seed)) for seed in range(8))],
    "urdf": lambda: [read("urdf", random_tree(seed)) for seed in range(6)],
}
ASKED |= {
    f"wrong_mjcf_{first}": lambda first=first: [read("xml", mutated(seed)) for seed in range(first, first + 30)]
    for first in (0, 30, 60)
}
ASKED |= {
    f"wrong_sdf_{first}": lambda first=first: [read("sdf", mutated_sdf(seed)) for seed in range(first, first + 30)]
    for first in (0, 30)
}
ASKED |= {f"wrong_urdf_{first}": lambda first=first: wrong_urdf(range(first, first + 40)) for first in (0, 40)}
ASKED |= {
    "said_of_urdf": of_urdf,
    "said_of_sdf": of_sdf,
    "said_of_mjcf": of_mjcf,
    "said_of_toml": of_toml,
    "said_of_yaml": of_yaml,
    "said_of_caspr": of_caspr,
    "right_angles": right_angles,
    "digits": of_words,
    "odd_read": odd_files.read,
    "odd_written": odd_files.write,
}
ASKED |= {
    f"{name}_of_{digits}_digits": lambda name=name, digits=digits: rounded_files(name, digits)
    for name, digits in (("planar", 4), ("sarrus", 6), ("bennett", 3), ("cranks", 8), ("spherical", 5))
}

#: Those that take longer than 0.15 s.
LONGER = {
    "odd_written",
    "odd_read",
    "spherical_of_5_digits",
    "cranks_of_8_digits",
    "said_of_urdf",
    "wrong_mjcf_30",
    "wrong_mjcf_60",
    "wrong_sdf_30",
}


@each_of(ASKED, LONGER)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
