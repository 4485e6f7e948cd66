"""A device on MyoArm in MuJoCo, beside the plant: both under the same drives, and the angle between the arms."""

import mujoco
import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import control

__all__ = ["PERSON", "Worn", "angles_apart", "law_of_drives"]

#: The parts of MyoArm that count, of a right arm without a side in its names: 5 joints of the shoulder, elbow, wrist.
PERSON = """
<mujoco>
  <compiler meshdir="bones"/>
  <worldbody><body name="trunk" pos="0 0 1.4" euler="90 -90 0">
    <geom type="sphere" size="0.1"/>
    <body name="clavicle"><joint name="girdle" axis="0 1 0"/><geom type="sphere" size="0.01" mass="0.1"/>
      <body name="helper" pos="0 0 0.17">
        <inertial pos="0 0 0" mass="0.001" diaginertia="1 1 1"/>
        <joint name="elv_angle" axis="0 1 0" damping="1"/>
        <body name="helper1">
          <inertial pos="0 0 0" mass="0.001" diaginertia="1 1 1"/>
          <joint name="shoulder_elv" axis="-1 0 0"/><joint name="shoulder1_r2" axis="0 1 0"/>
          <body name="humerus"><joint name="shoulder_rot" axis="0 1 0"/>
            <geom type="capsule" fromto="0 0 0 0.02 -0.28 0" size="0.04" mass="2"/>
            <site name="shaft" pos="0 -0.1 0"/>
            <body name="ulna" pos="0 -0.29 0"><joint name="elbow_flexion" axis="0 0 1"/>
              <geom type="sphere" size="0.02" mass="0.5"/>
              <body name="radius"><joint name="pro_sup" axis="0 1 0"/>
                <geom type="capsule" fromto="0 0 0 0 -0.24 0" size="0.03" mass="1"/>
                <body name="hand" pos="0 -0.26 0"><joint name="flexion" axis="1 0 0"/>
                  <geom type="sphere" size="0.03" mass="0.4"/><site name="palm"/></body>
              </body></body></body></body></body></body></body></worldbody>
  <equality><joint joint1="girdle" joint2="shoulder_elv" polycoef="0 0.2 0 0 0"/>
    <joint joint1="shoulder1_r2" joint2="elv_angle" polycoef="0 -1 0 0 0"/></equality>
  <tendon><spatial name="biceps"><site site="shaft"/><site site="palm"/></spatial></tendon>
  <actuator><motor name="biceps" tendon="biceps"/><motor name="wrist" joint="flexion"/></actuator>
  <sensor><jointpos joint="elbow_flexion"/></sensor>
  <keyframe><key name="rest" qpos="0 0 0 0 0 0 0 0"/></keyframe>
</mujoco>
"""

SHOULDER = ("elv_angle", "shoulder_elv", "shoulder1_r2", "shoulder_rot")


class Worn:
    """The written model in a pose, with its {O_A} and {O_B}."""

    def __init__(self, path, side):
        self.model = mujoco.MjModel.from_xml_path(str(path))
        self.data = mujoco.MjData(self.model)
        joints = [self.model.joint(f"{name}_{side[0]}" if side else name) for name in SHOULDER]
        self._at = [joint.qposadr[0] for joint in joints]
        elevation = joints[1].id
        # Clavicle and scapula follow the elevation.
        coupled = (self.model.eq_obj2id == elevation) & (self.model.eq_type == mujoco.mjtEq.mjEQ_JOINT)
        self._follow = self.model.jnt_qposadr[self.model.eq_obj1id[coupled]], self.model.eq_data[coupled, 1]

    def _turn(self, body):
        return Rotation.from_matrix(self.data.body(body).xmat.reshape(3, 3))

    @property
    def pose(self):
        """Of {O_B} in {O_A}."""
        return self._turn("exo_base").inv() * self._turn("exo_arm")

    def place(self, pose):
        """Set the shoulder's angles of a pose."""

        def off(angles):
            self.data.qpos[self._at] = angles[0], angles[1], -angles[0], angles[2]
            self.data.qpos[self._follow[0]] = self._follow[1] * angles[1]
            mujoco.mj_kinematics(self.model, self.data)
            return (self.pose * pose.inv()).as_rotvec()

        found = least_squares(off, [1.0, 0.5, 0.0], xtol=1e-15, ftol=1e-15, gtol=1e-15)
        assert np.abs(off(found.x)).max() < 1e-9
        mujoco.mj_forward(self.model, self.data)

    def numbers(self, kind, count):
        """Of actuators or tendons of limbs."""
        return np.array([getattr(self.model, kind)(f"limb_{k + 1}").id for k in range(count)])


def angles_apart(exo, worn, step, tension=None):
    """Angles between the arms of plant and MuJoCo along a lift by 20° in 1 s, rad, one a step.

    The plant moves under the model-based controller. MuJoCo gets the tensions of its drives, or what a law makes of the
    run, the number of the sample, and MuJoCo's lengths and their rates.
    """
    way = np.radians([[25.0, 15.0, 0.0], [45.0, 15.0, 0.0]])
    reference = control.AnglePath([0.0, 1.0], way, exo.side, "minimum_jerk")
    experiment = control.Experiment("lift", "lift", exo.mechanism, reference, "model")
    plant = experiment.plant
    run = plant.simulate(experiment.made_controller(plant), 1.0, experiment.start(plant), sample_rate=1.0 / step)
    assert run.status == "completed"
    assert (run.rotations[0].inv() * run.rotations[-1]).magnitude() > np.radians(19.0)
    model, data = worn.model, worn.data
    model.opt.timestep = step
    worn.place(run.rotations[0])
    drives, tendons = worn.numbers("actuator", plant.count), worn.numbers("tendon", plant.count)
    turns = [worn.pose]
    for k in range(len(run.times) - 1):
        made = (
            run.tensions[k]
            if tension is None
            else tension(run, k, data.ten_length[tendons], data.ten_velocity[tendons])
        )
        data.ctrl[drives] = made
        mujoco.mj_step(model, data)
        mujoco.mj_kinematics(model, data)
        turns.append(worn.pose)
    return (Rotation.concatenate(turns) * run.rotations.inv()).magnitude()


def law_of_drives(exo):
    """Tensions of stiff drives by where they stand: spring and damper in series."""
    drives = ep.Plant(exo).drives
    k = np.array([each.stiffness for each in drives])
    c = k * [each.parameters.damping_time for each in drives]

    def tension(run, sample, length, speed):
        return k * (length - run.drive_positions[sample]) + c * (speed - run.drive_speeds[sample])

    return tension
