"""The scene of a device that is not a wrist: arrows are the answer's forces, where they act."""

import numpy as np
from places import URDF

import exo_pin as ep
from exo_pin.cli import main
from exo_pin.view import ChainScene, Scene


def test_a_device_is_drawn_in_a_pose_with_its_forces():
    exo = ep.load(URDF / "serial-y-x-z.urdf")
    scene = exo.view()
    assert type(scene) is Scene
    pose = exo.pose(60, 30)
    answer = scene.show(pose)
    np.testing.assert_allclose(answer.shoulder_force, exo.reaction(pose).shoulder_force)
    np.testing.assert_allclose(scene.q, exo.configurations(pose))
    forces = scene._forces(scene.q)
    total = sum(force for _, force in forces.values())
    # Shoulder, weight of the wearer's arm, and the cuff, which the device pulls: the arm is at rest.
    np.testing.assert_allclose(total, 0.0, atol=1e-9)
    # The cuff's force acts in its middle: of the moments only its couple about the arm is left.
    moment = sum(np.cross(at, force) for at, force in forces.values())
    along = pose.apply([0.0, 0.0, 1.0])
    np.testing.assert_allclose(moment, (moment @ along) * along, atol=1e-9)
    # Another configuration has no forces of that pose.
    scene.show(exo.chain.close(exo.chain.neutral()))
    assert scene._forces(scene.q) == {}


def test_a_configuration_and_a_robot_without_an_arm_are_drawn_without_forces():
    exo = ep.load(URDF / "spherical-3rrr.urdf")
    assert type(exo.view(q=exo.chain.neutral())) is ChainScene


def test_the_command_draws_a_device_in_a_pose(tmp_path, capsys):
    page = tmp_path / "page.html"
    assert main(["view", str(URDF / "serial-y-x-z.urdf"), "--flexion", "60", "--plot", str(page)]) == 0
    assert "The device can hold this pose." in capsys.readouterr().out
    assert page.stat().st_size > 10_000


def test_a_route_is_drawn_between_its_points():
    exo = ep.load(URDF / "spring-support.urdf")
    scene = exo.view()
    pose = exo.pose(0, 70)
    scene.show(pose)
    ((name, _, _route),) = scene._routes
    assert name == "spring_0"
    placed = scene._stage.placements()["/meshcat/routes/spring_0/0"]
    start, end = (exo.device.springs[0].route.points[k] for k in (0, 1))
    assert {start.link, end.link} & {"universe"}
    middle = np.asarray(placed)[:3, 3]
    where = [np.array(p.point) if p.link == "universe" else pose.apply(p.point) for p in (start, end)]
    assert min(np.linalg.norm(middle - at) for at in (*where, np.mean(where, axis=0))) < 1e-9
