"""The map over many poses against the query pose by pose, against free bodies, and against the way it is cut up."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from guided_limbs import guided
from scipy.spatial.transform import Rotation
from some_muscles import LAWS
from wrists import random_mechanism, regular_poses

import exo_pin as ep
from exo_pin.muscle import save_parameters

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


#: Bounds on the side forces of a stack of shape (3, 4) of four limbs, N, which vary along its last axis.
BOUNDS = np.array([[1.0], [5.0], [20.0], [60.0]]) * np.linspace(0.5, 1.0, 4)


@pytest.mark.parametrize("split", ["minimal", "spherical", "elastic"])
@pytest.mark.parametrize("varied", ["case", "offset", "limits"])
def test_every_pose_has_its_own_arguments(split, varied):
    """Poses that are chosen anew within limits keep their own load, motion, bounds, limits and centre."""
    exo, rng = guided(ep.load("four-cables").replace(limbs=[ep.Limb("UPU")] * 4)), np.random.default_rng(22)
    poses = exo.pose(*rng.uniform(0.0, 80.0, (2, 3, 4)))
    options = {
        "motion": ep.Motion(*rng.uniform(-1.0, 1.0, (2, 3, 4, 3))),
        "load": ep.Load(*rng.uniform(-9.0, 9.0, (2, 3, 4, 3)), at=rng.uniform(-0.3, 0.3, (3, 4, 3)), frame="arm"),
        "limits": rng.uniform(25.0, 60.0, (2, 3, 4, 4)) * [[[[-1.0]]], [[[1.0]]]] if varied == "limits" else 40.0,
    }
    if varied == "offset":
        options["centre_offset"] = ep.CentreOffset(*rng.uniform(-5e-3, 5e-3, (2, 3, 4, 3)))
    if split == "minimal":
        options["constraint_bounds"] = (-BOUNDS, rng.uniform(1.0, 2.0, (3, 1, 4)) * BOUNDS)
        options["weights"] = ep.Weights(tension=0.01) if varied == "offset" else None
    mapped, answer = (
        exo.reaction_map(poses, split=split, chunk=5, **options),
        exo.reaction(poses, split=split, **options),
    )
    assert 0 < answer.held.sum() < answer.held.size
    for name in ("status", "unknown"):
        np.testing.assert_array_equal(getattr(mapped, name), getattr(answer, name))
    for name in ("shoulder_force", "actuator_forces", "constraint_forces"):
        np.testing.assert_allclose(getattr(mapped, name), getattr(answer, name), atol=1e-4)
    if split == "minimal":
        lower, upper = options["constraint_bounds"]
        g = mapped.constraint_forces[mapped.held]
        assert (np.broadcast_to(lower, answer.constraint_forces.shape)[mapped.held] - 1e-6 <= g).all()
        assert (g <= np.broadcast_to(upper, answer.constraint_forces.shape)[mapped.held] + 1e-6).all()


@pytest.mark.parametrize("name", ["three-linear-actuators", "four-cables"])
@pytest.mark.parametrize("limits", ["design", "none", "pull", 30.0, (0.0, 90.0), [0.0, 90.0]])
@pytest.mark.parametrize("law", ["sold", "sheet"])
def test_muscles_whose_law_is_no_polynomial(tmp_path, name, limits, law):
    exo, rng = ep.load(name), np.random.default_rng(4)
    poses, rest = exo.pose(*rng.uniform(10.0, 50.0, (2, 40))), exo.inverse_kinematics(exo.pose(30, 30)).lengths
    save_parameters(replace(LAWS[law], nominal_length=None), tmp_path / "law.toml")
    muscle = ep.Actuator("pneumatic muscle", force_law=(tmp_path / "law.toml").read_text(), supply_pressure=3e5)
    strokes = [ep.Stroke(0.2, 0.75, 1.0, float(length) - 0.18) for length in rest]
    exo = exo.replace(limbs=[ep.Limb("SPS", stroke=stroke, actuator=muscle) for stroke in strokes])
    mapped, answer = exo.reaction_map(poses, limits=limits, chunk=7), exo.reaction(poses, limits=limits)
    assert limits == "none" or len(set(mapped.status)) > 1
    for key in ("status", "unknown"):
        np.testing.assert_array_equal(getattr(mapped, key), getattr(answer, key))
    np.testing.assert_allclose(mapped.shoulder_force, answer.shoulder_force, atol=1e-6)


def test_whether_zero_is_trivial_does_not_depend_on_how_limits_are_written():
    exo = ep.load("four-cables")
    exo = exo.replace(limbs=[replace(limb, kind="UPU") for limb in exo.limbs])
    # The last one is out of stroke, so that nothing is chosen in it.
    poses, column = exo.pose([0.0, 30.0, 150.0], 20.0), np.zeros((3, 1))
    spelled = ["design", 50.0, (0.0, 50.0), [0.0, 50.0], np.array([0.0, 50.0]), ([0.0] * 4, [50.0] * 4), (column, 50.0)]
    for limits in spelled:
        assert exo.reaction_map(poses, split="minimal", limits=limits).trivial
        assert not exo.reaction_map(poses, split="minimal", limits=limits, constraint_bounds=9.0).trivial


@pytest.mark.full
@pytest.mark.parametrize("split", ["spherical", "minimal"])
def test_memory_beside_the_answer_does_not_grow(split):
    exo = ep.load("prototype")
    # A load that is the same for every pose, and bounds that are, must not be spread out either.
    question = {"split": split, "load": ep.Load([0, 0, -5.0]), "keep": ("magnitude", "status"), "chunk": 4096}
    if split == "minimal":
        question["constraint_bounds"] = (-5.0, np.array([4.0, 5, 6]))
    exo.reaction_map(Rotation.random(10, 0), **question)
    poses = Rotation.random(300_000, np.random.default_rng(80))
    tracemalloc.start()
    try:
        own = exo.reaction_map(poses, **question)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    # Blocks of 4096 poses, with forces and limits, are some twenty arrays of 98 kB; all quaternions would be 9.6 MB.
    assert peak - own.magnitude.nbytes - own.status_codes.nbytes - own.unknown.nbytes < 2.5e6


def test_progress_is_shown_only_when_asked_for(capsys):
    exo, poses = ep.load("prototype"), Rotation.random(1000, np.random.default_rng(81))
    exo.reaction_map(poses, chunk=100)
    assert capsys.readouterr() == ("", "")
    exo.reaction_map(poses, chunk=100, threads=2, progress=True)
    out, err = capsys.readouterr()
    assert out == ""
    assert "reaction map" in err


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
