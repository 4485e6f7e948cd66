"""What a device does not hold is named: the wearer's moment about the arm, a joint with the effort that it lacks."""

import numpy as np
import pinocchio as pin
import pytest
from idle_devices import Builder
from places import URDF
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import UndrivenMotion
from exo_pin.device import Brake, Drive, Route

G = 9.81


def serial(seed=0, count=3):
    """Hinges through O, all driven, on an arm."""
    build = Builder(np.random.default_rng(seed))
    build.hinges(count, [True] * count)
    return build


def gravity_moment(device, pose):
    """Moment of the weight of the arm about O, N m."""
    return np.cross(pose.apply(np.array(device.arm.centre_of_mass)), [0.0, 0.0, -G * device.arm.mass])


def test_a_ball_on_the_arm_leaves_its_own_turn_to_the_wearer():
    """The shipped 3RPS on a bent elbow: its limbs do not turn the arm about itself, and the forearm is on one side."""
    exo = ep.load(URDF / "3rps-passive-ball.urdf")
    arm = ep.Arm.from_anthropometry(1.75, 75, sex="male", elbow_flexion=90, degrees=True)
    bent, straight = exo.worn_by(arm), exo.worn_by(ep.Arm.from_anthropometry(1.75, 75, sex="male"))
    pose = exo.pose(90, 0, 45)
    answer = bent.reaction(pose)
    along = pose.apply([0.0, 0.0, -1.0])
    missing = -gravity_moment(bent.device, pose) @ along
    assert abs(missing) > 1.0
    np.testing.assert_allclose(answer.actuator_forces[3:], missing * along, atol=1e-6)
    assert not answer.can_hold
    assert answer.equilibrium_status == "ok"
    assert f"the wearer's own muscles would have to add {abs(missing):.3g} N m about the arm." in answer.verdict
    with pytest.raises(UndrivenMotion):
        bent.chain.inverse_dynamics(exo.configurations(pose))
    # One freedom is left with locked drives.
    assert bent.chain.mobility(exo.configurations(pose)).locked.degrees_of_freedom == 1
    assert straight.reaction(pose).can_hold
    assert exo.singularity(pose).kind == "passive"


@pytest.mark.parametrize("limit", [None, 100.0, 0.5])
def test_a_brake_holds_a_slide_that_otherwise_falls(limit, tmp_path):
    build = serial()
    build.appendage("loose")
    loose, pose = build.device(), Rotation.from_rotvec([0.4, 0.2, -0.3])
    index = build.model.getJointId("extra")
    axis = np.array(build.model.joints[index].createData().S).ravel()[:3]
    weight = G * build.model.inertias[index].mass * axis[2]
    answer = ep.solve(loose, ep.Case(pose))
    assert answer.status == "no_equilibrium"
    assert not answer.can_hold
    assert np.isnan(answer.actuator_forces).all()
    lacking = f"no drive holds 'extra': {abs(weight):.3g} N are missing."
    assert answer.verdict == f"The device cannot hold this pose: {lacking}"
    stack = ep.solve(loose, ep.Case(Rotation.concatenate([pose, pose])))
    assert "no drive holds 'extra' (2)" in stack.verdict
    assert loose.holds_alone
    braked = loose.replace(brakes=[Brake("stop", "extra", limit)])
    held, without = ep.solve(braked, ep.Case(pose)), ep.solve(serial().device(), ep.Case(pose))
    np.testing.assert_allclose(held.actuator_forces[3], weight, atol=1e-9)
    # What the slide's own brake does is not the arm's affair.
    np.testing.assert_allclose(held.actuator_forces[:3], without.actuator_forces, atol=1e-9)
    assert held.drive_units[3] == ("stop", "N")
    assert held.can_hold == (limit == 100.0)
    assert held.unknown == (limit is None)
    if limit == 0.5:
        assert f"stop would have to push with {weight:.2g} N (at most 0.5 N)" in held.verdict


def test_a_brake_beside_a_drive_leaves_the_drive_at_rest():
    """Both hold one hinge: the brake's effort is a reaction, and costs nothing beside the drive's."""
    device, pose = serial().device(), Rotation.from_rotvec([0.4, 0.2, -0.3])
    alone = ep.solve(device, ep.Case(pose), ep.Assumptions(limits="none")).actuator_forces
    braked = device.replace(brakes=[Brake("stop", "hinge_2", 0.6 * abs(alone[1]))])
    free, held = (ep.solve(braked, ep.Case(pose), ep.Assumptions(limits=limits)) for limits in ("none", "design"))
    np.testing.assert_allclose(free.actuator_forces, [alone[0], 0.0, alone[2], alone[1]], atol=2e-6 * abs(alone[1]))
    # The brake slips at its limit: the drive has the rest.
    expected = [alone[0], 0.4 * alone[1], alone[2], 0.6 * alone[1]]
    np.testing.assert_allclose(held.actuator_forces, expected, atol=1e-6)
    assert held.can_hold


def mixed(motor, cable):
    """A hinge device whose first axis has a cable besides its motor."""
    route = Route.over(("universe", (0.3, 0.1, 0.2)), ("arm", (0.05, 0.0, -0.25)))
    device = serial().device()
    own = tuple(Drive(drive.name, drive.joint, lower=-motor, upper=motor) for drive in device.drives)
    return device.replace(drives=(*own, Drive("cable", route=route, lower=0.0, upper=cable, least=0.0)))


def test_newtons_and_newton_metres_are_shared_by_their_limits():
    pose = Rotation.from_rotvec([0.4, 0.2, -0.3])
    device = mixed(20.0, 300.0)
    answer = ep.solve(device, ep.Case(pose), ep.Assumptions(limits="none"))
    M, m = answer.source.poses.state.moment_of_f[0], answer.source.poses.state.moment[0]
    size = np.array([20.0, 20.0, 20.0, 300.0])
    expected = size * (np.linalg.pinv(M * size) @ m)
    np.testing.assert_allclose(answer.actuator_forces, expected, atol=1e-9)
    assert answer.criterion == "least sum of squares of the tensions, each effort over its greatest limit"
    assert not [text for text in answer.cautions if "N m are shared" in text]
    # The unit of a drive does not count: a limit twice as large in N draws as much as the torque's would.
    same = ep.solve(mixed(20.0, None), ep.Case(pose), ep.Assumptions(limits="none"))
    np.testing.assert_allclose(same.actuator_forces, np.linalg.pinv(M) @ m, atol=1e-9)
    caution = "Efforts in N and in N m are shared by their numbers: no limit is known of cable, to compare them by."
    assert caution in same.cautions
    within = ep.solve(mixed(4.0, 300.0), ep.Case(pose))
    f, size = within.actuator_forces, np.array([4.0, 4.0, 4.0, 300.0])
    assert within.can_hold
    best = minimize(
        lambda z: z @ z, f / size, jac=lambda z: 2.0 * z, bounds=[(-1.0, 1.0)] * 3 + [(0.0, 1.0)],
        constraints={"type": "eq", "fun": lambda z: M @ (size * z) - m, "jac": lambda z: M * size},
        options={"ftol": 1e-15, "maxiter": 300},
    )  # fmt: skip
    np.testing.assert_allclose(f / size, best.x, atol=1e-6)
    assert within.optimum.kkt < 1e-8


def test_no_choice_of_efforts_asks_more_of_the_wearer_than_the_device_leaves():
    """Three cables that turn the arm about one axis: what they cannot make is his, whatever else is made least."""
    lines = [((0.3, 0.1, 0.2), (0.05, 0.0, -0.25))] * 2 + [((0.6, 0.2, 0.4), (0.1, 0.0, -0.5))]
    cables = [
        Drive(f"cable_{k}", route=Route.over(("universe", a), ("arm", b)), lower=-60.0)
        for k, (a, b) in enumerate(lines)
    ]
    device = Builder(np.random.default_rng(5)).device().replace(drives=cables)
    pose = Rotation.from_rotvec([0.3, -0.2, 0.1])
    # Both lines are in one plane with O, and turn the arm about its normal n.
    ends = np.array(lines[0][0]), pose.apply(np.array(lines[0][1]))
    n = np.cross(*ends) / np.linalg.norm(np.cross(*ends))
    load = -gravity_moment(device, pose)
    answers = [
        ep.solve(device, ep.Case(pose), ep.Assumptions(split, limits="none", weights=weights))
        for split, weights in (("spherical", None), ("minimal", None), ("minimal", ep.Weights(tension=0.1)))
    ]
    for answer in answers:
        np.testing.assert_allclose(answer.actuator_forces[3:], load - (load @ n) * n, atol=1e-7)
    first, least, between = (float(answer.magnitude) for answer in answers)
    assert least < between < first
    assert answers[0].range().least == pytest.approx(least, rel=1e-6)
    assert answers[0].criterion == "least sum of squares of the tensions, after the wearer's least moment"


def test_springs_change_nothing_of_what_holds_a_devices_own_motions():
    """Stiff ones have the rigid answer, with a row for every motion; what nothing holds they do not hold either."""
    build, pose = Builder(np.random.default_rng(4)), Rotation.from_rotvec([0.4, 0.5, -0.3])
    last = build.arm
    for k, axis in enumerate(([0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.6, 0.8, 0.0])):
        kind = pin.JointModelRevoluteUnaligned(*axis)
        last = build.add(last, kind, np.zeros(3), f"hinge_{k + 1}", 0.8, build.near(0.2))
        build.drive(f"hinge_{k + 1}", 50.0)
    build.loops.append(ep.chain.Closure("frame", "rigid", "hinge_4_link", "universe"))

    def on_cuff(stiffness):
        cuff = ep.Interfaces(cuff=ep.Interface.of(stiffness, stiffness, np.zeros(3)))
        return ep.solve(
            build.device().replace(interfaces=cuff), ep.Case(pose), ep.Assumptions("elastic", limits="none")
        )

    rigid = ep.solve(build.device(), ep.Case(pose), ep.Assumptions(limits="none"))
    assert build.device().structure.held == 1
    apart = []
    for stiffness in (1e4, 1e5):
        soft = on_cuff(stiffness)
        assert soft.status == "ok"
        apart.append(np.abs(soft.actuator_forces - rigid.actuator_forces).max())
    assert 1e-6 < apart[0] < 0.05 * np.abs(rigid.actuator_forces).max()
    assert apart[1] == pytest.approx(0.1 * apart[0], rel=0.1)
    # A slide that stands upright on the frame.
    build.add(last, pin.JointModelPZ(), [0.3, 0.2, 0.0], "extra", 0.5, [0.0, 0.1, 0.0])
    answer = on_cuff(1e5)
    assert answer.status == "no_equilibrium"
    assert f"no drive holds 'extra': {0.5 * G:.3g} N are missing" in answer.verdict


@pytest.mark.parametrize("name", ["serial-y-x-z", "spherical-3rrr", "3rps-passive-ball"])
def test_the_moment_of_an_effort_on_the_arm_is_that_of_virtual_work(name):
    """Also of efforts that leave something to the wearer: it then acts on the arm, and not within the device."""
    exo = ep.load(URDF / f"{name}.urdf")
    pose = exo.pose(40, 20, 10)
    per_effort = exo.reaction(pose, limits="none").source.poses.state.attached_of_f[0].sum(axis=0)
    np.testing.assert_allclose(per_effort[3:, :3], exo.jacobian(pose).T, atol=1e-9)
    # A moment of the wearer acts on the arm, and on no part of the device.
    np.testing.assert_allclose(per_effort[:, 3:], 0.0, atol=1e-9)
