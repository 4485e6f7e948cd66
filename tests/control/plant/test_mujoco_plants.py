"""Devices that are no wrist, with the person's passive moment, against MuJoCo's matrices of their exported models.

MuJoCo gives mass matrix, bias, and rows of the loops of the exported MJCF; loops are solved exactly, and the classical
Runge-Kutta method of fourth order integrates with a step of 2 ms; one of 4 ms gives the same to 1e-7 rad.
"""

import mujoco
import numpy as np
import pytest
from mujoco_exact import ExactMujoco
from mujoco_motion import moved
from places import URDF

import exo_pin as ep
from exo_pin import control

TISSUE = control.Passive(
    [3.0, 4.0, 1.0], [0.4, 0.5, 0.2], ep.shoulder_rotation(10.0, 20.0, 0.0, degrees=True), "a test"
)


@pytest.mark.full
@pytest.mark.parametrize("name", ["serial-y-x-z", "spherical-3rrr", "spring-support"])
def test_devices_move_as_mujocos_own_matrices_say(name, tmp_path):
    exo = ep.load(URDF / f"{name}.urdf")
    device, pose, rotor = exo.device.as_chain(), exo.pose(flexion=30.0, abduction=15.0), 0.05
    plant = ep.Plant(exo, control.PlantOptions(joint_motor=control.JointMotor(inertia=rotor)), wearer=TISSUE)
    limits = np.array([drive.upper for drive in device.drives])
    commands = 0.8 * exo.reaction(pose, limits="none").actuator_forces / limits if len(limits) else np.zeros(0)
    run = plant.simulate(lambda t, seen: commands, 1.0, plant.state(pose), control_rate=10.0, rtol=1e-10)

    model = mujoco.MjModel.from_xml_path(str(device.chain.to_mjcf(tmp_path)))
    exact = ExactMujoco(model, device.chain)
    motors = [int(model.jnt_dofadr[model.joint(drive.joint).id]) for drive in device.drives]
    model.dof_armature[motors] = rotor

    def push(R, q):
        forces = np.zeros(model.nv)
        forces[motors] = commands * limits
        for spring in device.springs:
            low, on_arm = np.array(spring.route.points[0].point), plant.equations.model.cuff
            span = R @ on_arm - low
            pull = -span / np.linalg.norm(span) * float(spring.law.force(np.linalg.norm(span)))
            start = int(model.jnt_dofadr[0])
            forces[start : start + 3] += R.T @ np.cross(R @ on_arm, pull)
        return forces

    first = exact.qpos_of(plant.equations.configuration(pose))
    found, coarse = (moved(exact, first, push, TISSUE, steps) for steps in (500, 250))
    assert (found[-1] * coarse[-1].inv()).magnitude() < 1e-7
    assert (run.rotations[1:] * found.inv()).magnitude().max() < 1e-6
    assert (run.rotations[-1] * pose.inv()).magnitude() > 0.05
    assert np.abs(run.energy_residual).max() < 1e-6
