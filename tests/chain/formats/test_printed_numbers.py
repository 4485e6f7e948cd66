"""What the digits of a file say: half units, decimals, rounding of a geometry, and inertias that rounding explains."""

import numpy as np
import pytest

from exo_pin import FileFormatError
from exo_pin.chain.formats.digits import Redrawn, decimals, rounding_of
from exo_pin.chain.formats.leaving_out import LeftOut
from exo_pin.chain.formats.urdf.urdf_shapes import urdf_shapes
from exo_pin.chain.formats.urdf.urdf_values import check_origin, inertia_of
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
        (["name", "0.1234"], 5e-5),
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


def test_numbers_are_redrawn_within_half_a_unit_and_equal_ones_alike():
    for word, half in (("0.1234", 5e-5), ("-2.12345", 5e-6), ("1.5e-4", 5e-6)):
        moved = np.array([float(Redrawn(seed).number(word)) - float(word) for seed in range(200)])
        assert 0.95 * half < np.abs(moved).max() <= half
        # To both sides alike: the mean is zero within its own spread.
        assert abs(moved.mean()) < 4.0 * half / np.sqrt(3.0 * len(moved))
    for word in ("0.123", "1", "0.1234567890123", "word"):
        assert Redrawn(0).number(word) == word
    # Three decimals move by half a unit of the fourth, where the file has no more.
    short = np.array([float(Redrawn(seed, 5e-5).number("0.123")) - 0.123 for seed in range(200)])
    assert 0.95 * 5e-5 < np.abs(short).max() <= 5e-5
    assert Redrawn(0, 4.9e-5).number("0.123") == "0.123"
    assert Redrawn(0, 5e-5).number("0.12") == "0.12"
    one = Redrawn(3)
    first = float(one.number("0.1234"))
    assert float(one.number("0.1234")) == first
    assert float(one.number("-0.1234")) == -first
    assert float(one.number("0.12340")) == first
    assert abs(float(one.number("0.1235")) - first - 1e-4) > 1e-9


def test_four_numbers_at_the_end_stay_a_quaternion():
    for text in ("0.1234 0.2345 0.3456 0.8999", "1.5 2 3 0.1234 0.2345 0.3456 0.8999"):
        moved = np.array(Redrawn(1).text(text).split(), dtype=float)
        assert np.linalg.norm(moved[-4:]) == pytest.approx(1.0, abs=1e-15)
        assert moved[:-4].tolist() == [float(word) for word in text.split()[:-4]]
    assert Redrawn(1).text("1 0 0 2") == "1 0 0 2"
    three = Redrawn(1)
    assert three.text("0.1234 0.2345 1") == " ".join([three.number("0.1234"), three.number("0.2345"), "1"])


def inertial(mass, *moments):
    ixx, iyy, izz, *products = moments
    ixy, ixz, iyz = products or ("0", "0", "0")
    text = f'<inertial><mass value="{mass}"/><inertia ixx="{ixx}" ixy="{ixy}" ixz="{ixz}" iyy="{iyy}" '
    return parse_xml(f'{text}iyz="{iyz}" izz="{izz}"/></inertial>')


@pytest.mark.parametrize(
    ("moments", "said"),
    [
        (("1", "1", "2"), None), (("1", "1", "2.000001"), None), (("1", "2", "0.9"), None),
        # 0.05 on each of two sides and on the third: three half units at most.
        (("1.0", "1.0", "2.1"), "rounded"), (("1.0", "1.0", "2.2"), "larger"), (("0.5", "0.6", "1.1"), None),
        (("1", "1", "2.2"), "larger"), (("-0.01", "1", "1"), "negative"), (("1", "-0.1", "1"), "negative"),
        (("1", "1", "1", "1.5", "0", "0"), "negative"), (("1", "1", "1", "0.5", "0", "0"), None),
        (("0.0", "0.0", "0.0"), None), (("1e-13", "1e-13", "9e-13"), None), (("1e-9", "1e-9", "9e-9"), "larger"),
    ],
)  # fmt: skip
def test_inertias_are_those_of_a_body_or_explained_by_their_digits(moments, said):
    found = inertial("1", *moments)
    if said in ("larger", "negative"):
        with pytest.raises(FileFormatError, match=said):
            inertia_of(found)
        return
    left = LeftOut()
    mass, matrix = inertia_of(found, left)
    assert mass == 1.0
    np.testing.assert_array_equal(np.diag(matrix), [float(text) for text in moments[:3]])
    np.testing.assert_array_equal(matrix, matrix.T)


def test_a_mass_of_zero_has_no_inertia():
    mass, matrix = inertia_of(inertial("0", "0", "0", "0"))
    assert mass == 0.0
    assert not matrix.any()
    with pytest.raises(FileFormatError, match="inertia but no mass"):
        inertia_of(inertial("0", "0", "0", "1e-9"))
    with pytest.raises(FileFormatError, match="zero or more"):
        inertia_of(inertial("-1e-9", "0", "0", "0"))
    assert inertia_of(inertial("2", "0", "0", "0"))[0] == 2.0
    # A thin rod, whatever its size.
    for size in ("1", "1000", "1e-6"):
        assert inertia_of(inertial("1", "0", size, size))[1][0, 0] == 0.0


@pytest.mark.parametrize(
    ("version", "inside", "said"),
    [
        ((1, 0), '<sphere radius="0.1"/>', None), ((1, 1), '<capsule radius="0.1" length="1"/>', None),
        ((1, 2), '<capsule radius="0.1" length="1"/>', None),
        ((1, 0), '<sphere radius="0"/>', None), ((1, 0), '<sphere radius="-1e-9"/>', "zero or more"),
        ((1, 0), '<box size="1 1 -1"/>', "zero or more"), ((1, 0), '<box size="1 1"/>', "3 numbers"),
        ((1, 0), "", "one shape, got 0"), ((1, 0), '<sphere radius="1"/><sphere radius="1"/>', "one shape, got 2"),
        ((1, 0), '<mesh filename="a.stl" scale="1 1 1"/>', None),
        ((1, 0), '<mesh filename="a.stl" scale="1 1"/>', "3 numbers"),
    ],
)  # fmt: skip
def test_pictures_are_one_shape_of_their_version(version, inside, said):
    visual = f"<visual><geometry>{inside}</geometry></visual>"
    left = LeftOut()
    shapes = list(urdf_shapes(parse_xml(f'<robot><link name="a">{visual}</link></robot>'), None, version, left))
    assert len(shapes) == (said is None)
    assert (said or "") in "".join(left.report)


@pytest.mark.parametrize(
    ("version", "origin", "said"),
    [
        ((1, 1), 'quat_xyzw="0 0 0 1"', None), ((1, 0), 'quat_xyzw="0 0 0 1"', 'version="1.1"'),
        ((1, 1), 'quat_xyzw="0 0 0 1.0000009"', None), ((1, 1), 'quat_xyzw="0 0 0 1.0000011"', "length 1.0000011"),
        ((1, 1), 'quat_xyzw="0 0 0 0.9999989"', "length 0.9999989"), ((1, 1), 'quat_xyzw="0 0 1"', "4 numbers"),
        ((1, 1), 'quat_xyzw="0 0 0 1" rpy="0 0 0"', "got both"), ((1, 0), 'xyz="1 2"', "3 numbers"),
        ((1, 0), 'rpy="1 2 3 4"', "3 numbers"), ((1, 0), 'xyz="1 2 3" rpy="0 0 1"', None),
    ],
)  # fmt: skip
def test_origins_are_three_numbers_each_or_a_quaternion(version, origin, said):
    element = parse_xml(f"<origin {origin}/>")
    if said is None:
        check_origin(element, version)
        return
    with pytest.raises(FileFormatError, match=said):
        check_origin(element, version)
