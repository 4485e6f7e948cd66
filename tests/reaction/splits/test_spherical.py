"""Split "spherical" within limits: the exact method against the quadratic program and against closed forms."""

import numpy as np
import pytest
from wrists import random_mechanism, regular_poses

from exo_pin.exo import ShoulderExo
from exo_pin.reaction import SPLITS


class Programs(type(SPLITS["spherical"])):
    """The same split with a quadratic program for every pose."""

    name = "spherical by programs"

    def choose_within(self, poses, rows, answer):
        """Leave all poses to the program."""
        return rows


@pytest.mark.parametrize("limbs", [3, 4, 5, 6, 7, 8])
@pytest.mark.parametrize("offset", [None, (0.01, -0.008, 0.012)])
def test_tensions_within_limits_agree_with_the_program(limbs, offset):
    rng = np.random.default_rng(100 * limbs + (offset is not None))
    exo = ShoulderExo.from_mechanism(random_mechanism(rng, n=limbs))
    poses = regular_poses(exo.mechanism, rng, 40, margin=0.05)
    free = exo.reaction(poses, centre_offset=offset)
    largest, typical = np.abs(free.actuator_forces).max(), np.quantile(np.abs(free.actuator_forces), 0.8)
    held = bound = 0
    for limit in ((0.0, np.inf), (-typical, typical), (-2.0 * largest, 2.0 * largest)):
        options = {"centre_offset": offset, "limits": limit}
        exact, program = exo.reaction(poses, **options), exo.reaction(poses, split=Programs(), **options)
        np.testing.assert_array_equal(exact.status, program.status)
        good = exact.held
        np.testing.assert_allclose(
            exact.actuator_forces[good], program.actuator_forces[good], rtol=0, atol=1e-9 * largest
        )
        f = exact.actuator_forces[good]
        assert ((limit[0] <= f) & (f <= limit[1])).all()
        assert (exact.residual[exact.has_answer] <= 1e-9).all()
        assert (exact.optimum.kkt[good] <= 1e-8).all()
        assert exact.optimum.unique[good].all()
        assert not exact.constraint_forces[good].any()
        held += good.sum()
        bound += ((f == limit[0]) | (f == limit[1])).any(axis=1).sum()
    assert held >= 40
    assert bound >= 5 or limbs == 3
