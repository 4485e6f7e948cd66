"""What the digits of a file say: half units, decimals, rounding of a geometry, and inertias that rounding explains."""

import pytest

from exo_pin.chain.formats.digits import Redrawn, decimals, rounding_of
from exo_pin.chain.formats.xml_elements import half_unit, parse_xml


@pytest.mark.parametrize(
    ("word", "half"),
    [
        ("1", 0.0), ("10", 0.0), ("0.000", 0.0), ("0", 0.0), ("1.0", 0.05), ("1.25", 0.005), (" 1.25\n", 0.005),
        ("2e3", 500.0), ("2.5e3", 50.0), ("2.50e-3", 5e-6), ("-0.001", 5e-4), ("1E1", 5.0), ("1.e2", 50.0),
    ],
)  # fmt: skip
def test_half_a_unit_of_the_last_digit(word, half):
    assert half_unit(word) == pytest.approx(half, rel=1e-12)


@pytest.mark.parametrize(
    ("word", "count"),
    [
        ("1", 0),
        ("1.5", 1),
        ("1.500", 1),
        ("1.0", 0),
        ("1.5e2", 0),
        ("1.5e-2", 3),
        ("1e-3", 3),
        ("15E-1", 1),
        ("0.0001", 4),
    ],
)
def test_decimals_are_counted_without_zeros_at_the_end(word, count):
    assert decimals(word) == count


@pytest.mark.parametrize(
    ("words", "rounding"),
    [
        (["0.1234"], 5e-5), (["0.123"], 0.0), (["0.1234", "0.12345"], 5e-6), (["0.1234", "1", "2.5"], 5e-5),
        (["0.123456789012"], 5e-13), (["0.1234567890123"], 0.0), (["0.1234", "0.12345678901234"], 0.0), ([], 0.0),
        (["name", "nan", "0.1234"], 5e-5),
        # A right angle tells by its own digits how far all were rounded, an exact one nothing.
        (["1.5708"], 5e-5), (["1.570796", "0.123456789"], 5e-7), (["1.5707963267948966", "0.1234"], 5e-5),
        (["-3.14159", "0.123456789"], 5e-6), (["3.142", "0.123456789"], 5e-10), (["1.571", "0.12345"], 5e-6),
        (["1.5709", "0.123456789"], 5e-10), (["inf", "0.1234"], 5e-5),
        # A robot a thousandth as large is as exact: 0.3 m and 0.3 mm, and what has four digits of either.
        (["0.0003", "-0.0008"], 0.0), (["3e-05", "1.25e-4"], 0.0), (["1234", "0.0003"], 0.0),
        (["0.0003", "0.0001234"], 5e-8), (["1.2340e-4", "0.3"], 5e-8), (["-0.0012340", "0.0000003"], 5e-8),
    ],
)  # fmt: skip
def test_the_rounding_of_a_geometry_is_half_a_unit_of_its_last_decimal(words, rounding):
    assert rounding_of(words) == pytest.approx(rounding, rel=1e-12)


def test_what_is_redrawn_of_an_element_is_its_geometry():
    text = (
        '<a xyz="0.1234 1 -0.1234" mass="0.1234"><pose>0.1234 0 0</pose><mass>0.1234</mass><inertial xyz="0.1234"/></a>'
    )
    root = parse_xml(text)
    moved = Redrawn(5).element(root)
    first = float(moved.attributes["xyz"].split()[0])
    assert 0.0 < abs(first - 0.1234) <= 5e-5
    assert moved.attributes == {"xyz": f"{first!r} 1 {-first!r}", "mass": "0.1234"}
    assert [child.text for child in moved.children] == [f"{first!r} 0 0", "0.1234", ""]
    assert moved.children[2].attributes == {"xyz": "0.1234"}
    assert root.says_as(parse_xml(text))
