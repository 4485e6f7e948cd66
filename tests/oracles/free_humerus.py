"""MyoArm with the humerus free to shift: MuJoCo's own Jacobians of its tendons are then net forces and moments.

Three slide joints between the scapula and the humerus, along the axes of the thorax. A tendon's Jacobian with respect
to them is minus the force of unit tension on the humerus and what hangs from it; with respect to the hinges it is minus
the moment about their axes, with the scapula held, because the couplings are not part of the Jacobian.
"""

import functools
import warnings

import numpy as np

from exo_pin.chain.formats.mjcf.mjcf_compiling import mujoco_warnings
from exo_pin.person import MUSCLES

_HINGES = ("elv_angle_r", "shoulder_elv_r", "shoulder_rot_r", "elbow_flexion_r", "pro_sup_r")


@functools.cache
def _model():
    import mujoco
    import myo_sim

    with mujoco_warnings(mujoco, []), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        spec = myo_sim.load_spec("myoarm_r")
        for name, axis in (("sx", [1, 0, 0]), ("sy", [0, 1, 0]), ("sz", [0, 0, 1])):
            spec.body("humphant_r").add_joint(name=name, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis, range=[-1, 1])
        # As in the package: the axis of elevation is 3e-6 rad off the perpendicular.
        along = np.array(spec.joint("elv_angle_r").axis) / np.linalg.norm(spec.joint("elv_angle_r").axis)
        across = np.array(spec.joint("shoulder_elv_r").axis)
        spec.joint("shoulder_elv_r").axis = across - across @ along * along
        return spec.compile()


def jacobians(plane, elevation, rotation, elbow, forearm):
    """Force (m, 3) and moments about the five hinges (m, 5) of unit tensions, and the hinges' first three axes.

    Vectors are in the frame of the model's thorax.
    """
    import mujoco

    model = _model()
    data = mujoco.MjData(model)
    at = {name: model.jnt_qposadr[model.joint(name).id] for name in (*_HINGES, "shoulder1_r2_r", "sx", "sy", "sz")}
    for name, angle in zip(_HINGES, (plane, elevation, rotation, elbow, forearm), strict=True):
        data.qpos[at[name]] = angle
    data.qpos[at["shoulder1_r2_r"]] = -plane
    for row in range(model.neq):
        if model.eq_obj2id[row] == model.joint("shoulder_elv_r").id:
            data.qpos[model.jnt_qposadr[model.eq_obj1id[row]]] = model.eq_data[row][1] * elevation
    mujoco.mj_fwdPosition(model, data)
    dense = np.zeros((model.ntendon, model.nv))
    mujoco.mju_sparse2dense(dense, data.ten_J, model.ten_J_rownnz, model.ten_J_rowadr, model.ten_J_colind)
    rows = dense[[model.tendon(f"{name}_tendon").id for name in MUSCLES]]
    thorax = data.xmat[model.body("myoarm_r_root").id].reshape(3, 3)
    slides = np.stack([data.xaxis[model.joint(name).id] for name in ("sx", "sy", "sz")])
    dof = {name: model.jnt_dofadr[model.joint(name).id] for name in at}
    force = -rows[:, [dof[name] for name in ("sx", "sy", "sz")]] @ slides @ thorax
    moments = -rows[:, [dof[name] for name in _HINGES]]
    axes = np.stack([data.xaxis[model.joint(name).id] for name in _HINGES[:3]]) @ thorax
    return force, moments, axes
