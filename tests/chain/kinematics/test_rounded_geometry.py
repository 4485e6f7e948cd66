"""Overconstrained mechanisms of rounded geometry move as the exact ones, and what they cannot tell they say."""

import mujoco
import numpy as np
import pytest
from mujoco_exact import ExactMujoco
from rounded_mechanisms import MECHANISMS, mechanism

from exo_pin import InvalidInput, NearSingularConfiguration
from exo_pin.chain import Closures

#: Errors of accelerations and reactions, as shares of the largest, over the tolerance of the geometry: at most 35
#: in 420 mechanisms.
_GROWTH = 100.0


def _forces(chain, q):
    # The delta's cranks; of the others the first hinge.
    driven = [f"hinge_{5 * k}" for k in range(MECHANISMS[chain.description.name])]
    v, _ = chain.dependent_motion(q, driven, np.ones(len(driven)))
    a = chain.forward_dynamics(q, v)
    held = chain.inverse_dynamics(q, v, a.a, actuated=driven)
    return (
        v,
        a.a,
        held.tau,
        np.concatenate([held.joint_reaction("hinge_1").force, a.forces.joint_reaction("hinge_1").force]),
    )


def _compare(name, digits, seed):
    exact, rounded = mechanism(name, None, seed), mechanism(name, digits, seed)
    zero = np.zeros(exact.model.nq)
    q = rounded.close(zero)
    here, there = rounded.mobility(q), exact.mobility(zero)
    assert here.rank == there.rank
    assert here.degrees_of_freedom == MECHANISMS[name]
    assert here.kinds == here.cautions == ()
    known = here.geometry
    np.testing.assert_allclose(rounded.close(q), q, atol=1e-12)
    for found, wanted in zip(_forces(rounded, q), _forces(exact, zero), strict=True):
        assert np.abs(found - wanted).max() <= _GROWTH * known * max(np.abs(wanted).max(), 1.0), (name, digits, seed)


@pytest.mark.parametrize("name", MECHANISMS)
def test_a_rounded_mechanism_moves_as_the_exact_one(name):
    """Mobility, closing, accelerations and reactions at 4 to 10 decimals, turned at random."""
    for digits in (4, 6, 8, 10):
        _compare(name, digits, seed=3)


@pytest.mark.full
@pytest.mark.parametrize("name", MECHANISMS)
def test_many_rounded_mechanisms_move_as_the_exact_ones(name):
    for seed in range(12):
        for digits in range(4, 11):
            _compare(name, digits, seed)


@pytest.mark.parametrize("digits", [5, 7, 9])
def test_a_flat_parallelogram_stays_singular(digits):
    """Both branches of a flat four-bar pass its pose: two freedoms there, one beside it."""
    chain = mechanism("planar", digits, seed=1, flat=True)
    q = chain.close(np.zeros(chain.model.nq))
    found = chain.mobility(q)
    assert found.degrees_of_freedom == 2
    assert "constraint" in found.kinds


@pytest.mark.parametrize("angle", [3e-6, 2e-4, 5e-4, 2e-3])
def test_a_pose_whose_rank_the_digits_do_not_determine_is_said(angle):
    """Beside the flat pose the smallest singular value is as the angle, and near the tolerance no force follows."""
    chain = mechanism("planar", 5, seed=1, flat=True)
    q = chain.close(np.array([angle, 0.0, 0.0]), hold=["hinge_0"])
    found = chain.mobility(q)
    assert found.regular_rank == 2
    near = found.singular_values[1] / found.tolerance
    if 0.1 < near < 10.0:
        assert "Caution: the rank is undetermined, 2 or less" in str(found)
        with pytest.raises(NearSingularConfiguration):
            chain.forward_dynamics(q)
    else:
        assert angle == 2e-3
        assert not found.cautions
        assert np.isfinite(chain.forward_dynamics(q).a).all()


@pytest.mark.parametrize("name", MECHANISMS)
def test_accelerations_are_mujocos_of_the_exact_mechanism(name, tmp_path):
    """MuJoCo's matrices of the exact mechanism, its equalities solved exactly; ours at six decimals."""
    exact, rounded = mechanism(name, None, 3), mechanism(name, 6, 3)
    oracle = ExactMujoco(mujoco.MjModel.from_xml_path(str(exact.to_mjcf(tmp_path))), exact)
    rest = np.zeros(exact.model.nv)
    wanted = oracle.acceleration(oracle.qpos_of(rest), rest, rest)
    found = rounded.forward_dynamics(rounded.close(rest), rest).a
    assert np.abs(found - wanted).max() <= _GROWTH * 5e-7 * np.abs(wanted).max()


def test_a_rounded_mechanism_says_what_agrees():
    chain = mechanism("spherical", 6, seed=3)
    text = str(chain.mobility(chain.close(np.zeros(3))))
    assert "3 rows agree with others to" in text


def test_the_motion_in_time_is_that_of_the_exact_mechanism():
    times = np.linspace(0.0, 0.1, 3)
    for name in ("spherical", "cranks"):
        exact, rounded = mechanism(name, None, 3), mechanism(name, 6, 3)
        rest = np.zeros(exact.model.nv)
        found = rounded.simulate(rounded.close(rest), rest, times)
        np.testing.assert_allclose(found.q[-1], exact.simulate(rest, rest, times).q[-1], atol=1e-4)


@pytest.mark.parametrize("tolerance", [-1e-6, 0.01, float("nan"), "1e-6"])
def test_a_tolerance_out_of_range_is_refused(tolerance):
    with pytest.raises(InvalidInput, match="tolerance of the geometry"):
        Closures("robot", tolerance=tolerance)
