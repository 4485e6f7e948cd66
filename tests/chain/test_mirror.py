"""The mirror image of a chain: every kind of joint and closure, by Pinocchio, by MuJoCo, and by what stays the same."""

import mjcf_chains
import mujoco
import mujoco_exact
import numpy as np
import pinocchio as pin
import pytest
import several_coordinates

from exo_pin.chain import ClosedChain, Closures, JointProperties

S = np.diag([1.0, -1.0, 1.0])
LOOPS = ("rigid", "spherical", "revolute", "universal", "prismatic", "cylindrical", "distance")


def endless(axis):
    """A hinge that counts no turns; Pinocchio makes those about any axis of URDF alone."""
    inertial = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    joint = f'<joint name="j" type="continuous"><parent link="a"/><child link="b"/><axis xyz="{axis}"/></joint>'
    return pin.buildModelFromXML(f'<robot name="r"><link name="a"/><link name="b">{inertial}</link>{joint}</robot>')


KINDS = {
    **{f"JointModel{kind}{axis}": None for kind in ("R", "RUB", "P") for axis in "XYZ"},
    "slide": lambda: pin.JointModelPrismaticUnaligned(np.array([0.48, 0.6, 0.64])),
    "hinge": lambda: pin.JointModelRevoluteUnaligned(np.array([0.48, -0.6, 0.64])),
    "endless": lambda: endless("0.48 0.6 0.64").joints[1],
    "free": pin.JointModelFreeFlyer,
    "translation": pin.JointModelTranslation,
    **several_coordinates.KINDS,
}


def joint_of(kind):
    return (KINDS[kind] or getattr(pin, kind))()


def tree_of(kind, seed=0):
    """A branch of the kind, a hinge and the kind again, with frames, springs and limits of every coordinate."""
    rng, model = np.random.default_rng(seed), pin.Model()
    model.gravity.linear = np.array([1.0, -4.0, -8.0])
    carrier, joints = 0, []
    for k, joint in enumerate((joint_of(kind), pin.JointModelRY(), joint_of(kind))):
        place = pin.SE3(pin.exp3(rng.normal(size=3)), 0.2 * rng.normal(size=3))
        carrier = model.addJoint(carrier, joint, place, f"joint_{k}")
        model.appendBodyToJoint(carrier, several_coordinates._body(rng), pin.SE3.Identity())
        site = pin.SE3(pin.exp3(rng.normal(size=3)), 0.2 * rng.normal(size=3))
        model.addFrame(pin.Frame(f"site_{k}", carrier, 0, site, pin.FrameType.OP_FRAME))
        own = model.joints[carrier]
        if own.nq == own.nv or own.shortname() in ("JointModelSpherical", "JointModelFreeFlyer"):
            part = slice(own.idx_q, own.idx_q + own.nq)
            reference = pin.integrate(model, pin.neutral(model), rng.uniform(-0.5, 0.5, model.nv))[part]
            joints.append(JointProperties(f"joint_{k}", float(rng.uniform(1.0, 20.0)), tuple(reference.tolist())))
    for name, count in (("Position", model.nq), ("Effort", model.nv), ("Velocity", model.nv)):
        setattr(model, f"lower{name}Limit", -rng.uniform(1.0, 2.0, count))
        setattr(model, f"upper{name}Limit", rng.uniform(2.0, 3.0, count))
    model.lowerDryFrictionLimit, model.upperDryFrictionLimit = (s * rng.uniform(0, 0.2, model.nv) for s in (-1.0, 1.0))
    model.damping, model.armature = rng.uniform(0.1, 1.0, (2, model.nv))
    model.referenceConfigurations["raised"] = pin.integrate(model, pin.neutral(model), rng.normal(size=model.nv))
    return ClosedChain(model, Closures("tree", joints=tuple(joints)))


def near(one, two, scale=1.0):
    np.testing.assert_allclose(one, two, rtol=0.0, atol=1e-12 * max(scale, float(np.abs(two).max(initial=0.0))))


def assert_image(chain, q, v, a):
    """Places, mass matrix, equations of motion, springs and loops of the image in the image of a motion."""
    image, signs = chain.mirrored(), chain.mirror_signs()
    q_, v_, a_ = signs.configuration * q, signs.motion * v, signs.motion * a
    here, there = chain.placements(q), image.placements(q_)
    assert here.keys() == there.keys()
    for name, place in here.items():
        near(S @ place.translation, there[name].translation)
        near(S @ place.rotation @ S, there[name].rotation)
    states = (chain.model, chain.model.createData(), q), (image.model, image.model.createData(), q_)
    M, M_ = (np.triu(pin.crba(*state)) for state in states)
    near(signs.motion[:, None] * M * signs.motion, M_)
    motions = (v, a), (v_, a_)
    efforts, efforts_ = (np.array(pin.rnea(*state, *motion)) for state, motion in zip(states, motions, strict=True))
    near(signs.motion * efforts, efforts_)
    near(signs.rows * chain.residual(q), image.residual(q_))
    near(signs.rows[:, None] * chain.constraint_jacobian(q) * signs.motion, image.constraint_jacobian(q_))
    near(signs.rows * chain.constraint_drift(q, v), image.constraint_drift(q_, v_))
    return image, signs, (q_, v_, a_)


def same_model(one, two):
    """The same joints, places, masses, frames and numbers, to rounding."""
    assert list(one.names) == list(two.names)
    assert [joint.shortname() for joint in one.joints] == [joint.shortname() for joint in two.joints]
    for own, other in zip(list(one.jointPlacements), list(two.jointPlacements), strict=True):
        near(own.homogeneous, other.homogeneous)
    for own, other in zip(list(one.inertias)[1:], list(two.inertias)[1:], strict=True):
        near(own.matrix(), other.matrix())
    for own, other in zip(one.frames, two.frames, strict=True):
        assert (own.name, own.parentJoint, own.parentFrame, own.type) == (
            other.name, other.parentJoint, other.parentFrame, other.type)  # fmt: skip
        near(own.placement.homogeneous, other.placement.homogeneous)
    near(one.gravity.vector, two.gravity.vector)
    for name in ("damping", "armature", *(f"{side}{kind}Limit" for side in ("lower", "upper")
                                          for kind in ("Position", "Effort", "Velocity", "DryFriction"))):  # fmt: skip
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name))
    kept = [{item.key(): item.data().tolist() for item in model.referenceConfigurations} for model in (one, two)]
    assert kept[0] == kept[1]


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_joint(kind):
    chain, rng = tree_of(kind), np.random.default_rng(1)
    q = pin.integrate(chain.model, chain.neutral(), rng.uniform(-1.0, 1.0, chain.model.nv))
    v, a = rng.normal(size=(2, chain.model.nv))
    image, signs, (q_, v_, a_) = assert_image(chain, q, v, a)
    same_model(chain.model, image.mirrored().model)
    assert image.mirrored().description == chain.description
    # Springs, damping and friction: every joint driven, so that nothing but its own effort holds it.
    efforts = [
        c.inverse_dynamics(*m, actuated=c.model.names[1:]).tau for c, m in ((chain, (q, v, a)), (image, (q_, v_, a_)))
    ]
    near(signs.motion * efforts[0], efforts[1])
    raised = chain.reference_configuration("raised")
    np.testing.assert_array_equal(signs.configuration * raised, image.reference_configuration("raised"))
    # A coordinate within its limits, seen from its ends, is so in the image.
    for name, values, own in (
        ("Position", q, signs.configuration),
        ("Effort", v, signs.motion),
        ("Velocity", a, signs.motion),
    ):
        gaps, gaps_ = (
            np.sort([x - getattr(m, f"lower{name}Limit"), getattr(m, f"upper{name}Limit") - x], axis=0)
            for m, x in ((chain.model, values), (image.model, own * values))
        )
        near(gaps, gaps_)
    one = [joint.nv == 1 for joint in list(chain.model.joints)[1:]]
    for joint in (joint for joint, alone in zip(list(chain.model.names)[1:], one, strict=True) if alone):
        assert (signs.configuration[chain.configuration_slice(joint)] == 1.0).all()
        assert (signs.motion[chain.velocity_slice(joint)] == 1.0).all()


@pytest.mark.parametrize("closure", LOOPS)
@pytest.mark.parametrize("kind", several_coordinates.KINDS)
def test_loops_of_every_kind(kind, closure):
    chain, q = several_coordinates.chain(kind, closure, seed=3)
    v, a = several_coordinates.motion(chain, q)
    image, signs, (q_, v_, a_) = assert_image(chain, q, v, a)
    assert np.abs(image.residual(q_)).max() < 1e-9
    # Open by some millimetres and degrees, rows have their signs, too.
    opened = pin.integrate(chain.model, q, np.random.default_rng(5).uniform(-0.2, 0.2, chain.model.nv))
    near(signs.rows * chain.residual(opened), image.residual(signs.configuration * opened))
    mobility = [c.mobility(at) for c, at in ((chain, q), (image, q_))]
    near(*(m.singular_values for m in mobility))
    assert mobility[0].degrees_of_freedom == mobility[1].degrees_of_freedom
    motions = [c.forward_dynamics(at, w).a for c, at, w in ((chain, q, v), (image, q_, v_))]
    np.testing.assert_allclose(signs.motion * motions[0], motions[1], atol=1e-9 * np.abs(motions[0]).max())
    forces = [
        c.inverse_dynamics(*m, actuated=c.model.names[1:]) for c, m in ((chain, (q, v, a)), (image, (q_, v_, a_)))
    ]
    for name, own in (("tau", signs.motion), ("multipliers", signs.rows)):
        one, two = (getattr(each, name) for each in forces)
        np.testing.assert_allclose(own * one, two, atol=1e-9 * np.abs(forces[0].tau).max())
    wrench = [each.joint_reaction("loop") for each in forces]
    np.testing.assert_allclose(S @ wrench[0].force, wrench[1].force, atol=1e-9 * np.abs(forces[0].tau).max())
    np.testing.assert_allclose(-S @ wrench[0].moment, wrench[1].moment, atol=1e-9 * np.abs(forces[0].tau).max())


#: Random robots that MJCF can hold: no body of theirs is without mass.
@pytest.mark.parametrize("seed", [3, 5, 8, 12, 13, 14, 17, 30, 31, 35])
def test_mujoco_sees_the_mirror_image(seed, tmp_path):
    """Both written as MJCF, in MuJoCo: places of the bodies, its mass matrix and bias, and equalities that hold."""
    robot = mjcf_chains.random_robot(seed, passive=False)
    chain = ClosedChain.from_mjcf(robot.text)
    image, signs = chain.mirrored(), chain.mirror_signs()
    q = mujoco_exact.ExactMujoco(mujoco.MjModel.from_xml_string(robot.text), chain).q_of(robot.qpos)
    v, found = np.random.default_rng(seed).normal(size=chain.model.nv), []
    for each, folder, q_, v_ in ((chain, "left", q, v), (image, "right", signs.configuration * q, signs.motion * v)):
        model = mujoco.MjModel.from_xml_path(str(each.to_mjcf(tmp_path / folder, q_)))
        exact = mujoco_exact.ExactMujoco(model, each)
        qpos = exact.qpos_of(q_)
        T, rate = exact.velocity_map(qpos, v_)
        data = exact.at(qpos, T @ v_)
        bias = T.T @ (data.qfrc_bias + exact.mass() @ rate @ v_)
        places = np.array([[data.body(b).xpos, data.body(b).xipos] for b in range(model.nbody)])
        names = [model.body(b).name for b in range(model.nbody)]
        found.append((names, places, T.T @ exact.mass() @ T, bias))
        assert np.abs(exact.rows()[0]).max(initial=0.0) < 1e-10
    (names, places, M, bias), (names_, places_, M_, bias_) = found
    assert names == names_
    np.testing.assert_allclose(places @ S, places_, atol=1e-9)
    np.testing.assert_allclose(signs.motion[:, None] * M * signs.motion, M_, atol=1e-9 * np.abs(M).max())
    np.testing.assert_allclose(signs.motion * bias, bias_, atol=1e-8 * max(1.0, np.abs(bias).max()))
