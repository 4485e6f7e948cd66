"""How sure |F_s| is: against dense sampling, against derivatives, and against the question asked by hand."""

import json
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


def worst(exo, pose, millimetres, split="spherical"):
    asked = OFFSET_ALONE | {"offset_mm": millimetres}
    if split != "elastic":
        asked = {
            name: size for name, size in asked.items() if name not in ("shoulder_stiffness_percent", "guides_percent")
        }
    asked.pop("load_percent")
    return exo.uncertainty(pose, split=split, uncertainties=asked)


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
    found = worst(exo, pose, 3.0)
    sampled = exo.reaction(again(pose, 500), centre_offset=in_ball(np.random.default_rng(53), 500, 0.003))
    assert 0.95 * found.worst_offset.magnitude <= sampled.magnitude.max()
    assert sampled.magnitude.max() <= found.worst_offset.magnitude * (1 + 1e-6)
    assert found.worst_offset.holds or not sampled.held.all()


@pytest.mark.full
def test_every_quantity_against_the_question_by_hand(exo):
    load = ep.Load([3.0, -5.0, -20.0], at=[0.0, 0.0, -0.3])
    certain = dict.fromkeys(("offset_mm", "pose_deg", "A[2]_mm", "B_mm"), 0.0)
    found = exo.uncertainty(LIFTED, None, load, "elastic", uncertainties=certain | {"cuff_height_mm": 5.0})
    effects = {effect.name: effect for effect in found.effects}
    assert effects.keys() == {
        "mass_percent", "centre_of_mass_mm", "load_percent", "shoulder_stiffness_percent", "guides_percent",
        "cuff_height_mm", "A[1]_mm", "A[3]_mm",
    }  # fmt: skip

    def asked(device, load=load):
        return float(device.reaction(LIFTED, None, load, "elastic").magnitude)

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
    asked = {"pose_deg": 1e-3, "offset_mm": 0.0}
    found = {effect.name: effect for effect in exo.uncertainty(LIFTED, uncertainties=asked).effects}
    turns = np.radians(1e-3) * np.concatenate([np.eye(3), -np.eye(3)])
    sizes = exo.reaction(Rotation.from_rotvec(turns) * LIFTED).magnitude
    slope = np.linalg.norm(sizes[:3] - sizes[3:]) / 2.0
    effect = found["pose_deg"]
    assert effect.greatest - effect.least == pytest.approx(2.0 * slope, rel=1e-3)


def test_the_peak_of_a_movement_is_asked():
    exo = ep.load("four-linear-actuators").worn_by(PERSON)
    poses = ep.shoulder_rotation(np.linspace(0, 90, 10), 30, 0, **DEGREES)
    motion = ep.Motion(np.linspace([0.0, 0, 0], [0.1, 0.2, 0.3], 10), np.zeros(3))
    whole = exo.reaction(poses, motion)
    found = exo.uncertainty(poses, motion, uncertainties={"offset_mm": 0.0})
    assert found.magnitude == pytest.approx(whole.peak, rel=1e-12)
    assert whole.magnitude[found.at] == pytest.approx(whole.peak)
    assert found.answer.case.motion.angular_velocity.tolist() == motion.angular_velocity[found.at].tolist()


def test_lost_holds_are_named_and_answers_are_data(tmp_path):
    exo = ep.load("four-cables").worn_by(PERSON)
    tight = [replace(limb, actuator=replace(limb.actuator, pull_limit=None)) for limb in exo.limbs]
    f = exo.reaction(LIFTED).actuator_forces.max()
    tight = [replace(limb, actuator=replace(limb.actuator, pull_limit=1.001 * f)) for limb in exo.limbs]
    found = exo.replace(limbs=tight).uncertainty(LIFTED, uncertainties={"offset_mm": 0.0})
    assert found.answer.can_hold
    assert any(text.startswith("The device may not hold the pose within") for text in found.cautions)
    assert "not held throughout" in str(found)
    data = json.loads(found.to_json())
    assert data["magnitude"] == found.magnitude
    assert [effect["name"] for effect in data["effects"]] == [effect.name for effect in found.effects]
    assert data["provenance"]["design"]["name"] == "four-cables"
    assert len(found.columns()["quantity"]) == len(found.effects)
    assert len(repr(found)) < 1200


def test_bad_questions(exo):
    with pytest.raises(ep.UnknownName, match="cuff_hight_mm"):
        exo.uncertainty(LIFTED, uncertainties={"cuff_hight_mm": 1.0})
    with pytest.raises(ep.InvalidInput, match="mass_percent"):
        exo.uncertainty(LIFTED, uncertainties={"mass_percent": -1.0})
    with pytest.raises(ep.InvalidInput, match="below 100"):
        exo.uncertainty(LIFTED, uncertainties={"mass_percent": 100.0})
    with pytest.raises(ep.InvalidInput, match="nothing of the kind"):
        exo.uncertainty(LIFTED, uncertainties={"load_percent": 5.0})
    with pytest.raises(ep.InvalidInput, match="offset_mm"):
        exo.uncertainty(LIFTED, uncertainties={"offset_mm": "much"})
    with pytest.raises(ep.SolverFailed, match="singular"):
        exo.uncertainty(ep.shoulder_rotation(0, 90, 0, **DEGREES))
    with pytest.raises(ep.MissingData, match="arm"):
        ep.load("scenario-one").uncertainty(LIFTED)


def test_what_counts_as_certain_is_listed_with_its_effect():
    exo = ep.load("prototype").worn_by(PERSON)
    found = exo.uncertainty(LIFTED, uncertainties={"mass_percent": 0.0, "offset_mm": 0.0, "A_mm": 0.0, "B_mm": 0.0})
    known = {each.name: each.effects["F_s_percent"] for each in found.known}
    assert {"mass", "offset", "lean", "A[1]", "B[3]"} <= known.keys()
    # Massless limbs: the force is in proportion to the arm's mass.
    assert known["mass"] == pytest.approx(1.0, rel=1e-9)
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
