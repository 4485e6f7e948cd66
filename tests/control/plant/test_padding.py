"""Cuff and harness that give way in motion: at rest the elastic answer, stiff the rigid plant, moving as in MuJoCo."""

from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest
from mujoco_exact import ExactMujoco
from mujoco_motion import moved
from places import URDF

import exo_pin as ep
from exo_pin import control

TISSUE = control.Passive(20.0, 1.0, ep.shoulder_rotation(10.0, 20.0, 0.0, degrees=True), "a test")
#: Too light to be seen in the forces; links of some devices have no mass.
PAD = control.Padding(damping_time=0.01, mass=1e-5, radius=0.05, source="a test")
CUFF = ep.Interface.of([3.7e3, 3.15e3, 2.25e3], 12.0, at=(0.0, 0.0, -0.2))
HARNESS = ep.Interface.of(2e4, 300.0, at=(-0.1, 0.0, 0.1))


def soft(name, cuff=CUFF, harness=None):
    exo = ep.load(URDF / f"{name}.urdf" if (URDF / f"{name}.urdf").is_file() else name)
    return exo.replace(arm=exo.arm.person or exo.arm, interfaces=ep.Interfaces(cuff=cuff, harness=harness))


@pytest.mark.parametrize(
    ("name", "parts"),
    [
        ("serial-y-x-z", "cuff"),
        ("serial-y-x-z", "harness"),
        ("spherical-3rrr", "cuff"),
        ("spring-support", "cuff"),
        pytest.param("three-linear-actuators", "cuff harness", marks=pytest.mark.full),
    ],
)
def test_at_rest_it_is_the_elastic_equilibrium(name, parts):
    interfaces = {"cuff": CUFF if "cuff" in parts else None, "harness": HARNESS if "harness" in parts else None}
    exo = soft(name, **interfaces)
    plant = ep.Plant(exo, wearer=TISSUE, **dict.fromkeys(parts.split(), PAD))
    pose, positions = exo.pose(20, 10), None
    if plant.count and not plant.drives[0].is_direct:
        positions = plant.held(pose, exo.reaction(pose, limits="none").actuator_forces).drive_positions
    rest = plant.rest(near=pose, drive_positions=positions)
    run = plant.simulate(lambda t, seen: np.zeros(plant.count), 1e-6, rest)
    load = ep.Load(np.zeros(3), run.wearer_moment[0])
    none = np.zeros(exo.device.limb_count)
    limits = (none, none) if positions is None and plant.count else "none"
    answer = exo.reaction(rest.orientation, load=load, split="elastic", limits=limits)
    np.testing.assert_allclose(run.cuff_displacement[0], answer.interface_displacements[1], atol=1e-6)
    np.testing.assert_allclose(run.harness_displacement[0], answer.interface_displacements[0], atol=1e-6)
    np.testing.assert_allclose(run.shoulder_force[0], answer.shoulder_force, atol=1e-3)
    if "cuff" in parts:
        # What weight and F_s leave for the cuff is the force of its spring.
        d, R = run.cuff_displacement[0], run.rotations[0]
        force, moment = R.apply(np.split(CUFF.stiffness @ d, 2))
        moment = moment + np.cross(R.apply(CUFF.at + d[:3]), force)
        np.testing.assert_allclose(run.cuff_wrench[0], [*force, *moment], atol=1e-6)
    assert np.abs(run.cuff_displacement[0] if "cuff" in parts else run.harness_displacement[0]).max() > 5e-4


@pytest.mark.full
def test_it_moves_as_mujocos_own_matrices_say(tmp_path):
    exo = ep.load(URDF / "serial-y-x-z.urdf").replace(interfaces=ep.Interfaces(cuff=CUFF))
    device, pose = exo.device.as_chain(), exo.pose(flexion=30.0, abduction=15.0)
    free = control.Padding(damping_time=0.0, source="a test")
    plant = ep.Plant(exo, control.PlantOptions(joint_motor=control.JointMotor(inertia=0.05)), wearer=TISSUE, cuff=free)
    limits = np.array([drive.upper for drive in device.drives])
    commands = np.array([0.05, 0.1, 0.2])
    run = plant.simulate(lambda t, seen: commands, 0.5, plant.state(pose), control_rate=20.0, rtol=1e-10)

    # Beyond three slides and a ball with MuJoCo's own springs, in the cuff's point, hangs what was on the arm.
    tree = ElementTree.parse(device.chain.to_mjcf(tmp_path))
    arm = tree.find(".//body[@name='arm']")
    pad = ElementTree.Element("body", name="pad", pos="0 0 -0.2")
    for axis, stiffness in zip(("1 0 0", "0 1 0", "0 0 1"), np.diag(CUFF.stiffness), strict=False):
        ElementTree.SubElement(pad, "joint", type="slide", axis=axis, stiffness=repr(float(stiffness)))
    ElementTree.SubElement(pad, "joint", type="ball", stiffness="12.0")
    for body in arm.findall("body"):
        body.set("pos", "0 0 0.2")
        arm.remove(body)
        pad.append(body)
    arm.append(pad)
    for key in tree.findall(".//keyframe"):
        tree.getroot().remove(key)
    model = mujoco.MjModel.from_xml_string(ElementTree.tostring(tree.getroot(), encoding="unicode"))
    exact = ExactMujoco(model, device.chain)
    motors = [int(model.jnt_dofadr[model.joint(drive.joint).id]) for drive in device.drives]
    model.dof_armature[motors] = 0.05

    def push(R, q):
        forces = np.zeros(model.nv)
        forces[motors] = commands * limits
        return forces

    rigid = ep.Plant(ep.load(URDF / "serial-y-x-z.urdf")).equations.configuration(pose)
    first = exact.qpos_of(rigid)
    first[int(model.jnt_qposadr[4])] = 1.0
    found, coarse = (moved(exact, first, push, TISSUE, steps, 0.5) for steps in (600, 300))
    assert (found[-1] * coarse[-1].inv()).magnitude() < 2e-6
    assert (run.rotations[1:] * found.inv()).magnitude().max() < 1e-6
    assert np.abs(run.cuff_displacement).max() > 1e-2
    assert np.abs(run.energy_residual).max() < 1e-6
