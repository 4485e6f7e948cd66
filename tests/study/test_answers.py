"""Answers of studies: comparisons, sweeps and ranks of designs, as they are stored."""

import pytest
from answers import changes
from places import URDF

import exo_pin as ep
from exo_pin.study import adl_box, compare, sweep

MAN = ep.Wearer(1.755, 85, "male", elbow_flexion=0.6, payload=0.5)


def named(*names):
    """Designs by name."""
    return [ep.load(URDF / f"{name}.urdf" if (URDF / f"{name}.urdf").exists() else name) for name in names]


def compared(*names, **options):
    return compare(*named(*names), poses=adl_box(50.0), person=MAN, **options)


ASKED = {
    "four_kinds": lambda: compared("prototype", "four-cables", "serial-y-x-z", "nesm", detailed=True),
    "sweep": lambda: sweep(ep.load("four-cables"), {"limb_count": [3, 4], "cuff_height_mm": [180, 1]}, adl_box(60.0)),
    "no_values": lambda: sweep(ep.load("four-cables"), {}, adl_box(60.0)),
}


#: Those that take longer than 0.15 s.
LONGER = {"four_kinds"}


@pytest.mark.parametrize("name", [pytest.param(name, marks=[pytest.mark.full] * (name in LONGER)) for name in ASKED])
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
