"""Published numbers of held poses, and verdicts against programs that know nothing of the package's."""

import dataclasses

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.spatial.transform import Rotation
from wrists import exo_of, random_mechanism, regular_poses

import exo_pin as ep
from exo_pin.study import evaluate


def test_published_examples():
    """Four cables at flexion 60°, abduction 30°, a lift, and which of two designs loads the shoulder less."""
    cables, linear = ep.load("four-cables"), ep.load("four-linear-actuators")
    answer = cables.reaction(cables.pose(60, 30))
    assert answer.magnitude == pytest.approx(46.46, abs=0.01)
    assert answer.actuator_forces.min() >= -1e-9
    lift = cables.pose([0, 30, 60, 90], 30)
    table = cables.compare(linear, lift)
    assert table["peak_F_s_N"][0] == pytest.approx(67.19, abs=0.01)
    assert table["peak_F_s_N"][1] == pytest.approx(42.06, abs=0.01)
    turn = 90.0 * (0.5 - 0.5 * np.cos(np.pi * np.linspace(0.0, 1.0, 41)))
    raised = ep.Movement.from_samples(np.linspace(0.0, 2.0, 41), cables.pose(turn, 30), smoothing=None)
    assert cables.follow(raised).peak == pytest.approx(62.79, abs=0.01)
    weak = ep.load("three-linear-actuators")
    limbs = [dataclasses.replace(limb, actuator=ep.Actuator("linear", 1.0, 1.0)) for limb in weak.limbs]
    assert evaluate(weak.replace(limbs=limbs), ep.adl_box(20.0))["holdable"] == 0.0
    # Numbers given as limits narrow those of the design.
    far = cables.reaction(cables.pose(70, 110), limits=1e5)
    assert not far.can_hold
    daily = cables.reaction(ep.adl_box(20.0))
    assert (daily.actuator_forces[daily.can_hold] >= -1e-9).all()


def balance(exo, pose, offset):
    """M_f, m, S_f and the load of M_f f = m and F_s = S_f f - load, and the stretches of the limbs, by hand.

    ``offset`` shifts base and cuff, each in its own axes.
    """
    R, geometry, arm = pose.as_matrix(), exo.geometry, exo.arm
    b, load = (geometry.platform_points + offset) @ R.T, arm.mass * exo.mechanism.gravity
    lines = b - geometry.base_points - offset
    s = lines / np.linalg.norm(lines, axis=1)[:, None]
    spans = [limb.stroke for limb in exo.limbs]
    lengths = [(size - own.end_fitting) / own.nominal_length for own, size in
               zip(spans, np.linalg.norm(lines, axis=1), strict=True)]  # fmt: skip
    inside = all(own.shortest <= length <= own.longest for own, length in zip(spans, lengths, strict=True))
    return np.cross(b, s).T, np.cross(R @ arm.centre_of_mass, load), s.T, load, inside


def room(exo, pose, offset, cone=None):
    """By how much every limit can be kept away from, N, by a linear program; negative or None if none is met."""
    moments, moment, pulls, load, inside = balance(exo, pose, offset)
    low, high = np.array([(limb.actuator.least_tension or -limb.actuator.push_limit, limb.actuator.pull_limit)
                          for limb in exo.limbs]).T  # fmt: skip
    rows, limits = [np.eye(len(low)), -np.eye(len(low))], [high, -low]
    if cone is not None:
        normals, beyond = cone.half_spaces(exo.side, pose)
        rows, limits = [*rows, normals @ pulls], [*limits, beyond + normals @ load]
    A = np.vstack(rows)
    found = linprog([*np.zeros(len(low)), -1.0], np.hstack([A, np.ones((len(A), 1))]), np.concatenate(limits),
                    np.hstack([moments, np.zeros((3, 1))]), moment, bounds=(None, None))  # fmt: skip
    return -found.fun if inside and found.status == 0 else None


@pytest.mark.parametrize(
    ("name", "split", "compression", "offset"),
    [
        pytest.param("four-cables", "spherical", 100.0, (0.0, 0.0, 0.0), marks=pytest.mark.full),
        ("four-cables", "minimal", 400.0, (0.0, 0.0, 0.0)),
        pytest.param("four-cables", "minimal", None, (0.01, 0.0, 0.01), marks=pytest.mark.full),
        ("four-linear-actuators", "minimal", None, (0.0, -0.015, 0.02)),
    ],
)
def test_no_verdict_is_wrong_with_a_cone_or_an_offset(name, split, compression, offset):
    """A linear program of its own says whether there are tensions; also where the limbs can only just hold."""
    exo, poses = ep.load(name), ep.adl_box(20.0)
    poses = Rotation.from_quat(poses.as_quat().reshape(-1, 4))[::2]
    cone = None if compression is None else ep.Person(1.75, 75, "male").glenoid_cone(muscle_compression=compression)
    answer = exo.reaction(poses, split=split, cone=cone, centre_offset=offset if any(offset) else None)
    left = [room(exo, pose, np.array(offset), cone) for pose in poses]
    clear = np.array([value is None or abs(value) > 1e-6 for value in left])
    held = np.array([value is not None and value > 0.0 for value in left])
    assert 0 < held.sum() < held.size
    np.testing.assert_array_equal(answer.can_hold[clear], held[clear])


def _can_be_held(answer, k):
    """Whether tensions of 0 to 3000 N and any side forces balance the arm without a shoulder, by a linear program."""
    state, upu = answer.source.poses.state.row(k), answer.source.poses.upu
    n = len(state.closure)
    A = np.block(
        [
            [state.moment_of_f, np.zeros((3, upu.size))],
            [state.shoulder_of_f, state.shoulder_of_g[:, upu]],
        ]
    )
    b = np.concatenate([state.moment, -state.shoulder])
    bounds = [(0.0, 3000.0)] * n + [(None, None)] * upu.size
    return linprog(np.zeros(n + upu.size), A_eq=A, b_eq=b, bounds=bounds).status == 0


@pytest.mark.parametrize(("sides", "cables"), [(0, 6), (0, 7), (1, 4), (3, 2)])
def test_without_a_shoulder_only_tensions_that_leave_it_unloaded_count(sides, cables):
    kinds = ["UPU"] * sides + ["SPS"] * cables
    rng = np.random.default_rng(90)
    mechanism = random_mechanism(rng, len(kinds), kinds)
    pull = ep.Actuator("cable", pull_limit=3000.0)
    stroke = ep.Stroke(0.3, 0.01, 10.0, 0.0)
    exo = exo_of(mechanism.replace(limbs=[ep.Limb(kind, actuator=pull, stroke=stroke) for kind in kinds]))
    poses = regular_poses(mechanism, rng, 15, margin=0.1)
    alone, held = (exo.reaction(poses, split="standalone", limits=bounds) for bounds in ("none", "design"))
    assert alone.has_answer.all()
    np.testing.assert_allclose(alone.shoulder_force, 0.0, atol=1e-6)
    np.testing.assert_array_equal(held.can_hold, [_can_be_held(held, k) for k in range(len(poses))])
    np.testing.assert_allclose(held.shoulder_force[held.can_hold], 0.0, atol=1e-6)
    assert held.actuator_forces[held.can_hold].min(initial=0.0) >= -1e-9
    # With a shoulder, other tensions hold some more of these poses, unless three side forces can replace it.
    assert (exo.reaction(poses).can_hold & ~held.can_hold).any() == (sides < 3)
