"""Devices as built and worn, and what sensors on them measure; through MuJoCo, or from the definition of a distance."""

from typing import NamedTuple

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation
from wrists import random_mechanism

import exo_pin as ep

#: The torso leans and looks aside.
TORSO = Rotation.from_euler("XYZ", [12.0, -7.0, 25.0], degrees=True)


class Device(NamedTuple):
    """Joints seen from the shoulder's centre, length offsets, mountings."""

    base: np.ndarray
    platform: np.ndarray
    offsets: np.ndarray
    torso: Rotation
    arm: Rotation


def near(exo, rng, joints=0.004, offsets=0.0, mounting=0.0, rings=(0.0, 0.0)):
    """A device whose joints (m), length offsets (m) and mountings (rad) differ at random from a design."""
    n = exo.geometry.limb_count
    torso, arm = (Rotation.from_rotvec(mounting * rng.normal(size=3)) for _ in range(2))
    shifts = [size * rng.normal(size=3) for size in rings]
    return Device(
        exo.geometry.base_points + joints * rng.normal(size=(n, 3)) + shifts[0],
        exo.geometry.platform_points + joints * rng.normal(size=(n, 3)) + shifts[1],
        offsets * rng.normal(size=n),
        torso,
        arm,
    )


def random_exo(rng, limbs):
    """A wrist whose joints A_i and B_i are at clearly different distances from the centre."""
    while True:
        exo = ep.ShoulderExo.from_mechanism(random_mechanism(rng, limbs))
        a, b = (np.linalg.norm(x, axis=1) for x in (exo.geometry.base_points, exo.geometry.platform_points))
        if np.abs(a - b).min() > 0.05:
            return exo


def poses(rng, count):
    """From all over the box of daily life."""
    low, high = np.array([0.0, -4.0, -20.0]), np.array([110.0, 96.0, 85.0])
    return ep.shoulder_rotation(*rng.uniform(low, high, (count, 3)).T, degrees=True)


def measured(device, arm_poses, rng=None, length_noise=0.0, orientation_noise=0.0):
    """Orientations of the arm's sensor seen from the torso's, and lengths, with errors."""
    ends = np.stack([arm_poses.apply(point) for point in device.platform], axis=1)
    lengths = np.sqrt(((ends - device.base) ** 2).sum(axis=2)) - device.offsets
    seen = device.torso.inv() * arm_poses * device.arm.inv()
    if rng is not None:
        lengths = lengths + length_noise * rng.normal(size=lengths.shape)
        seen = seen * Rotation.from_rotvec(orientation_noise * rng.normal(size=(len(arm_poses), 3)))
    return seen, lengths


def _frame(position, turn):
    x, y, z, w = turn.as_quat().tolist()
    return f'pos="{" ".join(map(repr, position.tolist()))}" quat="{w!r} {x!r} {y!r} {z!r}"'


def measured_by_mujoco(device, arm_poses):
    """The same without errors: tendons between sites measure lengths, frame sensors on a leaning torso orientations."""
    # {O_A} in the torso's sensor is Q_T⁻¹, the arm's sensor in {O_B} is Q_S⁻¹.
    base = "".join(f'<site name="A{i}" {_frame(p, Rotation.identity())}/>' for i, p in enumerate(device.base))
    arm = "".join(f'<site name="B{i}" {_frame(p, Rotation.identity())}/>' for i, p in enumerate(device.platform))
    n = len(device.base)
    tendons = "".join(f'<spatial name="t{i}"><site site="A{i}"/><site site="B{i}"/></spatial>' for i in range(n))
    model = mujoco.MjModel.from_xml_string(f"""
<mujoco><worldbody>
  <body name="torso" {_frame(np.array([0.3, -0.2, 1.1]), TORSO)}>{base}
    <site name="torso_sensor" {_frame(np.array([-0.1, 0.0, 0.2]), device.torso)}/>
    <body name="arm"><joint type="ball"/><geom size="0.01"/>{arm}
      <site name="arm_sensor" {_frame(np.array([0.05, 0.0, -0.2]), device.arm.inv())}/>
    </body></body></worldbody>
  <tendon>{tendons}</tendon>
  <sensor><framequat objtype="site" objname="torso_sensor"/><framequat objtype="site" objname="arm_sensor"/></sensor>
</mujoco>""")
    data = mujoco.MjData(model)
    seen, lengths = [], []
    for x, y, z, w in arm_poses.as_quat():
        data.qpos[:] = [w, x, y, z]
        mujoco.mj_forward(model, data)
        ground = Rotation.from_quat(data.sensordata.reshape(2, 4), scalar_first=True)
        seen.append(ground[0].inv() * ground[1])
        lengths.append(data.ten_length - device.offsets)
    return Rotation.concatenate(seen), np.array(lengths)
