"""The scene of a device that is not a wrist: arrows are the answer's forces, where they act."""

import itertools

import numpy as np
import pinocchio as pin
import pytest
from places import URDF
from scenes import commands, panel, place, placements

import exo_pin as ep
from exo_pin.cli import main
from exo_pin.device import DeviceKind, Drive, LinearSpring, Route, Spring
from exo_pin.view import ChainScene, Scene

MAN = ep.Wearer(1.755, 85, "male")
#: No arrow is cut at this scale.
SCALE = 1e-3


def arrow(scene, name):
    """Where a drawn arrow starts and how far it reaches, m; None where it is not drawn."""
    shaft, head = (place(scene, f"/meshcat/forces/{name}/{part}") for part in ("shaft", "head_0"))
    if np.linalg.norm(head[:3, 2]) < 1e-5:
        return None
    last = f"/meshcat/forces/{name}/head_1"
    drawn = {item["path"] for item in commands(scene) if item["type"] == "set_object"}
    end = place(scene, last) if last in drawn else head
    return shaft[:3, 3], end[:3, 3] + end[:3, 2] - shaft[:3, 3]


def texts(scene):
    return [label["text"] for label in panel(scene, "labels")]


def legend(scene):
    return [item["text"] for item in panel(scene, "legend")["items"]]


@pytest.mark.parametrize(
    "name",
    [
        *("serial-y-x-z", "nesm", "spring-support"),
        *(pytest.param(name, marks=pytest.mark.full) for name in ("spherical-3rrr", "3rps-passive-ball")),
    ],
)
def test_a_device_is_drawn_on_its_wearer_with_the_forces_of_its_answer(name):
    exo = ep.load(URDF / f"{name}.urdf").worn_by(MAN)
    scene = exo.view(metres_per_newton=SCALE)
    assert type(scene) is Scene
    pose = exo.pose(50, 30)
    answer = scene.show(pose)
    np.testing.assert_allclose(answer.shoulder_force, exo.reaction(pose).shoulder_force)
    (o, shoulder), (centre, weight), (cuff, device) = (arrow(scene, part) for part in ("shoulder", "weight", "device"))
    np.testing.assert_allclose(o, 0.0, atol=1e-12)
    np.testing.assert_allclose(shoulder / SCALE, answer.shoulder_force, atol=1e-9)
    # The arm is at rest: the arrows on it add up to nothing, and of their moments only a couple is left that goes
    # through the cuff, and what the wearer adds.
    np.testing.assert_allclose((shoulder + weight + device) / SCALE, 0.0, atol=1e-9)
    moment = (np.cross(centre, weight) + np.cross(cuff, device)) / SCALE
    couple = answer.cuff_wrench[3:] - np.cross(cuff, answer.cuff_wrench[:3])
    wearer = exo.device.moment_of_wearer(answer.actuator_forces[None])[0]
    np.testing.assert_allclose(moment + couple + wearer, 0.0, atol=1e-9)
    # Who wears it is drawn, with one arm: the chain's own is not.
    drawn = {item["path"] for item in commands(scene) if item["type"] == "set_object"}
    assert any("/bust/" in path for path in drawn)
    if any("/human/" in path for path in drawn):
        assert not any(path.startswith("/meshcat/exo/visuals/arm_") for path in drawn)
    numbers = panel(scene, "numbers")
    assert numbers["values"][0]["value"] == f"{answer.magnitude:.1f} N"
    assert answer.verdict in [note["text"] for note in numbers["notes"]]
    for drive in exo.device.drives:
        assert any(text.startswith(drive.name) for text in texts(scene))


def test_moments_of_hinges_turn_about_their_axes_the_right_way_round():
    exo = ep.load(URDF / "nesm.urdf").worn_by(MAN)
    scene = exo.view(human=False)
    pose = exo.pose(50, 30)
    answer, model = scene.show(pose), exo.chain.model
    for i, drive in enumerate(exo.device.drives):
        turned = place(scene, f"/meshcat/forces/drive_{i}/turn/round")
        axis = turned[:3, 2] / np.linalg.norm(turned[:3, 2])
        # Work of the moment on the link beyond the hinge is effort times the joint's own turn.
        joint = model.getJointId(drive.joint)
        link = next(f.name for f in model.frames if f.parentJoint == joint and f.name != drive.joint)
        q, dq = exo.configurations(pose), np.zeros(model.nv)
        dq[exo.chain.velocity_slice(drive.joint)] = 1e-6
        after = exo.chain.placement(pin.integrate(model, q, dq), link).rotation
        small = pin.log3(after @ exo.chain.placement(q, link).rotation.T) / 1e-6
        np.testing.assert_allclose(small, axis * np.sign(answer.actuator_forces[i]), atol=1e-4)
    assert "moment of a drive, not to scale" in legend(scene)


def test_a_slide_pushes_where_its_limb_meets_the_arm():
    exo = ep.load(URDF / "3rps-passive-ball.urdf").worn_by(MAN)
    scene = exo.view(human=False, metres_per_newton=SCALE)
    pose = exo.pose(50, 30)
    answer = scene.show(pose)
    total = np.zeros(6)
    for i, effort in enumerate(answer.actuator_forces[:3]):
        at, vector = arrow(scene, f"drive_{i}/{'push' if effort > 0 else 'pull'}")
        np.testing.assert_allclose(np.linalg.norm(vector) / SCALE, abs(effort), rtol=1e-9)
        assert arrow(scene, f"drive_{i}/{'pull' if effort > 0 else 'push'}") is None
        end = at + vector if effort > 0 else at
        total += np.concatenate([vector, np.cross(end, vector)]) / SCALE
        assert f"limb_{i + 1}_slide {'pushes' if effort > 0 else 'pulls'} {abs(effort):.0f} N" in texts(scene)
    assert {"drive or spring pulls", "drive or spring pushes"} & set(legend(scene))
    assert np.isfinite(total).all()


def test_springs_are_coils_and_cables_lines_between_their_points():
    exo = ep.load(URDF / "spring-support.urdf").worn_by(MAN)
    way = Route.over(("universe", [0.05, 0.1, 0.25]), ("universe", [0.0, 0.15, 0.2]), ("arm", [0.03, 0.0, -0.2]))
    exo = exo.replace(drives=[Drive("rope", route=way)])
    scene = exo.view(metres_per_newton=SCALE)
    pose = exo.pose(0, 70)
    answer = scene.show(pose)
    (spring,), ends = exo.device.springs, {}
    for name, points in (("spring_0", spring.route.points), ("drive_0", way.points)):
        found = [exo.chain.placement(exo.configurations(pose), p.link).act(np.array(p.point)) for p in points]
        for k, (start, end) in enumerate(itertools.pairwise(found)):
            drawn = place(scene, f"/meshcat/exo/routes/{name}/{k}")
            np.testing.assert_allclose(drawn[:3, 3], start, atol=1e-9)
            np.testing.assert_allclose(drawn[:3, 3] + drawn[:3, 2], end, atol=1e-9)
        ends[name] = found
    # A coil has more corners than a bar, and the legend names both.
    sizes = {
        item["path"]: len(item["object"]["geometries"][0]["data"]["attributes"]["position"]["array"].data)
        for item in commands(scene)
        if item["type"] == "set_object" and "/routes/" in item["path"] and "end" not in item["path"]
    }
    assert sizes["/meshcat/exo/routes/spring_0/0"] > 5 * sizes["/meshcat/exo/routes/drive_0/0"]
    assert {"cable", "spring"} <= set(legend(scene))
    # The cable pulls the arm towards its last pulley with its tension, the strut pushes it away from its anchor.
    at, vector = arrow(scene, "drive_0/pull")
    np.testing.assert_allclose(at, ends["drive_0"][-1], atol=1e-9)
    towards = ends["drive_0"][1] - ends["drive_0"][2]
    tension = answer.actuator_forces[0]
    assert tension > 0.0
    np.testing.assert_allclose(vector / SCALE, tension * towards / np.linalg.norm(towards), atol=1e-9)


def test_a_spring_in_a_hinge_turns_it_back():
    exo = ep.load(URDF / "nesm.urdf")
    stiff = exo.replace(springs=[Spring("back", LinearSpring(10.0), joint="flexion")])
    scene = stiff.view(human=False)
    pose = stiff.pose(60, 0)
    scene.show(pose)
    x = stiff.configurations(pose)[stiff.chain.configuration_slice("flexion")][0]
    assert f"back {10.0 * abs(x):.1f} N m" in texts(scene)
    assert "/meshcat/exo/springs/0" in placements(scene)
    # It turns the link against its deflection: the drive has that much more to give.
    drive = [drive.name for drive in exo.device.drives].index("flexion")
    more = stiff.reaction(pose).actuator_forces[drive] - exo.reaction(pose).actuator_forces[drive]
    np.testing.assert_allclose(more, 10.0 * x, atol=1e-9)
    axes = [place(scene, f"/meshcat/forces/{name}/turn/round")[:3, 2] for name in (f"drive_{drive}", "spring_0")]
    assert np.sign(axes[0] @ axes[1]) == -np.sign(x * stiff.reaction(pose).actuator_forces[drive])


@pytest.mark.parametrize("name", ["prototype", "six-cables"])
def test_a_wrist_whose_forces_come_from_a_chain_is_drawn_with_them(name):
    exo = ep.load(URDF / f"{name}.urdf").worn_by(MAN)
    assert exo.wrist.beyond_record
    scene = exo.view(metres_per_newton=1e-4)
    pose = exo.pose(50, 30)
    answer = scene.show(pose)
    assert scene.messages == () or all("no forces" not in text for text in scene.messages)
    state = exo.wrist.inverse_kinematics(pose)
    total, moment = arrow(scene, "shoulder")[1] + arrow(scene, "weight")[1], np.cross(*arrow(scene, "weight"))
    for i, (f, s, b) in enumerate(zip(answer.actuator_forces, state.directions, state.platform_points, strict=True)):
        for part, sign in (("pull", 1.0), ("push", -1.0)):
            found = arrow(scene, f"limb_{i + 1}/{part}")
            size = max(sign * f, 0.0) * 1e-4
            assert (found is None) == (size < 0.003)
            vector = np.zeros(3) if found is None else found[1]
            if found is not None:
                np.testing.assert_allclose(vector, -1e-4 * f * s, atol=1e-9)
            total, moment = total + vector, moment + np.cross(b, vector)
        side = answer.limb_wrenches[i, :3]
        assert np.isfinite(side).all()
    # What small arrows leave out: side forces of heavy limbs and tensions below 30 N.
    left_out = 30.0 * len(state.lengths) + 30.0
    assert np.linalg.norm(total) / 1e-4 < left_out
    assert f"shoulder {answer.magnitude:.0f} N" in texts(scene)
    assert "Forces on the arm" in panel(scene, "legend")["scale"]


class Opaque(DeviceKind):
    """A kind of somebody else's: it has a chain, and the names of the protocol."""

    def __init__(self, chain_device):
        self._chain = chain_device

    def as_chain(self):
        return self._chain


@pytest.mark.parametrize("name", ["nesm", "spring-support", "prototype"])
def test_another_kind_is_drawn_with_the_same_parts_and_forces(name):
    known = ep.load(URDF / f"{name}.urdf").worn_by(MAN)
    other = ep.ShoulderExo.from_device(Opaque(known.chain_device))
    pictures, pose = [each.view(human=False, metres_per_newton=2e-4) for each in (known, other)], known.pose(50, 30)
    one, two = (scene.show(pose) for scene in pictures)
    np.testing.assert_allclose(one.shoulder_force, two.shoulder_force)
    drawn = [placements(scene) for scene in pictures]
    shapes = [path for path in drawn[0] if "/visuals/" in path or "/routes/" in path]
    assert len(shapes) > 10
    for path in (*shapes, "/meshcat/forces/shoulder/shaft"):
        np.testing.assert_allclose(drawn[0][path], drawn[1][path], atol=1e-6, err_msg=path)
    # Tensions of limbs and efforts of slides are the same pulls and pushes.
    said = [sorted(t.split()[-2] for t in texts(s) if "pulls" in t or "pushes" in t) for s in pictures]
    assert said[0] == said[1]


def test_a_pose_that_a_device_does_not_reach_is_not_drawn_as_if_it_did():
    exo = ep.load(URDF / "serial-y-x-z.urdf").worn_by(MAN)
    scene = exo.view(human=False)
    # On the way its first and third axis come in line.
    far = exo.pose(0, 110, 0)
    assert np.isnan(exo.configurations(far)).any()
    answer = scene.show(far)
    numbers = panel(scene, "numbers")
    assert numbers["headline"].startswith("No solution")
    assert answer.verdict in [note["text"] for note in numbers["notes"]]
    assert "the device does not reach this pose, and is not drawn" in [note["text"] for note in numbers["notes"]]
    hidden = [
        item["value"]
        for item in commands(scene)
        if item.get("property") == "visible" and item["path"] == "/meshcat/exo"
    ]
    assert hidden == [False]
    scene.show(exo.pose(20, 20))
    hidden = [
        item["value"]
        for item in commands(scene)
        if item.get("property") == "visible" and item["path"] == "/meshcat/exo"
    ]
    assert hidden == [True]


def test_a_motion_of_a_device_is_recorded_with_its_forces():
    exo = ep.load(URDF / "nesm.urdf").worn_by(MAN)
    poses = exo.pose(np.linspace(10.0, 60.0, 4), 20.0)
    film = exo.view(human=False).record(poses, [0.0, 0.1, 0.2, 0.3])
    np.testing.assert_allclose(film.reaction.shoulder_force, exo.reaction(poses).shoulder_force)
    assert any("/forces/drive_1/turn" in path for path in film._frames["moving"])
    assert any("/exo/visuals/" in path for path in film._frames["moving"])


def test_a_mirrored_device_has_mirrored_arrows():
    exo = ep.load(URDF / "spring-support.urdf").worn_by(MAN)
    S = np.diag([1.0, -1.0, 1.0])
    pictures = []
    for each in (exo, exo.mirrored()):
        scene = each.view(human=False, metres_per_newton=SCALE)
        scene.show(each.pose(50, 30))
        pictures.append(scene)
    for name in ("shoulder", "weight", "device", "spring_0/push"):
        for one, two in zip(arrow(pictures[0], name), arrow(pictures[1], name), strict=True):
            np.testing.assert_allclose(S @ one, two, atol=1e-9)
    # A moment is mirrored the other way round.
    turns = [place(scene, "/meshcat/forces/wearer/round")[:3, 2] for scene in pictures]
    np.testing.assert_allclose(-S @ turns[0], turns[1], atol=1e-9)


@pytest.mark.full
def test_a_persons_muscles_are_drawn_with_any_device_or_alone():
    pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")
    person, exo = ep.Person(1.755, 85, "male"), ep.load(URDF / "spring-support.urdf")
    pose = exo.pose(50, 20)
    worn, bare = exo.view(person=person), exo.view(person=person, device=False)
    worn.show(pose), bare.show(pose)
    assert {"weight", "shoulder", "contact", "device", "strut"} <= {text.split()[0] for text in texts(worn)}
    assert {text.split()[0] for text in texts(bare)} == {"weight", "contact"}
    contact = exo.joint_contact(pose, person, exo.worn_by(person).reaction(pose))
    assert f"contact {contact.magnitude:.0f} N" in texts(worn)
    assert f"contact {contact.without_device.magnitude:.0f} N" in texts(bare)


def test_options_fit_every_device_or_are_refused():
    serial, robot = ep.load(URDF / "serial-y-x-z.urdf"), ep.load(URDF / "dummy-shoulder.urdf")
    assert not {drive.joint for drive in serial.device.drives} & set(texts(serial.view(human=False)))
    with pytest.raises(ep.InvalidInput, match="labels"):
        serial.view(labels=True)
    assert serial.view(human=False, metres_per_newton=0.002).metres_per_newton == 0.002
    assert type(serial.view(q=serial.chain.neutral())) is ChainScene
    assert type(ep.load("prototype").view(q=ep.load("prototype").chain.neutral())) is ChainScene
    with pytest.raises(ep.InvalidInput, match="muscles"):
        serial.view(limbs="muscles")
    with pytest.raises(ep.InvalidInput, match="human"):
        robot.view(human=True)
    with pytest.raises(ep.InvalidInput, match="metres_per_newton"):
        serial.view(q=serial.chain.neutral(), metres_per_newton=0.01)
    with pytest.raises(ep.InvalidInput, match="person"):
        serial.view(device=False)


@pytest.mark.full
def test_the_command_draws_a_device_in_a_pose(tmp_path, capsys):
    page = tmp_path / "page.html"
    robot = str(URDF / "serial-y-x-z.urdf")
    assert main(["view", robot, "--flexion", "60", "--scale", "50", "--plot", str(page)]) == 0
    assert "The device can hold this pose." in capsys.readouterr().out
    assert page.stat().st_size > 10_000
    assert main(["view", robot, "--to", "30,0,0", "--seconds", "0.1", "--plot", str(page)]) == 0
    assert "play(JSON" in page.read_text()


def drawn(scene):
    """Where each part of the device is, by its path, shape (4, 4)."""
    return {
        item["path"]: np.array(item["matrix"]).reshape(4, 4).T
        for item in commands(scene)
        if item["type"] == "set_transform" and item["path"].startswith("/meshcat/exo")
    }


@pytest.mark.parametrize("name", ["serial-y-x-z", "3rps-passive-ball", "spring-support", "nesm"])
def test_a_device_is_drawn_where_its_offset_has_it(name):
    exo = ep.load(URDF / f"{name}.urdf").worn_by(MAN)
    shift, rest = np.array([0.004, -0.003, 0.005]), exo.pose()
    here, there = exo.view(human=False), exo.view(human=False)
    here.show(rest, limits="none")
    there.show(rest, centre_offset=shift, limits="none")
    one, two = drawn(here), drawn(there)
    assert one.keys() == two.keys()
    moved = {path for path in one if np.allclose(two[path][:3, 3] - one[path][:3, 3], shift, atol=1e-9)}
    # The whole device moves at rest, and the arm's own shapes stay in the shoulder.
    assert len(moved) > 3
    assert all("arm" in path or "shoulder" in path for path in one.keys() - moved), one.keys() - moved
    assert not notes(there)


def notes(scene):
    return [note["text"] for note in panel(scene, "numbers")["notes"] if "drawn as if" in note["text"]]


@pytest.mark.parametrize("name", ["serial-y-x-z", "3rps-passive-ball", "spring-support"])
def test_a_displaced_device_is_drawn_in_the_configuration_of_its_answer(name):
    """Harness and cuff apart; a device that cannot follow is drawn as it is, and the panel says so."""
    exo = ep.load(URDF / f"{name}.urdf").worn_by(MAN)
    base = np.array([0.004, -0.003, 0.005])
    pose, offset = exo.pose(30.0, 20.0, 5.0), ep.CentreOffset(base, 2.0 * base)
    answer, scene = exo.reaction(pose, centre_offset=offset, limits="none"), exo.view(human=False)
    scene.show(pose, centre_offset=offset, limits="none")
    follows = answer.status != "out_of_reach"
    assert follows == (name != "serial-y-x-z")
    assert bool(notes(scene)) == (not follows)
    if not follows:
        return
    # The tree hangs on the arm; that its loops close on the displaced torso is what makes the configuration.
    q, plain, found = answer.source.poses.placed.q[0], exo.view(human=False), drawn(scene)
    plain.show(pose, limits="none")
    here, there = (exo.chain.placements(each) for each in (exo.configurations(pose), q))
    for path, at in drawn(plain).items():
        link = path.rsplit("/", 1)[-1].rsplit("_", 1)[0]
        if link in here and link != exo.chain.roles.arm and "/visuals/" in path:
            expected = there[link].homogeneous @ np.linalg.inv(here[link].homogeneous) @ at
            np.testing.assert_allclose(found[path][:3, 3], expected[:3, 3] + pose.apply(2.0 * base), atol=1e-9)
