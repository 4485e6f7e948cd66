"""What of MJCF is refused or left out."""

import mujoco
import numpy as np
import pytest
from joint_arrays import ARRAYS
from mjcf_arm import arm, read
from said_of_files import ROWS, SAID

from exo_pin import FileFormatError, InvalidInput, UnknownName
from exo_pin.chain import ClosedChain

#: Springs that yield came with MuJoCo 4.
NAMED = [
    row for row in ROWS["mjcf_named"] if "springyield" not in str(row) or hasattr(mujoco.MjModel, "jnt_springyield")
]
NAMES = sorted({name for name, *_ in ROWS["mjcf_named"]})


def _accelerations(chain):
    rng = np.random.default_rng(0)
    q = chain.neutral() if chain.model.nq > 7 else chain.close(chain.neutral())
    return chain.forward_dynamics(q, rng.normal(size=chain.model.nv), rng.normal(size=chain.model.nv)).a


@pytest.mark.parametrize(("name", "parts", "said", "without"), NAMED, ids=range(len(NAMED)))
def test_what_changes_the_motion_is_left_out_by_name_alone(name, parts, said, without):
    with pytest.raises(FileFormatError, match=said) as caught:
        read(**parts)
    assert f'leave_out=["{name}"]' in str(caught.value)
    others = [other for other in NAMES if other != name]
    with pytest.raises(FileFormatError, match=said):
        ClosedChain.from_mjcf(arm(**parts), others)
    chain, plain = ClosedChain.from_mjcf(arm(**parts), [name]), read(**without)
    report = [text for text in chain.description.left_out if text.startswith(f"{name}: ")]
    assert len(report) == 1
    assert not any(text.startswith(f"{name}: ") for text in plain.description.left_out)
    np.testing.assert_allclose(_accelerations(chain), _accelerations(plain), rtol=1e-12, atol=1e-12)
    assert chain.closures == plain.closures
    for array in ARRAYS:
        np.testing.assert_array_equal(getattr(chain.model, array), getattr(plain.model, array), array)


def test_other_names_to_leave_out_are_refused():
    with pytest.raises(UnknownName, match=r"unknown thing to leave out 'tendon' \(did you mean 'tendons'"):
        ClosedChain.from_mjcf(arm(), ["tendon"])
    with pytest.raises(InvalidInput, match="leave_out"):
        ClosedChain.from_mjcf(arm(), "tendons")


SERVOS = [
    '<position name="p" joint="ja" kp="2" ctrlrange="1 2"/>',
    '<velocity name="p" joint="ja" kv="2"/>',
    '<general name="p" joint="ja" gaintype="affine" biastype="affine" biasprm="1 2 3"/>',
    '<muscle name="p" joint="ja" ctrllimited="false" lengthrange="0 1"/>',
]


@pytest.mark.parametrize("servo", SERVOS)
def test_a_joint_with_a_servo_is_actuated_and_its_law_left_out(servo):
    chain = read(more=f"<actuator>{servo}</actuator>")
    assert chain.roles.actuated == ("ja",)
    assert any("control_laws: actuator 'p'" in text for text in chain.description.left_out)
    assert np.isinf(chain.model.upperEffortLimit[0])
    np.testing.assert_array_equal(_accelerations(chain), _accelerations(read()))


def test_a_limit_with_a_margin_is_where_mujoco_holds_the_joint():
    """A pendulum falls against its limit and comes to rest there; MuJoCo's limit gives way by its softness alone."""
    text = """<mujoco><compiler angle="radian"/><option gravity="0 0 -9.81" timestep="0.001"/><worldbody><body>
    <joint name="j" axis="0 1 0" range="0.2 2" margin="0.3" damping="2" limited="true" ref="1"/>
    <geom size="0.05" pos="-0.4 0 0.4"/></body></worldbody></mujoco>"""
    model = mujoco.MjModel.from_xml_string(text)
    model.jnt_solimp[0] = [0.999, 0.9999, 0.001, 0.5, 2.0]
    data = mujoco.MjData(model)
    for _ in range(10000):
        mujoco.mj_step(model, data)
    low, high = (
        ClosedChain.from_mjcf(text).model.lowerPositionLimit[0],
        ClosedChain.from_mjcf(text).model.upperPositionLimit[0],
    )
    assert (low, high) == pytest.approx((0.5, 1.7))
    assert data.qpos[0] == pytest.approx(low, abs=2e-3) or data.qpos[0] == pytest.approx(high, abs=2e-3)
    assert abs(data.qvel[0]) < 1e-6


@pytest.mark.parametrize(("count", "said"), [(6, "outside, stands still ("), (7, "; and 2 more (")])
def test_many_things_are_said_in_a_few_words(count, said):
    bodies = "".join(f'<body name="m{k}" mocap="true"/>' for k in range(count))
    (text,) = [x for x in read(world=bodies).description.left_out if x.startswith("mocap")]
    assert f"{said}may change forces" in text


@pytest.mark.parametrize(("text", "said"), SAID["not_mjcf"])
def test_text_that_is_not_mjcf_is_refused(text, said, tmp_path):
    path = tmp_path / "some.xml"
    if text is not None:
        path.write_text(text)
    with pytest.raises(FileFormatError, match=said):
        ClosedChain.from_mjcf(path)
    with pytest.raises(FileFormatError, match="no such file"):
        ClosedChain.from_mjcf(tmp_path)
    with pytest.raises(FileFormatError, match="no such file"):
        ClosedChain.from_mjcf("x" * 5000)
    with pytest.raises(InvalidInput, match="got 5"):
        ClosedChain.from_mjcf(5)
