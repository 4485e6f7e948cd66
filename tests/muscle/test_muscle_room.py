"""The example in the room's description."""

import doctest

import exo_pin.muscle as room


def test_the_example_runs():
    result = doctest.testmod(room)
    assert result.attempted >= 5
    assert result.failed == 0
