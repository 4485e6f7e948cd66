"""Chains that were read from MJCF against MuJoCo's own equations of motion, many of them.

A tenth runs in every run of the tests, all of it with ``pytest -m "not long"``.
"""

import warnings
from contextlib import suppress

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from mjcf_chains import random_robot
from mjcf_mutations import PLANT, mutated
from mujoco_exact import ExactMujoco, assert_same, joint_numbers

from exo_pin import FileFormatError, LoopNotClosed
from exo_pin.chain import ClosedChain


def blocks(count, size):
    """Seeds in blocks for the full run, and half of the first block for every run."""
    full = [pytest.param(range(first, first + size), marks=pytest.mark.full) for first in range(0, count, size)]
    return [range(size // 2), *full]


def moving_states(seeds):
    """Random robots as chains and as MuJoCo's, where their loops are closed, with velocities that keep them closed."""
    found = [moving_state(seed) for seed in seeds]
    regular = [(seed, *state) for seed, state in zip(seeds, found, strict=True) if state is not None]
    assert len(regular) >= 0.95 * len(seeds)
    return regular


def moving_state(seed):
    """None where the pose is so near a singular one that the rank of the equalities is a matter of opinion."""
    robot = random_robot(seed)
    chain = ClosedChain.from_mjcf(robot.text)
    exact = ExactMujoco(mujoco.MjModel.from_xml_string(robot.text), chain)
    q, rng = exact.q_of(robot.qpos), np.random.default_rng(seed)
    assert np.abs(chain.residual(q)).max(initial=0.0) < 1e-12
    with suppress(LoopNotClosed):  # otherwise the given configuration is as good
        q = chain.close(pin.integrate(chain.model, q, rng.uniform(-0.3, 0.3, chain.model.nv)))
    qpos = exact.qpos_of(q)
    exact.at(qpos)
    assert np.abs(exact.rows()[0]).max(initial=0.0) < 1e-11
    if exact.rank() is None:
        return None
    motions = exact.motions()
    return chain, exact, q, qpos, motions @ rng.normal(size=motions.shape[1]), rng


@pytest.mark.parametrize("seeds", blocks(1000, 25))
def test_accelerations_are_those_of_mujoco_with_exact_equalities(seeds):
    # Rounding grows with the condition of the projected mass matrix, some 1e4, and with the drift's 1e-12 error.
    for seed, chain, exact, q, qpos, qvel, rng in moving_states(seeds):
        exact.at(qpos)
        assert exact.rank() == chain.mobility(q).rank, seed
        v = np.linalg.solve(exact.velocity_map(qpos), qvel)
        T, rate = exact.velocity_map(qpos, v)
        tau = 3.0 * rng.normal(size=len(v))
        theirs = exact.acceleration(qpos, qvel, np.linalg.solve(T.T, tau))
        expected = np.linalg.solve(T, theirs - rate @ v)
        found = chain.forward_dynamics(q, v, tau).a
        np.testing.assert_allclose(
            found, expected, rtol=0, atol=1e-8 * max(1.0, np.abs(expected).max()), err_msg=str(seed)
        )


@pytest.mark.parametrize("seeds", blocks(2000, 100))
def test_a_mutated_file_means_what_mujoco_reads_or_is_refused(seeds, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    read = 0
    for seed in seeds:
        text = mutated(seed)
        with warnings.catch_warnings():
            # MuJoCo's own warnings, which the reader passes on.
            warnings.simplefilter("ignore", RuntimeWarning)
            try:
                chain = ClosedChain.from_mjcf(text)
            except FileFormatError:
                continue
        assert list(tmp_path.iterdir()) == []  # no MUJOCO_LOG.TXT
        read += 1
        mujoco.set_mju_user_warning(lambda _: None)
        try:
            assert_same_physics(text, chain, seed)
        finally:
            mujoco.set_mju_user_warning(None)
    assert read > len(seeds) / 5


def assert_same_physics(text, chain, seed):
    """Mass matrix, bias, passive forces and equalities at a random state."""
    model = mujoco.MjModel.from_xml_string(text)
    for cable in chain.description.cables:
        # The chain alone does not feel its spring, as it says; a device of it does.
        assert cable.name in next(said for said in chain.description.left_out if said.startswith("cables: "))
        own = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_TENDON, cable.name)
        model.tendon_stiffness[own if own >= 0 else int(cable.name.removeprefix("tendon_"))] = 0.0
    exact = ExactMujoco(model, chain, joint_numbers(model, chain))
    assert (chain.model.nq, chain.model.nv) == (model.nq, model.nv)
    rng = np.random.default_rng(seed)
    q = pin.integrate(chain.model, chain.neutral(), rng.uniform(-1.0, 1.0, model.nv))
    v = rng.uniform(-1.0, 1.0, model.nv)
    qpos = exact.qpos_of(q)
    T, rate = exact.velocity_map(qpos, v)
    data = exact.at(qpos, T @ v)
    M, ours = exact.mass(), chain.model.createData()
    upper = np.triu(np.reshape(pin.crba(chain.model, ours, q), M.shape))
    assert_same(upper + np.triu(upper, 1).T, T.T @ M @ T, what=f"{seed}: mass matrix")
    bias = T.T @ (data.qfrc_bias + M @ rate @ v)
    # Its terms may cancel: velocities are of size one, and they of the size of M.
    assert_same(
        pin.nonLinearEffects(chain.model, ours, q, v), bias, what=f"{seed}: bias", least=np.abs(M).max(initial=0.0)
    )
    assert_same(chain._state.passive.force(q, v), T.T @ data.qfrc_passive, what=f"{seed}: passive forces")
    friction = T.T @ model.dof_frictionloss
    off = int(mujoco.mjtDisableBit.mjDSBL_FRICTIONLOSS | mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    flags = mujoco.MjModel.from_xml_string(text).opt.disableflags
    np.testing.assert_array_equal(chain.model.upperDryFrictionLimit, friction * (not flags & off), err_msg=str(seed))
    assert_same_gaps(exact, chain, q, seed)
    assert_same_motions(exact, chain, q, seed)


def assert_same_gaps(exact, chain, q, seed):
    """The equalities stand open by the same vectors and the same turns."""
    gaps, _ = exact.rows()
    size, start = max(1.0, np.abs(exact.data.xpos).max()), 0
    closures = iter(chain.closures)
    for index in counted(exact.model):
        if is_on_one_body(exact.model, index):
            start += 6 if exact.model.eq_type[index] == mujoco.mjtEq.mjEQ_WELD else 3
            continue
        closure = next(closures)
        own = chain.residual(q)[chain.rows(closure.name)]
        if closure.type in ("coupling", "distance"):
            size_here = max(1.0, abs(gaps[start]))
            np.testing.assert_allclose(own, gaps[start : start + 1], rtol=0, atol=1e-9 * size_here, err_msg=str(seed))
            start += 1
            continue
        is_weld = exact.model.eq_type[index] == mujoco.mjtEq.mjEQ_WELD
        theirs = gaps[start : start + (6 if is_weld else 3)]
        start += len(theirs)
        x, y, z, w = closure.placement_a.quaternion
        axes = chain.placement(q, closure.frame_a).rotation @ pin.Quaternion(w, x, y, z).toRotationMatrix()
        np.testing.assert_allclose(axes @ own[:3], theirs[:3], rtol=0, atol=1e-9 * size, err_msg=str(seed))
        scale = abs(exact.model.eq_data[index, 10]) if is_weld else 0.0
        assert (closure.type == "rigid") == (scale > 0.0)
        if scale:
            # MuJoCo's turn is the vector part of a quaternion.
            turned = np.sin(np.linalg.norm(own[3:]) / 2.0)
            np.testing.assert_allclose(np.linalg.norm(theirs[3:]) / scale, turned, rtol=0, atol=1e-7, err_msg=str(seed))
    assert start == len(gaps)
    assert next(closures, None) is None


def counted(model):
    """Equalities that count in MuJoCo: those that are active, where no flag disables them all."""
    flags = int(mujoco.mjtDisableBit.mjDSBL_EQUALITY | mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    return [] if model.opt.disableflags & flags else np.flatnonzero(model.eq_active0).tolist()


def is_on_one_body(model, index):
    """Whether both ends of a connect or weld are on one rigid body."""
    if mujoco.mjtEq(int(model.eq_type[index])) in (mujoco.mjtEq.mjEQ_JOINT, mujoco.mjtEq.mjEQ_TENDON):
        return False
    ends = [int(model.eq_obj1id[index]), int(model.eq_obj2id[index])]
    if model.eq_objtype[index] == mujoco.mjtObj.mjOBJ_SITE:
        ends = [int(model.site_bodyid[site]) for site in ends]
    return model.body_weldid[ends[0]] == model.body_weldid[ends[1]]


def assert_same_motions(exact, chain, q, seed):
    """On closed loops, if they can be closed, the equalities leave the same motions."""
    try:
        q = chain.close(q, restarts=0)
    except LoopNotClosed:
        return
    qpos = exact.qpos_of(q)
    exact.at(qpos)
    rank = exact.rank()
    if rank is None:
        return
    assert rank == chain.mobility(q).rank, seed
    motions = np.linalg.solve(exact.velocity_map(qpos), exact.motions())
    J = chain.constraint_jacobian(q)
    if J.size:
        np.testing.assert_allclose(J @ motions, 0.0, rtol=0, atol=1e-8 * np.abs(J).max(), err_msg=str(seed))


def test_the_unchanged_plant_is_read():
    chain = ClosedChain.from_mjcf(PLANT)
    assert_same_physics(PLANT, chain, 0)
    assert [closure.type for closure in chain.closures] == ["spherical", "rigid"]
