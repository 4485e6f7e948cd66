"""Kinds and intervals of the components of an answer, against answers at the corners of the bounds."""

import itertools

import numpy as np
import pytest
import scipy
from guided_limbs import guided
from scipy.spatial.transform import Rotation
from wrists import random_mechanism, regular_poses

import exo_pin as ep
from exo_pin.reaction import Certificate

DEGREES = {"degrees": True}
LIFTED = ep.shoulder_rotation(60, 30, 0, **DEGREES)
SHAPES = ("actuator_forces", "constraint_forces", "shoulder_force")


@pytest.fixture(scope="module")
def worn():
    return ep.load("prototype").worn_by(ep.Arm.from_anthropometry(1.75, 75, "male"))


def kinds(answer):
    parts = answer.certificate.components
    return [sorted(set(getattr(parts, name).ravel().tolist())) for name in SHAPES]


def random_exo(n, upu=None, seed=60):
    upu = n if upu is None else upu
    mechanism = random_mechanism(np.random.default_rng(seed), n, ["UPU"] * upu + ["SPS"] * (n - upu))
    return ep.ShoulderExo.from_mechanism(mechanism)


@pytest.mark.parametrize(
    ("split", "offset", "expected"),
    [
        ("spherical", None, [["unique"], ["assumed"], ["assumed"]]),
        ("minimal", None, [["unique"], ["optimiser"], ["optimiser"]]),
        ("standalone", None, [["unique"], ["assumed"], ["assumed"]]),
        # Displaced, side forces have moments about the shoulder, so that tensions follow from stiffness, too.
        ("elastic_locked", [0, 0, 0.01], [["stiffness"], ["stiffness"], ["stiffness"]]),
        ("spherical", [0, 0, 0.01], [["assumed"], ["assumed"], ["assumed"]]),
        ("elastic", [0, 0, 0.01], [["stiffness"], ["stiffness"], ["stiffness"]]),
    ],
)
def test_kinds_of_three_limbs(split, offset, expected, worn):
    answer = guided(worn).reaction(LIFTED, split=split, centre_offset=offset)
    assert kinds(answer) == expected


def test_what_only_least_squares_decides():
    exo = guided(random_exo(4))
    pose = regular_poses(exo.mechanism, np.random.default_rng(61), 1, margin=0.1)[0]
    # Four tensions for three moments: stiffness across the limbs does not say how the actuators share them.
    assert kinds(exo.reaction(pose, split="elastic")) == [["optimiser"]] * 3
    assert kinds(exo.reaction(pose, split="spherical")) == [["optimiser"], ["assumed"], ["optimiser"]]
    assert "measured" in exo.reaction(pose, split="elastic").certificate.sentence()
    # Five open forces for three components of F_s: the least is reached in more than one way.
    minimal = exo.reaction(pose, split="minimal", constraint_bounds=(-50.0, 50.0))
    assert kinds(minimal)[2] == ["optimiser"]
    assert "bounded" in minimal.certificate.components.constraint_forces
    assert "other values do as well" in minimal.certificate.sentence()
    # Tight bounds hold the optimum in a corner, where it is the only one.
    tight = exo.reaction(pose, split="minimal", constraint_bounds=(-5.0, 5.0))
    assert kinds(tight) == [["optimiser"]] * 3
    spring = random_exo(4, upu=0)
    assert kinds(spring.reaction(pose, split="spherical"))[1] == ["unique"]


def test_bounded_components_do_differ_between_equally_good_answers():
    """With four limbs, holding g_1 at another value inside costs nothing, as the certificate says."""
    exo = random_exo(4)
    pose = regular_poses(exo.mechanism, np.random.default_rng(61), 1, margin=0.1)[0]
    first = exo.reaction(pose, split="minimal", constraint_bounds=(-50.0, 50.0))
    assert (first.certificate.components.constraint_forces == "bounded").all()
    inside = int(np.abs(first.constraint_forces).argmin())
    lower, upper = np.full(4, -50.0), np.full(4, 50.0)
    lower[inside] = upper[inside] = first.constraint_forces[inside] + 1.0
    other = exo.reaction(pose, split="minimal", constraint_bounds=(lower, upper))
    assert abs(other.magnitude - first.magnitude) < 1e-7
    assert abs(other.constraint_forces[inside] - first.constraint_forces[inside]) == pytest.approx(1.0)
    # Where the certificate says that the optimiser fixes it, the same move does cost.
    first = exo.reaction(pose, split="minimal", constraint_bounds=(-5.0, 5.0))
    lower, upper = np.full(4, -5.0), np.full(4, 5.0)
    lower[1] = upper[1] = first.constraint_forces[1] + 1.0
    other = exo.reaction(pose, split="minimal", constraint_bounds=(lower, upper))
    assert other.magnitude > first.magnitude + 1e-4


@pytest.mark.parametrize("offset", [None, [0.004, -0.006, 0.01]])
def test_intervals_are_those_of_the_corners(offset, worn):
    rng = np.random.default_rng(63)
    lower, upper = np.array([-30.0, -5.0, 2.0]), np.array([10.0, 25.0, 40.0])
    for pose in regular_poses(worn.mechanism, rng, 5, margin=0.05):
        corners = [
            worn.reaction(pose, split="minimal", constraint_bounds=(g, g), centre_offset=offset, limits="none")
            for g in (np.array(c) for c in itertools.product(*zip(lower, upper, strict=True)))
        ]
        ask = {"split": "minimal", "constraint_bounds": (lower, upper), "centre_offset": offset, "limits": "none"}
        parts = worn.reaction(pose, **ask).certificate.components
        for name, intervals in zip(
            SHAPES, (parts.actuator_intervals, parts.constraint_intervals, parts.shoulder_intervals), strict=True
        ):
            values = np.array([getattr(answer, name) for answer in corners])
            scale = np.abs(values).max() + 1.0
            np.testing.assert_allclose(intervals[:, 0], values.min(axis=0), atol=1e-9 * scale)
            np.testing.assert_allclose(intervals[:, 1], values.max(axis=0), atol=1e-9 * scale)


def test_limits_and_no_bounds(worn):
    free = worn.reaction(LIFTED).certificate.components
    np.testing.assert_array_equal(free.constraint_intervals, np.tile([-np.inf, np.inf], (3, 1)))
    np.testing.assert_array_equal(free.shoulder_intervals, np.tile([-np.inf, np.inf], (3, 1)))
    answer = worn.reaction(LIFTED, split="minimal", constraint_bounds="actuator", limits="none")
    size = np.abs(answer.actuator_forces)
    parts = answer.certificate.components
    np.testing.assert_allclose(parts.constraint_intervals, np.stack([-size, size], axis=1))
    np.testing.assert_allclose(parts.actuator_intervals, np.repeat(answer.actuator_forces[:, None], 2, axis=1))


def test_tension_bounds_cut_by_hand():
    """One self-stress t: f + t v within the bounds gives the interval of t in closed form."""
    exo = random_exo(4, upu=0)
    pose = regular_poses(exo.mechanism, np.random.default_rng(64), 1, margin=0.1)[0]
    answer, state = exo.reaction(pose), exo.inverse_kinematics(pose)
    arms = np.cross(state.platform_points, state.directions)
    v = np.linalg.svd(arms.T)[2][3]
    f = answer.actuator_forces
    lower, upper = f - 20.0, f + np.array([10.0, 20.0, 30.0, 40.0])
    ends = np.sort(np.stack([(lower - f) / v, (upper - f) / v]), axis=0)
    low, high = ends[0].max(), ends[1].min()
    parts = exo.reaction(pose, limits=(lower, upper)).certificate.components
    both = f[:, None] + v[:, None] * [low, high]
    np.testing.assert_allclose(parts.actuator_intervals, np.sort(both, axis=1), atol=1e-6)
    of_t = state.directions.T @ v
    both = answer.shoulder_force[:, None] + of_t[:, None] * [low, high]
    np.testing.assert_allclose(parts.shoulder_intervals, np.sort(both, axis=1), atol=1e-6)
    # One bound on one limb leaves the other way open.
    lower = np.full(4, -np.inf)
    lower[0] = f[0] - 10.0
    half = exo.reaction(pose, limits=(lower, np.inf)).certificate.components
    np.testing.assert_allclose(half.actuator_intervals[0], [f[0] - 10.0, np.inf], atol=1e-6)
    assert (np.isinf(half.actuator_intervals).sum(axis=1) == 1).all()


@pytest.mark.parametrize("n", [4, 5])
def test_limits_of_the_query_bound_the_intervals(n):
    exo, lower, upper = random_exo(n, upu=0), -20.0, 300.0
    poses = regular_poses(exo.mechanism, np.random.default_rng(66), 3, margin=0.1)
    free, within = exo.reaction(poses), exo.reaction(poses, limits=(lower, upper))
    held = np.flatnonzero(within.held)
    assert held.size
    assert np.isinf(free.certificate.components.actuator_intervals[held]).all()
    parts = within.certificate.components
    assert (parts.actuator_intervals[held] >= lower - 1e-6).all()
    assert (parts.actuator_intervals[held] <= upper + 1e-6).all()
    # An end that is no limit itself is the least tension with which the pose can be held.
    least = np.where(within.held[:, None], parts.actuator_intervals[..., 0], -np.inf)
    row, limb = np.argwhere(least > lower + 1.0)[0]
    for most, status in ((1e-3, "ok"), (-1e-3, "infeasible")):
        bounds = lower, np.where(np.arange(n) == limb, least[row, limb] + most, upper)
        assert exo.reaction(poses[row], limits=bounds).status == status


def test_intervals_scale_with_limits_far_above_the_load():
    exo = random_exo(5, upu=0)
    pose = regular_poses(exo.mechanism, np.random.default_rng(66), 1, margin=0.1)[0]
    ends = [
        exo.reaction(pose, limits=(-most, most)).certificate.components.actuator_intervals / most
        for most in (1e6, 1e8, 1e10)
    ]
    assert np.abs(ends[0]).max() == pytest.approx(1.0)
    for found in ends[1:]:
        np.testing.assert_allclose(found, ends[0], atol=1e-3)


def test_bounds_that_a_solver_does_not_take_are_scaled(monkeypatch):
    """The solver gives up on ends above 1000 N; the intervals are the same all the same."""
    exo = random_exo(5, upu=0)
    answer = exo.reaction(regular_poses(exo.mechanism, np.random.default_rng(66), 1, margin=0.1)[0], limits=(-8e3, 8e3))
    solver, expected, gave_up = scipy.optimize.linprog, answer.certificate.components, []

    def weak(target, **given):
        found = solver(target, **given)
        if given["b_ub"].max() > 1e3:
            gave_up.append(found.status)
            found.status = 4
        return found

    monkeypatch.setattr(scipy.optimize, "linprog", weak)
    again = exo.reaction(answer.case.poses, limits=(-8e3, 8e3)).certificate.components
    np.testing.assert_allclose(again.actuator_intervals, expected.actuator_intervals, atol=1e-6)
    np.testing.assert_allclose(again.shoulder_intervals, expected.shoulder_intervals, atol=1e-6)
    assert gave_up


def test_a_bad_row_says_so_and_spoils_no_other(worn):
    singular = worn.reaction(Rotation.identity())  # near, but with an answer
    assert singular.has_answer
    poses = Rotation.concatenate([ep.shoulder_rotation(0, 90, 0, **DEGREES), LIFTED])
    answer = worn.reaction(poses)
    assert answer.equilibrium_status.tolist() == ["singular", "ok"]
    parts = worn.reaction(poses, split="minimal", constraint_bounds=(-30, 30)).certificate.components
    assert (parts.shoulder_force[0] == "none").all()
    assert np.isnan(parts.shoulder_intervals[0]).all()
    single = worn.reaction(LIFTED, split="minimal", constraint_bounds=(-30, 30)).certificate.components
    np.testing.assert_allclose(parts.shoulder_intervals[1], single.shoulder_intervals)
    assert "1 of 2 poses" in str(parts)


def test_sentences(worn):
    text = worn.reaction(LIFTED).certificate.sentence()
    assert "Unique by equilibrium: f_1, f_2, f_3." in text
    assert "the stiffness of the shoulder and what resists sideways in limbs 1, 2, 3" in text
    known = guided(worn)
    assert 'split="elastic" determines them' in known.reaction(LIFTED).certificate.sentence()
    elastic = known.reaction(LIFTED, split="elastic").certificate.sentence()
    assert "Determined by stiffness: f_1, f_2, f_3, g_1, g_2, g_3, F_s x, F_s y, F_s z." in elastic
    assert "To determine" not in elastic
    spring = random_exo(3, upu=0)
    pose = regular_poses(spring.mechanism, np.random.default_rng(65), 1, margin=0.1)[0]
    assert "To determine" not in spring.reaction(pose).certificate.sentence()


def test_bad_certificate_questions(worn):
    certificate = worn.reaction(LIFTED).certificate
    bare = Certificate(*(getattr(certificate, name) for name in (
        "undetermined", "redundant_closures", "actuator_forces", "constraint_forces", "shoulder_force",
        "torso_wrench", "chosen_by",
    )))  # fmt: skip
    with pytest.raises(ep.InvalidInput, match="query"):
        bare.sentence()
