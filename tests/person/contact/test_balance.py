"""Moments and contact force of muscles and loads, by adding up the forces on a free body."""

import numpy as np
import pytest

from exo_pin.person.contact.query import ExternalLoads, balance_of
from exo_pin.person.limb.limb_state import LimbGeometry
from exo_pin.person.limb.muscle_table import MuscleState

POSES, MUSCLES = 2, 3


def some_body(seed=0):
    """Lines of muscles with the points where they hold, what they can do, and a load with its point."""
    rng = np.random.default_rng(seed)
    pull, points = rng.normal(size=(2, POSES, MUSCLES, 3))
    elbow, forearm = rng.normal(size=(2, POSES, MUSCLES))
    unknown = dict.fromkeys(LimbGeometry._fields)
    limb = LimbGeometry(
        **(unknown | {"pull": pull, "moment": np.cross(points, pull), "elbow": elbow, "forearm": forearm})
    )
    muscles = MuscleState(np.ones((POSES, MUSCLES)), *rng.uniform(1.0, 9.0, (2, POSES, MUSCLES)))
    force, at = rng.normal(size=(2, POSES, 3))
    return limb, muscles, ExternalLoads(force, np.cross(at, force), rng.normal(size=POSES)), points, at


@pytest.mark.parametrize("shift", [(0.0, 0.0, 0.0), (0.3, 0.0, 0.0), (0.0, -0.2, 0.5)])
def test_forces_and_moments_are_those_of_a_free_body(shift):
    limb, muscles, loads, points, at = some_body()
    balance = balance_of(limb, muscles, loads, np.array(shift))
    a = np.random.default_rng(1).uniform(0.0, 1.0, (POSES, MUSCLES))
    for k in range(POSES):
        # A muscle's tension has its passive part whether or not it is active.
        tension = a[k] * muscles.active[k] + muscles.passive[k]
        forces = [*(tension[:, None] * limb.pull[k]), loads.force[k]]
        places = [*points[k], at[k]]
        moment = sum(np.cross(place - shift, force) for place, force in zip(places, forces, strict=True))
        left = balance.rows[k] @ a[k] + balance.constant[k]
        np.testing.assert_allclose(left[:3], moment, atol=1e-12)
        assert left[3] == pytest.approx(limb.elbow[k] @ tension + loads.elbow[k])
        assert left[4] == pytest.approx(limb.forearm[k] @ tension)
        contact = balance.pull[k] @ a[k] + balance.rest[k]
        np.testing.assert_allclose(contact + sum(forces), 0.0, atol=1e-12)
