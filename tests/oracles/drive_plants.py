"""Plants of the found designs for tests, held in a pose, and an integration of them that shares no code with theirs."""

from dataclasses import replace

import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import control

WITHOUT_FRICTION = {"viscous": 0.0, "coulomb": 0.0, "load_friction": 0.0, "damping_time": 0.0}
SMOOTH = ep.PlantOptions(
    winch=control.Winch(**WITHOUT_FRICTION),
    linear_actuator=control.LinearActuator(**WITHOUT_FRICTION),
    pulley_friction=0.0,
)


def holding(plant, pose):
    """Tensions of least shoulder force that hold a pose."""
    lengths = plant.contractions.lengths(pose)
    least, greatest = plant.force_limits(lengths)
    return control.tensions_for_motion(plant.mechanism, pose, None, greatest, least).tensions


def held(name, options=None, abduction=30.0, spin=(0.0, 0.0, 0.0)):
    """A plant, the tensions that hold it in a pose, and a state there with an angular velocity."""
    plant = ep.Plant(ep.load(name), options)
    pose = ep.shoulder_rotation(10.0, abduction, 5.0, degrees=True)
    tensions = holding(plant, pose)
    return plant, tensions, replace(plant.held(pose, tensions), angular_velocity=np.array(spin))


def integrated(plant, start, forces, times):
    """Motor-driven plant without friction and stops, from the equations as they stand in a textbook.

    Twelve numbers of the arm (rotation matrix and angular velocity) and two a drive, by SciPy. Returns rotations.
    """
    arm, geometry, n = plant.mechanism.arm, plant.mechanism.geometry, plant.count
    mass = np.array([drive.parameters.mass for drive in plant.drives])
    stiffness = np.array([drive.stiffness for drive in plant.drives])
    pushes = np.array([drive.pushes for drive in plant.drives])
    half = 0.5 * np.array([drive.play for drive in plant.drives])
    c, g = arm.centre_of_mass, plant.mechanism.gravity
    about_origin = arm.inertia + arm.mass * (c @ c * np.eye(3) - np.outer(c, c))

    def rate(t, x):
        R, w, s, v = x[:9].reshape(3, 3), x[9:12], x[12 : 12 + n], x[12 + n :]
        b = geometry.platform_points @ R.T
        span = b - geometry.base_points
        length = np.linalg.norm(span, axis=1)
        gap = length - s
        tension = stiffness * np.where(np.abs(gap) > half, gap - np.sign(gap) * half, 0.0)
        tension = np.where(pushes, tension, np.maximum(tension, 0.0))
        moment = np.cross(R @ c, arm.mass * g) - np.cross(b, tension[:, None] * span / length[:, None]).sum(axis=0)
        inertia = R @ about_origin @ R.T
        turned = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]]) @ R
        change = np.linalg.solve(inertia, moment - np.cross(w, inertia @ w))
        return np.concatenate([turned.ravel(), change, v, (tension - forces(t)) / mass])

    first = np.concatenate(
        [start.orientation.as_matrix().ravel(), start.angular_velocity, start.drive_positions, start.drive_speeds]
    )
    # In its play a drive feels nothing; a step over all of it would end far beyond.
    tight = {"rtol": 1e-12, "atol": 1e-12, "max_step": 2e-3}
    found = solve_ivp(rate, (0.0, times[-1]), first, method="DOP853", t_eval=times, **tight)
    return Rotation.from_matrix(found.y[:9].T.reshape(-1, 3, 3))


def limb_mjcf(exo):
    """The arm on a ball joint with a tendon a limb, each with a motor, as MJCF."""
    arm, tendons, motors, sites, points = exo.arm, "", "", "", ""
    for i, (a, b) in enumerate(zip(exo.geometry.base_points, exo.geometry.platform_points, strict=True)):
        points += f'<site name="a{i}" pos="{a[0]!r} {a[1]!r} {a[2]!r}"/>'
        sites += f'<site name="b{i}" pos="{b[0]!r} {b[1]!r} {b[2]!r}"/>'
        tendons += f'<spatial name="t{i}"><site site="a{i}"/><site site="b{i}"/></spatial>'
        motors += f'<motor tendon="t{i}"/>'
    J, c = arm.inertia, arm.centre_of_mass
    full = " ".join(repr(float(v)) for v in (J[0, 0], J[1, 1], J[2, 2], J[0, 1], J[0, 2], J[1, 2]))
    return f"""<mujoco><compiler balanceinertia="false"/><worldbody>{points}<body><joint type="ball"/>
      <inertial pos="{c[0]!r} {c[1]!r} {c[2]!r}" mass="{arm.mass!r}" fullinertia="{full}"/>{sites}</body></worldbody>
      <tendon>{tendons}</tendon><actuator>{motors}</actuator></mujoco>""".replace("np.float64(", "").replace(")", "")
