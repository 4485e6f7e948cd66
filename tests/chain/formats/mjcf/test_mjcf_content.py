"""What is read of MJCF, field by field."""

import pickle
from contextlib import nullcontext

import mujoco
import numpy as np
import pytest
from mjcf_arm import arm, flag, motor, read
from mjcf_mutations import PLANT

from exo_pin import ExoPinError, FileFormatError, UnknownName
from exo_pin.chain import ClosedChain, Closures


@pytest.mark.parametrize(
    ("parts", "flags", "read_as"),
    [
        ({"option": "gravity"}, "gravity", ("gravity", 0.0)),
        ({"option": "spring", "ja": 'stiffness="3"'}, "spring", ("springs", 0.0)),
        ({"option": "damper", "ja": 'damping="3"'}, "damper", ("damping", 0.0)),
        ({"option": "frictionloss", "ja": 'frictionloss="3"'}, "frictionloss", ("friction", 0.0)),
        ({"option": "limit", "ja": 'range="0 1"'}, "limit", ("upper", np.inf)),
    ],
)
def test_disabled_flags_take_their_forces_away(parts, flags, read_as):
    def seen(chain):
        model, springs = chain.model, [item.stiffness for item in chain.description.joints]
        return {
            "gravity": np.linalg.norm(model.gravity.linear),
            "springs": sum(springs),
            "damping": model.damping[0],
            "friction": model.upperDryFrictionLimit[0],
            "upper": model.upperPositionLimit[0],
        }

    what, value = read_as
    off = read(**(parts | {"option": flag(flags)}))
    on = read(**(parts | {"option": flag(flags, "enable")}))
    assert seen(off)[what] == value
    assert np.isfinite(seen(on)[what])
    assert seen(on)[what] > 0.0


def test_joint_properties():
    chain = read(
        option='<option gravity="1 2 3"/>',
        ja='range="-1 2" damping="0.5" frictionloss="0.3" armature="0.2" ref="0.7" springref="0.4" stiffness="6"',
        jc='stiffness="2" damping="0.1"',
        more='<keyframe><key name="up" qpos="0.1 0.2 0 0 1 0"/><key qpos="0 0 1 0 0 0"/></keyframe>',
    )
    model = chain.model
    np.testing.assert_array_equal(model.gravity.linear, [1, 2, 3])
    assert chain.description.root.gravity == (1, 2, 3)
    np.testing.assert_array_equal(model.lowerPositionLimit, [-1, *[-np.inf] * 5])
    np.testing.assert_array_equal(model.upperPositionLimit, [2, *[np.inf] * 5])
    np.testing.assert_array_equal(model.damping, [0.5, 0, 0.1, 0.1, 0.1])
    np.testing.assert_array_equal(model.upperDryFrictionLimit, [0.3, 0, 0, 0, 0])
    np.testing.assert_array_equal(model.lowerDryFrictionLimit, [-0.3, 0, 0, 0, 0])
    np.testing.assert_array_equal(model.armature, [0.2, 0, 0, 0, 0])
    springs = [(item.joint, item.stiffness, item.spring_reference) for item in chain.description.joints]
    assert springs == [("ja", 6, (0.4,)), ("jc", 2, (0, 0, 0, 1))]
    known = {item.key(): item.data().tolist() for item in model.referenceConfigurations}
    assert known == {"qpos0": [0.7, 0, 0, 0, 0, 1], "up": [0.1, 0.2, 0, 1, 0, 0], "key_1": [0, 0, 0, 0, 0, 1]}


@pytest.mark.parametrize(
    ("ja", "actuators", "limits"),
    [
        ("", "", (-np.inf, np.inf)),
        ('actuatorfrcrange="-3 4"', "", (-3, 4)),
        ("", '<motor joint="ja"/>', (-np.inf, np.inf)),
        ("", '<motor joint="ja" gear="10" ctrlrange="-1 2"/>', (-10, 20)),
        ("", '<motor joint="ja" gear="-10" ctrlrange="-1 2"/>', (-20, 10)),
        ("", '<motor joint="ja" gear="10" ctrlrange="-1 2" forcerange="-0.5 0.3"/>', (-5, 3)),
        ('actuatorfrcrange="-3 4"', '<motor joint="ja" gear="10" ctrlrange="-1 0.1"/>', (-3, 1)),
        ("", '<general joint="ja" gainprm="3" ctrlrange="-1 2"/>', (-3, 6)),
        # The control of an actuator with dynamics does not bound its force.
        ("", '<general joint="ja" dyntype="integrator" ctrlrange="-1 2"/>', (-np.inf, np.inf)),
        ("", '<general joint="ja" dyntype="integrator" ctrlrange="-1 2" forcerange="-7 8"/>', (-7, 8)),
        ("", '<motor joint="ja" ctrlrange="-1 2"/><motor joint="ja" gear="2" forcerange="-1 1"/>', (-3, 4)),
        ("", '<motor joint="ja" ctrlrange="-1 2"/><motor joint="ja"/>', (-np.inf, np.inf)),
    ],
)
def test_efforts_are_limited_as_mujoco_limits_them(ja, actuators, limits):
    text = arm(ja=ja, more=f"<actuator>{actuators}</actuator>")
    chain = ClosedChain.from_mjcf(text)
    assert (chain.model.lowerEffortLimit[0], chain.model.upperEffortLimit[0]) == limits
    np.testing.assert_array_equal(chain.model.upperEffortLimit[1:], np.inf)
    assert chain.roles.actuated == (("ja",) if actuators else ())
    # Whatever the controls, MuJoCo's forces stay within, and they come near to the limits.
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    forces = []
    for control in (-1e6, 0.0, 1e6):
        data.ctrl[:] = control * np.sign(model.actuator_gear[:, 0])
        data.act[:] = control
        mujoco.mj_forward(model, data)
        forces.append(data.qfrc_actuator[0])
    for limit, force in zip(limits, (min(forces), max(forces)), strict=True):
        if actuators:
            assert force == limit if np.isfinite(limit) else abs(force) > 1e5


def test_effort_limits_of_the_model_bound_inverse_dynamics_on_both_sides():
    text = arm(option=flag("gravity"), more=motor('forcerange="-1 5"'))
    chain = ClosedChain.from_mjcf(text)
    q = chain.neutral()
    a = np.zeros(5)
    inertia = 1.0 / chain.forward_dynamics(q, tau=[1.0, 0, 0, 0, 0]).a[0]
    for effort, expected in ((4.0, nullcontext()), (-0.5, nullcontext()), (-2.0, pytest.raises(ExoPinError))):
        a[0] = effort / inertia
        a[1] = chain.forward_dynamics(q, tau=[effort, 0, 0, 0, 0]).a[1]
        with expected:
            tau = chain.inverse_dynamics(q, None, a, effort_bounds="model").tau
            assert tau[0] == pytest.approx(effort)


def test_objects_without_names_are_called_after_their_numbers():
    text = (
        PLANT.replace('<joint name="twist"', "<joint")
        .replace('<body name="tool"', "<body")
        .replace('name="glue" ', "")
        .replace(' name="top"', "")
    )
    chain = ClosedChain.from_mjcf(text)
    assert "joint_2" in chain.model.names
    frames = {frame.name for frame in chain.model.frames}
    assert "body_4" in frames
    assert "top" not in frames
    assert [closure.name for closure in chain.closures] == ["tie", "equality_1"]


def test_one_name_for_two_frames():
    # A body, its joint and a site in it with one name: the joint keeps it, and its frame is elsewhere.
    inner = '<body name="x" pos="0 0 1"><joint name="x" pos="0.1 0 0"/><geom size="0.1"/>SITE</body>'
    inner = inner.replace("SITE", '<site name="x" pos="0 0 3"/>')
    chain = read(inb=inner, more='<equality><connect name="x" body1="x" body2="c" anchor="0 0 0"/></equality>')
    q = chain.neutral()
    np.testing.assert_allclose(chain.placement(q, "x").translation, [0.6, 0, 1])
    np.testing.assert_allclose(chain.placement(q, "x_body").translation, [0.5, 0, 1])
    np.testing.assert_allclose(chain.placement(q, "x_site").translation, [0.5, 0, 4])
    assert [(item.name, item.frame_a) for item in chain.closures] == [("x_closure", "x_body")]
    # In one place they share the frame.
    shared = read(inb=inner.replace('pos="0.1 0 0"', "").replace('pos="0 0 3"', ""))
    assert not {"x_body", "x_site"} & {frame.name for frame in shared.model.frames}
    # A name that is given to a frame is not another body's.
    third = read(inb=inner, world='<body name="x_body" pos="0 0 7"><joint/><geom size="0.1"/></body>')
    np.testing.assert_allclose(third.placement(third.neutral(), "x_body").translation, [0, 0, 7])
    np.testing.assert_allclose(third.placement(third.neutral(), "x_body_").translation, [0.5, 0, 1])
    # The world's name is taken.
    universe = read(inb='<body name="universe"><joint name="universe"/><geom size="0.1"/></body>')
    assert "universe_joint" in universe.model.names
    assert "universe_body" in {frame.name for frame in universe.model.frames}


def test_several_bodies_on_the_world_and_several_joints_on_a_body():
    chain = ClosedChain.from_mjcf(PLANT)
    assert list(chain.model.names)[1:] == ["lift", "swing", "twist", "elbow", "ball", "turn", "fly"]
    assert [chain.model.parents[k] for k in range(1, 8)] == [0, 1, 2, 3, 1, 5, 0]
    assert [chain.model.inertias[k].mass > 0.0 for k in range(1, 8)] == [True, False, True, True, True, True, True]


def test_a_path_or_the_text_itself(tmp_path):
    path = tmp_path / "arm.xml"
    path.write_text(arm())
    models = [ClosedChain.from_mjcf(source).model for source in (path, str(path), arm(), "\n " + arm())]
    assert all(model == models[0] for model in models)
    again = pickle.loads(pickle.dumps(ClosedChain.from_mjcf(path)))
    assert again.model == models[0]


def test_mujocos_warnings_become_pythons_and_no_log_is_written(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    before = mujoco.get_mju_user_warning()
    with pytest.warns(RuntimeWarning, match="NaN"):
        chain = read(ina='<site name="mark" rgba="nan 0 0 1"/>')
    assert np.isfinite(chain.placement(chain.neutral(), "mark").translation).all()
    assert mujoco.get_mju_user_warning() is before
    assert list(tmp_path.iterdir()) == []


def test_physics_that_is_not_known_is_noticed(monkeypatch):
    # As if this package did not know dampers.
    monkeypatch.setattr("exo_pin.chain.structure.passive.PassiveForces.force", lambda *_: np.zeros(5))
    assert read().model.nv == 5
    with pytest.raises(FileFormatError, match="MuJoCo computes other passive forces"):
        read(ja='damping="1"')


def test_closing_starts_where_the_file_draws_the_bodies(tmp_path):
    text = """<mujoco model="hung"><compiler angle="radian"/><worldbody>
    <body name="arm" pos="0 0 1"><joint name="hip" axis="0 1 0" ref="0.4"/><geom size="0.1"/></body>
    <body name="load" pos="0.3 0 1" euler="0 0 0.5"><freejoint name="fly"/><geom size="0.1"/></body></worldbody>
    <equality><connect name="pin" body1="arm" body2="load" anchor="0.3 0 0"/></equality>
    <keyframe><key name="home" qpos="0.5 0.3 0 1 1 0 0 0"/></keyframe></mujoco>"""
    chain = ClosedChain.from_mjcf(text)
    q = chain.reference_configuration()
    model = mujoco.MjModel.from_xml_string(text)
    np.testing.assert_allclose(q, model.qpos0[[0, 1, 2, 3, 5, 6, 7, 4]], atol=1e-15)
    # A connect holds at qpos0 by definition; with all joints at zero the load is at the world's origin.
    assert np.abs(chain.residual(q)).max() < 1e-15
    assert np.abs(chain.residual(chain.neutral())).max() > 0.3
    np.testing.assert_array_equal(chain.close(q), q)
    np.testing.assert_allclose(chain.reference_configuration("home"), [0.5, 0.3, 0, 1, 0, 0, 0, 1])
    with pytest.raises(UnknownName, match="unknown reference configuration 'away'; there are: home, qpos0"):
        chain.reference_configuration("away")
    # A keyframe "closed" is where the file is drawn, unless another configuration is given.
    again = ClosedChain.from_mjcf(chain.to_mjcf(tmp_path))
    np.testing.assert_allclose(
        again.placement(again.reference_configuration("closed"), "load").translation, [0.3, 0, 1]
    )
    plain = ClosedChain.from_urdf("<robot name='r'><link name='a'/></robot>", Closures("r"))
    np.testing.assert_array_equal(plain.reference_configuration(), plain.neutral())
