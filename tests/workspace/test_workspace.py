"""Criteria of a workspace by hand, shares of the volume by Monte Carlo, limits, bodies and the mirror image."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from places import URDF
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import InvalidInput, MissingData
from exo_pin.device import ChainDevice, Route, Spring, TableLaw
from exo_pin.load_case import ADL_BOX
from exo_pin.workspace import CRITERIA, Criteria, task_reach
from exo_pin.wrist import BodyShape

REST = Rotation.identity()


def toy(**limb):
    """Three limbs along the axes x, y and z at rest, each 0.1 m from O: every figure is known by hand."""
    base = [[0.0, 0.1, 0.3], [0.3, 0.0, 0.1], [0.1, 0.3, 0.0]]
    platform = [[0.0, 0.1, -0.2], [-0.2, 0.0, 0.1], [0.1, -0.2, 0.0]]
    arm = ep.Arm(2.0, [0.0, 0.0, -0.25], np.diag([0.1, 0.1, 0.01]))
    return ep.ShoulderExo(ep.WristGeometry(base, platform), arm=arm, limbs=[ep.Limb("SPS", **limb)] * 3, name="toy")


LINEAR = ep.Actuator("linear", pull_limit=100.0, push_limit=80.0)


def test_stroke_by_hand():
    exo = toy(stroke=ep.Stroke(0.4, 0.75, 1.0, 0.12))
    found = exo.workspace(REST, ["stroke"])  # 0.5 m long, between 0.42 and 0.52 m
    assert float(found.margins["stroke"]) == pytest.approx(0.02)
    assert found.inside.all()
    too_long = toy(stroke=ep.Stroke(0.4, 0.75, 1.0, 0.05)).workspace(REST, ["stroke"])
    assert float(too_long.margins["stroke"]) == pytest.approx(-0.05)
    assert str(too_long.reasons) == "stroke"


def test_singularity_and_side_of_rest_by_hand():
    exo = toy()
    found = exo.workspace(REST, ["singularity"])
    # The planes O A_i B_i stand across one another.
    assert abs(float(found.margin)) == pytest.approx(1.0)
    assert float(found.margins["singularity"]) == pytest.approx(0.95)
    # Rest is on the positive side of its own criterion, whatever the sign of det X.
    mirror = exo.mirrored().workspace(REST, ["singularity"])
    assert float(mirror.margins["singularity"]) == pytest.approx(0.95)


def test_forces_by_hand():
    exo = toy(actuator=LINEAR)
    found = exo.workspace(REST, ["forces"])
    # The arm hangs: nothing to hold, and each limb pushes with 80 N at 0.1 m.
    assert float(found.margins["forces"]) == pytest.approx(8.0)
    np.testing.assert_allclose(found.shoulder_force, [0.0, 0.0, 2.0 * 9.81], atol=1e-12)
    loaded = exo.workspace(REST, ["forces"], load=ep.Load([0.0, 0.0, 0.0], moment=[5.0, 0.0, 0.0]))
    assert np.abs(loaded.tensions).max() == pytest.approx(50.0)
    assert float(loaded.margins["forces"]) == pytest.approx(min(8.0 - 5.0, 10.0 - 5.0, 8.0), abs=2.1)
    assert not exo.workspace(REST, ["forces"], load=ep.Load([0, 0, 0], moment=[0.0, 11.0, 0.0])).inside.any()


def test_shoulder_force_by_hand():
    exo = toy(actuator=LINEAR)
    for limit in (19.0, 20.0):
        found = exo.workspace(REST, Criteria(names=("shoulder_force",), largest_shoulder_force=limit))
        assert float(found.margins["shoulder_force"]) == pytest.approx(limit - 19.62)
        assert bool(found.inside) == (limit > 19.62)


def test_shoulder_range_is_the_diamond_of_the_record():
    exo = ep.load("prototype")
    poses = Rotation.random(300, rng=np.random.default_rng(0))
    for each in (exo, exo.mirrored()):
        found = each.workspace(poses, ["shoulder_range"])
        # Of the two triples of angles of one orientation the better one counts.
        _, abduction, axial = np.degrees(ep.shoulder_angles(poses, each.side)).T
        first, second = abs(abduction - 90.0) + abs(axial), abs(90.0 - abduction) + 180.0 - abs(axial)
        np.testing.assert_array_equal(found.inside, np.minimum(first, second) < 95.0)
    centre = exo.workspace(exo.pose(0.0, 60.0, 20.0), ["shoulder_range"])
    assert np.degrees(float(centre.margins["shoulder_range"])) == pytest.approx(95.0 - 30.0 - 20.0)
    # At 90° of abduction an axial turn is one of flexion as well: of all triples the best one counts.
    level = exo.pose(0.0, 90.0, [0.0, 40.0, 120.0])
    level = exo.workspace(Rotation.from_quat(level.as_quat().round(7)), ["shoulder_range"])
    np.testing.assert_allclose(np.degrees(level.margins["shoulder_range"]), 95.0, atol=1e-4)


def test_joint_angles_count_from_the_straight_direction():
    exo = ep.load("prototype")
    state = exo.inverse_kinematics(REST)
    limbs = []
    for i, limb in enumerate(exo.limbs):
        straight = exo.geometry.base_frames[i].T @ state.directions[i]
        limbs.append(replace(limb, joint_straight=tuple(straight)))
    with pytest.raises(MissingData, match="straight direction"):
        exo.workspace(REST, ["joint_angles"])
    # One direction serves both ends: none is left at the base, and the angles of the platform's joint count from it.
    found = exo.replace(limbs=limbs).workspace(REST, ["joint_angles"])
    sums = []
    for i, limb in enumerate(limbs):
        turn = Rotation.align_vectors([limb.joint_straight], [[0.0, 0.0, 1.0]])[0]
        there = turn.inv().apply(-exo.geometry.platform_frames[i].T @ state.directions[i])
        sums.append(
            np.abs(np.arctan2(-there[1], np.hypot(there[0], there[2]))) + np.abs(np.arctan2(there[0], there[2]))
        )
    assert float(found.margins["joint_angles"]) == pytest.approx(np.radians(95.0) - max(sums))
    lifted = ep.shoulder_rotation([0, 40, -20], [30, 60, 10], [0, 20, -30], degrees=True)
    left = exo.replace(limbs=limbs)
    image = Rotation.from_quat(lifted.as_quat() * [-1.0, 1.0, -1.0, 1.0])
    margins = [each.workspace(poses, ["joint_angles"]).margins["joint_angles"] for each, poses in
               ((left, lifted), (left.mirrored(), image))]  # fmt: skip
    np.testing.assert_allclose(*margins, atol=1e-12)
    straight = [replace(limb, joint_straight=(0.0, 0.0, 1.0)) for limb in exo.limbs]
    plain = exo.replace(limbs=straight).workspace(REST, ["joint_angles"])
    # Erratum 26: at rest |θx| + |θy| is 120 to 149° at the base.
    assert np.degrees(float(plain.margins["joint_angles"])) < 95.0 - 148.0


def test_body_scales_and_mirrors():
    small, large = BodyShape.of(ep.Wearer(1.5, 75, "male")), BodyShape.of(ep.Wearer(1.8, 75, "male"))
    # Heights of the trunk are shares of stature; of two men of one mass the taller one is the more slender.
    np.testing.assert_allclose(large.torso[:5, [2, 5]], 1.2 * small.torso[:5, [2, 5]])
    assert (large.torso[:4, 6] < small.torso[:4, 6]).all()
    right = BodyShape.of(ep.Wearer(1.5, 75, "male"), side="right")
    np.testing.assert_allclose(right.torso[:, [1, 4]], -small.torso[:, [1, 4]])
    bent = ep.Wearer(1.8, 75, "male", elbow_flexion=90, degrees=True)
    # The arm's lengths are those of its mass: from the elbow's centre to the third knuckle.
    assert BodyShape.of(bent).arm[1, 3] == pytest.approx((268.9 + 86.2) / 1741 * 1.8)
    assert BodyShape.of(bent).arm[1, 2] == pytest.approx(-281.7 / 1741 * 1.8)
    tip = bent.segments()[2][1] / np.linalg.norm(bent.segments()[2][1] - BodyShape.of(bent).arm[1, :3])
    assert tip[0] > 0.0
    with pytest.raises(InvalidInput, match=r"1\.75 m"):
        BodyShape.of(ep.Wearer(175, 75, "male"))


def test_a_body_of_several_postures_and_persons_is_the_union():
    small, tall = ep.Wearer(1.52, 50, "female"), ep.Wearer(1.87, 102, "male")
    exo = ep.load("four-linear-actuators")
    poses = exo.pose(*np.random.default_rng(5).uniform([[0], [0], [-60]], [[110], [90], [60]], (3, 60)))
    both = exo.workspace(poses, Criteria(wearers=(small, tall), elbow_range=(0.0, 2.0)))
    each = []
    for person in (small, tall):
        for bend in np.linspace(0.0, 2.0, 13):
            worn = exo.worn_by(replace(person, elbow_flexion=bend))
            each.append(worn.workspace(poses))
    gaps = np.min([one.gaps for one in each], axis=0)
    np.testing.assert_allclose(both.gaps, gaps, atol=1e-12)
    # Forces are checked in postures at most 45° apart, which are some of these.
    assert (both.magnitude <= np.max([one.magnitude for one in each], axis=0) + 1e-9).all()
    held = [
        exo.worn_by(replace(p, elbow_flexion=b)).workspace(poses) for p in (small, tall) for b in (0, 2 / 3, 4 / 3, 2)
    ]
    np.testing.assert_allclose(both.magnitude, np.max([one.magnitude for one in held], axis=0), rtol=1e-9)
    np.testing.assert_allclose(
        both.margins["forces"], np.min([one.margins["forces"] for one in held], axis=0), rtol=1e-9
    )
    assert "a person of 1.52 m and 50 kg (female) and by a person of 1.87 m and 102 kg" in str(both)
    assert "from 0 to 115°" in str(both)
    with pytest.raises(MissingData, match="who wears it"):
        ep.load("prototype").replace(arm=ep.Arm(3.0, [0, 0, -0.3])).workspace(poses, Criteria(elbow_range=(0.0, 1.0)))
    for wrong in ((1.0, 0.0), (0.0, 130.0), 3):
        with pytest.raises(InvalidInput, match="elbow_range"):
            Criteria(elbow_range=wrong)
        with pytest.raises(InvalidInput, match="elbow_range"):
            ep.BodyShape.of(ep.Wearer(1.75, 75, "male"), elbow_range=wrong)
    with pytest.raises(InvalidInput, match="wearers"):
        Criteria(wearers=("1.75,75,male",))


@pytest.mark.parametrize("name", ["four-cables", "three-linear-actuators"])
def test_share_of_the_volume_against_monte_carlo(name):
    exo, rng = ep.load(name), np.random.default_rng(11)
    found = exo.workspace(ADL_BOX.poses(5.0), ["forces", "stroke"])
    # Uniform on the group: the sine of abduction is uniform, beyond 90° on the other branch.
    (f0, f1), (a0, a1), (i0, i1) = ADL_BOX.intervals
    low, high = np.sin(np.radians(a0)), 2.0 - np.sin(np.radians(a1))
    sine = rng.uniform(low, high, 40_000)
    bent = np.degrees(np.arcsin(np.minimum(sine, 2.0 - sine)))
    abduction = np.where(sine > 1.0, 180.0 - bent, bent)
    poses = exo.pose(rng.uniform(f0, f1, len(sine)), abduction, rng.uniform(i0, i1, len(sine)))
    inside = exo.workspace(poses, ["forces", "stroke"]).inside
    noise = 3.0 * np.sqrt(inside.var() / len(inside))
    assert abs(found.volume_share - inside.mean()) <= found.volume_share.error + noise
    assert found.volume_share.error < 0.03


@pytest.mark.parametrize(
    ("narrow", "wide"),
    [
        ({"least_margin": 0.5}, {"least_margin": 0.05}),
        ({"largest_shoulder_force": 60.0}, {"largest_shoulder_force": 200.0}),
        ({"least_tension": 30.0}, {"least_tension": 0.0}),
        ({"least_moment": 3.0}, {"least_moment": 0.0}),
        ({"least_gap": 0.02}, {"least_gap": 0.0}),
    ],
)
def test_wider_limits_never_shrink_the_workspace(narrow, wide):
    exo = cable_design()
    body = BodyShape.of(ep.Wearer(1.75, 75, "male"))
    inside = [
        exo.workspace(16.0, Criteria(**{"largest_shoulder_force": 300.0, "body": body, **limits})).inside
        for limits in (narrow, wide)
    ]
    assert inside[0].sum() < inside[1].sum()
    assert not (inside[0] & ~inside[1]).any()


def cable_design():
    """Four cables of a design found by a search, joints rounded to centimetres."""
    base = np.array([[8, -22, 8], [-5, 14, 20], [-7, -7, -21], [5, 5, 24]]) / 100.0
    platform = np.array([[8, 6, -11], [-13, 6, -23], [-13, 6, -27], [13, -5, -28]]) / 100.0
    limb = ep.Limb("SPS", actuator=ep.Actuator("cable", pull_limit=400.0))
    arm = ep.Arm.from_anthropometry(1.75, 75, sex="male")
    return ep.ShoulderExo(ep.WristGeometry(base, platform), arm=arm, limbs=[limb] * 4)


def test_right_shoulder_is_the_mirror_image():
    exo = cable_design()
    limits = {"largest_shoulder_force": 150.0, "names": ("singularity", "forces", "shoulder_force", "clearance")}
    left = exo.workspace(20.0, Criteria(body=BodyShape.of(ep.Wearer(1.75, 75, "male")), **limits))
    right = exo.mirrored().workspace(20.0, Criteria(body=BodyShape.of(ep.Wearer(1.75, 75, "male"), "right"), **limits))
    for name, margin in left.margins.items():
        np.testing.assert_allclose(right.margins[name], margin, rtol=1e-6, atol=1e-9)


MAN = ep.Wearer(1.755, 85.0, "male")


@pytest.fixture(scope="module")
def serial():
    return ep.load(URDF / "serial-y-x-z.urdf").worn_by(MAN)


def test_the_same_wrist_has_the_same_held_poses_both_ways():
    exo = ep.load("four-linear-actuators-worn")
    device = ChainDevice.from_chain(exo.chain).replace(arm=exo.arm)
    limits = [d.__class__(d.name, d.joint, pulls=True, lower=-600.0, upper=600.0, least=d.least, greatest=d.greatest)
              for d in device.drives]  # fmt: skip
    poses = exo.pose(*np.meshgrid([0.0, 30.0, 60.0, 90.0], [0.0, 40.0]))
    names = ep.Criteria(("stroke", "forces"))
    one, other = (
        exo.workspace(poses, names),
        ep.ShoulderExo.from_device(device.replace(drives=limits)).workspace(poses, names),
    )
    np.testing.assert_array_equal(one.inside, other.inside)
    np.testing.assert_allclose(other.margins["forces"], one.margins["forces"], rtol=1e-6)
    np.testing.assert_allclose(other.shoulder_force, one.shoulder_force, atol=1e-5)


NAN = np.nan
LIMITS = Criteria(
    least_margin=0.1, least_moment=2.0, largest_shoulder_force=50.0, largest_pull_out=30.0, largest_cuff_pull=20.0,
    largest_cuff_slip=0.01, least_moment_without_limb=1.5, least_gap=0.004,
)  # fmt: skip


@pytest.mark.parametrize(
    ("name", "values", "expected"),
    [
        ("joint_angles", {"bend": [0.2, -0.1]}, [0.2, -0.1]),
        ("singularity", {"margin": [0.5, -0.05]}, [0.4, -0.15]),
        ("connected", {"connection": [0.3, -np.inf]}, [0.2, -np.inf]),
        ("forces", {"moment": [5.0, 1.0, NAN]}, [3.0, -1.0, NAN]),
        ("shoulder_force", {"shoulder_size": [50.0, 60.0, NAN]}, [0.0, -10.0, NAN]),
        ("socket", {"pull_out": [-100.0, 40.0]}, [130.0, -10.0]),
        ("cuff_pull", {"cuff_pull": [5.0, 25.0]}, [15.0, -5.0]),
        ("cuff_slip", {"cuff_slip": [0.002, 0.02]}, [0.008, -0.01]),
        ("limb_loss", {"moment_without_limb": [4.0, 1.0]}, [2.5, -0.5]),
        ("clearance", {"gaps": [[0.01, 0.02, 0.03], [0.5, 0.001, 0.2], [0.5, 0.4, 0.0]]}, [0.006, -0.003, -0.004]),
        ("shoulder_range", {"shoulder_range": lambda: np.array([0.3])}, [0.3]),
    ],
)
def test_margins_by_hand(name, values, expected):
    at = {key: np.array(value) if isinstance(value, list) else value for key, value in values.items()}
    found = CRITERIA[name].margin(SimpleNamespace(criteria=LIMITS, **at))
    np.testing.assert_allclose(found, expected, atol=1e-15)


LOW, HIGH = 0.285, 0.5
WAY = Route.over(("universe", (0.0, 0.0, -0.4)), ("arm", (0.0, 0.0, -0.2)))


@pytest.fixture(scope="module")
def exo():
    serial = ep.load(URDF / "serial-y-x-z.urdf")
    return serial.replace(springs=[Spring("strut", TableLaw((LOW, HIGH), (-30.0, -10.0)), route=WAY)])


def test_the_margin_is_the_distance_to_the_nearer_end(exo):
    """By the distance of the strut's ends in each pose, over the length of the table."""
    rng = np.random.default_rng(3)
    poses = exo.pose(*rng.uniform([0.0, 0.0, -30.0], [150.0, 80.0, 60.0], (40, 3)).T)
    found = exo.workspace(poses, ["evaluated", "singularity", "forces"])
    size = np.linalg.norm(poses.apply([0.0, 0.0, -0.2]) - [0.0, 0.0, -0.4], axis=1)
    expected = np.minimum(size - LOW, HIGH - size) / (HIGH - LOW)
    assert 0.2 < (expected >= 0.0).mean() < 0.9
    np.testing.assert_allclose(found.margins["evaluated"], expected, atol=1e-9)
    assert found.fractions["evaluated"] == (expected >= 0.0).mean()
    np.testing.assert_array_equal(found.not_evaluated, expected < 0.0)
    assert found.summary()["not_evaluated"] == (expected < 0.0).mean()
    # Kinematics are those without the spring; of forces nothing is known.
    bare = exo.replace(springs=[]).workspace(poses, ["singularity", "forces"])
    np.testing.assert_array_equal(found.margins["singularity"], bare.margins["singularity"])
    np.testing.assert_array_equal(np.isnan(found.margins["forces"]), found.not_evaluated)
    assert np.isnan(found.magnitude[found.not_evaluated]).all()
    assert not found.unknown.any()
    assert f"{100.0 * (expected < 0.0).mean():.1f} % are not evaluated: a spring has no data there" in str(found)


def test_rates_of_a_movement_are_how_fast_limbs_become_shorter():
    """By differences of the lengths; power is what a tension gives where its limb becomes shorter."""
    exo = ep.load("four-linear-actuators")
    times = np.linspace(0.0, 2.0, 41)
    movement = ep.Movement.from_samples(times, exo.pose(50.0 * np.sin(0.8 * times) ** 2, 30.0), smoothing=None)
    table = task_reach(exo.mechanism, {"lift": movement}, (), ["singularity", "forces"])
    speed = -np.gradient(exo.inverse_kinematics(movement.poses).lengths, times, axis=0)
    power = speed * exo.workspace(movement.poses, ["singularity", "forces"]).tensions
    assert table["fastest_limb_m_s"][0] == pytest.approx(np.abs(speed).max(), rel=0.01)
    assert table["largest_power_W"][0] == pytest.approx(power.max(), rel=0.01)


def test_poses_that_two_hinges_do_not_have_are_said_to_be_no_fault_of_a_limit(serial):
    chain = serial.device.chain
    held = chain.locked(["internal_rotation"], chain.reference_configuration())
    two = ep.ShoulderExo.from_device(ep.device.ChainDevice.from_chain(held)).worn_by(MAN)
    own, others = two.pose([20, 40], [0, 10]), two.pose([20, 40], [0, 10], [30, 40])
    assert two.workspace(own, ["singularity"]).index == 1.0
    assert "goes to none" not in str(two.workspace(own, ["singularity"]))
    for criteria in (["singularity"], ["singularity", "stroke"]):
        found = two.workspace(others, criteria)
        assert found.index == 0.0
        assert "One that turns the arm about fewer than three axes goes to none of a grid" in str(found).replace(
            "\n", " "
        )
