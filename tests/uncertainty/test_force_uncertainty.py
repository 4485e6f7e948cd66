"""How sure |F_s| is: against dense sampling, against derivatives, and against the question asked by hand."""

from dataclasses import replace

import numpy as np
import pytest
from guided_limbs import guided
from scipy.spatial.transform import Rotation
from wrists import random_mechanism, regular_poses

import exo_pin as ep

DEGREES = {"degrees": True}
LIFTED = ep.shoulder_rotation(60, 30, 0, **DEGREES)
PERSON = ep.Arm.from_anthropometry(1.75, 75, "male")
PERCENT = ("mass_percent", "load_percent", "shoulder_stiffness_percent", "guides_percent")
OFFSET_ALONE = dict.fromkeys(("pose_deg", "A_mm", "B_mm", "centre_of_mass_mm", *PERCENT), 0.0)


@pytest.fixture(scope="module")
def exo():
    return guided(ep.load("prototype").worn_by(PERSON), stiffness=2e4 * np.eye(3))


def again(pose, count):
    return Rotation.from_quat(np.tile(pose.as_quat(), (count, 1)))


def in_ball(rng, count, radius):
    u = rng.normal(size=(count, 3))
    return u / np.linalg.norm(u, axis=1, keepdims=True) * radius * np.cbrt(rng.random((count, 1)))


#: The device's centre as a question may state it, m.
OFF = np.array([0.002, -0.001, 0.0015])


def worst(exo, pose, millimetres, split="spherical", off=None):
    asked = OFFSET_ALONE | {"offset_mm": millimetres}
    if split != "elastic":
        asked = {
            name: size for name, size in asked.items() if name not in ("shoulder_stiffness_percent", "guides_percent")
        }
    asked.pop("load_percent")
    return exo.uncertainty(pose, split=split, uncertainties=asked, centre_offset=off)


@pytest.mark.full
@pytest.mark.parametrize(("split", "radius"), [("spherical", 15.0), ("elastic", 4.0)])
def test_no_sampled_offset_exceeds_the_worst(split, radius, exo):
    found = worst(exo, LIFTED, radius, split)
    size = 1e-3 * radius
    assert [effect.name for effect in found.effects] == ["offset_mm"]
    assert np.linalg.norm(found.worst_offset.offset) <= size * (1 + 1e-9)
    offsets = in_ball(np.random.default_rng(50), 1000, size)
    sampled = exo.reaction(again(LIFTED, 1000), split=split, centre_offset=offsets)
    assert 0.95 * found.worst_offset.magnitude <= sampled.magnitude.max()
    assert sampled.magnitude.max() <= found.worst_offset.magnitude * (1 + 1e-6)
    assert found.effects[0].least <= sampled.magnitude.min() + 0.05 * found.magnitude
    evidence = exo.reaction(LIFTED, split=split, centre_offset=found.worst_offset.offset)
    np.testing.assert_allclose(evidence.shoulder_force, found.worst_offset.shoulder_force, rtol=1e-6)
    assert found.magnitude == pytest.approx(exo.reaction(LIFTED, split=split).magnitude)


def test_a_ball_with_a_singular_configuration_has_no_worst_force(exo):
    rest = Rotation.identity()
    found = worst(exo, rest, 15.0)
    assert found.worst_offset.magnitude == found.effects[0].greatest == np.inf
    assert not found.worst_offset.holds
    assert "no bound" in str(found)
    # The evidence: on a line through it the forces grow as the inverse of the distance.
    at = found.worst_offset.offset
    along = at / np.linalg.norm(at)
    sizes = [exo.reaction(rest, centre_offset=at - d * along).magnitude for d in (1e-6, 1e-7)]
    assert 8.0 < sizes[1] / sizes[0] < 12.0
    # A ball that ends short of it has a finite answer, as the nearest of its kind must.
    short = worst(exo, rest, 0.98e3 * np.linalg.norm(at))
    assert 5 * short.magnitude < short.worst_offset.magnitude < np.inf


def test_worst_offset_of_cables_within_their_limits():
    mechanism = random_mechanism(np.random.default_rng(51), 4)
    limb = ep.Limb("SPS", actuator=ep.Actuator("cable", pull_limit=2000.0))
    exo = ep.ShoulderExo.from_mechanism(mechanism.replace(limbs=(limb,) * 4))
    poses = regular_poses(mechanism, np.random.default_rng(52), 40, margin=0.1)
    pose = poses[int(np.flatnonzero(exo.reaction(poses).held)[0])]
    found = worst(exo, pose, 3.0, off=OFF)
    assert found.magnitude == float(exo.reaction(pose, centre_offset=OFF).magnitude)
    sampled = exo.reaction(again(pose, 500), centre_offset=OFF + in_ball(np.random.default_rng(53), 500, 0.003))
    there = exo.reaction(pose, centre_offset=OFF + found.worst_offset.offset)
    np.testing.assert_allclose(there.shoulder_force, found.worst_offset.shoulder_force, rtol=1e-9)
    # No neighbour on the ball is worse.
    turns = Rotation.from_rotvec(2.0 * np.concatenate([np.eye(3), -np.eye(3)]), degrees=True)
    beside = exo.reaction(again(pose, 6), centre_offset=OFF + turns.apply(found.worst_offset.offset)).magnitude
    assert beside.max() <= found.worst_offset.magnitude * (1 + 1e-9)
    assert found.effects[0].least <= sampled.magnitude.min() * (1 + 1e-3)
    assert found.effects[0].least > 0.9 * sampled.magnitude.min()
    assert 0.95 * found.worst_offset.magnitude <= sampled.magnitude.max()
    assert sampled.magnitude.max() <= found.worst_offset.magnitude * (1 + 1e-6)
    assert found.worst_offset.holds or not sampled.held.all()


def test_every_quantity_against_the_question_by_hand(exo):
    load = ep.Load([3.0, -5.0, -20.0], [2.0, 1.0, -1.0], at=[0.0, 0.0, -0.3])
    certain = dict.fromkeys(("offset_mm", "pose_deg", "A[2]_mm", "B_mm"), 0.0)
    certain |= {"cuff_height_mm": 5.0}
    found = exo.uncertainty(LIFTED, None, load, "elastic", centre_offset=OFF, uncertainties=certain)
    effects = {effect.name: effect for effect in found.effects}
    assert effects.keys() == {
        "mass_percent", "centre_of_mass_mm", "load_percent", "shoulder_stiffness_percent", "guides_percent",
        "cuff_height_mm", "A[1]_mm", "A[3]_mm",
    }  # fmt: skip

    def asked(device, load=load):
        return float(device.reaction(LIFTED, None, load, "elastic", centre_offset=OFF).magnitude)

    assert found.magnitude == asked(exo)
    arm, shoulder, geometry = exo.arm, exo.mechanism.shoulder, exo.geometry
    heavier = [exo.replace(arm=replace(arm, mass=s * arm.mass, inertia=s * arm.inertia)) for s in (0.95, 1.05)]
    stiffer = [exo.replace(shoulder=replace(shoulder, stiffness=s * shoulder.stiffness)) for s in (0.5, 1.5)]
    loads = [ep.Load(s * load.force, s * load.moment, load.at) for s in (0.95, 1.05)]
    higher = [exo.replace(geometry=geometry.replace(h_B=geometry.circles.h_B + s)) for s in (-0.005, 0.005)]
    for name, sizes in {
        "mass_percent": [asked(device) for device in heavier],
        "shoulder_stiffness_percent": [asked(device) for device in stiffer],
        "load_percent": [asked(exo, own) for own in loads],
        "cuff_height_mm": [asked(device) for device in higher],
    }.items():
        sizes = [*sizes, found.magnitude]
        assert (effects[name].least, effects[name].greatest) == pytest.approx((min(sizes), max(sizes)), rel=1e-9)
    changes = [effect.change(found.magnitude) for effect in found.effects]
    assert changes == sorted(changes, reverse=True)


def test_a_ball_has_its_steepest_direction(exo):
    """Of a small ball the effect is that of the gradient, which differences show."""
    asked = {"pose_deg": 1e-3, "offset_mm": 1e-3, "lean_deg": 1e-3, "centre_of_mass_mm": 1e-3}
    found = {effect.name: effect for effect in exo.uncertainty(LIFTED, uncertainties=asked).effects}
    assert found.keys() == asked.keys() | {"mass_percent", *(f"{end}[{i}]_mm" for end in "AB" for i in (1, 2, 3))}
    steps = np.concatenate([np.eye(3), -np.eye(3)])
    turns, gravity, arm = Rotation.from_rotvec(1e-3 * steps, degrees=True), np.array(exo.device.gravity), exo.arm
    sizes = {
        "pose_deg": exo.reaction(turns * LIFTED).magnitude,
        "offset_mm": exo.reaction(again(LIFTED, 6), centre_offset=1e-6 * steps).magnitude,
        "lean_deg": [exo.replace(gravity=own.apply(gravity)).reaction(LIFTED).magnitude for own in turns],
        "centre_of_mass_mm": [
            exo.replace(arm=replace(arm, centre_of_mass=arm.centre_of_mass + 1e-6 * step)).reaction(LIFTED).magnitude
            for step in steps
        ],
    }
    for name, magnitudes in sizes.items():
        slope = np.linalg.norm(np.subtract(magnitudes[:3], magnitudes[3:])) / 2.0
        assert found[name].greatest - found[name].least == pytest.approx(2.0 * slope, rel=1e-3), name


def test_what_counts_as_certain_is_listed_with_its_effect():
    exo = ep.load("prototype").worn_by(PERSON)
    certain = dict.fromkeys(("mass_percent", "offset_mm", "A_mm", "B_mm", "load_percent"), 0.0)
    found = exo.uncertainty(LIFTED, uncertainties=certain)
    known = {each.name: each.effects["F_s_percent"] for each in found.known}
    assert {"mass", "offset", "lean", "A[1]", "B[3]"} <= known.keys()
    # Massless limbs: the force is in proportion to the arm's mass.
    assert known["mass"] == pytest.approx(1.0, rel=1e-9)
    assert {(each.size, each.unit) for each in found.known if each.name != "mass"} == {(1.0, "mm"), (1.0, "deg")}
    steps = 1e-3 * np.concatenate([np.eye(3), -np.eye(3)])
    sizes = exo.reaction(again(LIFTED, 6), centre_offset=steps).magnitude
    share = 50.0 * np.linalg.norm(sizes[:3] - sizes[3:]) / found.magnitude
    assert known["offset"] == pytest.approx(share, rel=1e-6)
    slope = []
    for axis in np.radians(0.5) * np.eye(3):
        leant = [
            exo.replace(gravity=Rotation.from_rotvec(sign * axis).as_matrix() @ exo.device.gravity)
            for sign in (1.0, -1.0)
        ]
        ahead, behind = (float(each.reaction(LIFTED).magnitude) for each in leant)
        slope.append(ahead - behind)
    assert known["lean"] == pytest.approx(100.0 * np.linalg.norm(slope) / found.magnitude, rel=0.05)
    assert str(found).startswith(f"{found.verdict}\n")
    assert found.verdict.startswith("Taken as known: ")
