"""Maps by free bodies, and with limits in every form that a question may give them."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from wrists import random_mechanism, regular_poses

import exo_pin as ep

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


def forms_of_limits(exo):
    """Limits as a question may give them, and devices of which less is known."""
    bare, stroke = exo.replace(limbs=(ep.Limb("SPS"),) * 4), ep.Stroke(1.0, 0.1, 0.28, 0.0)
    yield from ((exo, limits) for limits in ("none", "design", "pull", (-10.0, 50.0), [Winch()] * 4))
    yield from ((bare, limits) for limits in ("design", "pull", (-10.0, 50.0), (2.0, 50.0), [Winch()] * 4))
    long = bare.replace(limbs=(ep.Limb("SPS", stroke=stroke), *bare.limbs[1:]))
    yield from ((long, limits) for limits in ("design", "none", "pull"))
    points = (exo.geometry.base_points[:3], exo.geometry.platform_points[:3])
    three = ep.ShoulderExo(ep.WristGeometry(*points), exo.arm, limbs=exo.limbs[:3])
    yield from ((three, limits) for limits in ("design", (-100.0, 5.0)))


@pytest.mark.parametrize("split", ["spherical", "minimal"])
def test_limits_of_every_form_hold_the_same_poses_as_an_answer(split):
    exo, seen = ep.load("four-cables"), set()
    poses, load = (
        exo.pose(*np.random.default_rng(4).uniform(0.0, 80.0, (2, 12))),
        ep.Load([0, 0, -60.0], at=[0, 0, -0.3]),
    )
    for device, limits in forms_of_limits(exo):
        mapped = device.reaction_map(poses, None, load, limits=limits, split=split, chunk=5)
        answer = device.reaction(poses, None, load, limits=limits, split=split)
        np.testing.assert_array_equal(mapped.status, answer.status)
        for name in ("unknown", "can_hold", "held", "has_answer"):
            np.testing.assert_array_equal(getattr(mapped, name), getattr(answer, name))
        np.testing.assert_allclose(mapped.magnitude, answer.magnitude, rtol=1e-6, atol=1e-6)
        for keep in (["status", "margin"], "magnitude"):
            some = device.reaction_map(poses, None, load, limits=limits, split=split, keep=keep)
            assert some.actuator_forces is some.shoulder_force is None
            if keep == "magnitude":
                np.testing.assert_array_equal(some.magnitude, mapped.magnitude)
                assert some.status_codes is some.unknown is some.margin is None
            else:
                np.testing.assert_array_equal(some.status, mapped.status)
                np.testing.assert_array_equal(some.unknown, mapped.unknown)
        seen |= set(answer.status)
    assert {"ok", "infeasible", "beyond_limits", "out_of_stroke"} <= seen


@pytest.mark.parametrize("n", [4, 7])
@pytest.mark.parametrize("share", [0.0, 1e-12, 1e-11, 5e-11, -1e-11, 1e-6])
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
    for split in ("spherical", "minimal"):
        assert (only.reaction(poses[0], split=split).status == "infeasible") == (share > 1e-9)
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
