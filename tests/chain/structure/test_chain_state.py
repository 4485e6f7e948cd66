import pickle

import numpy as np
import pinocchio as pin
import pytest
from mechanisms import five_bar, four_bar, parallelogram, planar_3rrr, random_loop, random_wrist
from scipy.spatial.transform import Rotation
from spatial_mechanisms import agile_eye, delta, stewart

from exo_pin.chain import TYPES, ClosedChain
from exo_pin.core.conventions import thesis_rotation
from exo_pin.core.errors import InvalidInput, LoopNotClosed, UndeterminedMotion, UnknownName
from exo_pin.design import preset
from exo_pin.wrist_chain import mechanism_urdf

# Central differences of step h: h²/6 of a third derivative of order 10 here, plus rounding eps/h times order 10.
STEP = 1e-5
FINITE = 1e-7


OTHERS = (
    planar_3rrr(),
    agile_eye(),
    delta(),
    delta("universal"),
    delta("rigid"),
    stewart(),
    parallelogram(),
)


def chains():
    for named in OTHERS:
        yield named.closures.name, named.chain()
    yield "four_bar", four_bar().chain()
    yield "four_bar_link", four_bar("link").chain()
    yield "five_bar", five_bar().chain()
    for part in ("whole", "wrist", "floating"):
        yield f"prototype-{part}", ClosedChain.from_urdf(*mechanism_urdf(preset("prototype"), part))
    for kind in TYPES:
        if kind != "point":
            yield f"loop-{kind}", random_loop(kind).chain()
    yield "mixed", ClosedChain.from_urdf(*mechanism_urdf(random_wrist(7, "USUSU")))


CHAINS = dict(chains())


def posed(chain):
    """The prototype away from its rest, which is close to singular."""
    q = chain.neutral()
    root = chain.configuration_slice("root_joint")
    q[root.stop - 4 : root.stop] = thesis_rotation(40, -20, -30, degrees=True).as_quat()
    return chain.close(q, hold=["root_joint"])


HAND = {"four_bar": four_bar().q, "four_bar_link": four_bar("link").q, "five_bar": five_bar().q}
HAND |= {f"loop-{kind}": random_loop(kind).q for kind in TYPES if kind != "point"}
HAND |= {named.closures.name: named.q for named in OTHERS}
START = HAND | {name: posed(chain) for name, chain in CHAINS.items() if name.startswith("prototype")}


@pytest.fixture(params=CHAINS, scope="module")
def chain(request):
    return CHAINS[request.param]


def open_configurations(chain, seed, count=5, size=0.3):
    rng = np.random.default_rng(seed)
    start = START.get(chain.description.name, chain.neutral())
    return [pin.integrate(chain.model, start, rng.uniform(-size, size, chain.model.nv)) for _ in range(count)]


@pytest.mark.parametrize("name", HAND)
def test_configurations_found_by_hand_are_closed(name):
    assert np.abs(CHAINS[name].residual(HAND[name])).max() < 1e-15


def test_close_reaches_1e_12(chain):
    for q in open_configurations(chain, 1, count=20):
        closed = chain.close(q)
        assert np.abs(chain.residual(closed)).max() <= 1e-12


def test_close_keeps_what_is_held(chain):
    held = chain.roles.actuated[0]
    part = chain.configuration_slice(held)
    for q in open_configurations(chain, 18, count=20, size=0.02):
        closed = chain.close(q, hold=[held])
        assert np.abs(chain.residual(closed)).max() <= 1e-12
        np.testing.assert_array_equal(closed[part], q[part])


def test_close_leaves_a_closed_configuration_alone(chain):
    closed = chain.close(open_configurations(chain, 2, count=1)[0])
    np.testing.assert_array_equal(chain.close(closed), closed)
    before = closed.copy()
    chain.close(closed)[:] = 0.0
    np.testing.assert_array_equal(closed, before)


def test_close_moves_little_more_than_the_nearest_closed_configuration(chain):
    # From a closed configuration, go away by 0.05: the answer may not lie farther than that, up to the manifold's
    # curvature.
    for q in open_configurations(chain, 3):
        closed = chain.close(q)
        rng = np.random.default_rng(4)
        away = rng.normal(size=chain.model.nv)
        away *= 0.05 / np.linalg.norm(away)
        back = chain.close(pin.integrate(chain.model, closed, away))
        assert np.linalg.norm(pin.difference(chain.model, closed, back)) < 0.12


def test_closing_the_four_bar_with_its_crank_held_gives_the_hand_derived_answer():
    named, chain = four_bar(), CHAINS["four_bar"]
    start = named.q + np.array([0.0, 0.3, -0.3])
    np.testing.assert_allclose(chain.close(start, hold=["crank_hinge"]), named.q, atol=1e-11)


def test_closing_the_five_bar_with_its_cranks_held_gives_the_hand_derived_answer():
    named, chain = five_bar(), CHAINS["five_bar"]
    start = named.q + np.array([0.0, 0.3, 0.0, -0.3])
    np.testing.assert_allclose(chain.close(start, hold=chain.roles.actuated), named.q, atol=1e-11)


def test_a_loop_that_cannot_close_raises_with_its_evidence():
    named, chain = five_bar(), CHAINS["five_bar"]
    # Cranks turned away from each other: the elbows are 0.6 apart, the forearms reach 0.55.
    q = named.q.copy()
    q[0], q[2] = np.pi, 0.0
    with pytest.raises(LoopNotClosed) as caught:
        chain.close(q, hold=chain.roles.actuated)
    error = caught.value
    assert error.residual == pytest.approx(np.abs(chain.residual(error.q)).max())
    # The forearms end up stretched along x, 0.05 short of each other.
    assert error.residual == pytest.approx(0.05, abs=1e-3)
    assert error.iterations > 1
    np.testing.assert_array_equal(error.q[[0, 2]], q[[0, 2]])
    for count in (0, 1):
        with pytest.raises(LoopNotClosed) as caught:
            chain.close(named.q + 0.2, max_iterations=count)
        assert caught.value.iterations == count
    with pytest.raises(LoopNotClosed):
        chain.close(named.q + 0.2, hold=chain.model.names[1:])


PINOCCHIOS = [
    name for name, chain in CHAINS.items() if {item.type for item in chain.closures} <= {"rigid", "spherical"}
]


@pytest.fixture(params=PINOCCHIOS)
def as_pinocchio(request):
    return CHAINS[request.param]


@pytest.mark.parametrize("name", sorted(set(CHAINS) - set(PINOCCHIOS)))
def test_closures_that_pinocchio_lacks_are_not_handed_to_it(name):
    with pytest.raises(InvalidInput, match="no constraint for the"):
        _ = CHAINS[name].constraint_models


def test_residual_is_pinocchios_relative_placement(as_pinocchio):
    chain = as_pinocchio
    q = open_configurations(chain, 5, count=1)[0]
    data = chain.model.createData()
    pin.forwardKinematics(chain.model, data, q)
    residual = chain.residual(q)
    for closure, constraint in zip(chain.closures, chain.constraint_models, strict=True):
        constraint_data = constraint.createData()
        constraint.calc(chain.model, data, constraint_data)
        b_in_a = constraint_data.c1Mc2
        rows = residual[chain.rows(closure.name)]
        np.testing.assert_allclose(rows[:3], -b_in_a.translation, atol=1e-14)
        if closure.rows == 6:
            expected = Rotation.from_matrix(b_in_a.rotation.T).as_rotvec()
            np.testing.assert_allclose(rows[3:], expected, atol=1e-14)


def test_jacobian_is_pinocchios_on_closed_loops(as_pinocchio):
    chain = as_pinocchio
    for q in open_configurations(chain, 6):
        q = chain.close(q)
        models = pin.StdVec_RigidConstraintModel()
        datas = pin.StdVec_RigidConstraintData()
        for constraint in chain.constraint_models:
            models.append(constraint)
            datas.append(constraint.createData())
        data = chain.model.createData()
        pin.computeJointJacobians(chain.model, data, q)
        for constraint, constraint_data in zip(models, datas, strict=True):
            constraint.calc(chain.model, data, constraint_data)
        theirs = pin.getConstraintsJacobian(chain.model, data, models, datas)
        # They refer a 6D twist to a's origin, this module to b's: the loops' 1e-12 apart.
        np.testing.assert_allclose(chain.constraint_jacobian(q), theirs, atol=1e-11)


def test_jacobian_is_the_derivative_of_the_residual_on_closed_loops(chain):
    rng = np.random.default_rng(7)
    for q in open_configurations(chain, 8):
        q = chain.close(q)
        for _ in range(3):
            v = rng.normal(size=chain.model.nv)
            ahead, behind = (chain.residual(pin.integrate(chain.model, q, s * STEP * v)) for s in (1, -1))
            np.testing.assert_allclose(
                chain.constraint_jacobian(q) @ v, (ahead - behind) / (2 * STEP), atol=FINITE * 10
            )


def test_rows_in_metres_are_the_derivative_of_the_residual_everywhere(chain):
    rng = np.random.default_rng(9)
    metres = np.concatenate(
        [[True] * TYPES[item.type].translations + [False] * TYPES[item.type].rotations for item in chain.closures]
    )
    for q in open_configurations(chain, 10, size=1.0):
        v = rng.normal(size=chain.model.nv)
        ahead, behind = (chain.residual(pin.integrate(chain.model, q, s * STEP * v)) for s in (1, -1))
        rates = (ahead - behind) / (2 * STEP)
        np.testing.assert_allclose((chain.constraint_jacobian(q) @ v)[metres], rates[metres], atol=FINITE)


def test_drift_is_the_jacobians_rate(chain):
    rng = np.random.default_rng(11)
    for q in open_configurations(chain, 12, size=1.0):
        v = rng.normal(size=chain.model.nv)
        ahead, behind = (chain.constraint_jacobian(pin.integrate(chain.model, q, s * STEP * v)) @ v for s in (1, -1))
        expected = (ahead - behind) / (2 * STEP)
        np.testing.assert_allclose(chain.constraint_drift(q, v), expected, atol=FINITE * 10)


def test_a_large_turn_closes_too():
    # The rigid closure starts 2.9 rad off: the logarithm has to be right near half a turn.
    named = four_bar("link")
    q = named.q.copy()
    q[2] += 2.9
    chain = CHAINS["four_bar_link"]
    assert abs(chain.residual(q)[5]) == pytest.approx(2.9)
    closed = chain.close(q, hold=["crank_hinge"])
    assert np.abs(chain.residual(closed)).max() <= 1e-12


@pytest.mark.parametrize("axis", np.eye(3))
@pytest.mark.parametrize("angle", [1e-9, 1.0, 3.0, np.pi - 1e-7, np.pi, np.pi + 1e-7, 4.0])
def test_the_turn_of_a_rigid_closure_is_its_rotation_vector(axis, angle):
    chain = CHAINS["prototype-wrist"]
    q = chain.neutral()
    turn = Rotation.from_rotvec(angle * axis)
    q[3:7] = turn.as_quat()
    rows = chain.residual(q)[:6]
    # Near half a turn both signs of the axis are right.
    expected = turn.as_rotvec()
    assert np.linalg.norm(rows[3:]) == pytest.approx(np.linalg.norm(expected), rel=1e-12)
    np.testing.assert_allclose(Rotation.from_rotvec(rows[3:]).as_matrix(), turn.as_matrix(), atol=1e-14)


def test_dependent_motion_keeps_the_loops_closed(chain):
    rng = np.random.default_rng(13)
    actuated = list(chain.roles.actuated)
    if chain.description.name == "random-7-whole":
        actuated = ["root_joint"]  # five actuators for three freedoms would contradict each other
    count = len(chain.velocity_indices(actuated))
    for q in open_configurations(chain, 14):
        q = chain.close(q)
        velocity, acceleration = rng.normal(size=(2, count))
        v, a = chain.dependent_motion(q, actuated, velocity, acceleration)
        indices = chain.velocity_indices(actuated)
        np.testing.assert_array_equal(v[indices], velocity)
        np.testing.assert_array_equal(a[indices], acceleration)
        J, drift = chain.constraint_jacobian(q), chain.constraint_drift(q, v)
        assert np.abs(J @ v).max() < 1e-10 * (1 + np.abs(v).max())
        assert np.abs(J @ a + drift).max() < 1e-10 * (1 + np.abs(a).max())


def test_dependent_motion_follows_the_closed_path():
    # Second differences of step h along the path of the closed mechanism: h²/12 of a fourth derivative, and the
    # loops' 1e-12 over h².
    chain, h = CHAINS["five_bar"], 1e-3
    rates, growth = np.array([0.7, -0.4]), np.array([0.3, 0.9])
    q = five_bar().q
    v, a = chain.dependent_motion(q, chain.roles.actuated, rates, growth)

    def at(t):
        there = q.copy()
        there[[0, 2]] += rates * t + growth * t**2 / 2
        return chain.close(there, hold=chain.roles.actuated)

    np.testing.assert_allclose((at(h) - at(-h)) / (2 * h), v, atol=1e-5)
    np.testing.assert_allclose((at(h) - 2 * q + at(-h)) / h**2, a, atol=1e-4)


def test_too_few_joints_leave_freedoms_and_too_many_contradict():
    chain, q = CHAINS["five_bar"], five_bar().q
    with pytest.raises(UndeterminedMotion) as caught:
        chain.dependent_motion(q, ["left_crank_hinge"], [1.0])
    assert caught.value.free == 1
    with pytest.raises(InvalidInput, match="opens the loops"):
        chain.dependent_motion(q, chain.model.names[1:], [1.0, 0.0, 0.0, 0.0])
    with pytest.raises(InvalidInput, match="twice"):
        chain.dependent_motion(q, ["left_crank_hinge"] * 2, [1.0, 1.0])
    with pytest.raises(LoopNotClosed):
        chain.dependent_motion(q + 0.1, chain.roles.actuated, [1.0, 1.0])


@pytest.mark.parametrize("part", ["whole", "wrist"])
def test_root_motion_is_told_in_world_axes(part):
    chain = CHAINS[f"prototype-{part}"]
    rng = np.random.default_rng(15)
    omega, eta = rng.normal(size=(2, 3))
    linear = () if part == "whole" else tuple(rng.normal(size=(2, 3)))
    q = open_configurations(chain, 16, count=1)[0]
    v, a = np.zeros((2, chain.model.nv))
    root = chain.velocity_slice("root_joint")
    v[root], a[root] = chain.root_motion(q, omega, eta, *linear)
    data = chain.model.createData()
    pin.forwardKinematics(chain.model, data, q, v, a)
    frame = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    velocity = pin.getVelocity(chain.model, data, 1, frame)
    acceleration = pin.getClassicalAcceleration(chain.model, data, 1, frame)
    np.testing.assert_allclose(velocity.angular, omega, atol=1e-14)
    np.testing.assert_allclose(acceleration.angular, eta, atol=1e-14)
    expected = linear if linear else (np.zeros(3), np.zeros(3))
    np.testing.assert_allclose(velocity.linear, expected[0], atol=1e-14)
    np.testing.assert_allclose(acceleration.linear, expected[1], atol=1e-14)


def test_root_motion_refuses_what_the_root_cannot_do():
    with pytest.raises(InvalidInput, match="centre"):
        CHAINS["prototype-whole"].root_motion(CHAINS["prototype-whole"].neutral(), [0] * 3, [0] * 3, [1, 0, 0])
    with pytest.raises(InvalidInput, match="spherical"):
        CHAINS["five_bar"].root_motion(five_bar().q, [0, 0, 1])


@pytest.mark.parametrize("bad", [np.zeros(3), np.full(4, np.nan), [0.0, 0.0, 0.0, np.inf], "q", np.zeros((4, 1))])
def test_bad_configurations_are_refused(bad):
    chain = CHAINS["five_bar"]
    for call in (chain.residual, chain.constraint_jacobian, chain.close, chain.mobility, chain.placements, chain.rnea):
        with pytest.raises(InvalidInput):
            call(bad)


def test_a_quaternion_that_is_none_is_refused():
    chain = CHAINS["prototype-whole"]
    q = chain.neutral()
    q[:4] *= 2.0
    with pytest.raises(InvalidInput, match="quaternion"):
        chain.close(q)


def test_unknown_names_list_what_there_is():
    chain = CHAINS["five_bar"]
    for call in (
        lambda: chain.placement(five_bar().q, "tipp"),
        lambda: chain.close(five_bar().q, hold=["left_crank"]),
        lambda: chain.rows("tipp"),
        lambda: chain.configuration_slice("left"),
    ):
        with pytest.raises(UnknownName) as caught:
            call()
        assert caught.value.available


def test_placements_are_pinocchios_frames():
    chain = CHAINS["prototype-whole"]
    q = open_configurations(chain, 17, count=1)[0]
    data = chain.model.createData()
    pin.framesForwardKinematics(chain.model, data, q)
    placements = chain.placements(q)
    for index, frame in enumerate(chain.model.frames):
        np.testing.assert_allclose(placements[frame.name].homogeneous, data.oMf[index].homogeneous, atol=1e-15)
        assert chain.placement(q, frame.name) == placements[frame.name]


def test_a_chain_can_be_pickled():
    chain = CHAINS["five_bar"]
    again = pickle.loads(pickle.dumps(chain))
    q = five_bar().q + 0.1
    np.testing.assert_array_equal(again.close(q), chain.close(q))
