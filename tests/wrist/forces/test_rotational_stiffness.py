"""Rotational stiffness of the arm: input that is none."""

import pytest

import exo_pin as ep
from exo_pin import wrist


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("100", 1e4), "tensions"),
        ((True, 1e4), "tensions"),
        ((100.0, ["1", "2", "3"]), "axial_stiffness"),
        (([1.0, 2.0], 1e4), "broadcast"),
        ((100.0, 1e4, [0.0, 0.0, 1.0]), "Load"),
    ],
)
def test_what_is_no_number_is_refused(arguments, message):
    exo = ep.load("prototype")
    with pytest.raises(ep.InvalidInput, match=message):
        wrist.rotational_stiffness(exo.mechanism, exo.pose(30), *arguments)
