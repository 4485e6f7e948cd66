"""Efforts of drives in the scene: moments about their hinges where their motors are, forces at the ends of slides."""

import numpy as np
import pinocchio as pin
import pytest
from scenes import URDF, panel, place
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.device import ConstantForce, LinearSpring, Route, Spring
from exo_pin.view import Scene

MAN = ep.Wearer(1.75, 75, "male")


def hinge(chain, q, name):
    """Origin and axis of a joint of one coordinate, base frame, by turning or moving it alone."""
    index, step = chain.velocity_slice(name).start, 1e-6
    v = np.zeros(chain.model.nv)
    v[index] = step
    here, there = (chain.placements(each)[name] for each in (q, pin.integrate(chain.model, q, v)))
    turn = Rotation.from_matrix(there.rotation @ here.rotation.T).as_rotvec() / step
    return here.translation, turn if np.linalg.norm(turn) > 0.5 else (there.translation - here.translation) / step


def moved(path):
    """Where a shape of unit height starts, and what it spans."""
    return path[:3, 3], path[:3, 2]


@pytest.mark.parametrize("side", ["left", "right"])
def test_moments_turn_about_their_hinges(side):
    exo = ep.load(URDF / "serial-y-x-z.urdf", side=side).worn_by(MAN)
    scene = Scene(exo, human=False)
    pose = exo.pose(40.0, 20.0, 10.0)
    answer = scene.show(pose)
    chain, q = exo.chain, exo.configurations(pose)
    shapes = [(shape.size[0], (chain.placement(q, shape.frame) * shape.place).translation)
              for shape in chain.description.shapes if shape.frame != "arm"]  # fmt: skip
    values = {item["name"]: item["value"] for item in panel(scene, "numbers")["values"]}
    for k, drive in enumerate(exo.device.drives):
        effort = float(answer.actuator_forces[k])
        at, turn = moved(place(scene, f"/meshcat/forces/drive_{k}/turn/round"))
        origin, axis = hinge(chain, q, drive.joint)
        np.testing.assert_allclose(turn / np.linalg.norm(turn), np.sign(effort) * axis, atol=1e-5)
        np.testing.assert_allclose(np.cross(at - origin, axis), 0.0, atol=1e-6)
        on_axis = [spot for _, spot in shapes if np.linalg.norm(np.cross(spot - origin, axis)) < 0.005]
        assert not on_axis or min(np.linalg.norm(spot - at) for spot in on_axis) < 0.006
        assert values[drive.name] == f"{effort:.1f} N m".replace("-", "−")
        assert any(label["text"] == f"{drive.name} {abs(effort):.1f} N m" for label in panel(scene, "labels"))
    assert "margin, det X" not in values


def test_slides_push_where_their_limb_ends():
    exo = ep.load(URDF / "3rps-passive-ball.urdf").worn_by(MAN)
    scene = Scene(exo, human=False)
    pose = exo.pose(40.0, 20.0, 10.0)
    answer = scene.show(pose)
    chain, q, scale = exo.chain, exo.configurations(pose), scene.metres_per_newton
    for k, drive in enumerate(exo.device.drives):
        effort = float(answer.actuator_forces[k])
        _, axis = hinge(chain, q, drive.joint)
        kind = "push" if effort > 0.0 else "pull"  # positive efforts make a limb longer
        shaft = moved(place(scene, f"/meshcat/forces/drive_{k}/{kind}/shaft"))
        head = moved(place(scene, f"/meshcat/forces/drive_{k}/{kind}/head_{int(effort > 0)}"))
        start, tip = shaft[0], head[0] + head[1]
        assert np.linalg.norm(tip - start) == pytest.approx(min(scale * abs(effort), 0.4), abs=1e-6)
        along = (tip - start) / np.linalg.norm(tip - start)
        assert abs(along @ axis) == pytest.approx(1.0, abs=1e-6)
        # On the arm it pushes away from the torso's side of the limb, or pulls towards it.
        end = tip if effort > 0 else start
        joints = [chain.placements(q)[name].translation for name in chain.model.names[1:]]
        assert min(np.linalg.norm(spot - end) for spot in joints) < 0.05


def test_springs_and_routes_act_where_they_meet_the_arm():
    exo = ep.load(URDF / "serial-y-x-z.urdf")
    way = Route.over(("universe", (0.0, 0.1, 0.3)), ("arm", (0.03, 0.04, -0.2)))
    springs = [
        Spring("rope", LinearSpring(200.0, 0.1), route=way),
        Spring("wound", ConstantForce(3.0), joint="flexion"),
    ]
    exo = exo.replace(springs=springs).worn_by(MAN)
    scene, pose = Scene(exo, human=False), exo.pose(30.0, 20.0)
    scene.show(pose)
    chain, q, scale = exo.chain, exo.configurations(pose), scene.metres_per_newton
    start, end = np.array([0.0, 0.1, 0.3]), pose.apply([0.03, 0.04, -0.2])
    size = np.linalg.norm(end - start)
    force = 200.0 * (size - 0.1)
    shaft = moved(place(scene, "/meshcat/forces/spring_0/pull/shaft"))
    head = moved(place(scene, "/meshcat/forces/spring_0/pull/head_0"))
    np.testing.assert_allclose(shaft[0], end, atol=1e-9)
    tip = head[0] + head[1]
    np.testing.assert_allclose(tip - end, min(scale * force, 0.4) * (start - end) / size, atol=1e-6)
    assert any(label["text"].startswith(f"rope pulls {force:.0f} N") for label in panel(scene, "labels"))
    # A law is the pull: its effort on the joint is the opposite.
    _, axis = hinge(chain, q, "flexion")
    _, turn = moved(place(scene, "/meshcat/forces/spring_1/turn/round"))
    np.testing.assert_allclose(turn / np.linalg.norm(turn), -axis, atol=1e-5)
    # The rope is drawn from end to end, its coil as wide as it is.
    root = next(path for path in scene._stage.placements() if path.endswith("routes/spring_0/0"))
    foot, line = moved(scene._stage.placements()[root])
    ends = np.array([foot, foot + line])
    assert min(np.abs(ends - [start, end]).max(), np.abs(ends - [end, start]).max()) < 1e-9
    assert {item["text"] for item in panel(scene, "legend")["items"]} >= {"spring"}
