"""Checks that frozen records share."""

from dataclasses import dataclass

import numpy as np
import pytest

from exo_pin import InvalidInput
from exo_pin.core.validation import as_count, require_type, set_positive


@dataclass(frozen=True)
class Box:
    length: float
    wall: float = 0.0
    mass: float | None = None

    def __post_init__(self):
        set_positive(self, "length")
        set_positive(self, "wall", zero=True)
        set_positive(self, "mass", optional=True)


def test_positive_fields_are_stored_as_floats():
    box = Box(np.int64(2))
    assert (box.length, box.wall, box.mass) == (2.0, 0.0, None)
    assert type(box.length) is float
    for wrong, name in (((0.0,), "length"), ((None,), "length"), ((1.0, -1.0), "wall")):
        with pytest.raises(InvalidInput, match=name):
            Box(*wrong)
    with pytest.raises(InvalidInput, match="mass"):
        Box(1.0, mass=0.0)


@pytest.mark.parametrize("value", [True, 1.0, "1", None, 0, -1])
def test_a_count_is_a_whole_number(value):
    assert as_count("n", np.int32(1), 1) == 1
    with pytest.raises(InvalidInput, match="n to be a whole number of 1 or more"):
        as_count("n", value, 1)


def test_a_wrong_type_is_named_with_what_was_expected():
    require_type("box", Box(1.0), Box)
    require_type("box", None, Box | None)
    for kind, words in ((Box, "expected box to be a Box, got int"), (Box | None, "a Box or None, got int")):
        with pytest.raises(InvalidInput, match=words):
            require_type("box", 3, kind)
    with pytest.raises(InvalidInput, match="an InvalidInput"):
        require_type("error", None, InvalidInput)
