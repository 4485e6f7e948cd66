"""What of a URDF is left out and said, and what is left out by name alone."""

import numpy as np
import pinocchio as pin
import pytest
from urdf_knee import BARE, GOOD

from exo_pin import FileFormatError, InvalidInput
from exo_pin.chain import ClosedChain


def test_an_axis_with_angles_is_refused():
    with pytest.raises(FileFormatError, match="an axis is a direction"):
        ClosedChain.from_urdf(GOOD.replace('<axis xyz="0 0 1"/>', '<axis xyz="0 0 1" rpy="0 1 0"/>'), BARE)


#: What is read as it stands where the caller says so.
NAMED = [
    ("inertia_rules", 'ixx="1"', 'ixx="2.2"', "larger than the sum"),
    ("inertia_rules", 'ixx="1"', 'ixx="-0.1"', "negative principal moment"),
    ("inertia_rules", 'mass value="2"', 'mass value="0"', "inertia but no mass"),
    ("empty_limits", 'lower="-1"', 'lower="1.5"', "lower <= upper"),
]


@pytest.mark.parametrize(("name", "old", "new", "said"), NAMED)
def test_what_is_wrong_is_read_by_name_alone(name, old, new, said):
    text = GOOD.replace(old, new)
    with pytest.raises(FileFormatError, match=said) as caught:
        ClosedChain.from_urdf(text, BARE)
    assert f'leave_out=["{name}"]' in str(caught.value)
    chain = ClosedChain.from_urdf(text, BARE, leave_out=[name])
    assert any(entry.startswith(f"{name}: ") and said in entry for entry in chain.description.left_out)
    plain = pin.buildModelFromXML(text)
    q, v = np.array([0.3]), np.array([0.7])
    for model in (chain.model, plain):
        data = model.createData()
        assert pin.crba(model, data, q)[0, 0] == pin.crba(plain, plain.createData(), q)[0, 0]
        assert pin.nonLinearEffects(model, data, q, v) == pin.nonLinearEffects(plain, plain.createData(), q, v)
    if name == "empty_limits":
        assert np.isinf([chain.model.lowerPositionLimit[0], chain.model.upperPositionLimit[0]]).all()


def test_inertias_that_miss_the_rules_by_their_digits_are_said():
    old = 'ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"'
    text = GOOD.replace(old, 'ixx="0.0333" ixy="0" ixz="0" iyy="0.0833" iyz="0" izz="0.1167"')
    (said,) = ClosedChain.from_urdf(text, BARE).description.left_out
    assert said == (
        "rounding: link 'b': inertial: principal moments of 0.0333, 0.0833, 0.1167 kg m², as rounded digits make them "
        "of 0.0333333, 0.0833333, 0.116667; read as they stand (no effect: read as written)"
    )


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize(
    ("given", "mended"),
    [
        # By a third of the miss each. Those of a plate, 1/30, 1/12 and 7/60, are rounded here.
        ((1.0, 1.0, 2.003), (1.001, 1.001, 2.002)), ((1.0, 1.0, 2.0 + 3e-9), (1.0 + 1e-9, 1.0 + 1e-9, 2.0 + 2e-9)),
        ((0.0333, 0.0833, 0.1167), (1 / 30, 1 / 12, 7 / 60)),
        ((1.0, 1.0, 2.0), None), ((0.3, 1.0, 1.0), None),
        # A tenth of the largest is the most.
        ((1.0, 1.0, 2.7), (1.0 + 0.7 / 3, 1.0 + 0.7 / 3, 2.7 - 0.7 / 3)), ((1.0, 1.0, 2.8), "refused"),
    ],
)  # fmt: skip
def test_mujoco_reads_them_mended_and_the_file_says_how(given, mended, size, tmp_path):
    text = GOOD
    for key, moment in zip(("ixx", "iyy", "izz"), given, strict=True):
        text = text.replace(f'{key}="1"', f'{key}="{moment * size!r}"')
    chain = ClosedChain.from_urdf(text, BARE, leave_out=["inertia_rules"])
    if mended == "refused":
        with pytest.raises(InvalidInput, match="mend its inertia"):
            chain.to_mjcf(tmp_path)
        return
    if mended is None:
        path = chain.to_mjcf(tmp_path)
    else:
        with pytest.warns(RuntimeWarning, match=r"body b: Principal moments of inertia mended: .* before, ") as told:
            path = chain.to_mjcf(tmp_path)
        # At the line that asked for the file.
        assert told[0].filename == __file__
    said = path.read_text(encoding="utf-8")
    assert ("kg m² after" in said) == (mended is not None)
    moments = np.linalg.eigvalsh(ClosedChain.from_mjcf(path).model.inertias[1].inertia)
    np.testing.assert_allclose(moments, np.sort(given if mended is None else mended) * size, rtol=0, atol=1e-8 * size)


def test_a_negative_moment_is_refused_of_mujoco(tmp_path):
    chain = ClosedChain.from_urdf(GOOD.replace('ixx="1"', 'ixx="-0.1"'), BARE, leave_out=["inertia_rules"])
    with pytest.raises(InvalidInput, match=r"b has -0\.1 kg m²: mend its inertia"):
        chain.to_mjcf(tmp_path)


FINGERS = """<robot name="hand"><link name="palm"/><link name="a"/><link name="b"/>
<joint name="one" type="fixed"><parent link="palm"/><child link="a"/>{}</joint>
<joint name="two" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/>{}</joint></robot>"""


def test_the_mimic_of_a_fixed_joint_has_no_effect():
    chain = ClosedChain.from_urdf(FINGERS.format('<mimic joint="two"/>', ""), BARE)
    assert chain.closures == ()
    assert chain.description.left_out == ("mimic: joint 'one' is fixed (no effect: a fixed joint does not move)",)


def test_a_joint_that_mimics_a_fixed_one_is_held_at_its_offset():
    chain = ClosedChain.from_urdf(FINGERS.format("", '<mimic joint="one" multiplier="2" offset="0.4"/>'), BARE)
    q = chain.close(chain.neutral())
    assert q == pytest.approx([0.4], abs=1e-12)
    assert chain.mobility(q).degrees_of_freedom == 0
