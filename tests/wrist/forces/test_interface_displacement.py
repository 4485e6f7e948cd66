"""Where an elastic harness and cuff put the device, point by point, and how far a wrench moves them."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.wrist.forces.elastic_equilibrium import displacement_under, placed


def spring(rng):
    root = rng.normal(size=(6, 6))
    return ep.Interface(root @ root.T + 6.0 * np.eye(6), 0.1 * rng.normal(size=3))


@pytest.mark.parametrize("parts", [(True, True), (True, False), (False, True), (False, False)])
def test_points_of_base_and_platform_go_with_their_parts(parts):
    rng = np.random.default_rng(170)
    harness, cuff = (spring(rng) if there else None for there in parts)
    points, arm = rng.normal(size=(4, 3)), Rotation.random(3, rng=rng)
    delta, base, held = 0.1 * rng.normal(size=(3, 3, 3))
    moved = [0.3 * rng.normal(size=(3, 6 if there else 0)) for there in parts]
    found = placed(points, arm.as_matrix(), delta, base, held, ep.Interfaces(harness, cuff), *moved)
    for k in range(3):

        def carried(point, spring, row):
            """A point of a part, in the frame of the body under it."""
            if spring is None:
                return point
            at = np.array(spring.at)
            return at + row[:3] + Rotation.from_rotvec(row[3:]).apply(point - at)

        for i in range(4):
            place = found.base[k] + found.base_points[k, i] + delta[k]
            np.testing.assert_allclose(place, carried(base[k] + points[i], harness, moved[0][k]), atol=1e-14)
            local = rng.normal(size=3)  # a joint of the platform, about its centre and in its axes
            place = found.matrices[k] @ (found.cuff[k] + local)
            np.testing.assert_allclose(place, arm[k].apply(carried(held[k] + local, cuff, moved[1][k])), atol=1e-13)


def test_displacements_store_the_energy_that_a_wrench_gives():
    """At (t, v) under the wrench, any small further motion takes from the wrench what it adds to the spring."""
    rng = np.random.default_rng(171)
    interface = spring(rng)
    at = np.array(interface.at)
    centre, wrench = 0.1 * rng.normal(size=(1, 3)), rng.normal(size=(1, 6))
    motion = np.zeros((1, 6))
    for _ in range(60):
        motion = displacement_under(interface, motion, wrench, centre)
    np.testing.assert_allclose(displacement_under(interface, motion, wrench, centre), motion, atol=1e-13)
    force, moment = wrench[0, :3], wrench[0, 3:]
    about = moment - np.cross(at + motion[0, :3] - centre[0], force)
    h = 1e-6
    for way in np.eye(6):
        ends = [motion[0] + s * h * way for s in (1, -1)]
        turn = (Rotation.from_rotvec(ends[0][3:]) * Rotation.from_rotvec(ends[1][3:]).inv()).as_rotvec()
        work = force @ (ends[0][:3] - ends[1][:3]) + about @ turn
        stored = 0.5 * (ends[0] @ interface.stiffness @ ends[0] - ends[1] @ interface.stiffness @ ends[1])
        assert work == pytest.approx(stored, rel=1e-6, abs=1e-14)
