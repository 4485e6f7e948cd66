"""What is missing where limbs cannot hold a pose: least squares and linear programs of SciPy, and proofs by hand."""

import numpy as np
import pytest
import scipy
from programs import random_pose

from exo_pin.numerics import LeastSquares, Solution
from exo_pin.reaction import Infeasibility
from exo_pin.reaction.holding.infeasible_poses import _extra_muscle, _relief, _separation, is_held, shortfall
from exo_pin.reaction.splits.limb_and_side_forces import Pose, Socket, choose, force_scale


def problem(pose):
    """The forces' effect on moments over the radius, and on force where F_s is bound, with what has to be supplied."""
    effect, target = pose.moment_effect, pose.state.moment / pose.radius
    if pose.alone:
        effect, target = np.vstack([effect, -pose.shoulder_effect]), np.append(target, pose.state.shoulder)
    return effect, target


@pytest.mark.parametrize("kind", ["pull", "range", "tight", "sides", "alone"])
def test_what_is_missing_is_least_and_proven(kind):
    rng, found, held = np.random.default_rng(len(kind)), 0, 0
    while found < 8 or held < 2:
        pose = random_pose(rng, kind, reachable=rng.random() < 0.3)
        effect, target = problem(pose)
        best = scipy.optimize.lsq_linear(
            effect, target, (pose.low - 1e-12, pose.high + 1e-12), tol=1e-14, method="bvls"
        )
        least, scale = np.sqrt(2.0 * best.cost), force_scale(pose)
        if 1e-12 * scale < least < 1e-6 * scale:
            continue
        missing = shortfall(pose)
        assert (missing is None) == is_held(pose) == (least <= 1e-9 * scale)
        if missing is None:
            held += 1
            continue
        found += 1
        parts = missing.missing[3:] / pose.radius
        parts = np.append(parts, missing.missing[:3]) if pose.alone else parts
        assert np.linalg.norm(parts) == pytest.approx(least, rel=1e-6)
        # Balance needs more along y than all forces within the limits give.
        y = np.append(missing.direction[3:] * pose.radius, missing.direction[:3] if pose.alone else [])
        assert np.linalg.norm(y) == pytest.approx(1.0, abs=1e-12)
        np.testing.assert_allclose(y, parts / least, atol=1e-5)
        assert missing.required == pytest.approx(y @ target, abs=1e-9 * scale)
        gains = y @ effect
        gains[np.abs(gains) < 1e-9] = 0.0
        ends = np.where(gains > 0.0, pose.high, np.where(gains < 0.0, pose.low, 0.0))
        assert missing.available == pytest.approx(gains @ ends, abs=1e-6 * scale)
        assert missing.required - missing.available == pytest.approx(least, abs=1e-5 * scale)
        # The closest forces are within the limits and miss just that.
        z = np.append(missing.f, missing.g[pose.upu])
        assert (z >= pose.low).all()
        assert (z <= pose.high).all()
        np.testing.assert_allclose(target - effect @ z, parts, atol=1e-7 * scale)
        balancing = pose.state.shoulder + pose.shoulder_effect @ z
        np.testing.assert_allclose(missing.shoulder, np.zeros(3) if pose.alone else balancing, atol=1e-12 * scale)
        for i in range(len(pose.f_low)):
            gain = y @ effect[:, i]
            if abs(gain) > 1e-4:
                # What gains along y is used up to its limit, which blocks.
                assert missing.blocking[i] == np.sign(gain)
            if missing.blocking[i] == 0:
                assert np.isinf(missing.relief[i])
        if not pose.alone and np.isfinite(missing.extra_force).all():
            np.testing.assert_allclose(
                np.cross(missing.extra_point, missing.extra_force), missing.missing[3:], atol=1e-9 * scale
            )
            assert missing.extra_force @ missing.extra_point == pytest.approx(0.0, abs=1e-9 * scale)
            # Of all directions that give the moment with the radius as lever arm, the one that lowers |F_s| most.
            assert np.linalg.norm(missing.extra_point) == pytest.approx(pose.radius, rel=1e-9)
            axis, size = missing.missing[3:] / np.linalg.norm(missing.missing[3:]), np.linalg.norm(missing.extra_force)
            side = scipy.linalg.null_space(axis[None])
            angles = np.linspace(0.0, 2.0 * np.pi, 721)
            pulls = size * (np.cos(angles)[:, None] * side[:, 0] + np.sin(angles)[:, None] * side[:, 1])
            left = np.linalg.norm(balancing - pulls, axis=1).min()
            assert np.linalg.norm(balancing - missing.extra_force) <= left + 1e-9 * scale


def bare(moment=(0.0, 0.0, 0.0), shoulder=(0.0, 0.0, 0.0), alone=False, socket=None, radius=0.5):
    """A pose without limbs that matter, for what is asked of a single muscle."""
    pose = random_pose(np.random.default_rng(1), "pull", n=3)
    state = pose.state._replace(moment=np.array(moment), shoulder=np.array(shoulder))
    return pose._replace(state=state, radius=radius, alone=alone, socket=socket)


def test_one_muscle_that_closes_a_gap():
    none, force, moment = np.zeros(3), np.array([0.0, 3.0, 4.0]), np.array([2.0, 0.0, 0.0])
    # A shoulder that takes no force: the missing wrench has to be a pure force.
    pull, point = _extra_muscle(bare(alone=True), force, moment, none)
    np.testing.assert_array_equal(pull, force)
    np.testing.assert_allclose(np.cross(point, pull), moment, atol=1e-15)
    assert point @ pull == 0.0
    for lacking in ((force, moment + 1e-6 * force), (none, moment)):
        assert np.isnan(_extra_muscle(bare(alone=True), *lacking, none)).all()
    # One in 100,000 along the moment is no rounding, whatever the sizes are.
    for size in (1e-4, 1.0, 1e4):
        for scale in (1e-4, 1.0, 1e4):
            across = np.array([1.0, 0.0, 0.0]), np.array([1e-5, 1.0, 0.0])
            assert np.isnan(_extra_muscle(bare(alone=True), size * across[0], scale * across[1], none)).all()
            pull, _ = _extra_muscle(bare(alone=True), size * across[0], scale * np.array([1e-12, 1.0, 0.0]), none)
            np.testing.assert_array_equal(pull, size * across[0])
    # Only a force is missing: through O.
    pull, point = _extra_muscle(bare(), force, 1e-12 * moment, none)
    np.testing.assert_array_equal(pull, force)
    np.testing.assert_array_equal(point, none)
    # Along the part of F_s across the moment, with the radius as lever arm: 2 N m / 0.5 m.
    pull, point = _extra_muscle(bare(), none, moment, np.array([7.0, 0.0, -3.0]))
    np.testing.assert_allclose(pull, [0.0, 0.0, -4.0], atol=1e-12)
    np.testing.assert_allclose(point, np.cross(pull, moment) / 16.0, atol=1e-12)
    # F_s along the moment, or none, leaves the direction open: across the moment all the same.
    for shoulder in (np.array([7.0, 0.0, 0.0]), np.array([7.0, 1e-10, 0.0]), none):
        pull, point = _extra_muscle(bare(), none, moment, shoulder)
        assert np.linalg.norm(pull) == pytest.approx(4.0)
        assert pull @ moment == pytest.approx(0.0, abs=1e-12)
        np.testing.assert_allclose(np.cross(point, pull), moment, atol=1e-12)


@pytest.mark.parametrize("least", [1.0, 9.0, 300.0])
def test_one_muscle_that_brings_the_force_into_a_hard_socket(least):
    """The socket asks of F_s - p that its y is at most -least; without it p lies along F_s."""
    socket = Socket(np.array([[0.0, 1.0, 0.0]]), np.array([-least]), None)
    shoulder = np.array([1.0, 2.0, -6.0])
    pull, point = _extra_muscle(bare(socket=socket), np.zeros(3), np.array([2.0, 0.0, 0.0]), shoulder)
    assert (shoulder - pull)[1] <= -least + 1e-6
    assert pull[0] == pytest.approx(0.0, abs=1e-7)
    np.testing.assert_allclose(np.cross(point, pull), [2.0, 0.0, 0.0], atol=1e-6)
    # No pull is nearer to one of the four directions of 4 N, and of those the one is taken that leaves least F_s.
    along = np.array([0.0, 2.0, -6.0]) / np.sqrt(40.0)
    tries = []
    for way in (along, -along, np.cross([1.0, 0.0, 0.0], along), -np.cross([1.0, 0.0, 0.0], along)):
        near = 4.0 * way
        near[1] = max(near[1], 2.0 + least)
        tries.append(near)
    best = min(tries, key=lambda p: np.linalg.norm(shoulder - p))
    np.testing.assert_allclose(pull, best, atol=1e-6)


@pytest.mark.parametrize("way", [[0.0, 1.0], [0.0, -1.0], [1.0, 0.0], [-1.0, 0.0]])
def test_a_muscle_is_found_in_each_direction_that_a_socket_leaves(way):
    """F_s lies along z; a strip of the socket leaves pulls along one way, and those of other ways too little."""
    shoulder, moment, radius = np.array([0.0, 0.0, 8.0]), np.array([0.6, 0.0, 0.0]), 0.05
    way, size = np.array([0.0, *way]), 0.6 / radius
    other = np.cross([1.0, 0.0, 0.0], way)
    # way · p >= 0.05 size and |other · p| <= 0.01 size, of p = shoulder - F.
    N = np.array([way, other, -other])
    h = N @ shoulder + size * np.array([-0.05, 0.01, 0.01])
    pull, point = _extra_muscle(bare(socket=Socket(N, h, None), radius=radius), np.zeros(3), moment, shoulder)
    np.testing.assert_allclose(pull, size * way, atol=1e-6 * size)
    np.testing.assert_allclose(np.cross(point, pull), moment, atol=1e-7)
    assert np.linalg.norm(point) == pytest.approx(radius, rel=1e-6)


def test_a_socket_in_which_no_muscle_brings_the_force():
    # F_s x at most -1 N, where pulls across x change nothing of it.
    socket = Socket(np.array([[1.0, 0.0, 0.0]]), np.array([-1.0]), None)
    lost = _extra_muscle(bare(socket=socket), np.zeros(3), np.array([2.0, 0.0, 0.0]), np.array([1.0, 2.0, 3.0]))
    assert np.isnan(lost).all()
    near = _extra_muscle(bare(socket=socket), np.zeros(3), np.array([2.0, 0.0, 0.0]), np.array([-2.0, 2.0, 3.0]))
    np.testing.assert_allclose(np.linalg.norm(near[0]), 4.0, atol=1e-6)


def test_the_proof_and_the_relief_of_programs_that_are_written_down():
    # z in [0, 2] x [0, inf), z1 + z2 <= 5; wanted is z1 = 7 alone.
    free, ends = np.zeros((0, 2)), np.zeros(0)
    program = LeastSquares(
        np.array([[1.0, 0.0]]), np.array([7.0]), free, ends, np.zeros(2), np.array([2.0, np.inf]), np.ones((1, 2)),
        np.array([5.0]),
    )  # fmt: skip

    def separation(y, inequality):
        blank = dict.fromkeys(Solution._fields)
        return _separation(
            program, Solution(**(blank | {"inequality": np.array([inequality])})), np.array([y]), np.array([7.0]), 1.0
        )

    assert separation(1.0, 0.0) == (7.0, 2.0, np.inf)
    assert separation(-1.0, 0.0) == (-7.0, 0.0, np.inf)
    # Multipliers of an inequality that are negative count as none; positive ones take gain away.
    assert separation(1.0, -3.0) == (7.0, 2.0, np.inf)
    required, available, valid = separation(1.0, 0.25)
    assert (required, available, valid) == (7.0, 0.25 * 5.0 + 0.75 * 2.0, np.inf)
    # Rounding that gains by a force without limit: the proof covers that force up to where it makes up the difference.
    ends_of = (program.low, program.high, program.C, program.c)
    leaking = LeastSquares(np.array([[1.0, 1e-3]]), np.zeros(1), free, ends, *ends_of)
    still = Solution(**(dict.fromkeys(Solution._fields) | {"inequality": np.zeros(1)}))
    for target, valid in ((7.0, 5000.0), (2.5, 500.0), (1.0, 0.0)):
        found = _separation(leaking, still, np.ones(1), np.array([target]), 1.0)
        assert found == pytest.approx((target, 2.0, valid))
    narrow = LeastSquares(
        np.eye(2),
        np.zeros(2),
        free,
        ends,
        np.array([1.0, -1.0]),
        np.array([2.0, 3.0]),
        np.ones((1, 2)),
        np.array([5.5]),
    )
    assert _relief(narrow, np.array([2.4, 3.0]), 0, 1) == pytest.approx(0.4, abs=1e-9)
    assert _relief(narrow, np.array([2.6, 3.0]), 0, 1) == np.inf  # beyond the inequality
    assert _relief(narrow, np.array([2.4, 3.1]), 0, 1) == np.inf  # two limits
    assert _relief(narrow, np.array([0.25, 1.0]), 0, -1) == pytest.approx(0.75, abs=1e-9)
    assert _relief(narrow, np.array([-4.0, 1.0]), 0, -1) == pytest.approx(5.0, abs=1e-9)
    assert _relief(narrow, np.array([1.5, -1.5]), 1, -1) == pytest.approx(0.5, abs=1e-9)
    assert _relief(narrow, np.array([1.5, 1.0]), 0, 0) == np.inf


def test_the_explanation_word_by_word():
    nan = np.nan
    one = {
        "infeasible": np.array([True, False]),
        "closest_actuator_forces": np.array([[-0.04, 20.0, 5.0], [nan] * 3]),
        "closest_constraint_forces": np.zeros((2, 3)),
        "closest_shoulder_force": np.zeros((2, 3)),
        "missing_wrench": np.array([[0.0, 0.0, 0.0, 0.0, 0.3, -0.4], [nan] * 6]),
        "direction": np.zeros((2, 6)),
        "required": np.ones(2),
        "available": np.zeros(2),
        "valid_up_to": np.ones(2),
        "blocking": np.array([[-1, 1, 0], [0, 0, 0]], dtype=np.int8),
        "relief": np.array([[np.inf, 3.21, np.inf], [nan] * 3]),
        "extra_muscle_force": np.array([[0.0, 3.0, -4.0], [nan] * 3]),
        "extra_muscle_point": np.array([[0.1, -0.0204, 0.0], [nan] * 3]),
    }

    def told(index=0, **other):
        return Infeasibility(**(one | {key: np.array([value, value]) for key, value in other.items()})).explain(index)

    missing = "With the best forces within the limits, 0.50 N m about (0.00, 0.60, -0.80) is missing."
    limbs = (
        "Limb 1 is at its least force, 0.0 N. "
        "Limb 2 is at its greatest force, 20.0 N (a limit 3.2 N wider would make the pose feasible)."
    )
    others = "Widening one of the others alone does not make the pose feasible."
    muscle = "A further muscle pulling 5.0 N along (0.00, 0.60, -0.80) through (100, -20, 0) mm would hold the pose."
    assert told() == f"{missing} {limbs} {others} {muscle}"
    assert told(1) == "This pose can be held."
    assert told(extra_muscle_force=[nan] * 3).endswith("No single further muscle was found that would hold the pose.")
    assert "(a limit 3.2 N wider would make the pose feasible). A further" in told(relief=[1.0, 3.21, np.inf])
    assert "Widening one of these limits alone" in told(relief=[np.inf] * 3)
    assert "Widening this limit alone" in told(relief=[np.inf] * 3, blocking=[0, 1, 0])
    assert "is missing. A further" in told(blocking=[0, 0, 0])
    force = told(missing_wrench=[0.0, 3.0, 4.0, 0.0, 0.0, 1e-10])
    assert force.startswith("With the best forces within the limits, 5.0 N of force is missing.")
    both = told(missing_wrench=[0.0, 3.0, 4.0, 0.0, 0.0, 2e-9])
    assert "0.00 N m about (0.00, 0.00, 1.00) and 5.0 N of force is missing." in both


@pytest.mark.parametrize("kind", ["pull", "range", "sides", "soft_cone", "weights", "spherical"])
def test_chosen_forces_are_no_worse_than_any_near_them(kind):
    """A random step along what balances, cut at the limits, never lowers the cost; the gap bounds what is left."""
    from programs import cost

    rng, tried = np.random.default_rng(len(kind) + 50), 0
    while tried < 5:
        pose = random_pose(rng, kind, reachable=True, faces=6)
        if not is_held(pose):
            continue
        tried += 1
        best = choose(pose)
        scale = force_scale(pose)
        assert isinstance(pose, Pose)
        z = np.append(best.f, best.g[pose.upu])
        np.testing.assert_allclose(pose.moment_effect @ z, pose.state.moment / pose.radius, atol=1e-9 * scale)
        assert 0.0 <= best.kkt < 1e-8
        assert abs(best.gap) < 1e-4 * scale
        if kind == "soft_cone":
            continue
        free = scipy.linalg.null_space(pose.moment_effect)
        for _ in range(20):
            other = z + free @ rng.normal(size=free.shape[1]) * scale * 1e-3
            if (other < pose.low).any() or (other > pose.high).any():
                continue
            g = np.zeros(len(pose.f_low))
            g[pose.upu] = other[len(pose.f_low) :]
            assert cost(pose, other[: len(pose.f_low)], g) >= cost(pose, best.f, best.g) - 1e-9 * scale**2
