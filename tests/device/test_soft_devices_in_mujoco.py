"""Devices on a soft harness and cuff are in balance in MuJoCo, at the configuration that they take there."""

import xml.etree.ElementTree as ET

import mujoco
import numpy as np
import pytest
from parallelogram_supports import parallelogram_support
from places import URDF
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.device.elastic.soft_equilibrium import soft_model


def on_springs_in_mujoco(chain, folder):
    """The chain in MuJoCo: the arm flies; slides and a ball are between it and the device, and under the frame."""
    tree = ET.parse(chain.to_mjcf(folder))
    world = tree.getroot().find("worldbody")
    if (ground := world.find("body[@name='ground']")) is not None:
        world.remove(ground)
        world.extend(list(ground))
    arm = world.find("body[@name='arm']")
    for inertial in tree.iter("inertial"):
        if float(inertial.get("mass")) < 1e-5:  # what MuJoCo needs of a massless body weighs nothing here
            inertial.set("mass", "1e-12")
            inertial.set("diaginertia", "1e-12 1e-12 1e-12")
    arm.remove(arm.find("joint"))
    arm.insert(0, ET.Element("freejoint", name="arm"))
    for parent, name in ((arm, "cuff_spring"), (world, "harness_spring")):
        # What is welded to the arm weighs on it, and stays.
        jointed = [child for child in parent if child.find("joint") is not None and child is not arm]
        moved = [*jointed, *parent.findall("site")]
        soft = ET.SubElement(parent, "body", name=name)
        for k, axis in enumerate(("1 0 0", "0 1 0", "0 0 1")):
            ET.SubElement(soft, "joint", type="slide", axis=axis, name=f"{name}{k}")
        ET.SubElement(soft, "joint", type="ball", name=f"{name}3")
        ET.SubElement(soft, "inertial", mass="1e-12", pos="0 0 0", diaginertia="1e-12 1e-12 1e-12")
        for child in moved:
            parent.remove(child)
            soft.append(child)
    return mujoco.MjModel.from_xml_string(ET.tostring(tree.getroot(), encoding="unicode"))


def spring_slope(spring, position, turn, unloaded):
    """Slope of a spring's energy, by central differences, over its joint's slides and turns about the moved axes."""

    def energy(step):
        R = turn * Rotation.from_rotvec(step[3:])
        moved = position + step[:3] + R.apply(spring.at - unloaded) - spring.at
        both = np.concatenate([moved, R.as_rotvec()])
        return 0.5 * both @ spring.stiffness @ both

    return np.array([(energy(step) - energy(-step)) / 2e-6 for step in 1e-6 * np.eye(6)])


def coupled(seed, at):
    """A spring whose six directions act on each other."""
    rng = np.random.default_rng(seed)
    size = np.sqrt([9e3, 7e3, 5e3, 250.0, 200.0, 150.0])
    mix = np.eye(6) + 0.15 * rng.normal(size=(6, 6))
    return ep.Interface(np.outer(size, size) * (mix @ mix.T), at)


@pytest.mark.parametrize("name", ["serial-y-x-z", "spherical-3rrr", "parallelogram"])
@pytest.mark.parametrize("soft", [("cuff",), ("harness",), ("harness", "cuff")], ids="+".join)
def test_a_misaligned_device_on_soft_harness_and_cuff_is_in_balance_in_mujoco(name, soft, tmp_path):
    exo = parallelogram_support(1) if name == "parallelogram" else ep.load(URDF / f"{name}.urdf")
    exo = exo.replace(arm=ep.Arm(exo.arm.mass, exo.arm.centre_of_mass, exo.arm.inertia))
    parts = {"harness": coupled(1, (-0.1, 0.05, 0.1)), "cuff": coupled(2, (0.0, 0.02, -0.19))}
    exo = exo.replace(interfaces=ep.Interfaces(**{key: parts[key] for key in soft}))
    shift = {"harness": np.array([0.006, -0.004, 0.01]), "cuff": np.array([-0.003, 0.005, 0.002])}
    pose = exo.pose(3, 6, 4) if name == "parallelogram" else exo.pose(50, 40, 10)
    answer = exo.reaction(pose, split="elastic", centre_offset=ep.CentreOffset(shift["harness"], shift["cuff"]))
    assert answer.status == "ok"
    assert np.abs(answer.interface_displacements[:, :3]).max() > 1e-3
    model = on_springs_in_mujoco(exo.chain, tmp_path)
    data, load, moves = mujoco.MjData(model), np.zeros(model.nv), np.ones(model.nv, dtype=bool)
    joints = {model.joint(k).name: k for k in range(model.njnt)}
    data.qpos[:7] = [0.0, 0.0, 0.0, *np.roll(pose.as_quat(), 1)]
    for key, slip in zip(("harness", "cuff"), np.array(answer.interface_displacements), strict=True):
        joint = joints[f"{key}_spring0"]
        turn, dof = Rotation.from_rotvec(slip[3:]), slice(model.jnt_dofadr[joint], model.jnt_dofadr[joint] + 6)
        at = np.array(parts[key].at)
        position = slip[:3] + at - turn.apply(at - shift[key])
        data.qpos[model.jnt_qposadr[joint] :][:7] = [*position, *np.roll(turn.as_quat(), 1)]
        if key in soft:
            load[dof] = -spring_slope(parts[key], position, turn, shift[key])
        moves[dof] = key in soft
    held = soft_model(exo.device).model.held
    q, efforts = answer.source.poses.placed.q[0], dict(zip(exo.device.drives, answer.actuator_forces, strict=True))
    for joint in set(joints) & set(exo.chain.model.names) - {"arm"}:
        own = q[held.configuration_slice(joint)]
        data.qpos[model.jnt_qposadr[joints[joint]]] = own[0] if len(own) == 1 else np.arctan2(own[1], own[0])
    for drive, effort in efforts.items():
        load[model.jnt_dofadr[joints[drive.joint]]] = effort
    mujoco.mj_forward(model, data)
    # The loops onto the torso are closed, and their forces carry what weight, springs and drives leave.
    assert np.abs(data.efc_pos[: data.ne]).max() < 1e-10
    rest = data.qfrc_bias - data.qfrc_passive - load
    rest[:3] -= answer.shoulder_force
    J, rest = data.efc_J.reshape(-1, model.nv)[: data.ne, moves], rest[moves]
    missing = rest - J.T @ np.linalg.lstsq(J.T, rest, rcond=1e-10)[0]
    assert np.abs(missing).max() < 1e-8 * np.abs(answer.shoulder_force).max()
