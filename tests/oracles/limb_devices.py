"""Devices of random limbs on an arm, and their assembly mode followed in many small steps by public functions alone."""

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.device import ChainDevice

BODY = (
    '<link name="{}"><inertial><mass value="{}"/><origin xyz="{} {} {}"/>'
    '<inertia ixx="0.02" iyy="0.02" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>'
)
JOINT = (
    '<joint name="{}" type="{}"><parent link="{}"/><child link="{}"/><origin xyz="{} {} {}"/>'
    '<axis xyz="{} {} {}"/></joint>'
)
#: Loops of a limb with as many joints as the loop has rows.
LOOPS = {"spherical": 3, "rigid": 6, "universal": 4}


def limb_device(rng, limbs=2, idle=0, types=("spherical", "spherical", "rigid", "universal")):
    """A device of limbs of hinges and slides, each from the arm to the torso; the first has idle joints more."""
    links, joints, closures, actuated = [BODY.format("arm", 4.0, 0, 0, -0.3)], [], [], []
    for limb in range(limbs):
        kind = types[int(rng.integers(len(types)))]
        parent, place = "arm", np.array([0.0, 0.0, -0.2]) + rng.uniform(-0.08, 0.08, 3)
        at = place.copy()
        for k in range(LOOPS[kind] + (idle if limb == 0 else 0)):
            name, axis = f"limb_{limb}_{k}", rng.normal(size=3)
            axis /= np.linalg.norm(axis)
            moves = "prismatic" if rng.uniform() < 0.15 else "continuous"
            limit = moves.replace("continuous", "revolute")
            joint = JOINT.format(name, limit, parent, name + "_link", *place, *axis)
            joints.append(joint.replace("</joint>", '<limit lower="-9" upper="9" effort="100" velocity="9"/></joint>'))
            place = rng.uniform(-0.15, 0.15, 3)
            links.append(BODY.format(name + "_link", rng.uniform(0.1, 0.4), *(0.5 * place)))
            parent, at = name + "_link", at + place
        actuated.append(name)
        ends = ep.chain.Placement(tuple(place)), ep.chain.Placement(tuple(at))
        closures.append(ep.chain.Closure(f"limb_{limb}_base", kind, parent, "universe", *ends))
    xml = f'<robot name="limbs">{"".join(links + joints)}</robot>'
    roles = ep.chain.Roles(arm="arm", shoulder="root_joint", actuated=tuple(actuated))
    described = ep.chain.Closures("limbs", ep.chain.Root("spherical"), tuple(closures), roles)
    return ChainDevice.from_chain(ep.ClosedChain.from_urdf(xml, described))


def in_small_steps(chain, q, turn, size=2e-3):
    """Follow a turn of the arm from a closed configuration; None where the loops do not close on the way.

    Returns
    -------
    ndarray or None
        The configuration at the end, shape (nq,).
    float
        The least ratio of the smallest to the largest singular value of the loops' rows on the way.
    """
    column = np.where(chain.metres, chain.characteristic_length, 1.0)
    arm = np.arange(chain.model.nv)[chain.velocity_slice("root_joint")]
    others = np.setdiff1d(np.arange(chain.model.nv), arm)
    steps, least = max(1, int(np.ceil(np.linalg.norm(turn) / size))), np.inf
    place = chain.configuration_slice("root_joint")
    for k in range(1, steps + 1):
        J = chain.constraint_jacobian(q)
        rows = J[:, others] * column[others]
        least = min(least, float(np.divide(*np.linalg.svd(rows, compute_uv=False)[[-1, 0]])))
        v = np.zeros(chain.model.nv)
        v[arm] = turn / steps
        v[others] = column[others] * np.linalg.lstsq(rows, -J[:, arm] @ v[arm], rcond=1e-9)[0]
        there = pin.integrate(chain.model, q, v)
        there[place] = Rotation.from_rotvec(k / steps * turn).as_quat()
        try:
            there = chain.close(there, hold=["root_joint"], restarts=0)
        except ep.LoopNotClosed:
            return None, least
        q = there
    return q, least
