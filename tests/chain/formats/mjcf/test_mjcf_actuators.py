"""Actuators, rotors, keyframes and energies of MJCF files."""

import mujoco
import numpy as np
import pytest
from mjcf_arm import arm, fixed_tendon, flag, motor, read

from exo_pin import FileFormatError
from exo_pin.chain import ClosedChain

INF = np.inf
BODY = """<mujoco><worldbody><body name="b"><joint name="j" axis="{axis}"/><geom size=".1" mass="1" pos=".1 .1 0"/>
</body></worldbody>{more}</mujoco>"""


def robot(more, axis="0 0 1"):
    return ClosedChain.from_mjcf(BODY.format(axis=axis, more=more))


def actuator(attributes, kind="general"):
    return f'<actuator><{kind} joint="j" {attributes}/></actuator>'


def test_an_activation_range_limits_the_effort():
    chain = robot(actuator('dyntype="filter" dynprm="1" gainprm="3" actlimited="true" actrange="-2 2"'))
    np.testing.assert_array_equal([chain.model.lowerEffortLimit[0], chain.model.upperEffortLimit[0]], [-6.0, 6.0])


def test_an_activation_range_without_zero_is_refused():
    with pytest.raises(FileFormatError, match="without control: its actrange is 1 to 2"):
        robot(actuator('dyntype="integrator" actlimited="true" actrange="1 2"'))


def test_negative_damping_is_refused():
    text = BODY.format(axis="0 0 1", more="").replace('axis="0 0 1"', 'axis="0 0 1" damping="-1"')
    with pytest.raises(FileFormatError, match="damping of zero or more"):
        ClosedChain.from_mjcf(text)


def test_rotors_of_several_motors_add_up():
    more = '<actuator><motor joint="j" armature=".25" gear="2"/><motor joint="j" armature=".5"/></actuator>'
    chain = robot(more)
    model = mujoco.MjModel.from_xml_string(BODY.format(axis="0 0 1", more=more))
    data, M = mujoco.MjData(model), np.zeros((1, 1))
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, M)
    np.testing.assert_allclose(chain.forward_dynamics([0.0], tau=[1.0]).a, 1.0 / M[0], rtol=1e-12)


def test_keyframes_have_their_own_configurations():
    more = '<keyframe><key qpos=".1"/><key name="key_0" qpos=".7"/><key name="qpos0" qpos=".3"/></keyframe>'
    known = {item.key(): float(item.data()[0]) for item in robot(more).model.referenceConfigurations}
    assert known["qpos0"] == 0.0
    assert known["key_0"] == 0.7
    assert sorted(known.values()) == [0.0, 0.1, 0.3, 0.7]


@pytest.mark.parametrize("axis", ["0 0 1", "0 0 -1", "0 -1 0", "1 2 2"])
def test_rotors_count_in_the_energy_whatever_the_axis(axis):
    # Pinocchio's kinetic energy leaves rotors out for joints about an axis that is none of x, y, z.
    chain = robot(actuator('armature=".5"', "motor"), axis)
    found = chain.simulate([0.3], [2.0], np.linspace(0.0, 0.5, 6))
    inertia = 1.0 / (chain.forward_dynamics([0.3], tau=[1.0]).a - chain.forward_dynamics([0.3]).a)[0]
    np.testing.assert_allclose(found.kinetic_energy[0], 0.5 * inertia * 2.0**2, rtol=1e-9)
    assert inertia > 0.5
    assert found.energy_drift < 1e-8


def test_text_with_a_byte_order_mark():
    assert ClosedChain.from_mjcf("\ufeff" + BODY.format(axis="0 0 1", more="")).model.nv == 1


@pytest.mark.parametrize("limits", ["0 1", "-1 0", "-1 1"])
@pytest.mark.parametrize("field", ["ctrlrange", "forcerange", "actuatorfrcrange"])
def test_ranges_with_zero_at_their_end_need_no_word(field, limits):
    parts = {"ja": f'{field}="{limits}"'} if field[0] == "a" else {"more": motor(f'{field}="{limits}"')}
    model = read(**parts).model
    assert (model.lowerEffortLimit[0], model.upperEffortLimit[0]) == tuple(map(float, limits.split()))


@pytest.mark.parametrize(
    ("more", "option", "said"),
    [
        # Rotors of an actuator that pushes nothing turn with its joint all the same.
        (motor('armature="1" gear="2" group="0"'), '<option actuatorgroupdisable="0"/>', None),
        (motor('damping="1"', "jc"), "", "has a rotor or damping"),
        (fixed_tendon() + '<actuator><motor tendon="t" armature="1"/></actuator>', "", "has a rotor or damping"),
        (motor('group="0"'), '<option actuatorgroupdisable="0"/>', None),
        (motor('group="31"'), '<option actuatorgroupdisable="0"/>', None),
    ],
)  # fmt: skip
def test_rotors_of_actuators_that_drive_nothing(more, option, said):
    if said is None:
        chain, plain = read(more=more, option=option), read()
        rotor = 4.0 if "armature" in more else 0.0
        assert chain.model.armature[0] == rotor
        assert chain.roles.actuated == (("ja",) if "31" in more else ())
        assert plain.model.armature[0] == 0.0
        return
    with pytest.raises(FileFormatError, match=said):
        read(more=more, option=option)


@pytest.mark.parametrize(
    ("law", "limits"),
    [
        # Numbers of a law that is none, and a law whose numbers are none, add no force.
        ('biastype="none" biasprm="1 2 3"', (-1.0, 2.0)), ('biastype="affine"', (-1.0, 2.0)),
        ('biastype="affine" biasprm="0 0 0"', (-1.0, 2.0)), ('biastype="affine" biasprm="1 0 0"', (-INF, INF)),
        ('biastype="affine" biasprm="0 0 -1"', (-INF, INF)), ('gaintype="affine" gainprm="1 0 0"', (-INF, INF)),
    ],
)  # fmt: skip
def test_an_actuator_is_a_servo_if_it_exerts_more_than_control_times_gain(law, limits):
    text = arm(more=f'<actuator><general name="m" joint="ja" ctrlrange="-1 2" {law}/></actuator>')
    chain = ClosedChain.from_mjcf(text)
    assert (chain.model.lowerEffortLimit[0], chain.model.upperEffortLimit[0]) == limits
    assert any("control_laws" in entry for entry in chain.description.left_out) == (
        np.isinf(limits[0]) and "bias" in law
    )
    if "gaintype" not in law:
        # In MuJoCo: the force without control, at a joint that stands off zero and moves.
        model = mujoco.MjModel.from_xml_string(text)
        data = mujoco.MjData(model)
        data.qpos[0], data.qvel[0] = 0.3, 0.4
        mujoco.mj_forward(model, data)
        assert (data.qfrc_actuator[0] != 0.0) == np.isinf(limits[0])


def test_rotors_and_their_friction_act_through_the_gear():
    chain = read(ja='armature="0.1" damping="0.2"', more=motor('gear="-3" armature="0.5" damping="0.25"'))
    # The velocity of a rotor is the gear times that of the joint, and its torque comes back times the gear.
    assert chain.model.armature[0] == pytest.approx(0.1 + 9.0 * 0.5)
    assert chain.model.damping[0] == pytest.approx(0.2 + 9.0 * 0.25)
    assert not chain.model.armature[1:].any()
    assert not chain.model.damping[1:].any()


@pytest.mark.parametrize(("name", "friction", "upper"), [
    ("frictionloss", 0.0, 1.0), ("limit", 3.0, INF), ("constraint", 0.0, INF), ("contact", 3.0, 1.0),
])  # fmt: skip
def test_flags_that_take_stops_and_friction_away(name, friction, upper):
    for state in ("disable", "enable"):
        model = read(option=flag(name, state), ja='frictionloss="3" range="0 1"').model
        off = state == "disable"
        assert model.upperDryFrictionLimit[0] == -model.lowerDryFrictionLimit[0] == (friction if off else 3.0)
        assert model.upperPositionLimit[0] == (upper if off else 1.0)
        assert model.lowerPositionLimit[0] == (-upper if off and np.isinf(upper) else 0.0)
