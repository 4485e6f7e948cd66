"""The map over many poses against the query pose by pose, against free bodies, and against the way it is cut up."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from wrists import random_mechanism, regular_poses

import exo_pin as ep

DEGREES = {"degrees": True}


MECHANISMS = {
    "prototype": lambda: ep.load("prototype").replace(limbs=None).mechanism,
    "worn-right": lambda: (
        ep.load("prototype", side="right")
        .worn_by(ep.Arm.from_anthropometry(1.75, 75, "male"))
        .replace(limbs=None)
        .mechanism
    ),
    "random-3-mixed": lambda: random_mechanism(np.random.default_rng(71), 3, ["SPS", "UPU", "SPS"]),
    "random-3-cables": lambda: random_mechanism(np.random.default_rng(72), 3, ["SPS"] * 3),
    "random-4": lambda: random_mechanism(np.random.default_rng(73), 4),
    "random-5": lambda: random_mechanism(np.random.default_rng(74), 5, ["UPU", "SPS", "UPU", "SPS", "UPU"]),
}


def exo_of(name):
    return ep.ShoulderExo.from_mechanism(MECHANISMS[name]())


def questions(mechanism, rng, count):
    """Splits with their bounds: none, infinite, two-sided, one-sided, equal, a stack of them, by actuator."""
    n = mechanism.limb_count
    yield "spherical", None
    if mechanism.is_upu.sum() >= 3:
        yield "standalone", None
    yield "minimal", None
    yield "minimal", (-np.inf, np.inf)
    yield "minimal", (-5.0, 8.0)
    yield "minimal", (np.full(n, -np.inf), np.linspace(0.5, 3, n))
    yield "minimal", (2.0, 2.0)
    yield "minimal", (-20 * rng.random((count, n)), 20 * rng.random((count, n)))
    if n == 3:
        yield "minimal", "actuator"


@pytest.mark.parametrize("name", MECHANISMS)
def test_map_equals_the_query(name):
    exo, rng = exo_of(name), np.random.default_rng(75)
    count = 40
    poses = regular_poses(exo.mechanism, rng, count)
    vectors = rng.normal(size=(5, count, 3))
    moving = ep.Motion(3 * vectors[0], vectors[1])
    terms = [(None, None), (moving, ep.Load(10 * vectors[2], vectors[3], 0.1 * vectors[4], "arm"))]
    for split, bounds in questions(exo.mechanism, rng, count):
        for motion, load in terms:
            own = exo.reaction_map(poses, motion, load, split, bounds)
            other = exo.reaction(poses, motion, load, split, bounds, limits="none")
            assert (own.status == other.equilibrium_status).all()
            assert own.trivial == other.trivial
            size = np.abs(other.actuator_forces).max(axis=1) + np.abs(other.constraint_forces).max(axis=1) + 10
            np.testing.assert_allclose(
                (own.shoulder_force - other.shoulder_force) / size[:, None], 0, atol=1e-9, err_msg=f"{split} {bounds}"
            )
            np.testing.assert_allclose((own.magnitude - other.magnitude) / size, 0, atol=1e-9)
            np.testing.assert_allclose(own.margin, other.margin, rtol=1e-12)
            # With more open forces than directions ProxQP fixes which of the least ones it is to about 1e-9 only.
            loose = split == "minimal" and bounds is not None and len(exo.limbs) > 3
            for mine, theirs in (
                (own.actuator_forces, other.actuator_forces),
                (own.constraint_forces, other.constraint_forces),
            ):
                np.testing.assert_allclose((mine - theirs) / size[:, None], 0, atol=1e-6 if loose else 1e-9)


def test_singular_and_folded_rows_spoil_no_other():
    exo = ep.load("prototype").replace(limbs=None)
    geometry = exo.geometry
    folded, _ = Rotation.align_vectors(geometry.base_points[:1].copy(), geometry.platform_points[:1].copy())
    good = ep.thesis_rotation(40, -20, -30, **DEGREES)
    singular = ep.thesis_rotation(90, 0, 0, **DEGREES)
    near = ep.shoulder_rotation(0, 6.2089, 0, **DEGREES)
    poses = Rotation.concatenate([good, singular, folded, near, good])
    for split, bounds in (("spherical", None), ("standalone", None), ("minimal", (-5.0, 5.0))):
        own = exo.reaction_map(poses, split=split, constraint_bounds=bounds)
        assert own.status.tolist() == ["ok", "singular", "folded", "near_singular", "ok"]
        assert own.has_answer.tolist() == [True, False, False, True, True]
        for array in (own.shoulder_force, own.actuator_forces, own.constraint_forces, own.magnitude):
            assert np.isnan(array[1:3]).all()
            assert np.isfinite(array[[0, 3, 4]]).all()
            np.testing.assert_array_equal(array[0], array[4])
        assert (own.status == exo.reaction(poses, split="spherical").equilibrium_status).all()


def same(a, b):
    for name in ("shoulder_force", "actuator_forces", "constraint_forces", "status_codes", "margin", "magnitude"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))


@pytest.mark.parametrize("name", ["prototype", "random-5"])
@pytest.mark.parametrize("split", ["spherical", "standalone", "minimal"])
def test_threads_and_chunks_do_not_change_a_bit(name, split):
    exo, rng = exo_of(name), np.random.default_rng(77)
    count, n = 5003, len(exo.limbs)
    poses = Rotation.random(count, rng)
    motion = ep.Motion(rng.normal(size=(count, 3)), rng.normal(size=3))
    question = {"motion": motion, "load": ep.Load(rng.normal(size=(count, 3)), at=[0, 0, -0.3]), "split": split}
    if split == "minimal":
        question["constraint_bounds"] = (-10 * rng.random((count, n)), 10.0)
    whole = exo.reaction_map(poses, **question, chunk=10**6)
    for threads, chunk in ((1, 100), (2, 1000), (3, 64), (2, 4999)):
        same(whole, exo.reaction_map(poses, **question, threads=threads, chunk=chunk))
    # A pose alone is the same as in a stack.
    k = 4711
    alone = question | {
        "motion": ep.Motion(motion.angular_velocity[k], motion.angular_acceleration),
        "load": ep.Load(question["load"].force[k], at=[0, 0, -0.3]),
    }
    if split == "minimal":
        alone["constraint_bounds"] = (question["constraint_bounds"][0][k], 10.0)
    np.testing.assert_array_equal(exo.reaction_map(poses[k], **alone).shoulder_force, whole.shoulder_force[k])


def test_stacks_of_any_shape_broadcast_their_terms():
    exo = ep.load("prototype")
    poses = ep.shoulder_rotation(np.linspace(0, 60, 4)[:, None], np.linspace(10, 50, 3), 0, **DEGREES)
    rng = np.random.default_rng(78)
    load = ep.Load(rng.normal(size=(4, 1, 3)), moment=rng.normal(size=(3, 3)))
    bounds = (-10 * rng.random((3, 3)), 10 * rng.random((4, 1, 1)))
    own = exo.reaction_map(poses, None, load, "minimal", bounds, chunk=5, limits="none")
    other = exo.reaction(poses, None, load, "minimal", bounds, limits="none")
    assert own.shoulder_force.shape == (4, 3, 3)
    assert own.status.shape == own.magnitude.shape == (4, 3)
    np.testing.assert_allclose(own.shoulder_force, other.shoulder_force, atol=1e-8)
    np.testing.assert_allclose(own.constraint_forces, other.constraint_forces, atol=1e-7)
    assert exo.reaction_map(poses[:0]).shoulder_force.shape == (0, 3, 3)
    single = exo.reaction_map(poses[0][0])
    assert single.shoulder_force.shape == (3,)
    assert single.magnitude.shape == ()


@pytest.mark.parametrize("split", ["standalone", "minimal"])
@pytest.mark.parametrize("kinds", [["SPS"] * 6, ["UPU"] + ["SPS"] * 4])
def test_cables_that_carry_the_arm_alone(kinds, split):
    """Enough limb forces are six, whatever kind of limb they come from."""
    mechanism = random_mechanism(np.random.default_rng(71), len(kinds), kinds)
    poses = regular_poses(mechanism, np.random.default_rng(72), 20, margin=0.05)
    exo = ep.ShoulderExo.from_mechanism(mechanism)
    series, query = exo.reaction_map(poses, split=split), exo.reaction(poses, split=split)
    assert (series.status == query.status).all()
    assert series.trivial == query.trivial == (split == "minimal")
    np.testing.assert_allclose(series.shoulder_force, 0, atol=1e-7)
    if split == "standalone":
        np.testing.assert_allclose(series.actuator_forces, query.actuator_forces, rtol=1e-6, atol=1e-6)


def test_questions_without_a_closed_form_have_the_same_answers():
    rng = np.random.default_rng(5)
    exo = ep.load("four-cables")
    poses = exo.pose(rng.uniform(0, 80, 12), rng.uniform(0, 60, 12))
    heavy = exo.replace(
        limbs=[replace(limb, base_body=ep.LimbBody.rod(0.3, 0.1, 0.01)) for limb in exo.mechanism.limbs]
    )
    quick = exo.replace(
        limbs=[replace(limb, actuator=replace(limb.actuator, speed_limit=0.2)) for limb in exo.mechanism.limbs]
    )
    motion = ep.Motion(rng.normal(size=(12, 3)), np.zeros((12, 3)))
    person = ep.Person(1.75, 75, "male")
    for device, question in (
        (heavy, {}),
        (heavy, {"motion": motion}),
        (quick, {"motion": motion}),
        (exo, {"centre_offset": [0.005, 0.0, 0.002]}),
        (exo, {"cone": person.glenoid_cone()}),
        (exo, {"split": "minimal", "weights": ep.Weights(tension=0.01)}),
        (exo.replace(shoulder=ep.Shoulder(stiffness=2e4)), {"split": "elastic", "limits": "none"}),
    ):
        found, single = device.reaction_map(poses, **question), device.reaction(poses, **question)
        np.testing.assert_array_equal(found.status, single.status)
        np.testing.assert_array_equal(found.unknown, single.unknown)
        np.testing.assert_array_equal(found.shoulder_force, single.shoulder_force)
        assert found.held.any() or "cone" in question
    kept = heavy.reaction_map(poses, keep="magnitude")
    assert kept.status_codes is None
    np.testing.assert_array_equal(kept.magnitude, heavy.reaction(poses).magnitude)


class Pull:
    """An actuator given for the question, which only pulls."""

    def force_limits(self, length):
        return np.zeros_like(length), np.full_like(length, 200.0)


@pytest.mark.parametrize("limits", [(-1e3, 150.0), "pull", [Pull()] * 4])
def test_side_forces_within_tensions(limits):
    """Numbers narrow the limits of the design and keep their sign; actuators bring one of their own."""
    cable = ep.load("four-cables").mechanism.limbs[0].actuator
    exo = ep.load("four-cables").worn_by(ep.Person(1.75, 75, "male")).replace(limbs=(ep.Limb(actuator=cable),) * 4)
    assert exo.mechanism.is_upu.all()
    poses = ep.shoulder_rotation([20, 60, 90], [10, 30, 60], 0, **DEGREES)
    question = {"split": "minimal", "limits": limits, "constraint_bounds": "actuator"}
    answer, mapped = exo.reaction(poses, **question), exo.reaction_map(poses, **question)
    assert answer.held.any()
    np.testing.assert_array_equal(mapped.status, answer.status)
    np.testing.assert_allclose(mapped.magnitude, answer.magnitude, rtol=1e-7, atol=1e-9)


def test_what_is_unknown_of_singular_and_of_slack_poses():
    exo = ep.load("prototype").worn_by(ep.Person(1.75, 75, "male"))
    poses = ep.shoulder_rotation([0, 60], [90, 30], 0, **DEGREES)
    for limits in ("none", "design"):
        answer, mapped = exo.reaction(poses, limits=limits), exo.reaction_map(poses, limits=limits)
        assert answer.status.tolist()[0] == "singular"
        np.testing.assert_array_equal(mapped.unknown, answer.unknown)
        assert not answer.unknown[0]


@pytest.mark.parametrize("n", [4, 7])
@pytest.mark.parametrize("estimated", [False, True])
def test_limits_that_are_the_same_in_all_poses(n, estimated):
    """Strokes that cut, forces that cut, estimates and limits that are not known: checked in compiled code."""
    mechanism = random_mechanism(np.random.default_rng(75 + n), n, ["SPS"] * n)
    poses = Rotation.random(300, 76)
    lengths = ep.ShoulderExo.from_mechanism(mechanism).inverse_kinematics(poses).lengths
    limbs = []
    for i in range(n):
        low, high = np.quantile(lengths[:, i], [0.04, 0.97])
        stroke = ep.Stroke(1.0, float(low), float(high), 0.0)
        pull = None if i == 1 else 60.0 + 20.0 * i
        limbs.append(ep.Limb("SPS", actuator=ep.Actuator("linear", pull, 5.0 * i), stroke=stroke))
    marks = {"limbs[0].stroke.travel": "a guess"} if estimated else {}
    exo = ep.ShoulderExo.from_mechanism(replace(mechanism, limbs=tuple(limbs), estimated=tuple(marks)))
    answer, mapped = exo.reaction(poses), exo.reaction_map(poses, chunk=128)
    assert {"ok", "infeasible", "out_of_stroke"} <= set(answer.status)
    assert answer.unknown.any()
    for name in ("status", "unknown", "can_hold"):
        np.testing.assert_array_equal(getattr(mapped, name), getattr(answer, name))
    size = np.abs(answer.limb_wrenches[..., :3]).max(axis=(-1, -2))
    good = answer.has_answer
    assert (np.abs(mapped.shoulder_force - answer.shoulder_force).max(axis=1)[good] <= 1e-8 * size[good]).all()


@pytest.mark.parametrize("changes", [{}, {"supply_pressure": 9e5}, {"least_tension": 20.0}, {"pull_limit": 40.0},
                                     {"force_law": "fitted-chou-hannaford"}])  # fmt: skip
def test_laws_of_muscles_limit_a_map_as_they_limit_an_answer(changes):
    exo = ep.load("prototype")
    low, high = np.array([limb.length_range for limb in exo.limbs]).T
    exo = exo.replace(limbs=[replace(limb, actuator=replace(limb.actuator, **changes)) for limb in exo.limbs])
    poses = Rotation.random(100_000, np.random.default_rng(7))
    lengths = exo.inverse_kinematics(poses).lengths
    poses = poses[((lengths > low - 0.003) & (lengths < high + 0.003)).all(axis=1)][:300]
    for question in ({}, {"split": "standalone"}, {"limits": "pull"}):
        found, answer = exo.reaction_map(poses, **question), exo.reaction(poses, **question)
        np.testing.assert_array_equal(found.status, answer.status)
        np.testing.assert_array_equal(found.unknown, answer.unknown)
        assert {"out_of_stroke", "beyond_limits"} <= set(found.status)
    assert changes or "ok" in found.status
