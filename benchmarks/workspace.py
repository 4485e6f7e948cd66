"""One workspace of 19,656 poses beside plain NumPy and a Python loop over MuJoCo, in one run.

::

    python benchmarks/workspace.py

The peers compute less: NumPy the lengths, det X, tensions and shoulder force of three limbs; MuJoCo one ``mj_forward``
a pose of a ball joint with three site tendons, for a part of the poses, scaled up.
"""

import time

import mujoco
import numpy as np

import exo_pin as ep
from exo_pin.core import compiled
from exo_pin.workspace import Criteria, free_joints, starting_design
from exo_pin.workspace.optimisation.search_poses import DesignVariables
from exo_pin.wrist import BodyShape

#: A shoulder whose centre goes back, in and up with the elevation of the arm.
PATH = ep.CentrePath([0.0, 0.5 * np.pi, np.pi], [[0, 0, 0], [-0.027, -0.011, 0.024], [-0.046, -0.048, 0.054]])
ARM = ep.Arm.from_anthropometry(1.75, 75, sex="male")
#: Poses that the loop over MuJoCo does.
PART = 2000


def design(limb_count):
    """Limbs at random with all data that the criteria need."""
    start = starting_design(ep.Actuator("linear", pull_limit=400.0, push_limit=400.0), ARM, limb_count)
    space = DesignVariables(start, free_joints(limb_count))
    rng = np.random.default_rng(limb_count)
    mechanism = space.design({name: rng.uniform(*pair) for name, pair in zip(space.names, space.bounds, strict=True)})
    limb = ep.Limb("UPU", stroke=ep.Stroke(0.5, 0.5, 1.0, 0.05), joint_limit=1.6, joint_straight=(0, 0, 1),
                   actuator=mechanism.limbs[0].actuator)  # fmt: skip
    shoulder = ep.Shoulder(abduction_centre=np.pi / 2, half_diagonal=1.6)
    return ep.ShoulderExo.from_mechanism(mechanism.replace(limbs=[limb] * limb_count, shoulder=shoulder))


def cpu(function, repeats=5):
    """Least CPU time, ms."""
    function()
    best = np.inf
    for _ in range(repeats):
        begun = time.process_time()
        function()
        best = min(best, time.process_time() - begun)
    return 1e3 * best


def with_numpy(exo, R):
    """Three limbs in plain NumPy."""
    a, arm = exo.geometry.base_points, exo.arm
    b = np.einsum("kij,nj->kni", R, exo.geometry.platform_points)
    span = b - a
    length = np.linalg.norm(span, axis=-1)
    s = span / length[..., None]
    X = -np.cross(a, b)
    X /= np.linalg.norm(X, axis=-1, keepdims=True)
    det = np.linalg.det(X)
    W = arm.mass * np.array([0.0, 0.0, -9.81])
    M = np.cross(R @ arm.centre_of_mass, W)
    f = np.linalg.solve(np.swapaxes(np.cross(b, s), 1, 2), M[..., None])[..., 0]
    shoulder = np.einsum("kn,kni->ki", f, s) - W
    return length, det, f, shoulder


def with_mujoco(exo, quaternions):
    """A loop over poses."""
    sites = "".join(f'<site name="a{i}" pos="{a[0]} {a[1]} {a[2]}"/>' for i, a in enumerate(exo.geometry.base_points))
    ends = "".join(
        f'<site name="b{i}" pos="{b[0]} {b[1]} {b[2]}"/>' for i, b in enumerate(exo.geometry.platform_points)
    )
    tendons = "".join(
        f'<spatial name="t{i}"><site site="a{i}"/><site site="b{i}"/></spatial>' for i in range(exo.geometry.limb_count)
    )
    c = exo.arm.centre_of_mass
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><worldbody>{sites}<body><joint type="ball"/><inertial pos="{c[0]} {c[1]} {c[2]}" '
        f'mass="{exo.arm.mass}" diaginertia="0.1 0.1 0.01"/>{ends}</body></worldbody>'
        f"<tendon>{tendons}</tendon></mujoco>"
    )
    data = mujoco.MjData(model)
    for quaternion in quaternions:
        data.qpos[:] = quaternion
        mujoco.mj_forward(model, data)


def main():
    """Print a table."""
    poses = ep.adl_box(4.0)
    R, wxyz = poses.as_matrix().reshape(-1, 3, 3), np.roll(poses.as_quat().reshape(-1, 4), 1, axis=1)
    three, six = design(3), design(6)
    everything = Criteria(largest_shoulder_force=150.0, body=BodyShape.of(ep.Wearer(1.75, 75, "male")))
    with compiled.mode("compiled"):
        rows = [
            ("three limbs, all criteria but clearances", cpu(lambda: three.workspace(criteria=Criteria(
                largest_shoulder_force=150.0)))),
            ("six limbs, all criteria", cpu(lambda: six.workspace(criteria=everything))),
            ("the same, moving centre", cpu(lambda: six.workspace(criteria=everything, centre_offset=PATH))),
            ("NumPy, three limbs, fewer criteria", cpu(lambda: with_numpy(three, R))),
            ("MuJoCo, three limbs, mj_forward", len(wxyz) / PART * cpu(lambda: with_mujoco(three, wxyz[:PART]), 2)),
        ]  # fmt: skip
    for name, milliseconds in rows:
        print(f"{name:<44}{milliseconds:9.1f} ms of CPU")


if __name__ == "__main__":
    main()
