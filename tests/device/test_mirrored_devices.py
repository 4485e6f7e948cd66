"""Devices on the other shoulder: the same coordinates, efforts and verdicts, and mirrored forces, at every question."""

import numpy as np
import pytest
from arm_alone import arm_alone
from places import URDF

import exo_pin as ep
from exo_pin.device import ChainDevice, Drive, LinearSpring, Route, SoftLink, Spring, TableLaw

#: Bent elbow and a load in the hand: the arm has moments of inertia of every kind.
MAN = ep.Wearer(1.755, 85.0, "male", elbow_flexion=np.radians(70.0), payload=1.5)
DEVICES = ("serial-y-x-z", "nesm", "spherical-3rrr", "3rps-passive-ball", "six-cables", "spring-support", "prototype",
           "prototype-shoulder")  # fmt: skip
#: The mirror image in the x-z plane; moments are pseudovectors.
MIRROR = np.diag([1.0, -1.0, 1.0])
WRENCH_MIRROR = np.diag([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
ANGLES = np.array([[0.0, 60.0, 30.0, 80.0, 20.0], [0.0, 20.0, 60.0, 10.0, 80.0], [0.0, 10.0, 20.0, -20.0, 10.0]])
MOTION = ep.Motion([1.0, 2.0, 0.5], [3.0, -2.0, 1.0])
LOAD = ep.Load((3.0, 2.0, -10.0), moment=(0.2, 0.1, -0.3), at=(0.05, 0.02, -0.3), frame="arm")
OFFSET = ep.CentreOffset([0.004, 0.003, -0.005], [0.002, -0.003, 0.001])
COUPLED = np.diag([3e3, 3.5e3, 2e3, 12.0, 12.0, 5.0])
COUPLED[0, 1] = COUPLED[1, 0] = 400.0
COUPLED[0, 4] = COUPLED[4, 0] = 30.0
COUPLED[1, 3] = COUPLED[3, 1] = -20.0
COUPLED[3, 5] = COUPLED[5, 3] = 1.5


def image_of(question):
    """The same question about the mirror image: moments and turns are pseudovectors."""
    found = dict(question)
    if "motion" in found:
        found["motion"] = ep.Motion(-MOTION.angular_velocity @ MIRROR, -MOTION.angular_acceleration @ MIRROR)
    if "load" in found:
        found["load"] = ep.Load(LOAD.force @ MIRROR, moment=-LOAD.moment @ MIRROR, at=LOAD.at @ MIRROR, frame="arm")
    if "centre_offset" in found:
        found["centre_offset"] = ep.CentreOffset(OFFSET.base @ MIRROR, OFFSET.cuff @ MIRROR)
    return found


def assert_image(exo, image, digits=1e-9, angles=ANGLES, **question):
    """Answers of a device and of its mirror image; returns them."""
    one = exo.reaction(exo.pose(*angles), **question)
    two = image.reaction(image.pose(*angles), **image_of(question))
    scale = digits * max(1.0, *(np.nanmax(np.abs(a), initial=0.0) for a in (one.shoulder_force, one.limb_wrenches)))
    assert one.status.tolist() == two.status.tolist()
    assert one.can_hold.tolist() == two.can_hold.tolist()
    np.testing.assert_allclose(one.shoulder_force @ MIRROR, two.shoulder_force, atol=scale)
    np.testing.assert_allclose(one.magnitude, two.magnitude, atol=scale)
    drives = [not name.startswith("wearer") for name, _ in one.drive_units]
    np.testing.assert_allclose(one.actuator_forces[:, drives], two.actuator_forces[:, drives], atol=scale)
    for name in ("cuff_wrench", "harness_wrench"):
        np.testing.assert_allclose(getattr(one, name) @ WRENCH_MIRROR, getattr(two, name), atol=scale, err_msg=name)
    np.testing.assert_allclose(one.source.poses.lengths[:, drives], two.source.poses.lengths[:, drives], atol=digits)
    return one, two


@pytest.fixture(scope="module", params=DEVICES)
def pair(request):
    """A shipped robot on the left shoulder and on the right one, worn by the same man."""
    path = URDF / f"{request.param}.urdf"
    return tuple(ep.load(path, side=side).worn_by(MAN) for side in ("left", "right"))


@pytest.mark.parametrize("question", [{}, {"motion": MOTION, "load": LOAD}, {"split": "minimal", "limits": "none"}],
                         ids=["rest", "moving", "minimal"])  # fmt: skip
def test_a_robot_is_worn_on_either_side(pair, question):
    left, right = pair
    assert (left.side, right.side, right.mirrored().side) == ("left", "right", "left")
    one, _ = assert_image(left, right, **question)
    assert one.has_answer.any()
    # Twice is the device itself.
    back = right.mirrored().reaction(left.pose(*ANGLES), **question)
    np.testing.assert_allclose(
        back.shoulder_force, one.shoulder_force, atol=1e-12 * np.nanmax(np.abs(one.limb_wrenches))
    )


def test_a_misplaced_centre_is_mirrored(pair):
    assert_image(*pair, centre_offset=OFFSET, digits=1e-8)


@pytest.mark.parametrize(
    "name",
    ["serial-y-x-z", *(pytest.param(name, marks=pytest.mark.full) for name in ("spherical-3rrr", "3rps-passive-ball"))],
)
def test_what_gives_way_is_mirrored(name):
    """Cuff, harness and shoulder with coupled stiffness, on both sides, off their centre."""
    cuff, harness = ep.Interface(COUPLED, (0.01, 0.02, -0.19)), ep.Interface(3.0 * COUPLED, (0.0, 0.1, 0.05))
    stiff = np.array([[2e4, 3e3, 1e3], [3e3, 3e4, 2e3], [1e3, 2e3, 4e4]])
    exo = ep.load(URDF / f"{name}.urdf").worn_by(MAN)
    soft = exo.replace(interfaces=ep.Interfaces(harness=harness, cuff=cuff), shoulder=ep.Shoulder(stiffness=stiff))
    # Newton's method stops at 1e-9 of the load.
    question = {"split": "elastic", "centre_offset": OFFSET}
    one, two = assert_image(soft, soft.mirrored(), digits=1e-6, angles=ANGLES[:, 1:3], **question)
    assert one.has_answer.any()
    np.testing.assert_allclose(one.load_share, two.load_share, atol=2e-3)


@pytest.mark.full
def test_a_soft_link_is_mirrored():
    exo = ep.load(URDF / "serial-y-x-z.urdf").worn_by(MAN)
    soft = exo.replace(
        soft_links=[SoftLink("link_1", ep.Interface(COUPLED, (0.1, 0.02, 0.0)))],
        interfaces=ep.Interfaces(cuff=ep.Interface(COUPLED, (0.0, 0.0, -0.19))),
    )
    right = soft.mirrored()
    one, _ = assert_image(soft, right, digits=1e-6, angles=ANGLES[:, 1:2], split="elastic")
    assert one.has_answer.all()
    rigid = exo.replace(interfaces=soft.device.interfaces).reaction(exo.pose(*ANGLES[:, 1:2]), split="elastic")
    assert np.abs(rigid.shoulder_force - one.shoulder_force).max() > 1e-3
    assert right.device.soft_links[0].spring.at.tolist() == [0.1, -0.02, 0.0]


def generated(seed):
    """An arm on cables over via points with ranges, a strut with a table, and a spring that goes slack."""
    rng = np.random.default_rng(seed)

    def way(low, count):
        """From the torso, over points of torso and arm, to the arm."""
        torso = rng.uniform([-0.2, 0.0, 0.0], [0.2, 0.3, 0.3], (count, 3))
        arm = rng.uniform([-0.1, -0.05, -0.3], [0.1, 0.1, low], (count, 3))
        return Route.over(*(("universe", at) for at in torso), *(("arm", at) for at in arm[::-1]))

    drives = [
        Drive(f"cable_{i}", route=way(-0.15, 1 + i % 2), lower=0.0, upper=400.0, least=0.05, greatest=1.2)
        for i in range(5)
    ]
    springs = [
        Spring("strut", TableLaw((0.02, 0.3, 0.6, 1.0), (5.0, 20.0, 18.0, 40.0)), route=way(-0.1, 1)),
        Spring("cord", LinearSpring(200.0, 0.3, only_pulls=True), route=way(-0.1, 2)),
    ]
    arm = ep.Arm.of_wearer(MAN)
    return ep.ShoulderExo.from_device(ChainDevice(arm_alone(), drives, springs, arm=arm, name=f"generated-{seed}"))


@pytest.mark.parametrize("seed", range(12))
def test_generated_cables_and_springs_are_mirrored(seed):
    exo = generated(seed)
    one, two = assert_image(exo, exo.mirrored(), motion=MOTION, load=LOAD)
    assert one.has_answer.any()
    names = [spring.route.points[0].point[1] for spring in two.source.poses.mechanism.springs]
    assert (np.array(names) < 0.0).all()


@pytest.mark.parametrize("name", ["appendix-d-wrist", "dummy-shoulder"])
def test_robots_without_forces_are_mirrored_too(name, tmp_path):
    right = ep.load(URDF / f"{name}.urdf", side="right")
    assert right.side == "right"
    again = ep.load(right.export(tmp_path / "other.urdf")[0])
    assert (again.side, again.mirrored().side) == ("right", "left")
    q = np.zeros(right.chain.model.nq) + right.chain.neutral()
    for frame, place in ep.load(URDF / f"{name}.urdf").chain.placements(q).items():
        np.testing.assert_allclose(right.chain.placement(q, frame).translation, place.translation @ MIRROR, atol=1e-12)
