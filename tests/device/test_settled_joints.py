"""Joints that no drive and no loop holds hang where gravity and springs leave them, in every pose of the arm."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.device import ChainDevice, Drive, LinearSpring, Route, Spring

LINK = (
    '<link name="{}"><inertial><mass value="{}"/><origin xyz="{} {} {}"/>'
    '<inertia ixx="0.02" iyy="0.02" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>'
)
HINGE = (
    '<joint name="{}" type="revolute"><parent link="{}"/><child link="{}"/><origin xyz="{} {} {}"/>'
    '<axis xyz="{} {} {}"/><limit lower="-9" upper="9" effort="9" velocity="9"/></joint>'
)
POSES = Rotation.from_rotvec([[0.0, 0.0, 0.0], [0.0, -0.8, 0.0], [0.9, 0.4, -0.2], [-0.3, -1.4, 0.5], [1.2, 0.0, 0.9]])


def pendulum_device(axis, centre, drives=()):
    """A pendulum on the arm, with its centre of mass at ``centre`` from the hinge."""
    xml = (
        f'<robot name="pendulum">{LINK.format("arm", 4.0, 0, 0, -0.3)}{LINK.format("bob", 0.5, *centre)}'
        f"{HINGE.format('hinge', 'arm', 'bob', 0.05, 0.0, -0.2, *axis)}</robot>"
    )
    roles = ep.chain.Roles(arm="arm", shoulder="root_joint")
    closures = ep.chain.Closures("pendulum", ep.chain.Root("spherical"), (), roles)
    cables = [
        Drive(f"cable_{k}", route=Route.over(("universe", (0.2, y, 0.3)), ("arm", (0.0, 0.0, -0.2))))
        for k, y in enumerate((-0.2, 0.0, 0.3))
    ]
    return ChainDevice.from_chain(ep.ClosedChain.from_urdf(xml, closures)).replace(drives=[*cables, *drives])


def configurations(device):
    return ep.ShoulderExo.from_device(device).configurations(POSES)


def rule(device):
    """How the configuration is chosen, as an answer says it."""
    cautions = ep.solve(device, ep.Case(POSES[1]), ep.Assumptions(limits="none")).cautions
    return next(text for text in cautions if text.startswith("Posture: "))


def hinge_angle(axis, centre, rotation):
    """Where the centre of mass is lowest: its part across the axis points as gravity's does."""
    axis, down = np.array(axis), rotation.inv().apply([0.0, 0.0, -1.0])
    across = down - axis * (axis @ down)
    out = np.array(centre) - axis * (axis @ centre)
    return np.arctan2(axis @ np.cross(out, across), out @ across)


@pytest.mark.parametrize("axis", [(1.0, 0.0, 0.0), (0.6, 0.8, 0.0), (0.48, 0.6, 0.64)])
@pytest.mark.parametrize("centre", [(0.02, 0.1, 0.05), (0.0, 0.0, 0.2)])
def test_a_pendulum_hangs_in_every_pose(axis, centre):
    device = pendulum_device(axis, centre)
    q = configurations(device)
    hinge = q[:, device.chain.configuration_slice("hinge")][:, 0]
    exact = [hinge_angle(axis, centre, R) for R in POSES]
    np.testing.assert_allclose(np.cos(hinge - exact), 1.0, atol=1e-12)
    assert "gravity and springs" in rule(device)


def test_a_spring_in_the_hinge_has_its_share():
    axis, centre = (1.0, 0.0, 0.0), (0.0, 0.1, 0.0)
    device = pendulum_device(axis, centre)
    route = Route.over(("arm", (0.1, 0.3, -0.1)), ("bob", centre))
    coil = Spring("coil", LinearSpring(0.8, slack=0.3), joint="hinge")
    for spring in (coil, Spring("band", LinearSpring(30.0, slack=0.1), route=route)):
        _is_stable(device.replace(springs=[spring]), spring)


def _is_stable(device, spring):
    """The energy of bob and spring is least where the hinge settles, seen from either side."""
    hinge, chain = device.chain.configuration_slice("hinge"), device.chain

    def energy(q, angle):
        q = q.copy()
        q[hinge] = angle
        frames = {name: chain.placement(q, name) for name in ("arm", "bob")}
        if spring.joint is not None:
            stored = 0.5 * 0.8 * (angle - 0.3) ** 2
        else:
            ends = [frames[point.link].act(np.array(point.point)) for point in spring.route.points]
            stored = 0.5 * 30.0 * (np.linalg.norm(ends[0] - ends[1]) - 0.1) ** 2
        return 0.5 * 9.81 * frames["bob"].act(np.array([0.0, 0.1, 0.0]))[2] + stored

    for q in configurations(device):
        angle, step = q[hinge][0], 1e-4
        here, there, back = (energy(q, angle + away) for away in (0.0, step, -step))
        assert abs(there - back) / (2.0 * step) < 1e-7
        assert there + back - 2.0 * here > 0.0


@pytest.mark.filterwarnings("ignore::exo_pin.OutsideHumanRange")
def test_a_device_with_a_pendulum_is_in_equilibrium():
    device = pendulum_device((0.6, 0.8, 0.0), (0.02, 0.1, 0.05))
    answer = ep.solve(device, ep.Case(POSES), ep.Assumptions(limits="none"))
    assert set(answer.equilibrium_status) <= {"ok", "near_singular"}
    # Cables and shoulder carry the weight of arm and bob.
    pulls = answer.actuator_forces[:, :3, None] * np.array([_pull(device, R) for R in POSES])
    total = answer.shoulder_force + pulls.sum(axis=1)
    np.testing.assert_allclose(total, np.tile([0, 0, 4.5 * 9.81], (5, 1)), atol=1e-9)


def _pull(device, rotation):
    """Directions of the cables' pulls on the arm, shape (3, 3)."""
    there = rotation.apply([0.0, 0.0, -0.2])
    away = np.array([drive.route.points[0].point for drive in device.drives]) - there
    return away / np.linalg.norm(away, axis=1)[:, None]


@pytest.mark.parametrize(
    "axis", [(1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, -0.6, 0.0), (-0.6, 0.8, 0.0)]
)
def test_an_upright_pendulum_falls_towards_larger_angles(axis):
    q = ep.ShoulderExo.from_device(pendulum_device(axis, (0.0, 0.0, 0.2))).configurations(POSES[0])
    assert q[4] == pytest.approx(np.pi, abs=1e-9)
