"""3RPS with a passive ball against vectors: what its planes leave, drives by virtual work, and the box."""

import numpy as np
import pytest
from device_files import loaded, reached
from published_devices.rps_device import AT, LENGTHS, joints, platform_turn

from exo_pin import shoulder_rotation

CHAIN = loaded("3rps-passive-ball")
SLIDES = CHAIN.roles.actuated
BOX = [(flexion, abduction, 0) for flexion in np.linspace(0, 110, 6) for abduction in np.linspace(-4, 96, 6)]


def lines(direction, Q):
    """Balls seen from O, and the limbs from A_i to them, shape (3, 3) each, m."""
    A, _, b = joints()
    balls = AT * direction + b @ Q.T
    return balls, balls - A


def cuff_rates(direction, Q):
    """Velocity of the cuff's ball by the rates of the limbs' lengths, shape (3, 3)."""
    _, r, b = joints()
    arms, limbs = b @ Q.T, lines(direction, Q)[1]
    u = limbs / np.linalg.norm(limbs, axis=1, keepdims=True)
    # r_i · (v + ω × arm_i) = 0 and u_i · (v + ω × arm_i) = rate of l_i.
    rows = np.concatenate([np.hstack([r, np.cross(arms, r)]), np.hstack([u, np.cross(arms, u)])])
    return np.linalg.inv(rows)[:3, 3:]


def held(angles, at=AT):
    """Closed with the cuff where it is at rest on the arm."""
    q = reached(CHAIN, shoulder_rotation(*angles, degrees=True))
    fixed = CHAIN.locked(["root_joint", "cuff_slide"], _at_slide(q, AT - at))
    start = fixed.neutral()
    names = list(fixed.model.names)[1:]
    for name in names:
        start[fixed.configuration_slice(name)] = q[CHAIN.configuration_slice(name)]
    closed = fixed.close(start)
    for name in names:
        q[CHAIN.configuration_slice(name)] = closed[fixed.configuration_slice(name)]
    q[CHAIN.configuration_slice("cuff_slide")] = 0.0
    return q


def _at_slide(q, value):
    moved = q.copy()
    moved[CHAIN.configuration_slice("cuff_slide")] = value
    return moved


@pytest.mark.parametrize("angles", [(20, 10, 0), (70, 30, 0), (10, 80, 0), (100, 20, 30)])
def test_the_chain_stands_as_its_planes_say(angles):
    pose = shoulder_rotation(*angles, degrees=True)
    direction = pose.apply([0.0, 0.0, -1.0])
    q = held(angles)
    rest = platform_turn(np.array([0.0, 0.0, -1.0]))
    # Link frames are parallel to the arm's with the arm hanging, where the platform is already tilted.
    turned = CHAIN.placement(q, "platform").rotation @ rest
    np.testing.assert_allclose(turned, platform_turn(direction), atol=1e-8)
    lengths = np.linalg.norm(lines(direction, turned)[1], axis=1)
    slides = [q[CHAIN.configuration_slice(name)][0] for name in SLIDES]
    at_rest = np.linalg.norm(lines(np.array([0.0, 0.0, -1.0]), rest)[1], axis=1)
    np.testing.assert_allclose(slides, lengths - at_rest, atol=1e-8)


@pytest.mark.parametrize("angles", [(20, 10, 0), (70, 30, 0), (10, 80, 0)])
def test_drives_make_the_moment_of_a_load_by_virtual_work(angles):
    q = held(angles)
    pose = shoulder_rotation(*angles, degrees=True)
    direction = pose.apply([0.0, 0.0, -1.0])
    moment = np.cross(direction, np.random.default_rng(1).normal(size=3))
    bare, loaded_ = (CHAIN.inverse_dynamics(q, external=load) for load in ({}, {"arm": np.r_[np.zeros(3), moment]}))
    # The force on the arm at the cuff, across it, whose moment about O is the opposite.
    force = np.cross(direction, moment) / AT
    np.testing.assert_allclose(np.cross(AT * direction, force), -moment, atol=1e-12)
    change = [loaded_.effort(name)[0] - bare.effort(name)[0] for name in SLIDES]
    np.testing.assert_allclose(change, cuff_rates(direction, platform_turn(direction)).T @ force, atol=1e-6)
    # And the shoulder bears the opposite of that force.
    shoulder = [each.joint_reaction("root_joint", on="arm").force for each in (bare, loaded_)]
    np.testing.assert_allclose(shoulder[1] - shoulder[0], -force, atol=1e-6)
    along = [each.joint_reaction("cuff_slide", in_frame="world").force @ direction for each in (bare, loaded_)]
    np.testing.assert_allclose(along, 0.0, atol=1e-9)


def test_the_box_is_within_travel_and_away_from_singular_poses():
    sizes, lengths = [], []
    for angles in BOX:
        direction = shoulder_rotation(*angles, degrees=True).apply([0.0, 0.0, -1.0])
        Q = platform_turn(direction)
        values = np.linalg.svd(cuff_rates(direction, Q), compute_uv=False)
        sizes.append([values[0], values[-1]])
        lengths.append(np.linalg.norm(lines(direction, Q)[1], axis=1))
    # Largest force of a drive for one of the cuff, and of the cuff for one of a drive.
    assert np.max(sizes, axis=0)[0] < 2.2
    assert 1.0 / np.min(sizes, axis=0)[1] < 2.5
    assert LENGTHS[0] < np.min(lengths) < np.max(lengths) < LENGTHS[1]
