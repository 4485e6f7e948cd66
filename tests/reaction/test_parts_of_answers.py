"""Parts of an answer one by one: balance, marks, closest forces, scales and gaps, from written-down records."""

from types import SimpleNamespace

import numpy as np
import pytest
from programs import random_pose
from wrists import random_mechanism, regular_poses

import exo_pin as ep
from exo_pin.reaction.answer import BEYOND, QUERY_STATUS, _balance_residual, _mark_non_finite, answered, chosen_forces
from exo_pin.reaction.constraints.actuator_limits import LimbLimits, stroke_limits
from exo_pin.reaction.constraints.limb_limits import as_limb_limits
from exo_pin.reaction.holding.infeasible_poses import is_held, shortfall
from exo_pin.reaction.indeterminacy.certificate import Certificate
from exo_pin.reaction.indeterminacy.closest_forces import closest_forces
from exo_pin.reaction.pressures import PressurePlan
from exo_pin.reaction.result import Reaction
from exo_pin.reaction.splits.limb_and_side_forces import choose, force_scale
from exo_pin.reaction.splits.spherical import Spherical, shortest_tensions
from exo_pin.reaction.splits.split import Chosen

NAN, INF = np.nan, np.inf
CODE = {name: QUERY_STATUS.index(name) for name in QUERY_STATUS}


def test_the_residual_is_what_is_missing_over_the_largest_force(plain):
    shoulder = np.array([[1.0, 2.0, -3.0], [1.0, 2.0, -3.0], [0.0, 0.0, 0.0], [NAN, 0.0, 0.0], [8.0, 0.0, 0.0]])
    on_arm = np.zeros((5, 2, 6))
    on_arm[:2, 0], on_arm[:2, 1] = [3.0, -1.0, 5.0, 0.1, 0.2, -0.3], [-2.0, 4.0, 1.0, -0.4, 0.1, 0.5]
    force = -shoulder - on_arm[..., :3].sum(axis=1)
    moment = -on_arm[..., 3:].sum(axis=1)
    found = np.empty(5)
    _balance_residual(shoulder, on_arm, force, moment, 0.2, found)
    np.testing.assert_allclose(found[[0, 1, 2, 4]], 0.0, atol=1e-16)
    assert np.isnan(found[3])
    # The largest of all force components counts: here one of a limb, of the load and of the shoulder.
    for axis in range(3):
        for miss in (0.5, -0.5):
            off = force.copy()
            off[0, axis] += miss
            off[4, axis] += miss
            _balance_residual(shoulder, on_arm, off, moment, 0.2, found)
            largest = max(np.abs(shoulder[0]).max(), np.abs(off[0]).max(), np.abs(on_arm[0, :, :3]).max())
            assert found[0] == pytest.approx(0.5 / largest)
            assert found[4] == pytest.approx(0.5 / max(8.0, np.abs(off[4]).max()))
            off = moment.copy()
            off[0, axis] += 0.4 * miss
            _balance_residual(shoulder, on_arm, force, off, 0.2, found)
            largest = max(np.abs(shoulder[0]).max(), np.abs(force[0]).max(), np.abs(on_arm[0, :, :3]).max())
            assert found[0] == pytest.approx(1.0 / largest)
    lost = np.zeros((5, 3))
    lost[2, 1] = 0.06
    _balance_residual(shoulder, on_arm, force, moment + lost, 0.2, found)
    assert found[2] == pytest.approx(0.3)  # without any force the miss itself


def chosen(status, f, unmet=None):
    own = Chosen(np.array(status, dtype=np.int8), 3)
    own.f[:], own.g[:], own.kkt[:], own.gap[:], own.unique[:] = np.array(f)[:, None], 1.0, 0.5, 0.25, True
    own.unmet[:] = 0 if unmet is None else unmet
    return own


def test_rows_without_an_answer_are_not_numbers():
    own = chosen([0, 1, 0, CODE["singular"], 0], [1.0, 2.0, INF, 4.0, NAN], [0, CODE["infeasible"], 0, 7, 8])
    _mark_non_finite(own)
    assert own.status.tolist() == [0, 1, CODE["not_solved"], CODE["singular"], CODE["not_solved"]]
    for part in (own.f[:, 0], own.g[:, 0], own.kkt, own.gap):
        assert np.isnan(part).tolist() == [False, False, True, True, True]
    assert own.unique.tolist() == [True, True, False, False, False]
    assert own.unmet.tolist() == [0, CODE["infeasible"], 0, 0, 0]
    # Only g overflows.
    own = chosen([0, 0], [1.0, 1.0])
    own.g[1, 2] = -INF
    _mark_non_finite(own)
    assert own.status.tolist() == [0, CODE["not_solved"]]
    # A status without an answer is enough.
    own = chosen([0, CODE["folded"]], [1.0, 1.0])
    _mark_non_finite(own)
    assert np.isnan(own.f[1]).all()
    assert own.status.tolist() == [0, CODE["folded"]]
    own = chosen([0, 1], [1.0, 1.0])
    _mark_non_finite(own)
    assert own.status.tolist() == [0, 1]
    assert np.isfinite(own.f).all()
    assert answered(np.array([0, 1, 2, 3, 9], dtype=np.int8)).tolist() == [0, 1]
    assert [code for name, code in CODE.items() if name in BEYOND] == [CODE[name] for name in BEYOND]


def test_why_limits_are_not_met_goes_by_rank():
    """A stroke goes before a speed, and a lost equilibrium of soft parts before both."""
    mechanism = random_mechanism(np.random.default_rng(3), 3, ["SPS"] * 3)
    exo = ep.ShoulderExo.from_mechanism(mechanism)
    answer = exo.reaction(regular_poses(mechanism, np.random.default_rng(4), 6, 0.05), limits="none")
    none, every = np.zeros((6, 3)), np.ones((6, 3), dtype=bool)
    error, speed = none.copy(), none.copy()
    error[[1, 3, 5], 0], speed[[2, 3], 1] = 0.01, 0.2
    limits = LimbLimits(none - INF, none + INF, ~every, ~every, error, True, speed)
    lost = np.array([0, 0, 0, 0, 1, 1], dtype=bool)
    poses = answer.source.poses._replace(limits=limits, moved=SimpleNamespace(infeasible=lost))
    found = chosen_forces(Spherical(), poses)
    names = [QUERY_STATUS[code] for code in found.unmet]
    assert names == ["ok", "out_of_stroke", "beyond_limits", "out_of_stroke", "infeasible", "infeasible"]
    np.testing.assert_allclose(found.f, answer.actuator_forces)
    asked = poses._replace(limits=LimbLimits(none - INF, none + INF, ~every, ~every, error, False, speed))
    assert (chosen_forces(Spherical(), asked).unmet == 0).all()


def test_a_stack_without_an_answer_is_not_trivial():
    exo = ep.load("prototype")
    poses = exo.pose(abduction=[90.0, 90.0])
    lost = exo.reaction(poses, split="minimal", limits="none")
    assert not lost.has_answer.any()
    assert lost.trivial is False
    both = exo.reaction(exo.pose(flexion=[0.0, 30.0], abduction=[90.0, 30.0]), split="minimal", limits="none")
    assert both.has_answer.tolist() == [False, True]
    assert both.trivial is True


def test_closest_forces_are_those_of_held_poses_and_of_the_evidence():
    exo = ep.load("four-cables")
    load = ep.Load(np.zeros(3), [[0.0, 0.0, 0.0], [900.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    answer = exo.reaction(exo.pose([[30.0], [60.0], [50.0]]), load=ep.Load(np.zeros(3), load.moment[:, None]))
    assert answer.held.ravel().tolist() == [True, False, True]
    near = closest_forces(answer)
    for k in (0, 2):
        np.testing.assert_array_equal(near.actuator_forces[k], answer.actuator_forces[k])
        np.testing.assert_array_equal(near.constraint_forces[k], answer.constraint_forces[k])
        np.testing.assert_array_equal(near.cuff_wrench[k], answer.cuff_wrench[k])
    proof = answer.infeasibility
    np.testing.assert_allclose(near.actuator_forces[1], proof.closest_actuator_forces[1], atol=1e-9)
    np.testing.assert_array_equal(near.constraint_forces[1], 0.0)
    # With these forces the cuff gives less than is needed by what is missing.
    missed = answer.cuff_wrench[1, 0] - near.cuff_wrench[1, 0]
    np.testing.assert_allclose(missed[3:], proof.missing_wrench[1, 0, 3:], atol=1e-7)
    # Forces that are beyond a limit, and no evidence of others: nothing is known. One limb is enough.
    three = ep.load("three-linear-actuators").worn_by(ep.Arm.from_anthropometry(1.75, 75, "male"))
    needed = three.reaction(three.pose(60.0, 30.0), limits="none")
    top = np.abs(needed.actuator_forces) + np.array([10.0, 10.0, 10.0])
    worst = int(np.abs(needed.actuator_forces).argmax())
    top[worst] -= 10.5
    over = three.reaction(three.pose(60.0, 30.0), limits=(-top, top))
    assert over.status == "beyond_limits"
    assert np.count_nonzero(over.limits.force_error) == 1
    fake = SimpleNamespace(
        actuator_forces=over.actuator_forces, constraint_forces=over.constraint_forces, cuff_wrench=over.cuff_wrench,
        infeasibility=None, held=over.held, limits=over.limits,
    )  # fmt: skip
    assert all(np.isnan(part).all() for part in closest_forces(fake))
    fake.held = np.array(True)
    np.testing.assert_array_equal(closest_forces(fake).actuator_forces, over.actuator_forces)


def test_words_on_what_equilibrium_determines():
    def told(undetermined, f, shoulder=(True, True)):
        flags = np.array(f)
        every = np.ones_like(flags)
        own = Certificate(np.array(undetermined), None, flags, every, np.array(shoulder)[:, None] & every, every, "")
        return own.statement

    text = told([1, 0], [[True, True], [True, False]])
    # A pose in which nothing is open counts like any other.
    assert text.startswith("Equilibrium alone does not determine 0 to 1 of the reactions. Determined: ")
    assert "tension" not in text.split("Not determined: ")[0]
    lost = told([1, -1], [[True, True], [False, False]])
    assert lost.startswith("Equilibrium alone does not determine 1 of the reactions.")
    assert lost.endswith("Not determined: none.")
    assert told([0, 0], [[True, True], [True, True]]) == "Equilibrium determines every reaction."
    assert told([-1, -1], [[False, False], [False, False]]) == "No pose has a solution."


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e5])
def test_the_scale_of_forces_scales_with_them(size):
    rng = np.random.default_rng(8)
    for kind in ("pull", "range", "hard_cone", "alone", "weights"):
        pose = random_pose(rng, kind, n=5, faces=6, reachable=True)
        state = pose.state._replace(moment=size * pose.state.moment, shoulder=size * pose.state.shoulder)
        socket = None if pose.socket is None else pose.socket._replace(h=size * pose.socket.h)
        ends = {name: size * getattr(pose, name) for name in ("f_low", "f_high", "g_low", "g_high")}
        other = pose._replace(state=state, socket=socket, **ends)
        assert force_scale(other) == pytest.approx(size * force_scale(pose), rel=1e-9)
        if not is_held(pose) or not is_held(other):
            continue
        one, two = choose(pose), choose(other)
        np.testing.assert_allclose(two.f, size * one.f, atol=1e-6 * size * force_scale(pose))
        assert two.gap <= 1e-6 * force_scale(other)


def test_side_forces_of_a_lost_pose_stay_below_its_tensions():
    rng, found = np.random.default_rng(11), 0
    while found < 4:
        pose = random_pose(rng, "by_tension", n=4, reachable=False)
        missing = shortfall(pose._replace(f_high=np.full(4, 0.3 * force_scale(pose))))
        if missing is None:
            continue
        found += 1
        assert (np.abs(missing.g) <= np.abs(missing.f) + 1e-9 * force_scale(pose)).all()


@pytest.mark.parametrize("n", [4, 7, 8])
def test_shortest_tensions_of_rows_of_any_size(n):
    """Components of the wanted moment may be zero, small and large in one row."""
    rng = np.random.default_rng(n)
    arms = 0.2 * rng.normal(size=(6, 3, n))
    stress = np.swapaxes(np.linalg.svd(arms)[2][:, 3:], 1, 2)
    inside = rng.uniform(0.0, 30.0, (6, n))
    moment = (arms @ inside[..., None])[..., 0]
    moment[:2] *= 1e-6
    f = (np.linalg.pinv(arms) @ moment[..., None])[..., 0]
    low, high = np.zeros((6, n)), np.full((6, n), 40.0)
    high[:2] *= 1e-6
    # The last row cannot be held.
    high[5] = 0.01
    found = shortest_tensions(f, stress, low, high)
    assert np.isnan(found).any(axis=1).tolist() == [False] * 5 + [True]
    for k in range(5):
        scale = np.abs(found[k]).max()
        np.testing.assert_allclose(arms[k] @ found[k], moment[k], atol=1e-9 * scale)
        assert (found[k] >= low[k]).all()
        assert (found[k] <= high[k]).all()
        # Optimality: where a tension is free, it is a sum of the moments' rows.
        free = (found[k] > 1e-9 * scale) & (found[k] < high[k] - 1e-9 * scale)
        y = np.linalg.lstsq(arms[k][:, free].T, found[k][free], rcond=None)[0]
        pull = arms[k].T @ y
        np.testing.assert_allclose(pull[free], found[k][free], atol=1e-6 * scale)
        assert (pull[found[k] <= 1e-9 * scale] <= 1e-6 * scale).all()
        assert (pull[found[k] >= high[k] - 1e-9 * scale] >= high[k, 0] - 1e-6 * scale).all()
    # A tension of one part of 1e-6 off balance is no balance.
    assert np.isnan(shortest_tensions(f[:1], stress[:1], inside[:1] + 1.0, inside[:1] + 1.0)).all()


def test_the_optimality_of_tensions_is_in_newtons():
    exo = ep.load("four-cables")
    answer = exo.reaction(exo.pose(60.0), limits=(20.0, 400.0))
    assert answer.source.chosen.unjudged.all()
    split, poses, f = answer.source.split, answer.source.poses, answer.actuator_forces
    best = split.judged(poses, 0, f, np.zeros(4))
    assert best.kkt < 1e-8
    assert abs(best.gap) < 1e-6
    # A step along the tensions that balance themselves costs; the gap bounds by how much, N.
    stress = poses.tensions.self_stress[0, :, 0]
    way = stress if ((f + stress) >= 20.0 - 1e-9).all() else -stress
    for step in (1.0, 5.0):
        other = f + step * way
        assert (other >= 20.0 - 1e-9).all()
        worse = split.judged(poses, 0, other, np.zeros(4))
        excess = np.linalg.norm(other) - np.linalg.norm(f)
        assert excess > 0.0
        assert worse.gap >= excess - 1e-9
        assert worse.gap <= np.linalg.norm(other)


class Given:
    """An actuator whose limits are written down, one row a pose."""

    def __init__(self, lower, upper):
        self.ends = np.array(lower, dtype=float), np.array(upper, dtype=float)

    def force_limits(self, length):
        return self.ends


@pytest.mark.parametrize(
    ("lower", "upper", "message"),
    [
        ([0.0, INF], [1.0, INF], "no force can meet"),
        ([0.0, -INF], [1.0, -INF], "no force can meet"),
        ([0.0, 2.0], [1.0, 1.0], "above its upper"),
        ([0.0, -1e30], [1.0, 1.0], "more than"),
        ([0.0, 0.0], [1.0, 1e30], "more than"),
    ],
)
def test_limits_of_one_pose_that_cannot_be_meant_are_refused(lower, upper, message):
    mechanism = ep.load("four-cables").mechanism
    lengths = np.ones((2, 4))
    with pytest.raises(ep.InvalidInput, match=message):
        as_limb_limits([Given([0.0, 0.0], [1.0, 1.0])] * 3 + [Given(lower, upper)], mechanism, (2,), lambda: lengths)
    found = as_limb_limits([Given([0.0, NAN], [1.0, 2.0])] * 4, mechanism, (2,), lambda: lengths)
    np.testing.assert_array_equal(found.lower, [[0.0] * 4, [-INF] * 4])
    np.testing.assert_array_equal(found.upper, [[1.0] * 4, [INF] * 4])
    np.testing.assert_array_equal(found.length_error, [[0.0] * 4, [INF] * 4])
    assert found.reachable.tolist() == [True, False]


def test_limits_of_strokes_of_actuators_of_which_little_is_known():
    exo = ep.load("four-cables")
    kinds = (ep.Actuator("linear", 50.0, 20.0), ep.Actuator("linear"), ep.Actuator("cable", 30.0), ep.Actuator("cable"))
    low, high = stroke_limits(exo.replace(limbs=[ep.Limb("SPS", actuator=kind) for kind in kinds]).mechanism)
    np.testing.assert_array_equal(low, [-20.0, -INF, 0.0, 0.0])
    np.testing.assert_array_equal(high[[0, 2]], [50.0, 30.0])
    assert (high[[1, 3]] > 1e3).all()


def test_a_stiffness_of_which_a_part_is_not_known_is_not_known():
    stiffness = np.array([np.diag([3.0, 1.0, 2.0]), np.full((3, 3), NAN), np.eye(3)])
    stiffness[0, 0, 1] = 4.0
    stiffness[2, 1, 1] = NAN
    plan = PressurePlan(None, None, None, stiffness)
    # Of the symmetric part: [[3, 2], [2, 1]] has the eigenvalues 2 ± √5.
    np.testing.assert_allclose(plan.least_stiffness, [2.0 - np.sqrt(5.0), NAN, NAN])
    assert plan.is_stable.tolist() == [False, False, False]
    assert PressurePlan(None, None, None, np.eye(3)).is_stable
    assert not PressurePlan(None, None, None, np.zeros((3, 3))).is_stable


def test_poses_that_were_not_solved_are_not_known():
    exo = ep.load("four-cables")
    answer = exo.reaction(exo.pose([[30.0, 60.0]]))
    states = answer.equilibrium_status.astype("<U12")
    states[0, 1] = "not_solved"
    own = SimpleNamespace(source=answer.source, equilibrium_status=states, has_answer=states == "ok")
    check = Reaction.limits.func(own)
    assert check.unknown.tolist() == [[False, True]]
    assert check.can_hold.shape == (1, 2)
    assert not check.can_hold[0, 1]


def test_ratios_of_forces_that_vanish():
    def ratio(size, spherical, limbs=10.0):
        size = np.array(size)
        vectors, wrench = np.outer(spherical, [0.0, 0.6, 0.8]), np.zeros((len(size), 2, 6))
        wrench[:, 1, 2], wrench[:, :, 3:] = -limbs, 1e9
        own = SimpleNamespace(magnitude=size, spherical_force=vectors, limb_wrenches=wrench)
        return Reaction.ratio.fget(own)

    found = ratio([3.0, 3.0, 0.0, NAN, 1e-12, 0.0], [2.0, 0.0, 0.0, 2.0, 1e-12, 4.0])
    np.testing.assert_allclose(found, [1.5, INF, NAN, NAN, NAN, 0.0])
    np.testing.assert_allclose(ratio([3e-9], [2e-9]), [1.5])
