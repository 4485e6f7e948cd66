"""Dry friction and stops in forward and inverse dynamics, against all active sets written out."""

import numpy as np
import pytest
from contact_enumeration import contact_acceleration
from moving_chains import moving
from rubbing_chains import slide, with_friction

from exo_pin import InfeasibleForces, UndrivenMotion
from exo_pin.chain import ClosedChain


@pytest.mark.parametrize("seed", range(8))
def test_stops_in_a_loop_are_those_of_all_active_sets(seed):
    rng = np.random.default_rng(seed)
    case = moving(("four-bar", "five-bar")[seed % 2], seed)
    model = case.chain.model.copy()
    nv = model.nv
    chosen = rng.choice(nv, size=2, replace=False)
    low, high = np.full((2, nv), np.inf) * np.array([[-1.0], [1.0]])
    contacts = []
    for k in chosen:
        if rng.random() < 0.5:
            low[k] = case.q[k]
            contacts.append((int(k), 0.0, np.inf))
        else:
            high[k] = case.q[k]
            contacts.append((int(k), -np.inf, 0.0))
    rubs = np.where(np.arange(nv) == chosen[0], 0.4, 0.0)
    contacts.append((int(chosen[0]), -0.4, 0.4))
    model.lowerPositionLimit, model.upperPositionLimit = low, high
    chain = with_friction(ClosedChain(model, case.chain.description), rubs)
    tau = 5.0 * rng.normal(size=nv)
    moved = chain.forward_dynamics(case.q, np.zeros(nv), tau, stops=True)
    other = contact_acceleration(chain, case.q, np.zeros(nv), tau, contacts)
    np.testing.assert_allclose(moved.a, other, atol=1e-8 * (1.0 + np.abs(other).max()))
    assert (moved.stop_reactions[np.isfinite(low)] >= 0.0).all()
    assert (moved.stop_reactions[np.isfinite(high)] <= 0.0).all()
    assert not moved.stop_reactions[np.isinf(low) & np.isinf(high)].any()
    assert moved.forces.residual <= 1e-9 * (1.0 + np.abs(moved.forces.multipliers).max())
    free = chain.forward_dynamics(case.q, np.zeros(nv), tau)
    assert not free.stop_reactions.any()


def test_a_block_on_an_incline_sticks_and_slips():
    angle, mass = 0.3, 2.0
    pull = mass * 9.81 * np.sin(angle)
    holds, slips = slide(angle, 1.01 * pull), slide(angle, 0.6 * pull)
    held = holds.forward_dynamics([0.0])
    np.testing.assert_array_equal(held.a, 0.0)
    np.testing.assert_allclose(held.friction, pull)
    np.testing.assert_allclose(slips.forward_dynamics([0.0]).a, -0.4 * pull / mass)
    np.testing.assert_allclose(slips.forward_dynamics([0.0], [1.0]).a, -1.6 * pull / mass)
    # Held by friction alone, and by efforts in the range that it leaves.
    forces = holds.inverse_dynamics([0.0], actuated=())
    np.testing.assert_allclose(forces.friction, pull)
    np.testing.assert_allclose(forces.friction_interval("slide"), [[pull, pull]])
    np.testing.assert_array_equal(forces.tau, 0.0)
    with pytest.raises(InfeasibleForces, match="friction of slide at most"):
        slips.inverse_dynamics([0.0], actuated=())
    driven = slips.inverse_dynamics([0.0], actuated=["slide"])
    np.testing.assert_allclose(driven.effort_interval("slide"), [[0.4 * pull, 1.6 * pull]])
    assert not driven.effort_is_unique[0]
    np.testing.assert_allclose(driven.tau, pull)
    bounded = slips.inverse_dynamics([0.0], actuated=["slide"], effort_bounds={"slide": (0.0, 0.7 * pull)})
    np.testing.assert_allclose(bounded.tau, 0.7 * pull)
    np.testing.assert_allclose(bounded.effort_interval("slide"), [[0.4 * pull, 0.7 * pull]])
    np.testing.assert_allclose(bounded.friction_interval("slide"), [[0.3 * pull, 0.6 * pull]])
    # Bounds that are infinite, as those of a model without effort limits, change nothing.
    for bounds in ("model", {"slide": (-np.inf, np.inf)}, {"slide": (0.0, np.inf)}):
        free = slips.inverse_dynamics([0.0], actuated=["slide"], effort_bounds=bounds)
        np.testing.assert_allclose(free.effort_interval("slide"), [[0.4 * pull, 1.6 * pull]])
    # In motion friction is known.
    moving = slips.inverse_dynamics([0.0], [0.5], actuated=["slide"])
    np.testing.assert_allclose(moving.friction_interval("slide"), [[-0.6 * pull, -0.6 * pull]])
    np.testing.assert_allclose(moving.effort_interval("slide"), [[1.6 * pull, 1.6 * pull]])
    for direction in (-1, 1):
        forces = slips.inverse_dynamics([0.0], [1e-8 * direction], actuated=["slide"])
        np.testing.assert_allclose(forces.tau, (1.0 + 0.6 * direction) * pull)
        assert forces.effort_is_unique.all()
    np.testing.assert_allclose(slips.inverse_dynamics([0.0], a=[3.0], actuated=["slide"]).tau, 1.6 * pull + 3.0 * mass)
    with pytest.raises(UndrivenMotion):
        slips.inverse_dynamics([0.0], v=[1.0], actuated=())
