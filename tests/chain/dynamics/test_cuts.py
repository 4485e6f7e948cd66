"""Forces do not depend on the cut of a mechanism, its root, or the order of a closure's bodies."""

import numpy as np
import pytest
from mechanisms import random_wrist
from skeletons import agile_eye_skeleton, four_bar_skeleton, parallelogram_skeleton

from exo_pin import thesis_rotation
from exo_pin.chain import ClosedChain
from exo_pin.design import preset
from exo_pin.wrist_chain import mechanism_urdf

#: Ways to cut a four-bar: joints cut, root, closures with their bodies exchanged, order.
FOUR_BAR = [
    (("C",), "world", (), 1),
    (("C",), "world", ("C",), 1),
    (("D",), "world", (), 1),
    (("D",), "world", ("D",), 1),
]
AT_A = [*FOUR_BAR, (("B",), "world", ("B",), 1)]
AT_B = [*FOUR_BAR, (("A",), "world", (), 1), (("A", "D"), "coupler", ("D",), -1), (("A", "D"), "crank", ("A",), 1)]
#: Skeleton, its motors, those that lead first, and ways to cut it.
CASES = {
    "four-bar driven at A": (four_bar_skeleton(), ("A",), AT_A),
    "four-bar driven at B": (four_bar_skeleton(), ("B",), AT_B),
    "four-bar with a ball at C": (four_bar_skeleton("C"), ("B",), AT_B),
    "four-bar with two motors": (four_bar_skeleton(), ("B", "A"), FOUR_BAR),
    "parallelogram": (
        parallelogram_skeleton(),
        ("high_0",),
        [
            (("high_1", "high_2"), "world", (), 1),
            (("high_1", "high_2"), "world", ("high_2",), -1),
            (("low_1", "high_2"), "world", ("low_1",), 1),
            (("low_0", "low_1", "low_2"), "bar", ("low_1",), -1),
        ],
    ),
    "agile eye": (
        agile_eye_skeleton(),
        ("tip_0", "tip_1", "tip_2"),
        [
            (("motor_1", "motor_2"), "world", (), 1),
            (("middle_0", "motor_2"), "world", ("middle_0",), -1),
            (("motor_0", "motor_1", "motor_2"), "platform", ("motor_1",), 1),
            (("motor_0", "motor_1", "motor_2"), "distal_0", ("motor_1",), -1),
        ],
    ),
}
IDS = [(name, way) for name, (_, _, ways) in CASES.items() for way in range(1, len(ways))]


def expressed_alike(skeleton, _, forces, joint):
    """Reaction on the joint's ``other`` body, about its point in world axes."""
    other = skeleton.joints[joint].other
    return forces.joint_reaction(joint, on="universe" if other == "world" else other, at=skeleton.joints[joint].point)


def on_other(skeleton, chain, joint, limits):
    """Bounds on what ``other`` receives as bounds on what the chain's own receiver does; the axes are parallel."""
    if joint in [closure.name for closure in chain.closures]:
        closure = next(item for item in chain.closures if item.name == joint)
        own = closure.frame_a
    else:
        index = int(chain.model.getJointId(joint))
        own = next(
            frame.name for frame in chain.model.frames if frame.parentJoint == index and frame.name in skeleton.bodies
        )
    low, high = (np.asarray(side, dtype=float) for side in limits)
    return (low, high) if own == skeleton.joints[joint].other else (-high, -low)


def solved(skeleton, motors, way, bounds=None, speed=2.0, acceleration=5.0, **problem):
    """Chain and forces in the motion that the first motors' rates give, with a load on a body."""
    cut, root, reverse, order = way
    chain = skeleton.chain(cut, root, reverse, order, motors)
    q = chain.neutral()
    freedoms = chain.mobility(q).degrees_of_freedom
    leading = motors[:freedoms]
    signs = [skeleton.sign(chain, motor) for motor in leading]
    rates = [sign * speed * (1 + 0.3 * k) for k, sign in enumerate(signs)]
    pushes = [sign * acceleration * (1 - 0.4 * k) for k, sign in enumerate(signs)]
    v, a = chain.dependent_motion(q, leading, rates, pushes)
    # A load about the world's origin, expressed about the body's frame, which is elsewhere in every chain.
    body, force, moment = list(skeleton.bodies)[-1], np.array([3.0, -2.0, 4.0]), np.array([0.3, 0.2, -0.5])
    load = {body: np.concatenate([force, moment - np.cross(chain.placement(q, body).translation, force)])}
    if bounds is not None:
        problem["reaction_bounds"] = {joint: on_other(skeleton, chain, joint, given) for joint, given in bounds.items()}
    return chain, chain.inverse_dynamics(q, v, a, external=load, **problem)


def assert_same_reactions(skeleton, motors, one, other, size, tolerance):
    for joint in skeleton.joints:
        here, there = (expressed_alike(skeleton, *pair, joint) for pair in (one, other))
        np.testing.assert_allclose(here.wrench, there.wrench, rtol=0, atol=tolerance * size)
        np.testing.assert_array_equal(here.unique, there.unique)
        assert here.undetermined == there.undetermined
        # The same span: each one's projection holds the other's directions.
        projections = [item.directions @ np.linalg.pinv(item.directions) for item in (here, there)]
        np.testing.assert_allclose(*projections, rtol=0, atol=1e-8)
        np.testing.assert_array_equal(np.isinf(here.interval), np.isinf(there.interval))
        finite = np.isfinite(here.interval)
        np.testing.assert_allclose(here.interval[finite], there.interval[finite], rtol=0, atol=1e-7 * size)
    for motor in motors:
        signs = [skeleton.sign(chain, motor) for chain, _ in (one, other)]
        efforts = [sign * forces.effort(motor)[0] for sign, (_, forces) in zip(signs, (one, other), strict=True)]
        assert efforts[0] == pytest.approx(efforts[1], rel=0, abs=tolerance * size)
        flags = [forces.effort_is_unique[chain.velocity_slice(motor)] for chain, forces in (one, other)]
        np.testing.assert_array_equal(*flags)
    assert one[1].undetermined == other[1].undetermined


def largest(skeleton, chain, forces):
    return max(np.abs(expressed_alike(skeleton, chain, forces, joint).wrench).max() for joint in skeleton.joints)


@pytest.mark.parametrize(("name", "way"), IDS)
def test_the_cut_the_root_and_the_side_change_no_reaction(name, way):
    skeleton, motors, ways = CASES[name]
    one, other = solved(skeleton, motors, ways[0]), solved(skeleton, motors, ways[way])
    assert one[1].undetermined > 0
    assert one[0].characteristic_length == pytest.approx(other[0].characteristic_length, rel=1e-12)
    assert_same_reactions(skeleton, motors, one, other, largest(skeleton, *one), 1e-9)


def wrists(mechanism, pose, **problem):
    """The shoulder as root and as closure, in one pose and motion: chain and forces of each."""
    answers = []
    for part, shoulder in (("whole", "root_joint"), ("floating", "shoulder")):
        chain = ClosedChain.from_urdf(*mechanism_urdf(mechanism, part))
        q = chain.neutral()
        root = chain.configuration_slice("root_joint")
        q[root.stop - 4 : root.stop] = thesis_rotation(*pose, degrees=True).as_quat()
        q = chain.close(q, hold=["root_joint"])
        # Of the root link, whose origin rests in a free-flyer: in its own axes.
        turned = thesis_rotation(*pose, degrees=True).inv().apply([[1.0, -0.5, 2.0], [3.0, 4.0, -2.0]])
        own = chain.velocity_slice("root_joint")
        motion = np.hstack([np.zeros((2, own.stop - own.start - 3)), turned])
        v, a = chain.dependent_motion(q, ["root_joint"], *motion)
        given = {key: {shoulder: value["shoulder"]} for key, value in problem.items()}
        answers.append((shoulder, chain.inverse_dynamics(q, v, a, external={"arm": [5, -8, 3, 1, 0.5, -2]}, **given)))
    return answers


WRISTS = {
    "prototype": (preset("prototype"), (40, -20, -30)),
    "heavy limbs": (random_wrist(21, "UUU", with_masses=True), (20, -10, 15)),
    "mixed": (random_wrist(22, "USUSU", with_masses=True), (20, -10, 15)),
}
FORCE_ONLY = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]


@pytest.mark.parametrize(
    "problem",
    [
        {},
        {"objective": {"shoulder": FORCE_ONLY}},
        {"reaction_bounds": {"shoulder": ([-5.0] * 3 + [-np.inf] * 3, [5.0] * 3 + [np.inf] * 3)}},
    ],
    ids=["metric", "objective", "bounds"],
)
@pytest.mark.parametrize("name", WRISTS)
def test_the_shoulder_as_root_or_as_closure_carries_the_same(name, problem):
    mechanism, pose = WRISTS[name]
    (root, one), (closure, other) = wrists(mechanism, pose, **problem)
    assert one.undetermined == other.undetermined >= 3
    pairs = [(root, closure)]
    for limb in range(1, mechanism.limb_count + 1):
        pairs += [(joint, joint) for joint in (f"limb_{limb}_slide", f"limb_{limb}_platform_x", f"limb_{limb}_base")]
    expressed = [(one.joint_reaction(a, on="arm" if a == root else None), other.joint_reaction(b)) for a, b in pairs]
    size = max(np.abs(here.wrench).max() for here, _ in expressed)
    # The motion and a program's answer are known to 1e-8 of what they are made of.
    tolerance = (1e-6 if problem else 1e-9) * size
    for here, there in expressed:
        np.testing.assert_allclose(here.wrench, there.wrench, rtol=0, atol=tolerance)
        np.testing.assert_array_equal(here.unique, there.unique)
        assert here.undetermined == there.undetermined
        projections = [item.directions @ np.linalg.pinv(item.directions) for item in (here, there)]
        np.testing.assert_allclose(*projections, rtol=0, atol=1e-7)
        finite = np.isfinite(here.interval)
        np.testing.assert_array_equal(finite, np.isfinite(there.interval))
        np.testing.assert_allclose(here.interval[finite], there.interval[finite], rtol=0, atol=1e-6 * size)
    # The free flight of the floating arm carries nothing.
    np.testing.assert_allclose(other.joint_reaction("root_joint").wrench, 0.0, atol=1e-9 * size)
