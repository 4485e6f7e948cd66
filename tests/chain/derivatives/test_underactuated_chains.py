"""Derivatives of chains whose actuators make some motions and not all: no row of the equations of motion is lost."""

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from scenes import needs_human
from underactuated_chains import LOOPS, TREES, tree_mjcf, underactuated

#: Step of the differences of fourth order, rad and m: Cassie's loops are near a singular configuration.
STEP = 1e-4
NAMES = [*TREES, "random tree", *LOOPS, pytest.param("Cassie", marks=needs_human)]
SEEDS = [pytest.param(seed, marks=pytest.mark.full) for seed in range(8)]


def difference(f, size):
    """A derivative and its error, from differences of fourth order with two steps; size is that of f itself.

    Its rounding is 1e-16 of that times the square of the loops' condition, up to 100 and for Cassie 300.
    """
    by_step = {s: f(s * STEP) - f(-s * STEP) for s in (1, 2, 4)}
    fine, coarse = ((8 * by_step[s] - by_step[2 * s]) / (12 * s * STEP) for s in (1, 2))
    error = 10 * np.abs(fine - coarse).max() + 1e-12 * max(size, 1.0) / STEP
    assert error <= 1e-5 * (size + np.abs(fine).max())
    return fine, error


class Motions:
    """Closed motions near one, as functions of the independent coordinates: NumPy's least squares on J alone."""

    def __init__(self, case, independent):
        self.case, self.independent = case, independent
        self.dependent = np.setdiff1d(np.arange(case.chain.model.nv), independent)

    def following(self, q, motion, right):
        """The motion whose independent part is given, with J motion = right."""
        J = self.case.chain.constraint_jacobian(q)
        motion = np.array(motion)
        left = right - J[:, self.independent] @ motion[self.independent]
        motion[self.dependent] = np.linalg.lstsq(J[:, self.dependent], left, rcond=1e-9)[0]
        return motion

    def at(self, kind, way, s):
        chain, zero = self.case.chain, np.zeros(self.case.chain.model.nv)
        q, (v, a) = self.case.q, (np.array(self.case.v), np.array(self.case.a))
        step = zero.copy()
        step[self.independent] = s * way
        if kind == "q":
            q = pin.integrate(chain.model, q, step)
            for _ in range(5):
                q = pin.integrate(chain.model, q, self.following(q, zero, -chain.residual(q)))
        v = self.following(q, v + step * (kind == "v"), np.zeros(chain.row_count))
        return q, v, self.following(q, a + step * (kind == "a"), -chain.constraint_drift(q, v))


def least_missing(chain, passive, q, v, a):
    """Efforts (in the passive rows missing forces) and multipliers, by NumPy from Pinocchio's RNEA and from J."""
    top = chain._state.topology
    tau = pin.rnea(chain.model, chain.model.createData(), q, v, a) - chain._state.passive.force(q, v)
    J = chain.constraint_jacobian(q)
    A = (J * top.row_scale[:, None] * top.column)[:, passive].T
    multipliers = top.row_scale * np.linalg.lstsq(A, top.column[passive] * tau[passive], rcond=1e-9)[0]
    return tau - J.T @ multipliers, multipliers


def check(case, ways):
    """All rows along some directions of the independent coordinates; return how many of them miss a force."""
    chain, drive = case.chain, case.chain._state.drive(case.actuated)
    found = chain.inverse_dynamics_derivatives(case.q, case.v, case.a, actuated=case.actuated)
    motions, missing = Motions(case, found.independent), 0
    ways = np.eye(len(found.independent)) if ways is None else ways(len(found.independent))

    def forces(kind, way, s):
        q, v, a = motions.at(kind, way, s)
        return np.concatenate(least_missing(chain, drive.passive, q, v, a))

    size = np.abs(forces("q", ways[0], 0.0)).max()
    for kind in "qva":
        got = np.vstack([getattr(found, f"tau_{kind}"), getattr(found, f"multipliers_{kind}")])
        for way in ways:
            expected, error = difference(lambda s, kind=kind, way=way: forces(kind, way, s), size)
            np.testing.assert_allclose(got @ way, expected, rtol=0, atol=error)
            missing += np.abs(expected[drive.passive]).max() > error
    return missing


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("name", NAMES)
def test_all_rows_against_differences_on_the_manifold(name, seed):
    assert check(underactuated(name, seed), None)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("name", ["five-bar", "Stewart platform", "rigid loop", "spherical loop"])
def test_pinocchios_constrained_dynamics_make_the_changed_motion(name, seed):
    # With the changes of efforts and missing forces found here as efforts. Pinocchio's derivatives of them are compared
    # for rigid closures; for points on two moving bodies they differ from differences of its own accelerations (4.1).
    case = underactuated(name, seed)
    chain, model = case.chain, case.chain.model
    found = chain.inverse_dynamics_derivatives(case.q, case.v, case.a, actuated=case.actuated)
    closures, datas, data = pin.StdVec_RigidConstraintModel(), pin.StdVec_RigidConstraintData(), model.createData()
    for closure in chain.constraint_models:
        closures.append(closure)
        datas.append(closure.createData())
    settings = pin.ProximalSettings(1e-14, 1e-10, 100)
    pin.initConstraintDynamics(model, data, closures, datas)

    def acceleration(q, v, tau):
        return pin.constraintDynamics(model, data, q, v, tau, closures, datas, settings).copy()

    motions, efforts, size = Motions(case, found.independent), found.forces.tau, np.abs(case.a).max()
    changes = {"q": (found.tau_q, found.a_q), "v": (found.tau_v, found.a_v), "a": (found.tau_a, None)}
    G = np.column_stack([motions.following(case.q, unit, np.zeros(chain.row_count)) for unit in units(found)])
    for kind, (tau, a) in changes.items():
        for k in range(tau.shape[1]):

            def at(s, kind=kind, k=k, tau=tau):
                q, v, _ = motions.at(kind, np.eye(tau.shape[1])[k], s)
                return acceleration(q, v, efforts + s * tau[:, k])

            expected, error = difference(at, size)
            np.testing.assert_allclose((G if a is None else a)[:, k], expected, rtol=0, atol=error)
    if name == "rigid loop":
        acceleration(case.q, case.v, efforts)
        by_q, by_v, by_tau, *_ = pin.computeConstraintDynamicsDerivatives(model, data, closures, datas, settings)
        for expected, a in (
            (by_q @ G + by_v @ found.v_q + by_tau @ found.tau_q, found.a_q),
            (by_v @ G + by_tau @ found.tau_v, found.a_v),
            (by_tau @ found.tau_a, G),
        ):
            np.testing.assert_allclose(a, expected, rtol=0, atol=1e-8 * (np.abs(expected).max() + size))


def units(found):
    return np.eye(len(found.tau_q))[found.independent]


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("name", TREES)
def test_a_tree_has_the_differences_of_mujocos_inverse_dynamics(name, seed):
    case = underactuated(name, seed)
    model = mujoco.MjModel.from_xml_string(tree_mjcf(TREES[name], np.random.default_rng(seed)))
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    data = mujoco.MjData(model)

    def tau(q, v, a):
        data.qpos[:], data.qvel[:], data.qacc[:] = q, v, a
        mujoco.mj_inverse(model, data)
        return data.qfrc_inverse.copy()

    found = case.chain.inverse_dynamics_derivatives(case.q, case.v, case.a, actuated=case.actuated)
    here = case.q, case.v, case.a
    for kind, got in enumerate((found.tau_q, found.tau_v, found.tau_a)):
        for column, unit in zip(got.T, units(found), strict=True):
            moved = [kind == n for n in range(3)]

            def at(s, unit=unit, moved=moved):
                return tau(*(x + s * unit * move for x, move in zip(here, moved, strict=True)))

            expected, error = difference(at, np.abs(at(0.0)).max())
            np.testing.assert_allclose(column, expected, rtol=0, atol=error)
