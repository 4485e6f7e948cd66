"""Laws of springs against their energy, routes against finite differences and MuJoCo's tendons, device files."""

import mujoco
import numpy as np
import pytest
from arm_alone import arm_alone

import exo_pin as ep
from exo_pin.device import (
    ChainDevice,
    ConstantForce,
    Drive,
    GasSpring,
    LinearSpring,
    Route,
    Spring,
    TableLaw,
)  # fmt: skip

LAWS = [
    ConstantForce(12.0),
    LinearSpring(300.0, 0.2),
    LinearSpring(300.0, 0.45, only_pulls=True),
    GasSpring(150.0, 0.6, 0.5),
    GasSpring(150.0, 0.6, 0.5, 1.4),
    TableLaw((0.1, 0.3, 0.5, 0.7), (5.0, 20.0, 18.0, 40.0)),
]
#: A cable from the torso over two points of torso and arm to the arm.
ROUTE = Route.over(
    ("universe", (0.05, 0.25, 0.12)),
    ("universe", (0.0, 0.15, 0.1)),
    ("arm", (0.02, 0.06, -0.1)),
    ("arm", (0.0, 0.05, -0.25)),
)


@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
def test_force_is_the_slope_of_energy(law):
    x = np.linspace(0.151, 0.649, 40)
    step = 1e-6
    slope = (law.energy(x + step) - law.energy(x - step)) / (2 * step)
    # Central differences of step h err by h² f'' / 6, and by rounding over h.
    np.testing.assert_allclose(law.force(x), slope, rtol=1e-6, atol=1e-6)


def test_the_image_of_a_route_in_the_mid_plane_is_itself():
    route = Route.over(("universe", (0.1, 0.0, 0.2)), ("arm", (0.0, -0.0, -0.2)))
    assert str(route.mirrored()) == str(Route.over(("universe", (0.1, 0.0, 0.2)), ("arm", (0.0, 0.0, -0.2))))


def bare_arm(drives=(), springs=()):
    """An arm on its shoulder, without links of a device."""
    arm = ep.Arm.from_anthropometry(1.755, 85.0, "male")
    return ChainDevice(arm_alone(), tuple(drives), tuple(springs), arm)


def pose(*angles):
    return ep.shoulder_rotation(*angles, degrees=True)


def test_a_routed_cable_pulls_as_mujocos_tendon():
    routes = [ROUTE, Route.over(("universe", (0.2, 0.0, 0.1)), ("arm", (0.06, 0.0, -0.25)))]
    routes += [Route.over(("universe", (-0.2, 0.1, 0.0)), ("arm", (-0.05, 0.0, -0.2)))]
    device = bare_arm([Drive(f"cable_{k}", route=route) for k, route in enumerate(routes)])
    R = pose(40, 50, 10)
    answer = ep.solve(device, ep.Case(R), ep.Assumptions(limits="none"))
    sites, tendons = "", ""
    arm_sites = ""
    for k, route in enumerate(routes):
        names = []
        for j, point in enumerate(route.points):
            site = f'<site name="s{k}{j}" pos="{point.point[0]} {point.point[1]} {point.point[2]}"/>'
            names.append(f'<site site="s{k}{j}"/>')
            sites, arm_sites = (sites, arm_sites + site) if point.link == "arm" else (sites + site, arm_sites)
        tendons += f'<spatial name="t{k}">{"".join(names)}</spatial>'
    arm = device.arm
    centre = " ".join(map(str, arm.centre_of_mass))
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><worldbody>{sites}<body name="arm"><joint type="ball"/><inertial mass="{arm.mass}" pos="{centre}" '
        f'diaginertia="0.1 0.1 0.1"/>{arm_sites}</body></worldbody><tendon>{tendons}</tendon></mujoco>'
    )
    data = mujoco.MjData(model)
    data.qpos[:] = np.roll(R.as_quat(), 1)
    mujoco.mj_forward(model, data)
    lengths = answer.source.poses.lengths[0]
    np.testing.assert_allclose(lengths, data.ten_length, rtol=1e-12)
    J = np.array(data.ten_J).reshape(3, -1)[:, :3]
    # Tensions balance the moment of the weight in the arm's own axes, in which MuJoCo's ball joint moves.
    np.testing.assert_allclose(-J.T @ answer.actuator_forces, data.qfrc_bias, atol=1e-9)
    exo = ep.ShoulderExo.from_device(device)
    np.testing.assert_allclose(exo.jacobian(R) @ R.as_matrix(), J, atol=1e-12)
    # A free body: the shoulder carries the weight and what all pieces of cable press and pull on the arm.
    points = [np.array([R.apply(p.point) if p.link == "arm" else p.point for p in route.points]) for route in routes]
    total = np.array([0.0, 0.0, -9.81 * arm.mass])
    for tension, at, route in zip(answer.actuator_forces, points, routes, strict=True):
        on = [p.link == "arm" for p in route.points]
        for a in range(len(at) - 1):
            unit = (at[a + 1] - at[a]) / np.linalg.norm(at[a + 1] - at[a])
            total = total + tension * unit * (on[a] - on[a + 1])
    np.testing.assert_allclose(answer.shoulder_force, -total, atol=1e-9)


def test_a_spring_along_a_route_takes_its_share_of_the_weight():
    law, route = (
        TableLaw((0.1, 0.4, 0.9), (0.0, 40.0, 60.0)),
        Route.over(("universe", (0, 0.1, 0.2)), ("arm", (0, 0.04, -0.2))),
    )
    R = pose(20, 60, 0)
    without, with_it = (
        ep.solve(bare_arm(springs=springs), ep.Case(R), ep.Assumptions(limits="none"))
        for springs in ((), (Spring("s", law, route=route),))
    )
    ends = np.array([0, 0.1, 0.2]), R.apply([0, 0.04, -0.2])
    along = ends[0] - ends[1]
    pull = law.force(np.linalg.norm(along)) * along / np.linalg.norm(along)
    np.testing.assert_allclose(with_it.cuff_wrench[:3], pull, atol=1e-12)
    np.testing.assert_allclose(without.shoulder_force - with_it.shoulder_force, pull, atol=1e-12)
    # What the wearer must add is the weight's moment less the spring's.
    change = without.actuator_forces - with_it.actuator_forces
    np.testing.assert_allclose(change, np.cross(ends[1], pull), atol=1e-12)
    assert not with_it.can_hold
