"""The wrist as MuJoCo sees it: a ball joint, site tendons, a force sensor. It shares no formula with exo_pin."""

from __future__ import annotations

import mujoco
import numpy as np


class MujocoWrist:
    """An arm on a ball joint at O, pulled by tendons from the torso.

    The side forces of UPU limbs pass through O and are not modelled: this is the case g = 0.
    """

    def __init__(self, mechanism):
        arm, geometry = mechanism.arm, mechanism.geometry
        inertia = arm.inertia
        six = [inertia[0, 0], inertia[1, 1], inertia[2, 2], inertia[0, 1], inertia[0, 2], inertia[1, 2]]

        def numbers(values):
            return " ".join(repr(float(value)) for value in values)

        n = geometry.limb_count
        base = "".join(f'<site name="A{i}" pos="{numbers(geometry.base_points[i])}"/>' for i in range(n))
        platform = "".join(f'<site name="B{i}" pos="{numbers(geometry.platform_points[i])}"/>' for i in range(n))
        tendons = "".join(f'<spatial name="T{i}"><site site="A{i}"/><site site="B{i}"/></spatial>' for i in range(n))
        motors = "".join(f'<motor tendon="T{i}" gear="1"/>' for i in range(n))
        self.model = mujoco.MjModel.from_xml_string(f"""
        <mujoco>
          <compiler balanceinertia="false"/>
          <option gravity="{numbers(mechanism.gravity)}"><flag contact="disable"/></option>
          <worldbody>{base}
            <body name="arm"><joint name="shoulder" type="ball"/>
              <inertial pos="{numbers(arm.centre_of_mass)}" mass="{arm.mass!r}" fullinertia="{numbers(six)}"/>
              <site name="O"/>{platform}
            </body>
          </worldbody>
          <tendon>{tendons}</tendon><actuator>{motors}</actuator>
          <sensor><force site="O"/></sensor>
        </mujoco>""")
        self.data = mujoco.MjData(self.model)
        self.body = self.model.body("arm").id

    def forces(self, R, velocity, acceleration, force, moment):
        """Return tensions (least norm), shoulder force on the arm, and the acceleration that they make, base frame."""
        model, data = self.model, self.data
        data.qpos[:] = R.as_quat(scalar_first=True)
        data.qvel[:] = R.as_matrix().T @ velocity
        data.qacc[:] = R.as_matrix().T @ acceleration
        data.ctrl[:] = 0.0
        data.xfrc_applied[:] = 0.0
        mujoco.mj_inverse(model, data)
        outside = np.zeros(3)
        mujoco.mj_applyFT(model, data, force, moment, np.zeros(3), self.body, outside)
        arms = data.ten_J.reshape(model.ntendon, 3)
        tensions = np.linalg.lstsq(-arms.T, data.qfrc_inverse - outside, rcond=None)[0]
        data.ctrl[:] = -tensions
        data.xfrc_applied[self.body, :3] = force
        data.xfrc_applied[self.body, 3:] = moment - np.cross(data.xipos[self.body], force)
        mujoco.mj_forward(model, data)
        # The sensor gives the force of the torso on the arm, in the site's frame (see the test of its sign).
        shoulder = data.site("O").xmat.reshape(3, 3) @ data.sensordata[:3]
        return tensions, shoulder, R.apply(data.qacc)
