"""What the elastic equations leave of each part's balance, against the affine state of the device at the same place."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from wrists import random_mechanism, regular_poses

import exo_pin as ep
from exo_pin.load_case.pose_stacks import arm_loads, as_query
from exo_pin.wrist.forces.displaced import MovedDevice
from exo_pin.wrist.forces.elastic_equilibrium import ElasticEquations, displacement_under, settle

pytestmark = pytest.mark.usefixtures("plain")

HARNESS, CUFF = ep.Interface.of(3e4, 500.0, [0, 0.05, 0]), ep.Interface.upper_arm_cuff(0.2, 4.0)
STIFFNESS = np.diag([1e4, 2e4, 3e4]) + 2e3
#: Wrench of the device's own moving part, N and N m.
OWN = np.array([3.0, -2.0, -8.0, 0.4, 0.7, -0.3])
KINDS = [
    (parts, locked, heavy) for parts in ("", "h", "c", "hc") for locked in (False, True) for heavy in (False, True)
]


def equations_of(parts, locked, heavy, scale=1.0, limbs=3, count=2):
    """Gravity, offsets, load and the device's own wrench, all times ``scale``."""
    rng = np.random.default_rng(230)
    bodies = [ep.LimbBody.rod(0.2, 0.12, 0.012), ep.LimbBody(0.3, 0.05, 2e-3, 7e-4)] if heavy else [None, None]
    own = [ep.Limb("UPU", *bodies, guide=ep.LimbGuide(60.0, 50.0, 4e5, 3e3))] * (limbs - 1) + [ep.Limb("SPS", *bodies)]
    mechanism = random_mechanism(rng, limbs)
    poses = regular_poses(mechanism, rng, count, margin=0.1)
    mechanism = mechanism.replace(
        limbs=own,
        gravity=scale * np.array(mechanism.gravity),
        interfaces=ep.Interfaces(HARNESS if "h" in parts else None, CUFF if "c" in parts else None),
    )
    base, cuff = 0.01 * scale * rng.normal(size=(2, count, 3))
    load = ep.Load([5.0 * scale, -3.0 * scale, 2.0 * scale], [0.1 * scale, 0.2 * scale, -0.1 * scale])

    def loads(rows, matrices):
        force, moment, _ = arm_loads(
            mechanism.arm, mechanism.gravity, as_query(Rotation.from_matrix(matrices), None, load)
        )
        return force, moment, np.tile(scale * OWN, (len(rows), 1))

    return ElasticEquations(mechanism, as_query(poses), base, cuff, loads, STIFFNESS, locked)


def unknowns(equations):
    x = 0.01 * np.random.default_rng(231).normal(size=(2, equations.size))
    if equations.locked:
        x[:, equations.parts[3].stop :] *= 2e3
    return x


@pytest.mark.parametrize(("parts", "locked", "heavy"), KINDS)
def test_what_is_left_is_what_the_forces_of_the_moved_device_leave(parts, locked, heavy):
    equations, rows = equations_of(parts, locked, heavy), np.arange(2)
    x = unknowns(equations)
    left = equations(rows, x, np.ones(2))[0]
    moved = MovedDevice(equations, rows, x)
    state, side = moved.displaced.state, moved.displaced.side
    g = side.stiffness * side.deflection
    f = moved.movement.forces if locked else moved.displaced.tensions.f + np.einsum(
        "kij,kj->ki", moved.displaced.tensions.f_of_g, g
    )  # fmt: skip
    on_arm, on_torso = (part.sum(axis=1) for part in state.wrenches(f, g))
    delta = x[:, :3]
    # The shoulder's own spring holds it, and not the F_s that is left for it.
    expected = [-state.shoulder_force(f, g) - delta @ STIFFNESS]
    if locked:
        unheld = np.einsum("kij,kj->ki", state.moment_of_f, f) + np.einsum("kij,kj->ki", state.moment_of_g, g)
        expected.append(unheld - state.moment)
    if "h" in parts:
        spring = x[:, equations.parts[2]]
        expected.append(spring - displacement_under(HARNESS, spring, on_torso, delta))
    if "c" in parts:
        # In the axes of the arm, about its joint: what the limbs and its own weight put on the platform.
        back = np.swapaxes(moved.movement.arm, 1, 2)
        wrench = (on_arm + OWN).reshape(2, 2, 3) @ np.swapaxes(back, 1, 2)
        spring = x[:, equations.parts[3]]
        expected.append(spring - displacement_under(CUFF, spring, wrench.reshape(2, 6), np.zeros((2, 3))))
    if locked:
        points = equations.mechanism.geometry
        aligned = points.platform_points @ np.swapaxes(equations.query.matrices, 1, 2) - points.base_points
        expected.append(moved.movement.lengths - np.linalg.norm(aligned, axis=2))
    expected = np.concatenate(expected, axis=1)
    assert np.abs(expected).min(axis=0).max() > 1.0
    np.testing.assert_allclose(left, expected, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(("parts", "locked", "heavy"), KINDS)
def test_a_share_of_the_load_is_the_load_of_a_lighter_device(parts, locked, heavy):
    """With that share of gravity, of the load and of both offsets, in full."""
    whole, part, rows = equations_of(parts, locked, heavy), equations_of(parts, locked, heavy, 0.6), np.arange(2)
    x = unknowns(whole)
    ours, theirs = whole(rows, x, np.full(2, 0.6))[0], part(rows, x, np.ones(2))[0]
    np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-10)
    assert np.abs(ours - whole(rows, x, np.ones(2))[0]).max() > 1.0


@pytest.mark.parametrize("limbs", [3, 4])
@pytest.mark.parametrize("heavy", [False, True])
def test_a_held_pose_that_has_settled_follows_from_its_own_wrenches(limbs, heavy):
    """Of more than three limbs with the shortest tensions."""
    equations, rows = equations_of("hc", False, heavy, 0.2, limbs), np.arange(2)
    x, reached = settle(equations, rows)
    np.testing.assert_array_equal(reached, 1.0)
    moved = MovedDevice(equations, rows, x)
    state, side = moved.displaced.state, moved.displaced.side
    g = side.stiffness * side.deflection
    for k in rows:
        row = state.row(k)
        f = np.linalg.lstsq(row.moment_of_f, row.moment - row.moment_of_g @ g[k], rcond=None)[0]
        on_arm, on_torso = (part.sum(axis=0) for part in row.wrenches(f, g[k]))
        delta = np.linalg.solve(STIFFNESS, -row.shoulder_force(f, g[k]))
        np.testing.assert_allclose(equations.led_to(x[k], k, delta, on_torso, on_arm + 0.2 * OWN), x[k], atol=1e-9)
    assert np.abs(x).min() > 1e-8
    assert np.abs(x).max() > 1e-3
