"""The reaction query, through Pinocchio and ProxSuite, against the closed form and against exhaustive answers."""

import dataclasses
import itertools
import json

import numpy as np
import pytest
from mujoco_oracle import MujocoWrist
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation
from wrists import random_mechanism, regular_poses

import exo_pin as ep
from exo_pin import wrist
from exo_pin.conventions import MIRROR, mirrored
from exo_pin.reaction import least_force

DEGREES = {"degrees": True}
PERSON = ep.Arm.from_anthropometry(1.75, 75, "male")


@pytest.fixture(scope="module")
def prototype():
    return ep.load("prototype")


def exo_of(mechanism):
    return ep.ShoulderExo.from_mechanism(mechanism)


def random_terms(rng, count):
    velocity, acceleration, force, moment = rng.normal(size=(4, count, 3))
    return ep.Motion(3 * velocity, 3 * acceleration), ep.Load(10 * force, moment)


MECHANISMS = {
    "prototype": lambda: ep.load("prototype").mechanism,
    "prototype-right": lambda: ep.load("prototype", side="right").mechanism,
    "worn": lambda: ep.load("prototype").worn_by(PERSON).mechanism,
    "random-3": lambda: random_mechanism(np.random.default_rng(20), 3),
    "random-3-mixed": lambda: random_mechanism(np.random.default_rng(21), 3, ["SPS", "UPU", "SPS"]),
    "random-5": lambda: random_mechanism(np.random.default_rng(22), 5, ["UPU", "SPS", "UPU", "SPS", "UPU"]),
}


@pytest.mark.parametrize("name", MECHANISMS)
def test_pinocchio_equals_the_closed_form(name):
    mechanism = MECHANISMS[name]()
    rng = np.random.default_rng(23)
    poses = regular_poses(mechanism, rng, 200)
    assert len(poses) == 200
    motion, load = random_terms(rng, len(poses))
    splits = ["spherical", "standalone"] if mechanism.is_upu.sum() >= 3 else ["spherical"]
    for split in splits:
        for terms, closed in (
            ((None, load), wrist.statics(mechanism, poses, load, split)),
            ((motion, load), wrist.dynamics(mechanism, poses, motion, load, split)),
        ):
            answer = exo_of(mechanism).reaction(poses, *terms, split=split)
            assert (answer.status == closed.status).all()
            scale = np.abs(closed.actuator_forces).max(axis=1) + np.abs(closed.constraint_forces).max(axis=1) + 10
            for own, other in (
                (answer.actuator_forces, closed.actuator_forces),
                (answer.constraint_forces, closed.constraint_forces),
                (answer.shoulder_force, closed.shoulder_force),
            ):
                np.testing.assert_allclose((own - other) / scale[:, None], 0, atol=1e-9)
            assert answer.residual.max() < 1e-9
            assert answer.is_balanced()


@pytest.mark.parametrize("name", ["prototype", "random-3", "random-5"])
def test_pinocchio_equals_mujoco(name):
    mechanism = MECHANISMS[name]()
    rng = np.random.default_rng(24)
    poses = regular_poses(mechanism, rng, 200)
    motion, load = random_terms(rng, len(poses))
    exo, oracle, none = exo_of(mechanism), MujocoWrist(mechanism), np.zeros(3)
    still, moving = exo.reaction(poses), exo.reaction(poses, motion, load)
    assert len(poses) == 200
    for k, pose in enumerate(poses):
        for answer, terms in (
            (still, (none,) * 4),
            (moving, (motion.angular_velocity[k], motion.angular_acceleration[k], load.force[k], load.moment[k])),
        ):
            tensions, shoulder, _ = oracle.forces(pose, *terms)
            scale = max(np.abs(tensions).max(), np.abs(shoulder).max())
            np.testing.assert_allclose(answer.actuator_forces[k], tensions, atol=1e-8 * scale)
            np.testing.assert_allclose(answer.shoulder_force[k], shoulder, atol=1e-8 * scale)


def test_reference_pose_of_the_prototype(prototype):
    answer = prototype.reaction(ep.thesis_rotation(40, -20, -30, **DEGREES))
    np.testing.assert_allclose(answer.actuator_forces, [0.478730, 3.732240, 13.185893], atol=1e-6)
    np.testing.assert_allclose(answer.shoulder_force, [6.136294, 13.289826, -2.869032], atol=2e-6)


def heavy_limbs(mechanism, rng):
    def half():
        return ep.LimbBody.rod(0.05 + 0.2 * rng.random(), 0.1 + 0.1 * rng.random(), 0.01)

    return mechanism.replace(limbs=tuple(ep.Limb(limb.kind, half(), half()) for limb in mechanism.limbs))


@pytest.mark.parametrize("name", ["prototype", "random-3-mixed", "random-5"])
def test_limbs_with_mass_balance_as_free_bodies(name):
    """Each limb: torso's wrench + arm's wrench + weight = rate of change of momentum, by differences of its motion."""
    mechanism = heavy_limbs(MECHANISMS[name](), np.random.default_rng(25))
    rng = np.random.default_rng(26)
    poses = regular_poses(mechanism, rng, 10, margin=0.1)
    motion, load = random_terms(rng, len(poses))
    answer = exo_of(mechanism).reaction(poses, motion, load)
    assert answer.residual.max() < 1e-9
    step = np.finfo(float).eps ** 0.25  # second differences: truncation and rounding both about 1e-8 of the scale

    for k, pose in enumerate(poses):
        omega, eta = motion.angular_velocity[k], motion.angular_acceleration[k]

        def momenta(t, pose=pose, omega=omega, eta=eta):
            """Momentum and moment of momentum about O of each limb by differences, at time t."""
            state = {s: limb_points(mechanism, moved(pose, omega, eta, t + s)) for s in (-step / 2, step / 2)}
            return limb_momenta(mechanism, state[-step / 2], state[step / 2], step)

        rate = (momenta(step) - momenta(-step)) / (2 * step)
        weight = limb_weights(mechanism, limb_points(mechanism, pose))
        forces = -answer.harness_wrenches[k] - answer.limb_wrenches[k] + weight
        scale = max(np.abs(answer.limb_wrenches[k]).max(), 1)
        np.testing.assert_allclose(forces, rate, atol=3e-5 * scale)


def moved(pose, omega, eta, t):
    return Rotation.from_rotvec(omega * t + eta * t**2 / 2) * pose


def limb_points(mechanism, pose):
    """Two point masses and an axial spin cannot stand for a rod, so six points a half: the same mass properties."""
    state = wrist.inverse_kinematics(mechanism.geometry, pose)
    points, masses = [], []
    for i, limb in enumerate(mechanism.limbs):
        s, X = state.directions[i], state.normals[i]
        own, weights = [], []
        for half, joint, sign in (
            (limb.base_body, mechanism.geometry.base_points[i], 1.0),
            (limb.platform_body, state.platform_points[i], -1.0),
        ):
            centre = joint + sign * half.centre * s
            m = half.mass / 6
            # Pairs at ±r along the three axes: axial inertia 4 m r_t², transverse 2 m (r_t² + r_s²).
            # An SPS limb's idle spin is no matter of the model: a rod without inertia about its own line.
            r_t = np.sqrt(half.axial_inertia / (4 * m)) if limb.kind == "UPU" else 0.0
            r_s = np.sqrt(half.transverse_inertia / (2 * m) - r_t**2)
            for axis, r in ((s, r_s), (X, r_t), (np.cross(s, X), r_t)):
                own += [centre + r * axis, centre - r * axis]
                weights += [m, m]
        points.append(own)
        masses.append(weights)
    return np.array(points), np.array(masses)


def limb_momenta(mechanism, before, after, step):
    (p, masses), (q, _) = before, after
    velocity, middle = (q - p) / step, (p + q) / 2
    momentum = (masses[..., None] * velocity).sum(axis=1)
    angular = (masses[..., None] * np.cross(middle, velocity)).sum(axis=1)
    return np.concatenate([momentum, angular], axis=1)


def limb_weights(mechanism, state):
    points, masses = state
    weight = masses[..., None] * mechanism.gravity
    return np.concatenate([weight.sum(axis=1), np.cross(points, weight).sum(axis=1)], axis=1)


def test_side_force_is_the_couple_in_the_universal_joint():
    """With heavy limbs too: g = 0 leaves no couple at B_i across both axes of its joint, (D-13), (D-18)."""
    mechanism = heavy_limbs(MECHANISMS["prototype"](), np.random.default_rng(27))
    poses = regular_poses(mechanism, np.random.default_rng(28), 10)
    exo = exo_of(mechanism)
    for split in ("spherical", "standalone"):
        answer = exo.reaction(poses, split=split)
        state = wrist.inverse_kinematics(mechanism.geometry, poses)
        force, moment = answer.limb_wrenches[..., :3], answer.limb_wrenches[..., 3:]
        couple = moment - np.cross(state.platform_points, force)
        radius = np.linalg.norm(state.platform_points, axis=-1)
        across = np.cross(state.platform_points / radius[..., None], state.normals)
        expected = answer.constraint_forces[..., None] * radius[..., None] * across
        np.testing.assert_allclose(couple, expected, atol=1e-9 * max(1, np.abs(moment).max()))


def exhaustive(constant, effect, lower, upper):
    """Least |c + G z| by trying every active set."""
    best = np.inf
    for pattern in itertools.product((-1, 0, 1), repeat=effect.shape[1]):
        pattern = np.array(pattern)
        z = np.where(pattern < 0, lower, np.where(pattern > 0, upper, 0.0))
        if not np.isfinite(z).all():
            continue
        free = pattern == 0
        if free.any():
            rest = constant + effect[:, ~free] @ z[~free]
            z[free] = np.linalg.lstsq(effect[:, free], -rest, rcond=None)[0]
        if (z < lower - 1e-12).any() or (z > upper + 1e-12).any():
            continue
        best = min(best, float(np.linalg.norm(constant + effect @ z)))
    return best


def test_least_force_equals_an_exhaustive_answer():
    rng = np.random.default_rng(30)
    for case in range(1000):
        m = int(rng.integers(1, 6))
        effect = rng.normal(size=(3, m))
        effect /= np.linalg.norm(effect, axis=0)
        if case % 5 == 0 and m >= 3:
            # Three side forces that nearly, or quite, fail to span space.
            effect[:, 2] = effect[:, :2] @ rng.normal(size=2) + 10 ** rng.uniform(-16, -1) * rng.normal(size=3)
        constant = rng.normal(size=3) * 10 ** rng.uniform(-1, 3)
        reach = np.abs(rng.normal(size=m)) * 20
        lower, upper = -reach, reach * rng.uniform(0, 2, size=m)
        if case % 7 == 0:
            upper[0] = np.inf
        answer = least_force(constant, effect, lower, upper)
        assert answer.residual <= 1e-8
        assert (answer.variables >= lower).all()
        assert (answer.variables <= upper).all()
        np.testing.assert_allclose(constant + effect @ answer.variables, answer.force, atol=1e-9)
        best = exhaustive(constant, effect, lower, upper)
        assert abs(np.linalg.norm(answer.force) - best) <= 1e-8 * np.linalg.norm(constant)


def test_minimal_with_bounds_equals_an_exhaustive_answer(prototype):
    rng = np.random.default_rng(31)
    exo = prototype.worn_by(PERSON)
    poses = regular_poses(exo.mechanism, rng, 1000)
    lower = -60 * rng.random((1000, 3))
    upper = 60 * rng.random((1000, 3))
    answer = exo.reaction(poses, split="minimal", constraint_bounds=(lower, upper))
    assert (answer.constraint_forces >= lower).all()
    assert (answer.constraint_forces <= upper).all()
    state = exo.inverse_kinematics(poses)
    for k in range(1000):
        best = exhaustive(answer.spherical_force[k], state.normals[k].T, lower[k], upper[k])
        assert abs(answer.magnitude[k] - best) <= 1e-8 * np.linalg.norm(answer.spherical_force[k])


def test_actuator_bound(prototype):
    exo = prototype.worn_by(PERSON)
    poses = regular_poses(exo.mechanism, np.random.default_rng(32), 50)
    answer = exo.reaction(poses, split="minimal", constraint_bounds="actuator")
    assert (np.abs(answer.constraint_forces) <= np.abs(answer.actuator_forces) * (1 + 1e-12)).all()
    assert (answer.ratio <= 1 + 1e-12).all()
    assert answer.ratio.min() < 0.9
    assert not answer.trivial


def test_unbounded_minimum_is_zero_and_says_that_it_is_trivial(prototype):
    poses = regular_poses(prototype.mechanism, np.random.default_rng(33), 100, margin=1e-3)
    answer = prototype.reaction(poses, split="minimal")
    assert answer.magnitude.max() <= 1e-9 * prototype.arm.mass * 9.81
    assert answer.trivial
    assert "trivial" in str(answer)
    infinite = prototype.reaction(poses[:3], split="minimal", constraint_bounds=(-np.inf, np.inf))
    assert infinite.trivial
    mixed = exo_of(MECHANISMS["random-3-mixed"]()).reaction(Rotation.identity(), split="minimal")
    assert not mixed.trivial
    assert mixed.magnitude > 1.0
    assert mixed.constraint_forces[[0, 2]].tolist() == [0, 0]


def test_more_limbs_lower_the_shoulder_force():
    mechanism = MECHANISMS["random-5"]().replace(limbs=(ep.Limb("SPS"),) * 5)
    poses = regular_poses(mechanism, np.random.default_rng(34), 30)
    exo = exo_of(mechanism)
    spherical, minimal = exo.reaction(poses), exo.reaction(poses, split="minimal")
    assert (minimal.magnitude < spherical.magnitude).all()
    # Optimal: what is left stands across everything that two self-stresses can do.
    J, state = exo.jacobian(poses), exo.inverse_kinematics(poses)
    for k in range(len(poses)):
        stress = np.linalg.svd(J[k].T)[2][3:].T
        np.testing.assert_allclose(stress.T @ state.directions[k] @ minimal.shoulder_force[k], 0, atol=1e-7)
        np.testing.assert_allclose(J[k].T @ (minimal.actuator_forces[k] - spherical.actuator_forces[k]), 0, atol=1e-9)


def test_standalone_equals_the_chain_without_a_ball_joint(prototype):
    """Inverse dynamics of the free-flying wrist in Pinocchio, by its closure Jacobian alone."""
    import pinocchio as pin

    from exo_pin.chain import mechanism_urdf

    chain = ep.ClosedChain.from_urdf(*mechanism_urdf(prototype.mechanism, part="wrist"))
    with_shoulder = prototype.chain
    for pose in regular_poses(prototype.mechanism, np.random.default_rng(35), 5):
        start = with_shoulder.close(prototype._equilibrium.configuration(pose.as_matrix(), pose.as_quat()))
        q = chain.close(np.concatenate([np.zeros(3), start]))
        tau = pin.rnea(chain.model, chain.model.createData(), q, np.zeros(chain.model.nv), np.zeros(chain.model.nv))
        slides = [chain.model.joints[chain.model.getJointId(f"limb_{i}_slide")].idx_v for i in (1, 2, 3)]
        selection = np.eye(chain.model.nv)[:, slides]
        unknown = np.linalg.solve(np.hstack([chain.constraint_jacobian(q).T, selection]), tau)
        answer = prototype.reaction(pose, split="standalone")
        np.testing.assert_allclose(-unknown[-3:], answer.actuator_forces, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(answer.shoulder_force, 0, atol=1e-9)


@pytest.mark.parametrize("split", ["spherical", "minimal", "standalone"])
def test_right_shoulder_is_the_mirror_image(split):
    left, right = (ep.load("prototype", side=side).worn_by(PERSON) for side in ("left", "right"))
    poses = regular_poses(left.mechanism, np.random.default_rng(36), 20)
    lower, upper = np.array([-5.0, -20, -1]), np.array([30.0, 2, 8])
    bounds = {"left": None, "right": None}
    if split == "minimal":
        bounds = {"left": (lower, upper), "right": (-upper, -lower)}
    a = left.reaction(poses, split=split, constraint_bounds=bounds["left"])
    b = right.reaction(mirrored(poses), split=split, constraint_bounds=bounds["right"])
    scale = np.abs(a.constraint_forces).max() + 1
    np.testing.assert_allclose(b.actuator_forces, a.actuator_forces, atol=1e-9 * scale)
    np.testing.assert_allclose(b.constraint_forces, -a.constraint_forces, atol=1e-8 * scale)
    np.testing.assert_allclose(b.shoulder_force, a.shoulder_force @ MIRROR, atol=1e-8 * scale)
    np.testing.assert_allclose(b.determinant, a.determinant, atol=1e-12)


def zero_of_abduction(exo):
    """Abduction in degrees at which det X = 0 next to rest."""
    return brentq(lambda a: float(exo.singularity(ep.shoulder_rotation(0, a, 0, **DEGREES)).determinant), 4.0, 9.0)


def test_singular_pose_and_path_through_the_surface(prototype):
    answer = prototype.reaction(ep.thesis_rotation(90, 0, 0, **DEGREES))
    assert answer.status == "singular"
    assert np.isnan(answer.shoulder_force).all()
    assert "singular" in str(answer)
    assert answer.certificate.undetermined == -1
    path = prototype.reaction(ep.shoulder_rotation(0, np.linspace(0, 30, 31), 0, **DEGREES))
    # det X changes sign at 6.21° of abduction.
    assert path.crossings().tolist() == [[6]]
    assert (path.status != "singular").all()
    fine = ep.shoulder_rotation(0, np.linspace(6.2, 6.22, 401), 0, **DEGREES)
    assert (prototype.reaction(fine).status == "near_singular").any()
    onto = prototype.reaction(ep.thesis_rotation([60, 90, 120], 0, 0, **DEGREES))
    assert onto.status.tolist() == ["ok", "singular", "ok"]
    # det X has the same sign on both sides: the path touches the surface and does not cross it.
    assert np.sign(onto.determinant[0]) == np.sign(onto.determinant[2])
    assert len(onto.crossings()) == 0
    through = prototype.reaction(ep.shoulder_rotation(0, [4.0, zero_of_abduction(prototype), 9.0], 0, **DEGREES))
    assert through.status[1] in ("singular", "near_singular")
    assert len(through.crossings()) == 1
    assert np.isfinite(onto.shoulder_force[[0, 2]]).all()


def test_certificate_of_the_wrist(prototype):
    certificate = prototype.reaction(ep.thesis_rotation(40, -20, -30, **DEGREES)).certificate
    assert certificate.undetermined == 3
    assert certificate.redundant_closures == 3
    assert certificate.actuator_forces.all()
    assert not certificate.constraint_forces.any()
    assert not certificate.shoulder_force.any()
    assert certificate.torso_wrench
    cables = prototype.replace(limbs=(ep.Limb("SPS"),) * 3).reaction(Rotation.identity()).certificate
    assert cables.undetermined == 0
    assert cables.shoulder_force.all()
    assert "determines every reaction" in str(cables)
    five = exo_of(MECHANISMS["random-5"]()).reaction(Rotation.identity()).certificate
    assert five.undetermined == 5
    assert not five.actuator_forces.any()
    assert five.torso_wrench


def test_ratio(prototype):
    # The g = 0 force of the prototype's own arm vanishes at this pose, so the ratio has no meaning there.
    null = ep.shoulder_rotation(112.098, -23.698, 10.153, **DEGREES)
    assert prototype.reaction(null).magnitude < 1e-3
    answer = prototype.reaction(
        ep.thesis_rotation(40, -20, -30, **DEGREES), split="minimal", constraint_bounds="actuator"
    )
    assert answer.ratio == pytest.approx(answer.magnitude / np.linalg.norm(answer.spherical_force))
    weightless = prototype.replace(gravity=[0, 0, 0]).reaction(Rotation.identity())
    assert np.isnan(weightless.ratio)
    assert weightless.status == "ok"


def test_cuff_and_harness(prototype):
    exo = prototype.worn_by(PERSON)
    pose = ep.shoulder_rotation(30, 20, 0, **DEGREES)
    motion = ep.Motion([1.0, -2.0, 0.5], [3.0, 1.0, -2.0])
    load = ep.Load([0, 0, -5.0], at=[0, 0, -0.5])
    answer = exo.reaction(pose, motion, load)
    # The person's arm alone: cuff, shoulder, its weight, the load and its inertia balance.
    own = exo.arm.person
    assert own.mass == pytest.approx(PERSON.mass)
    centre = pose.as_matrix() @ own.centre_of_mass
    omega, eta = motion.angular_velocity, motion.angular_acceleration
    acceleration = np.cross(eta, centre) + np.cross(omega, np.cross(omega, centre))
    force = answer.cuff_wrench[:3] + answer.shoulder_force + own.mass * exo.mechanism.gravity + load.force
    np.testing.assert_allclose(force, own.mass * acceleration, atol=1e-9)
    # Massless limbs: what they put on the torso is what they take from the arm.
    np.testing.assert_allclose(answer.harness_wrenches, -answer.limb_wrenches, atol=1e-12)
    # Torso: harness and shoulder together carry all weight and inertia.
    total = answer.harness_wrenches[:, :3].sum(axis=0) - answer.shoulder_force
    whole = exo.arm
    c = pose.as_matrix() @ whole.centre_of_mass
    a = np.cross(eta, c) + np.cross(omega, np.cross(omega, c))
    np.testing.assert_allclose(total, whole.mass * (exo.mechanism.gravity - a) + load.force, atol=1e-9)


def test_stacks_of_any_shape(prototype):
    poses = ep.shoulder_rotation(np.linspace(0, 60, 4)[:, None], np.linspace(10, 50, 3), 0, **DEGREES)
    answer = prototype.reaction(poses)
    assert answer.shoulder_force.shape == (4, 3, 3)
    assert answer.limb_wrenches.shape == (4, 3, 3, 6)
    assert answer.certificate.shoulder_force.shape == (4, 3, 3)
    np.testing.assert_array_equal(answer.shoulder_force[2, 1], prototype.reaction(poses[2][1]).shoulder_force)
    assert prototype.reaction(poses[:0]).status.shape == (0, 3)


def test_answers_print_and_turn_into_json(prototype):
    exo = prototype.worn_by(PERSON)
    single = exo.reaction(ep.shoulder_rotation(30, 20, 0, **DEGREES))
    assert single.percent_body_weight == pytest.approx(100 * single.magnitude / (75 * 9.81))
    text = str(single)
    for part in ("% of body weight", "limb 3 side force", "Equilibrium leaves 3 reactions open", "cuff"):
        assert part in text
    back = json.loads(single.to_json())
    np.testing.assert_array_equal(back["shoulder_force"], single.shoulder_force)
    stack = exo.reaction(ep.thesis_rotation([10, 90], 0, 0, **DEGREES))
    assert json.loads(stack.to_json())["shoulder_force"][1] == [None] * 3
    assert "with an answer" in str(stack)
    for part in ("poses", "crossings"):
        assert part in str(prototype.reaction(Rotation.random(0)))


def arrays_of(record):
    """All arrays of a record and of the records in it, by name."""
    for name, value in vars(record).items():
        if isinstance(value, np.ndarray):
            yield name, value
        elif dataclasses.is_dataclass(value):
            yield from arrays_of(value)


def test_answers_are_read_only(prototype):
    poses = ep.shoulder_rotation([10, 60], 30, 0, **DEGREES)
    pulling = prototype.reaction(poses, actuator_bounds="pull")
    assert pulling.infeasibility is not None
    by_stiffness = prototype.replace(shoulder=ep.Shoulder(stiffness=2e4)).reaction(poses, split="elastic")
    records = [
        pulling,
        by_stiffness,
        pulling.certificate.components,
        prototype.reaction_map(poses),
        wrist.statics(prototype.mechanism, poses),
    ]
    for record in records:
        named = list(arrays_of(record))
        assert len(named) >= 5
        assert [name for name, array in named if array.flags.writeable] == []
    with pytest.raises(ValueError, match="read-only"):
        by_stiffness.shoulder_force[0] = 0.0


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"split": "fair"}, ep.UnknownName, "minimal, spherical, standalone"),
        ({"constraint_bounds": "actuator"}, ep.InvalidInput, "minimal"),
        ({"split": "minimal", "constraint_bounds": "muscle"}, ep.UnknownName, "actuator"),
        ({"split": "minimal", "constraint_bounds": (1.0, -1.0)}, ep.InfeasibleBounds, "lower bound above"),
        ({"split": "minimal", "constraint_bounds": (np.nan, 1.0)}, ep.InvalidInput, "NaN"),
        ({"split": "minimal", "constraint_bounds": (np.zeros(4), 1.0)}, ep.InvalidInput, "broadcast"),
        ({"split": "minimal", "constraint_bounds": 3.0}, ep.InvalidInput, "lower, upper"),
        ({"load": [0, 0, 1]}, ep.InvalidInput, "Load"),
        ({"motion": [0, 0, 1]}, ep.InvalidInput, "Motion"),
    ],
)
def test_bad_questions(prototype, arguments, error, message):
    with pytest.raises(error, match=message):
        prototype.reaction(Rotation.identity(), **arguments)


def test_questions_that_lack_data(prototype):
    with pytest.raises(ep.MissingData, match="arm mass"):
        ep.load("scenario-one").reaction(Rotation.identity())
    example = ep.load("appendix-d")
    assert example.reaction(Rotation.identity()).status == "ok"
    with pytest.raises(ep.MissingData, match="inertia"):
        example.reaction(Rotation.identity(), ep.Motion([1, 0, 0], [0, 0, 0]))
    with pytest.raises(ep.NonConvexBound):
        exo_of(MECHANISMS["random-5"]()).reaction(Rotation.identity(), split="minimal", constraint_bounds="actuator")
    with pytest.raises(ep.InvalidInput, match="too few"):
        exo_of(MECHANISMS["random-3-mixed"]()).reaction(Rotation.identity(), split="standalone")


def test_folded_cable_beside_others_is_answered():
    """A cable that points at O only loses its moment arm: the other four hold the pose."""
    rng = np.random.default_rng(60)
    base = rng.normal(size=(5, 3)) * 0.1 + [0, -0.1, 0.05]
    platform = rng.normal(size=(5, 3)) * 0.08 + [0, 0.02, -0.2]
    base[0], platform[0] = [0, 0, -0.1], [0, 0, -0.2]
    tilt = Rotation.from_rotvec([0.3, 0.2, 0.1])
    arm = random_mechanism(rng, 3).arm
    cables = ep.ShoulderExo(ep.WristGeometry(base, platform, neutral=tilt), arm, [ep.Limb("SPS")] * 5)
    poses = Rotation.from_euler("X", [[0.0], [10.0]], degrees=True)
    answer, closed = cables.reaction(poses), wrist.statics(cables.mechanism, poses)
    assert answer.status.tolist() == closed.status.tolist() == ["ok", "ok"]
    np.testing.assert_allclose(answer.shoulder_force, closed.shoulder_force, rtol=1e-9)
    np.testing.assert_allclose(answer.actuator_forces, closed.actuator_forces, rtol=1e-9, atol=1e-9)
    assert answer.actuator_forces[0, 0] == pytest.approx(0, abs=1e-12)
    heavy = exo_of(heavy_limbs(cables.mechanism, rng)).reaction(poses)
    assert (heavy.status == "ok").all()
    assert heavy.residual.max() < 1e-9


@pytest.mark.parametrize("split", ["spherical", "minimal", "elastic", "standalone"])
def test_folded_cable_beside_upu_limbs_is_answered(split):
    """It has no side force and needs no plane, so the UPU limbs hold the pose, by every way of asking."""
    rng = np.random.default_rng(69)
    base = rng.normal(size=(5, 3)) * 0.1 + [0, -0.1, 0.05]
    platform = rng.normal(size=(5, 3)) * 0.08 + [0, 0.02, -0.2]
    base[0], platform[0] = [0, 0, -0.1], [0, 0, -0.2]
    guide = ep.LimbGuide(50.0, 30.0)
    kinds = [ep.Limb("SPS")] + [ep.Limb(guide=guide)] * 3 + [ep.Limb("SPS")]
    geometry = ep.WristGeometry(base, platform, neutral=Rotation.from_rotvec([0.3, 0.2, 0.1]))
    exo = ep.ShoulderExo(geometry, random_mechanism(rng, 3).arm, kinds, ep.Shoulder(stiffness=2e4))
    folded, beside = Rotation.identity(), Rotation.from_rotvec([1e-6, -2e-6, 0])
    bounds = (-5.0, 8.0) if split == "minimal" else None
    answer, near = (exo.reaction(pose, split=split, constraint_bounds=bounds) for pose in (folded, beside))
    assert answer.status == near.status == "ok"
    assert answer.residual < 1e-9
    mapped = exo.reaction_map(folded, split=split, constraint_bounds=bounds)
    off = exo.reaction(folded, split=split, constraint_bounds=bounds, centre_offset=np.zeros(3))
    assert mapped.status == off.status == "ok"
    for other, tolerance in ((mapped, 1e-7), (off, 1e-7), (near, 1e-2)):
        np.testing.assert_allclose(answer.shoulder_force, other.shoulder_force, atol=tolerance)
    if split in ("spherical", "elastic"):
        assert answer.actuator_forces[0] == pytest.approx(0, abs=1e-9)
    assert exo.singularity(folded).kind == "regular"
    # A UPU limb in the same place has no plane, and nobody can say which way it pushes.
    stiff = exo.replace(limbs=(ep.Limb(guide=guide), *kinds[1:]))
    assert stiff.reaction(folded, split=split, constraint_bounds=bounds).status == "folded"
    assert stiff.reaction_map(folded, split=split, constraint_bounds=bounds).status == "folded"
    assert stiff.singularity(folded).kind == "folded"


def test_tension_of_heavy_limbs_is_what_the_slide_carries():
    """Free body of the platform half alone, along the limb, by second differences of its motion."""
    mechanism = heavy_limbs(MECHANISMS["random-3-mixed"](), np.random.default_rng(61))
    poses = regular_poses(mechanism, np.random.default_rng(62), 5, margin=0.1)
    motion, load = random_terms(np.random.default_rng(63), len(poses))
    answer = exo_of(mechanism).reaction(poses, motion, load)
    step = np.finfo(float).eps ** 0.25
    for k, pose in enumerate(poses):
        omega, eta = motion.angular_velocity[k], motion.angular_acceleration[k]

        def centres(t, pose=pose, omega=omega, eta=eta):
            state = wrist.inverse_kinematics(mechanism.geometry, moved(pose, omega, eta, t))
            half = np.array([limb.platform_body.centre for limb in mechanism.limbs])
            return state.platform_points - half[:, None] * state.directions

        acceleration = (centres(step) - 2 * centres(0.0) + centres(-step)) / step**2
        s = wrist.inverse_kinematics(mechanism.geometry, pose).directions
        mass = np.array([limb.platform_body.mass for limb in mechanism.limbs])[:, None]
        # On the platform half: the arm's force, its weight, and f from the slide, which pulls it to the torso, -s.
        from_slide = mass * (acceleration - mechanism.gravity) + answer.limb_wrenches[k, :, :3]
        f = -np.einsum("ij,ij->i", from_slide, s)
        np.testing.assert_allclose(f, answer.actuator_forces[k], atol=2e-6 * np.abs(f).max())


@pytest.mark.parametrize(
    ("kinds", "trivial"),
    [(["SPS"] * 6, True), (["UPU"] + ["SPS"] * 4, True), (["UPU", "UPU", "SPS"], False), (["SPS"] * 5, False)],
)
def test_trivial_minimum_is_judged_by_what_is_free(kinds, trivial):
    exo = exo_of(random_mechanism(np.random.default_rng(64), len(kinds), kinds))
    answer = exo.reaction(regular_poses(exo.mechanism, np.random.default_rng(65), 5, margin=0.05), split="minimal")
    assert answer.trivial is trivial
    assert bool(answer.magnitude.max() < 1e-7) is trivial


def test_six_cables_stand_alone():
    exo = exo_of(random_mechanism(np.random.default_rng(66), 6, ["SPS"] * 6))
    poses = regular_poses(exo.mechanism, np.random.default_rng(67), 5, margin=0.05)
    answer = exo.reaction(poses, split="standalone")
    assert (answer.status == "ok").all()
    assert answer.magnitude.max() < 1e-7
    assert answer.residual.max() < 1e-9


def test_limbs_in_planes_through_one_line_do_not_stand_alone():
    """Level limbs in upright planes: no side force nor self-stress lifts the centre, and the pose is singular."""
    base, platform = [], []
    for angle in (0.3, 1.6, 2.9):
        across = np.array([np.cos(angle), np.sin(angle), 0.0])
        base.append(0.1 * across - [0, 0, 0.1])
        platform.append(0.2 * across - [0, 0, 0.1])
    base.append([0.1, -0.12, 0.03])
    platform.append([0.06, 0.05, -0.21])
    geometry = ep.WristGeometry(base, platform)
    exo = ep.ShoulderExo(geometry, ep.load("prototype").arm, [ep.Limb()] * 3 + [ep.Limb("SPS")])
    answer = exo.reaction(Rotation.identity(), split="standalone")
    assert answer.status == "singular"
    assert np.isnan(answer.shoulder_force).all()


def test_bounds_of_any_size_keep_their_digits():
    rng = np.random.default_rng(68)
    for _ in range(300):
        effect = rng.normal(size=(3, 3))
        effect /= np.linalg.norm(effect, axis=0)
        constant = rng.normal(size=3) * 100
        reach = np.array([20.0, 20.0, 20.0])
        reach[rng.integers(3)] = 10.0 ** rng.uniform(2, 15)
        answer = least_force(constant, effect, -reach, reach)
        best = exhaustive(constant, effect, -reach, reach)
        assert abs(np.linalg.norm(answer.force) - best) <= 1e-8 * np.linalg.norm(constant)


def test_near_the_surface_the_unbounded_minimum_stays_small(prototype):
    zero = zero_of_abduction(prototype)
    poses = ep.shoulder_rotation(0, zero + np.array([1e-3, 1e-4, 1e-5]), 0, **DEGREES)
    answer = prototype.reaction(poses, split="minimal")
    assert (answer.status == "near_singular").all()
    # It is zero to the rounding of the side forces, which are huge there and must cancel.
    assert (answer.magnitude < 1e-15 * np.abs(answer.constraint_forces).max(axis=1)).all()
    assert np.abs(answer.constraint_forces).max() > 1e12


def test_leaning_trunk_mirrors(prototype):
    leaning = prototype.replace(gravity=[1.0, 2.0, -9.0])
    pose = ep.shoulder_rotation(60, 30, 10, **DEGREES)
    left, right = leaning.reaction(pose), leaning.mirrored().reaction(mirrored(pose))
    np.testing.assert_allclose(right.shoulder_force, left.shoulder_force @ MIRROR, atol=1e-9)
    lopsided = ep.Arm(2.0, [0.02, 0.05, -0.25])
    a = prototype.worn_by(lopsided).reaction(pose)
    b = ep.load("prototype", side="right").worn_by(lopsided).reaction(mirrored(pose))
    np.testing.assert_allclose(b.shoulder_force, a.shoulder_force @ MIRROR, atol=1e-9)


def test_weight_of_the_person_is_counted_on_earth(prototype):
    moon = prototype.worn_by(PERSON).replace(gravity=[0, 0, 0])
    answer = moon.reaction(ep.shoulder_rotation(60, 30, 0, **DEGREES))
    assert answer.body_weight == pytest.approx(75 * 9.81)
    assert answer.percent_body_weight == 0.0
    assert "% of body weight" in str(answer)
