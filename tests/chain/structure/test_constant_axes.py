"""Joints whose motion subspace changes with q: composite, universal, SphericalZYX, ellipsoid."""

import changing_axes
import numpy as np
import pinocchio as pin
import pytest
from changing_axes import KINDS, motion

from exo_pin import InvalidInput
from exo_pin.chain import TYPES, ClosedChain, Closures
from exo_pin.chain.derivatives.reaction_derivatives import _freed
from exo_pin.core import compiled

CLOSURES = [kind for kind in TYPES if kind not in ("point", "coupling")]
#: Central differences of fourth order: step⁴ of the formula, rounding over the step.
STEP, TOLERANCE = 3e-4, 2e-9


def difference(f):
    return (8 * (f(STEP) - f(-STEP)) - (f(2 * STEP) - f(-2 * STEP))) / (12 * STEP)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("closure", CLOSURES)
def test_jacobian_rate_and_drift_against_differences(kind, closure):
    chain, q = changing_axes.chain(kind, closure)
    v, _ = motion(chain, q)
    model = chain.model
    # Along a motion that keeps the loop closed, so that the Jacobian is the residual's derivative.
    rate = difference(lambda s: chain.constraint_jacobian(pin.integrate(model, q, s * v)))
    np.testing.assert_allclose(chain.constraint_drift(q, v), rate @ v, atol=TOLERANCE * (1 + v @ v))
    chain._state.buffers.drift_of(q, v)
    np.testing.assert_allclose(chain._state.buffers.jacobian_rate, rate, atol=TOLERANCE * (1 + np.abs(v).max()))


@pytest.mark.parametrize("kind", KINDS)
def test_drift_is_the_acceleration_of_the_points_at_zero_joint_acceleration(kind):
    # Pinocchio's forward kinematics knows the bias of every joint: a second route to J̇ v of a ball closure.
    chain, q = changing_axes.chain(kind, "spherical")
    v, _ = motion(chain, q)
    model, data, closure = chain.model, chain.model.createData(), chain.closures[0]
    frames = []
    for end, name in (("a", closure.frame_a), ("b", closure.frame_b)):
        place = getattr(closure, f"placement_{end}")
        joint = model.frames[model.getFrameId(name)].parentJoint
        pose = pin.SE3(pin.Quaternion(np.array(place.quaternion)).normalized(), np.array(place.translation))
        frames.append((joint, pose))
    pin.forwardKinematics(model, data, q, v, np.zeros(model.nv))
    accelerations, rotations, twists = [], [], []
    for joint, pose in frames:
        R = (data.oMi[joint] * pose).rotation
        twist, rate = pose.actInv(data.v[joint]), pose.actInv(data.a[joint])
        accelerations.append(R @ (rate.linear + np.cross(twist.angular, twist.linear)))
        rotations.append(R)
        twists.append(R @ twist.linear)
    np.testing.assert_allclose(twists[0], twists[1], atol=1e-12)
    expected = rotations[0].T @ (accelerations[0] - accelerations[1])
    np.testing.assert_allclose(chain.constraint_drift(q, v), expected, atol=1e-12 * (1 + v @ v))


@pytest.mark.parametrize("method", ["proximal", "projected"])
@pytest.mark.parametrize("closure", ["spherical", "rigid"])
@pytest.mark.parametrize("kind", KINDS)
def test_forward_dynamics_does_not_open_the_loop(kind, closure, method):
    chain, q = changing_axes.chain(kind, closure, passive=True)
    v, _ = motion(chain, q)
    tau = np.random.default_rng(4).normal(size=chain.model.nv)
    moved = chain.forward_dynamics(q, v, tau, method=method)
    # q(t) = q + v t + a t²/2 stays on the loop up to t³: the second difference of the residual is of size t.
    a, residuals = moved.a, []
    for t in (1e-3, 5e-4):
        ahead = pin.integrate(chain.model, q, v * t + a * t**2 / 2)
        residuals.append(np.abs(chain.residual(ahead)).max())
    assert residuals[1] < residuals[0] / 6 + 1e-13
    again = chain.inverse_dynamics(q, v, a, actuated=list(chain.model.names)[1:], objective=None)
    # Forces that differ from tau by Jᵀλ make the same motion.
    J = chain.constraint_jacobian(q)
    left = again.tau - tau + J.T @ (again.multipliers - moved.forces.multipliers)
    np.testing.assert_allclose(left, 0.0, atol=1e-8 * (1 + np.abs(tau).max() + np.abs(again.multipliers).max()))


@pytest.mark.full
@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "ellipsoid"])
def test_derivatives_of_inverse_dynamics_against_differences(kind):
    compare_derivatives(kind)


def test_derivatives_of_a_universal_joint_against_differences():
    # Kernels of derivatives compile longest.
    with compiled.mode("plain"):
        compare_derivatives("universal")


def compare_derivatives(kind):
    chain, q = changing_axes.chain(kind, "distance", passive=True)
    v, a = motion(chain, q)
    # One row makes one coordinate dependent: the hinge that moves the closure more.
    row = np.abs(chain.constraint_jacobian(q)[0])
    dependent = max(("left_1", "right_0"), key=lambda joint: row[chain.velocity_slice(joint)].max())
    independent = [joint for joint in list(chain.model.names)[1:] if joint != dependent]
    own = chain.velocity_indices(independent)
    external = {"left_0_link": np.array([3.0, -2.0, 1.0, 0.5, -0.4, 0.3])}
    problem = {"external": external, "actuated": independent}
    v, a = chain.dependent_motion(q, independent, v[own], a[own])
    found = chain.inverse_dynamics_derivatives(q, v, a, independent=independent, **problem)
    G = chain.reduced_jacobian(q, independent)

    reaction = found.joint_reaction("left_1")

    def efforts(q, velocity, acceleration):
        forces = chain.inverse_dynamics(
            q, *chain.dependent_motion(q, independent, velocity, acceleration), metric="closures", **problem
        )
        return np.concatenate([forces.tau, forces.joint_reaction("left_1", intervals=False).wrench])

    for k in range(len(own)):
        unit = np.eye(len(own))[k]

        def at(s, k=k):
            there = pin.integrate(chain.model, q, s * G[:, k])
            return efforts(chain.close(there, hold=independent, tolerance=1e-13), v[own], a[own])

        expected = difference(at)
        np.testing.assert_allclose(
            np.append(found.tau_q[:, k], reaction.q[:, k]), expected, atol=1e-7 * (1 + np.abs(expected).max())
        )
        expected = difference(lambda s, unit=unit: efforts(q, v[own] + s * unit, a[own]))
        np.testing.assert_allclose(
            np.append(found.tau_v[:, k], reaction.v[:, k]), expected, atol=1e-7 * (1 + np.abs(expected).max())
        )


def test_derivatives_of_an_ellipsoid_are_refused():
    chain, q = changing_axes.chain("ellipsoid")
    with pytest.raises(InvalidInput, match="ellipsoid"):
        chain.inverse_dynamics_derivatives(q, actuated=list(chain.model.names)[1:])


@pytest.mark.parametrize("kind", KINDS)
def test_a_joint_whose_axes_move_in_its_child_is_not_freed(kind):
    """The speed of a free flight in its place is the twist of its child by Pinocchio."""
    chain, q = changing_axes.chain(kind)
    state, index = chain._state, chain.model.getJointId("left_0")
    if kind not in ("spherical", "planar"):
        with pytest.raises(InvalidInput, match="axes of joint 'left_0' move"):
            _freed(state, index)
        return
    freed, into = _freed(state, index)
    v = np.random.default_rng(3).normal(size=chain.model.nv)
    data = chain.model.createData()
    pin.forwardKinematics(chain.model, data, q, v)
    twist = data.v[index].vector
    np.testing.assert_allclose((into @ v)[freed.velocity_slice("left_0")], twist, atol=1e-12)


def test_joints_out_of_depth_first_order_are_refused():
    model, body = pin.Model(), pin.Inertia(1.0, np.array([0.0, 0.0, 0.3]), 0.01 * np.eye(3))
    first = model.addJoint(0, pin.JointModelRX(), pin.SE3.Identity(), "first")
    second = model.addJoint(0, pin.JointModelRY(), pin.SE3.Identity(), "second")
    third = model.addJoint(first, pin.JointModelRX(), pin.SE3.Identity(), "third")
    for joint in (first, second, third):
        model.appendBodyToJoint(joint, body, pin.SE3.Identity())
    # What the refusal keeps out: Pinocchio's mass matrix is not the one of its own RNEA.
    data, q, zero = model.createData(), np.array([0.3, 0.4, 0.5]), np.zeros(3)
    upper = np.triu(pin.crba(model, data, q))
    M = upper + np.triu(upper, 1).T
    columns = [pin.rnea(model, data, q, zero, unit) - pin.rnea(model, data, q, zero, zero) for unit in np.eye(3)]
    assert np.abs(M - np.column_stack(columns)).max() > 1e-3
    with pytest.raises(InvalidInput, match=r"'third' hangs on 'first' but is numbered after 'second'"):
        ClosedChain(model, Closures("out of order"))


def test_joints_of_one_name_are_refused():
    model = pin.Model()
    for parent in (0, 1):
        model.addJoint(parent, pin.JointModelRX(), pin.SE3.Identity(), "hinge")
    with pytest.raises(InvalidInput, match="two joints have the name 'hinge'"):
        ClosedChain(model, Closures("twins"))


def test_mimic_joints_of_a_model_are_refused():
    xml = """<robot name="r"><link name="a"/>{}</robot>""".format(
        "".join(
            f"""<link name="{child}"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0"
            iyz="0"/></inertial></link><joint name="{child}_joint" type="revolute"><parent link="{parent}"/><child
            link="{child}"/><axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/>{mimic}</joint>"""
            for parent, child, mimic in (("a", "b", ""), ("b", "c", '<mimic joint="b_joint" multiplier="2"/>'))
        )
    )
    model = pin.buildModelFromXML(xml, True)
    assert list(model.mimicking_joints)
    with pytest.raises(InvalidInput, match="mimic"):
        ClosedChain(model, Closures("mimic"))


@pytest.mark.parametrize("number", [np.nan, np.inf, -1e-6])
@pytest.mark.parametrize("joint", [1, 2])
def test_masses_and_centres_that_no_body_has_are_refused(number, joint):
    for name in ("mass", "lever"):
        model = changing_axes.tree("spherical", 0)
        setattr(model.inertias[joint], name, number if name == "mass" else np.array([0.0, 0.0, number]))
        if name == "lever" and np.isfinite(number):
            ClosedChain(model, Closures("eccentric"))
            continue
        with pytest.raises(InvalidInput, match=model.names[joint]):
            ClosedChain(model, Closures("heavy"))
    model = changing_axes.tree("spherical", 0)
    model.inertias[joint].mass = 0.0
    ClosedChain(model, Closures("light"))
