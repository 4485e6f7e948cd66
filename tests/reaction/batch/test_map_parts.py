"""Parts of a map: three limbs by free bodies, questions with a closed form, and limits that the kernels take."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from wrists import random_mechanism, regular_poses

import exo_pin as ep
from exo_pin.load_case import Case
from exo_pin.reaction.answer import QUERY_STATUS
from exo_pin.reaction.assumptions import Assumptions
from exo_pin.reaction.batch.map_blocks import PoseBlocks, TermBlocks
from exo_pin.reaction.batch.map_limits import MapLimits
from exo_pin.reaction.batch.map_without_kernels import fields_of, has_closed_form
from exo_pin.reaction.batch.reaction_maps import ReactionMap
from exo_pin.reaction.splits.minimal import Minimal
from exo_pin.reaction.splits.spherical import Spherical

COUNT = 70  # more than one block of poses


def free_body(mechanism, R, motion, load):
    """Per pose: directions s, normals X and b x s as columns, force and moment that limbs and shoulder hold."""
    a, arm = np.array(mechanism.geometry.base_points), mechanism.arm
    for k in range(len(R)):
        b = np.array(mechanism.geometry.platform_points) @ R[k].T
        s = (b - a) / np.linalg.norm(b - a, axis=1)[:, None]
        X = -np.cross(a, b) / np.linalg.norm(np.cross(a, b), axis=1)[:, None]
        c, inertia = R[k] @ arm.centre_of_mass, R[k] @ arm.inertia_about_origin @ R[k].T
        weight = arm.mass * np.array(mechanism.gravity)
        force, moment = weight.copy(), np.cross(c, weight)
        if motion is not None:
            w, e = motion.angular_velocity[k], motion.angular_acceleration[k]
            force -= arm.mass * (np.cross(e, c) + np.cross(w, np.cross(w, c)))
            moment -= inertia @ e + np.cross(w, inertia @ w)
        if load is not None:
            turn = R[k] if load.frame == "arm" else np.eye(3)
            push = turn @ load.force[k]
            force += push
            moment += turn @ load.moment[k] + np.cross(R[k] @ load.at[k], push)
        yield s.T, X.T, np.cross(b, s).T, force, moment


@pytest.mark.parametrize("split", ["spherical", "standalone"])
@pytest.mark.parametrize("terms", ["rest", "motion", "base", "arm"])
def test_maps_of_three_limbs_are_free_bodies(split, terms):
    rng = np.random.default_rng(len(terms) + len(split))
    mechanism = random_mechanism(rng, 3)
    poses = Rotation.random(COUNT, rng=rng)
    motion = ep.Motion(*rng.normal(size=(2, COUNT, 3))) if terms == "motion" else None
    load = None
    if terms in ("base", "arm"):
        load = ep.Load(*(10.0 * rng.normal(size=(2, COUNT, 3))), at=rng.normal(size=(COUNT, 3)), frame=terms)
    found = ep.ShoulderExo.from_mechanism(mechanism).reaction_map(poses, motion, load, split, limits="none")
    assert (found.status != "ok").sum() < COUNT // 2
    R = poses.as_matrix()
    for k, (s, X, arms, force, moment) in enumerate(free_body(mechanism, R, motion, load)):
        values = np.linalg.svd(arms, compute_uv=False) ** 2
        assert found.margin[k] == pytest.approx(3.0 / np.sqrt(values.sum() * (1.0 / values).sum()), rel=1e-6, abs=1e-9)
        if not found.has_answer[k]:
            assert np.isnan(found.actuator_forces[k]).all()
            continue
        f = np.linalg.solve(arms, moment)
        scale = np.abs(f).max()
        np.testing.assert_allclose(found.actuator_forces[k], f, atol=1e-8 * scale)
        held = s @ f - force
        if split == "spherical":
            np.testing.assert_array_equal(found.constraint_forces[k], 0.0)
            assert not np.signbit(found.constraint_forces[k]).any()  # tables have no "-0"
            np.testing.assert_allclose(found.shoulder_force[k], held, atol=1e-8 * scale)
        else:
            g = np.linalg.solve(X, -held)
            np.testing.assert_allclose(found.constraint_forces[k], g, atol=1e-7 * max(scale, np.abs(g).max()))
            np.testing.assert_array_equal(found.shoulder_force[k], 0.0)
            assert not np.signbit(found.shoulder_force[k]).any()
        assert found.magnitude[k] == pytest.approx(np.linalg.norm(found.shoulder_force[k]), rel=1e-12)


class Winch:
    """A given actuator that only pulls."""

    def force_limits(self, length):
        return np.zeros_like(length), np.full_like(length, 200.0)


def test_which_questions_have_a_closed_form():
    exo = ep.load("four-cables")
    pose = exo.pose(30.0)
    mechanism, at_rest, plain = exo.mechanism, Case(pose), Assumptions()
    moving = Case(pose, ep.Motion(np.ones(3), np.ones(3)))
    assert has_closed_form(mechanism, at_rest, plain)
    assert has_closed_form(mechanism, moving, plain)
    light = mechanism.replace(
        limbs=tuple(replace(limb, base_body=ep.LimbBody.rod(0.01, 0.1, 0.01)) for limb in mechanism.limbs)
    )
    assert not has_closed_form(light, at_rest, plain)
    one = mechanism.replace(limbs=(*mechanism.limbs[:3], light.limbs[3]))
    assert not has_closed_form(one, at_rest, plain)
    for limit in ("speed_limit", "power_limit"):
        slow = mechanism.replace(limbs=tuple(
            replace(limb, actuator=replace(limb.actuator, **{limit: 0.2})) for limb in mechanism.limbs
        ))  # fmt: skip
        assert has_closed_form(slow, at_rest, plain)
        assert not has_closed_form(slow, moving, plain)
    given, bounds = [Winch()] * 4, {"split": "minimal", "constraint_bounds": "actuator"}
    assert has_closed_form(mechanism, at_rest, Assumptions(limits=given))
    assert has_closed_form(mechanism, at_rest, Assumptions(**bounds))
    assert not has_closed_form(mechanism, at_rest, Assumptions(limits=given, **bounds))
    assert not has_closed_form(mechanism, Case(pose, centre_offset=[0.001, 0.0, 0.0]), plain)
    facing = ep.glenoid_orientation(35, 0, -10, retroversion=5, inclination=8, degrees=True)
    assert not has_closed_form(mechanism, at_rest, Assumptions(cone=ep.GlenoidCone(orientation=facing)))
    assert not has_closed_form(mechanism, at_rest, Assumptions("minimal", weights=ep.Weights(tension=1.0)))
    assert has_closed_form(mechanism, at_rest, Assumptions("minimal"))
    assert not has_closed_form(mechanism, at_rest, Assumptions("elastic"))


def test_fields_of_an_answer_in_a_map():
    exo = ep.load("four-cables")
    answer = exo.reaction(exo.pose([30.0, 60.0]), load=ep.Load(np.zeros(3), [[0.0] * 3, [900.0, 0.0, 0.0]]))
    some = fields_of(answer, ["status", "margin"])
    assert some["status_codes"].tolist() == [QUERY_STATUS.index("ok"), QUERY_STATUS.index("infeasible")]
    assert some["status_codes"].dtype == np.int8
    np.testing.assert_array_equal(some["unknown"], answer.unknown)
    assert some["margin"] is answer.margin
    names = ("shoulder_force", "actuator_forces", "constraint_forces", "magnitude")
    assert all(some[name] is None for name in names)
    other = fields_of(answer, names)
    assert other["status_codes"] is other["unknown"] is other["margin"] is None
    assert other["actuator_forces"] is answer.actuator_forces
    assert (other["split"], other["trivial"]) == (answer.split, answer.trivial)


def test_what_limits_of_a_map_bind():
    """Limits that are the same in all poses go to the kernels, others are looked up pose by pose."""
    exo = ep.load("four-cables").mechanism
    bare = exo.replace(limbs=(ep.Limb("SPS"),) * 4)
    law, least, shape = Spherical(), Minimal(), (2, 3)

    def told(limits, mechanism=exo, split=law):
        own = MapLimits(limits, mechanism, shape, split)
        return own.bind, own.one_signed, own.choose, own.forces[0].shape

    assert told("none") == (False, False, False, (0, 4))
    assert told("design") == (True, True, False, (1, 4))
    assert told("pull") == (True, True, False, (1, 4))
    assert told("design", bare) == (False, False, False, (0, 4))
    assert told("pull", bare) == (True, True, False, (1, 4))
    # Another split chooses pose by pose, unless equilibrium determines the tensions.
    assert told("design", split=least) == (True, True, True, (0, 4))
    three = exo.replace(
        limbs=exo.limbs[:3],
        geometry=ep.WristGeometry(exo.geometry.base_points[:3], exo.geometry.platform_points[:3]),
    )
    assert told("design", three, least) == (True, True, False, (1, 3))
    assert told((-10.0, 50.0)) == (True, True, True, (0, 4))
    assert told((-10.0, 50.0), bare) == (True, False, True, (0, 4))
    assert told((2.0, 50.0), bare) == (True, True, True, (0, 4))
    assert told([Winch()] * 4, bare) == (True, False, True, (0, 4))
    # Strokes alone bind, too.
    stroke = ep.Stroke(1.0, 0.1, 0.9, 0.0)
    long = bare.replace(limbs=(ep.Limb("SPS", stroke=stroke), *bare.limbs[1:]))
    assert told("design", long) == (True, False, False, (1, 4))
    assert told("none", long)[0] is False
    low, high = MapLimits("design", exo, shape, law).forces
    np.testing.assert_array_equal(low[0], [limb.effort_range[0] for limb in exo.limbs])
    np.testing.assert_array_equal(high[0], [limb.effort_range[1] for limb in exo.limbs])


@pytest.mark.parametrize("n", [4, 7])
@pytest.mark.parametrize("share", [0.0, 1e-12, 1e-11, -1e-11])
def test_tensions_that_limits_leave_no_choice(n, share):
    """Least and greatest tension are the same: where they balance the arm, to rounding, they hold it."""
    rng = np.random.default_rng(n)
    exo = ep.ShoulderExo.from_mechanism(random_mechanism(rng, n, ["SPS"] * n))
    poses = regular_poses(exo.mechanism, rng, 4, margin=0.1)
    f = exo.reaction(poses[0]).actuator_forces
    rods = [ep.Actuator("linear", max(float(one), 0.0), -min(float(one), 0.0)) for one in f * (1.0 - share)]
    only = exo.replace(limbs=[ep.Limb("SPS", actuator=rod) for rod in rods])
    mapped, answer = only.reaction_map(poses), only.reaction(poses)
    assert (answer.status[1:] == "infeasible").all()
    np.testing.assert_array_equal(mapped.status, answer.status)
    np.testing.assert_array_equal(mapped.unknown, answer.unknown)
    np.testing.assert_allclose(mapped.actuator_forces, answer.actuator_forces, atol=1e-7)
    np.testing.assert_allclose(mapped.shoulder_force, answer.shoulder_force, atol=1e-7)


@pytest.mark.parametrize(
    ("n", "split", "bounds"),
    [(4, "spherical", None), (7, "spherical", None), (4, "minimal", 5.0), (3, "minimal", (-1.0, 4.0)),
     (3, "minimal", "actuator"), (4, "standalone", None), (3, "minimal", None), (5, "minimal", None)],
)  # fmt: skip
def test_maps_of_any_limbs_balance_and_say_what_is_trivial(n, split, bounds):
    rng = np.random.default_rng(n)
    mechanism = random_mechanism(rng, n)
    poses, load = Rotation.random(5, rng=rng), ep.Load(*(10.0 * rng.normal(size=(2, 5, 3))), at=rng.normal(size=(5, 3)))
    exo = ep.ShoulderExo.from_mechanism(mechanism)
    found = exo.reaction_map(poses, None, load, split, bounds, limits="none")
    answer = exo.reaction(poses, None, load, split, bounds, limits="none")
    assert found.unknown.all()
    rows = np.flatnonzero(found.has_answer)
    assert rows.size >= 3
    for k, (s, X, arms, force, moment) in enumerate(free_body(mechanism, poses.as_matrix(), None, load)):
        if k not in rows:
            continue
        f, g, scale = found.actuator_forces[k], found.constraint_forces[k], np.abs(found.actuator_forces[k]).max()
        np.testing.assert_allclose(arms @ f, moment, atol=1e-9 * scale)
        np.testing.assert_allclose(found.shoulder_force[k], s @ f + X @ g - force, atol=1e-9 * scale)
        assert found.magnitude[k] == pytest.approx(np.linalg.norm(found.shoulder_force[k]), rel=1e-9)
        assert found.magnitude[k] == pytest.approx(answer.magnitude[k], rel=1e-6, abs=1e-6 * scale)
    assert found.trivial == answer.trivial == (split == "minimal" and bounds is None)


def test_tensions_alone_make_a_least_force_trivial_from_six_limbs_on():
    rng = np.random.default_rng(9)
    for kinds, trivial in (
        (["SPS"] * 6, True), (["SPS"] * 5, False), (["UPU"] + ["SPS"] * 4, True), (["UPU", "UPU"] + ["SPS"] * 2, True),
        (["UPU", "UPU", "SPS"], False), (["UPU"] * 3, True), (["UPU"] + ["SPS"] * 3, False),
    ):  # fmt: skip
        exo = ep.ShoulderExo.from_mechanism(random_mechanism(rng, len(kinds), kinds))
        pose = Rotation.random(rng=rng)
        assert exo.reaction_map(pose, split="minimal", limits="none").trivial == trivial
        # Side forces within bounds do not count.
        bounded = exo.reaction_map(pose, split="minimal", constraint_bounds=5.0, limits="none")
        assert bounded.trivial == (trivial and kinds == ["SPS"] * 6)


def test_blocks_of_poses_and_of_terms():
    poses = Rotation.random(6, rng=np.random.default_rng(1))
    grid = Rotation.from_quat(poses.as_quat().reshape(2, 3, 4))
    for stack in (poses, grid):
        blocks = PoseBlocks(stack)
        assert (blocks.shape, blocks.count) == (stack.shape, 6)
        np.testing.assert_allclose(blocks.block(2, 5), poses.as_quat()[2:5], atol=1e-15)
    single = PoseBlocks(poses[0])
    assert (single.shape, single.count) == ((), 1)
    np.testing.assert_array_equal(single.block(0, 1), poses.as_quat()[:1])
    mechanism = random_mechanism(np.random.default_rng(2), 3)
    heavy = mechanism.replace(arm=ep.Arm(2.0, [0.0, 0.1, -0.2]))
    terms = TermBlocks(heavy, None, None, (6,)).block(1, 4)
    assert (terms.mass, terms.moving, terms.loaded, terms.in_arm) == (2.0, False, False, False)
    np.testing.assert_array_equal(terms.inertia, np.zeros((3, 3)))
    np.testing.assert_array_equal(terms.centre, [[0.0, 0.1, -0.2]])
    motion = ep.Motion(np.arange(18.0).reshape(6, 3), np.ones(3))
    for moving, missing in ((None, "weight"), (motion, "motion")):
        with pytest.raises(ep.MissingData, match=missing):
            TermBlocks(mechanism.replace(arm=None), moving, None, (6,))
    with pytest.raises(ep.MissingData, match="inertia"):
        TermBlocks(heavy, motion, None, (6,))
    load = ep.Load([1.0, 2.0, 3.0], np.zeros(3), at=0.1 * np.arange(18.0).reshape(6, 3), frame="arm")
    terms = TermBlocks(mechanism, motion, load, (6,)).block(1, 4)
    assert (terms.moving, terms.loaded, terms.in_arm) == (True, True, True)
    np.testing.assert_array_equal(terms.velocity, motion.angular_velocity[1:4])
    np.testing.assert_array_equal(terms.acceleration, [[1.0] * 3])
    np.testing.assert_array_equal(terms.at, load.at[1:4])
    np.testing.assert_array_equal(terms.force, [[1.0, 2.0, 3.0]])
    np.testing.assert_allclose(terms.inertia, mechanism.arm.inertia_about_origin)
    assert not TermBlocks(mechanism, None, ep.Load(np.ones(3)), (6,)).block(0, 1).in_arm


def test_a_map_knows_what_it_holds():
    names = ("ok", "near_singular", "singular", "folded", "not_solved", "infeasible", "out_of_stroke", "beyond_limits")
    codes = np.array([QUERY_STATUS.index(name) for name in names], dtype=np.int8)
    unknown = np.array([False, True, *[False] * 6])
    found = ReactionMap(None, None, None, codes, unknown, None, None, "spherical")
    assert found.status.tolist() == list(names)
    assert found.has_answer.tolist() == [True, True, False, False, False, True, True, True]
    assert found.held.tolist() == [True, True, *[False] * 6]
    assert found.can_hold.tolist() == [True, *[False] * 7]
