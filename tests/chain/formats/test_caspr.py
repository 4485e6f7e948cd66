"""CASPR's cable robots: against MuJoCo's mass matrix, bias and tendon lengths of the same robot, written by hand."""

import mujoco
import numpy as np
import pinocchio as pin
import pytest
import scipy
from caspr_robots import ARM, MOMENTS, ROUTES, cables, link, motion, system
from scipy.spatial.transform import Rotation

from exo_pin import ClosedChain

MJCF = """<mujoco><worldbody><site name="a" pos="0.2 0 0.1"/><site name="d" pos="-0.2 0.1 0"/>
<body pos="0.1 0.2 0.3"><joint type="ball"/>{0}<site name="b" pos="0.075 0.02 -0.1"/>
<body pos="0 0.01 -0.3"><joint axis="1 0 0"/><joint axis="0 0 1"/>{0}
<site name="c" pos="0.07 0.02 -0.13"/><site name="e" pos="0.01 -0.045 -0.12"/></body></body></worldbody>
<tendon><spatial><site site="a"/><site site="b"/><site site="c"/></spatial>
<spatial><site site="d"/><site site="e"/></spatial></tendon></mujoco>""".format(
    '<inertial mass="3" pos="0.01 0.02 -0.13" fullinertia="0.03 0.025 0.01 0.001 0.002 -0.001"/>'
)


def lengths(chain, q):
    model, data = chain.model, chain.model.createData()
    pin.framesForwardKinematics(model, data, q)
    found = []
    for cable in chain.description.cables:
        places = [data.oMf[model.getFrameId(frame, pin.FrameType.BODY)].act(np.array(at)) if frame != "universe"
                  else np.array(at) for frame, at in cable.points]  # fmt: skip
        found.append(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())
    return found


def test_the_robot_is_that_of_mujoco():
    chain, theirs = ClosedChain.from_caspr(ARM, cables(*ROUTES)), mujoco.MjModel.from_xml_string(MJCF)
    data, rng, own = mujoco.MjData(theirs), np.random.default_rng(0), chain.model.createData()
    assert [cable.tension for cable in chain.description.cables] == [(3.0, 45.0)] * 2
    assert chain.roles.actuated == ("forearm_turn_x", "forearm_turn_z")
    for _ in range(5):
        q, v = pin.integrate(chain.model, chain.neutral(), rng.normal(size=5)), rng.normal(size=5)
        data.qpos[:], data.qvel[:] = np.r_[q[3], q[:3], q[4:]], v
        mujoco.mj_forward(theirs, data)
        upper = np.triu(pin.crba(chain.model, own, q))
        assert np.allclose(lengths(chain, q), data.ten_length, atol=1e-12)
        assert np.allclose(lengths(chain.mirrored(), chain.mirror_signs().configuration * q), data.ten_length)
        assert np.allclose(pin.nonLinearEffects(chain.model, own, q, v), data.qfrc_bias, atol=1e-9)
        assert np.allclose(upper @ v + np.triu(upper, 1).T @ v, product(theirs, data, v), atol=1e-10)


def product(theirs, data, v):
    found = np.zeros(len(v))
    mujoco.mj_mulM(theirs, data, found, v)
    return found


@pytest.mark.parametrize(
    ("kind", "angles", "turns"),
    [("S_EULER_XYZ", "XYZ", (1, 2, 3)), ("S_FIXED_XYZ", "xyz", (1, 2, 3)), ("SPATIAL_EULER_XYZ", "XYZ", (4, 5, 6))],
)
def test_angles_at_the_start_turn_the_link(kind, angles, turns):
    count = max(turns)
    start = 0.1 * np.arange(1, count + 1)
    joint = motion(kind, count).replace(" ".join(["0"] * count), " ".join(map(str, start)), 1)
    chain = ClosedChain.from_caspr(system(link(1, "ball", joint, 0, "0 0 0")), cables())
    data = chain.model.createData()
    pin.forwardKinematics(chain.model, data, chain.model.referenceConfigurations["q_initial"])
    wanted = Rotation.from_euler(angles, start[-3:]).as_matrix()
    assert np.allclose(data.oMi[1].rotation, wanted, atol=1e-12)
    assert np.allclose(data.oMi[1].translation, start[:3] if count == 6 else 0.0)


#: CASPR's "Example spatial" with "basic_7_cables": ends on the frame and on the plate, m.
FRAME = ((0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1), (0.5, 0, 0), (1, 1, 0), (0, 1, 0))
PLATE = (
    (-0.15, -0.1, 0.05), (0.15, -0.1, 0.05), (0.15, 0.1, 0.05), (-0.15, 0.1, 0.05), (0, -0.1, -0.05),
    (0.15, 0.1, -0.05), (-0.15, 0.1, -0.05),
)  # fmt: skip
#: Lengths, m, and forces of least sum of squares, N, that CASPR gives along its trajectory "traj_processor_test":
#: cable_lengths.csv and cable_forces.csv of HILMR/PYCASPR, by the time in s.
PUBLISHED = {
    0.0: ((0.69642, 0.69642, 0.69642, 0.69642, 0.60208, 0.69642, 0.69642),
          (8.7955, 8.7955, 8.7955, 8.7955, 8.6453, 5, 5)),
    1.0: ((0.73259, 0.71226, 0.68828, 0.7093, 0.60143, 0.66027, 0.68215),
          (7.9988, 9.4931, 8.8433, 9.2651, 8.8792, 6.7481, 5)),
    2.0: ((0.83268, 0.76337, 0.67552, 0.75295, 0.61101, 0.56045, 0.6517),
          (5.6246, 11.665, 9.2375, 10.769, 9.8032, 11.783, 5)),
    2.5: ((0.86278, 0.78061, 0.67456, 0.76816, 0.61706, 0.5305, 0.64534),
          (5, 13.567, 10.43, 12.371, 11.837, 15.144, 5.7811)),
}  # fmt: skip


def test_forces_of_a_published_run_come_back():
    plate = (
        link(1, "plate", motion("SPATIAL_EULER_XYZ", 6), 0, "0 0 0")
        .replace("<mass>3.0</mass>", "<mass>1</mass>")
        .replace("0.01 0.02 -0.13", "0 0 0")
        .replace(MOMENTS, "<Ixx>0.0042</Ixx><Iyy>0.0083</Iyy><Izz>0.0108</Izz><Ixy>0</Ixy><Ixz>0</Ixz><Iyz>0</Iyz>")
    )
    ends = [[(n, " ".join(map(str, at))) for n, at in enumerate(pair)] for pair in zip(FRAME, PLATE, strict=True)]
    routes = cables(*ends).replace("<force_min>3<", "<force_min>5<").replace("<force_max>45<", "<force_max>300<")
    chain = ClosedChain.from_caspr(system(plate), routes)
    least, most = np.transpose([cable.tension for cable in chain.description.cables])
    for time, (published_lengths, published_forces) in PUBLISHED.items():
        u = time / 3.0  # a quintic in 3 s
        share, more = u**3 * (10.0 - 15.0 * u + 6.0 * u**2), u * (60.0 - 180.0 * u + 120.0 * u**2) / 9.0
        along = np.array([0.1, 0.1, -0.1])
        q, a = np.r_[0.5 + share * along, 0.0, 0.0, 0.0, 1.0], np.r_[more * along, 0.0, 0.0, 0.0]
        assert np.allclose(lengths(chain, q), published_lengths, atol=5.1e-6)
        # v makes no force here: the plate is moved without turning.
        wanted = pin.rnea(chain.model, chain.model.createData(), q, np.zeros(6), a)
        steps = 1e-6 * np.eye(6)
        ahead, behind = ([lengths(chain, pin.integrate(chain.model, q, s * step)) for step in steps] for s in (1, -1))
        rows = (np.array(ahead) - np.array(behind)) / 2e-6
        weight = 1e5  # what equilibrium asks comes before small forces
        found = scipy.optimize.lsq_linear(
            np.r_[-weight * rows, np.eye(7)], np.r_[weight * wanted, np.zeros(7)], (least, most), method="bvls"
        )
        assert np.allclose(found.x, published_forces, atol=1e-3)
