"""Every device of the ``urdf`` folder: consistency, mobility, and its forces against MuJoCo and a balance."""

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from device_files import loaded, named, reached
from mujoco_exact import ExactMujoco, assert_same
from mujoco_tree import MujocoTree
from places import REPOSITORY
from published_devices import DEVICES

from exo_pin import shoulder_rotation
from exo_pin.consistency import check_chain

#: Freedoms, the same with the drives locked, and the redundant rows of the closures.
MOBILITY = {
    "serial-y-x-z": (3, 0, 3),
    "nesm": (3, 0, 3),
    "spherical-3rrr": (3, 0, 9),
    "3rps-passive-ball": (4, 1, 0),
    "spring-support": (3, 3, 0),
    "six-cables": (3, 0, 0),
}
POSES = ((20, 10, 0), (60, 30, 20), (15, 75, 40))


def held(name, angles):
    """Chain, configuration and forces with the arm held in a pose, by the drives or where there are none by itself."""
    chain = loaded(name)
    q = reached(chain, shoulder_rotation(*angles, degrees=True))
    # The arm hangs straight below its cuff's ball, which has no moment about the arm to hold.
    more = [] if chain.roles.actuated else ["root_joint"]
    return chain, q, chain.inverse_dynamics(q, actuated=[*chain.roles.actuated, *more])


def test_the_page_has_these_figures():
    page = (REPOSITORY / "docs" / "concepts" / "devices.md").read_text(encoding="utf-8")
    rows = [
        [cell.strip() for cell in line.strip("|").split("|")] for line in page.splitlines() if line.startswith("| `")
    ]
    told = {row[0].strip("`"): row[2:] for row in rows if len(row) == 6}
    assert set(told) == set(MOBILITY)
    for name, (freedoms, drives, redundant, mass) in told.items():
        chain = loaded(name)
        assert (int(freedoms), int(redundant)) == (MOBILITY[name][0], MOBILITY[name][2])
        assert int(drives) == len(chain.roles.actuated)
        assert float(mass) == pytest.approx(sum(each.mass for each in chain.model.inertias) - 4.199, abs=6e-3)


@pytest.mark.parametrize("name", MOBILITY)
def test_a_device_is_consistent_and_has_the_freedoms_of_its_kind(name):
    chain = loaded(name)
    report = check_chain(chain)
    assert report.passed, str(report)
    free, locked, redundant = MOBILITY[name]
    for angles in ((0, 0, 0), *POSES):
        mobility = chain.mobility(reached(chain, shoulder_rotation(*angles, degrees=True)))
        assert (mobility.degrees_of_freedom, mobility.redundant, mobility.kinds) == (free, redundant, ())
        left = mobility if mobility.locked is None else mobility.locked
        assert left.degrees_of_freedom == locked
    assert chain.roles.shoulder == "root_joint"
    assert chain.roles.arm == "arm"
    if name not in DEVICES:  # written as a wrist: the cuff is part of the arm's link
        return
    assert chain.roles.cuff == "cuff_middle"
    weld = chain.model.frames[chain.model.getFrameId("cuff_weld")]
    assert chain.model.inertias[1].mass == pytest.approx(4.199 + weld.inertia.mass)


@pytest.mark.parametrize("angles", POSES)
@pytest.mark.parametrize("name", MOBILITY)
def test_mujocos_open_tree_rests_under_the_same_forces_and_transmits_them(name, angles):
    chain, q, forces = held(name, angles)
    tree = MujocoTree(named(name))
    tree.put(chain, q, np.zeros(chain.model.nv), np.zeros(chain.model.nv))
    for closure in chain.closures:
        wrench = forces.joint_reaction(closure.name, at=(0.0, 0.0, 0.0)).wrench
        tree.push(closure.frame_a, wrench, np.zeros(3))
    size = max(np.abs(forces.joint_reaction(joint).wrench).max() for joint in list(chain.model.names)[1:])
    np.testing.assert_allclose(tree.inverse(chain), forces.tau, rtol=0, atol=1e-9 * size)
    mujoco.mj_sensorAcc(tree.model, tree.data)
    ours = forces.joint_reaction("root_joint", on="arm", in_frame="local").wrench
    np.testing.assert_allclose(tree.transmitted("root_joint"), ours, rtol=0, atol=1e-9 * size)


@pytest.mark.parametrize("name", MOBILITY)
def test_mujoco_reads_the_export_and_its_own_loops_hold_the_pose(name, tmp_path):
    chain, q, forces = held(name, POSES[1])
    exact = ExactMujoco(mujoco.MjModel.from_xml_path(str(chain.to_mjcf(tmp_path))), chain)
    qpos = exact.qpos_of(q)
    exact.at(qpos)
    T = exact.velocity_map(qpos)
    M = pin.crba(chain.model, chain.model.createData(), q)
    assert_same(T.T @ exact.mass() @ T, np.triu(M) + np.triu(M, 1).T)
    assert exact.rank() == chain.mobility(q).rank
    # MuJoCo's acceleration under our efforts, its equalities solved exactly: none.
    gravity = exact.acceleration(qpos, np.zeros(chain.model.nv), np.zeros(chain.model.nv))
    assert_same(
        exact.acceleration(qpos, np.zeros(chain.model.nv), T @ forces.tau), 0.0, 1e-7, least=np.abs(gravity).max()
    )
