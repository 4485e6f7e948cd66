"""Records of known movements in the files of other programs, written from SciPy's rotations alone.

Each writer takes a folder, a :class:`Truth` and returns the file and what has to be said about it.
"""

import datetime
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

#: Turns about x, y and z of {O_A} as axes of OpenSim, (x, z, -y).
C = Rotation.from_matrix([[1, 0, 0], [0, 0, 1], [0, -1, 0]])
A, B = np.array([0.0048, 0.99909, 0.0424]), np.array([-0.99826, 0.0023, 0.0589])
SEGMENTS = [
    "Pelvis", "L5", "L3", "T12", "T8", "Neck", "Head", "RightShoulder", "RightUpperArm", "RightForeArm", "RightHand",
    "LeftShoulder", "LeftUpperArm", "LeftForeArm", "LeftHand",
]  # fmt: skip
#: Targets of movements that begin and end hanging: flexion, abduction, internal rotation, degrees.
TARGETS = (
    (80, 5, 10), (20, 85, 0), (70, 60, -20), (100, 30, 30), (60, 75, 15), (110, 20, -10), (85, 50, 40), (40, 95, -15),
)  # fmt: skip


class Truth(NamedTuple):
    """A movement: times, clinical angles in degrees, side, and the elbow's flexion in degrees."""

    t: np.ndarray
    angles: np.ndarray
    side: str
    elbow: np.ndarray

    @property
    def poses(self):
        sign = 1.0 if self.side == "left" else -1.0
        return Rotation.from_euler("YXZ", np.radians(self.angles) * [-1.0, sign, -sign])


def movement(seed, side, target=None, noise=0.1, rate=100):
    """Hanging, a raise to a target and back in 2 to 4 s, hanging, with white noise."""
    rng = np.random.default_rng(seed)
    goal = np.array(TARGETS[seed % len(TARGETS)] if target is None else target, dtype=float)
    goal += rng.uniform(-5, 5, 3) if target is None else 0.0
    duration = rng.uniform(2.0, 4.0)
    t = np.arange(round((duration + 1.6) * rate)) / rate
    tau = np.clip((t - 0.8) / duration, 0, 1)
    share = np.sin(np.pi * (10 * tau**3 - 15 * tau**4 + 6 * tau**5)) ** 2
    angles = share[:, None] * goal + noise * rng.normal(size=(len(t), 3))
    return Truth(t, angles, side, 60 * share)


def lines(path, head, names, rows, separator=",", mark=".", encoding="utf-8"):
    cells = [[f"{x:.6f}".replace(".", mark) if isinstance(x, float) else str(x) for x in row] for row in rows]
    text = "\n".join([*head, separator.join(names), *(separator.join(row) for row in cells), ""])
    path.write_bytes(text.encode(encoding))
    return path


CLINICAL = ("flexion_deg", "abduction_deg", "internal_rotation_deg")


def table(truth, values, t=None):
    return np.c_[truth.t if t is None else t, values].tolist()


def clinical(folder, truth):
    return lines(folder / "clinical.csv", [], ("time_s", *CLINICAL), table(truth, truth.angles)), {}


def semicolons(folder, truth):
    names = ("Time [s]", "Flexion [°]", "Abduction [°]", "Internal Rotation [°]")
    head = ["sep=;", "Subject;P07", "Date;3.5.2026", ""]
    return lines(folder / "german.csv", head, names, table(truth, truth.angles), ";", ",", "cp1252"), {}


def tabs(folder, truth):
    rows = [["s", "rad", "rad", "rad"], *table(truth, np.radians(truth.angles))]
    return lines(folder / "tabs.txt", [], ("TIME", "Flexion", "ABDUCTION", "Internal_Rotation"), rows, "\t"), {}


def utf16(folder, truth):
    rows = table(truth, truth.angles)
    return lines(folder / "excel.txt", [], ("time_s", *CLINICAL), rows, "\t", ",", "utf-16"), {}


def iso(folder, truth):
    start = datetime.datetime(2026, 5, 3, 12, 0, 0, tzinfo=datetime.UTC)
    stamps = [(start + datetime.timedelta(seconds=float(t))).isoformat().replace("+00:00", "Z") for t in truth.t]
    rows = [[stamp, *map(float, row)] for stamp, row in zip(stamps, truth.poses.as_quat(), strict=True)]
    return lines(folder / "iso.csv", [], ("timestamp", "qx", "qy", "qz", "qw"), rows), {}


def epoch(folder, truth):
    rows = [[f"{1.7e12 + 1e3 * t:.0f}", *map(float, row)] for t, row in zip(truth.t, truth.angles, strict=True)]
    return lines(folder / "epoch.csv", [], ("t", *CLINICAL), rows), {}


def frames(folder, truth):
    rows = [[k, *map(float, row)] for k, row in enumerate(truth.angles)]
    return lines(folder / "frames.csv", [], ("Frame", *CLINICAL), rows), {"rate": 100.0}


def thesis(folder, truth):
    values = truth.poses.as_euler("XYZ", degrees=True)
    return lines(
        folder / "thesis.csv", [], ("time_s", "theta_x_deg", "theta_y_deg", "theta_z_deg"), table(truth, values)
    ), {}


def isb_values(truth):
    """(plane, elevation, axial), degrees, by SciPy's Y-X-Y in the ISB's own axes; a left arm is mirrored first."""
    poses = truth.poses
    if truth.side == "left":
        poses = Rotation.from_quat(poses.as_quat() * [-1, 1, -1, 1])
    # ISB: x forward, y up, z right. Y-X-Y with a negative middle angle.
    first, middle, last = (C * poses * C.inv()).as_euler("YXY", degrees=True, suppress_warnings=True).T
    return np.c_[first - 180, middle, last + 180]


def isb(folder, truth):
    names = ("time_s", "plane_of_elevation_deg", "elevation_deg", "axial_rotation_deg")
    return lines(folder / "isb.csv", [], names, table(truth, isb_values(truth))), {}


def quaternions(folder, truth):
    return lines(folder / "q.csv", [], ("time_s", "qx", "qy", "qz", "qw"), table(truth, truth.poses.as_quat())), {}


MATRIX = [f"r{i}{j}" for i in "123" for j in "123"]


def matrices(folder, truth):
    rows = table(truth, truth.poses.as_matrix().reshape(-1, 9))
    return lines(folder / "matrix.csv", [], ("time_s", *MATRIX), rows), {}


def opensim_head(count, columns, degrees="yes"):
    return [
        "Coordinates",
        "version=1",
        f"nRows={count}",
        f"nColumns={columns}",
        f"inDegrees={degrees}",
        "",
        "endheader",
    ]


def rajagopal_values(truth):
    sign = 1 if truth.side == "right" else -1
    return (C * truth.poses * C.inv()).as_euler("ZXY", degrees=True) * [1, sign, sign]


def rajagopal(folder, truth, degrees="yes", values=None):
    s = truth.side[0]
    values = rajagopal_values(truth) if values is None else values
    names = ("time", f"arm_flex_{s}", f"arm_add_{s}", f"arm_rot_{s}", f"elbow_flex_{s}", "pelvis_tx")
    rows = np.c_[truth.t, values, truth.elbow, 0 * truth.t].tolist()
    return lines(folder / "raj.mot", opensim_head(len(rows), 6, degrees), names, rows, "\t"), {}


def states(folder, truth):
    """States of a simulation, in rad, columns by their paths."""
    s = truth.side[0]
    base = f"/jointset/acromial_{s}/"
    names = ["time"]
    columns = [truth.t]
    for k, name in enumerate(("arm_flex", "arm_add", "arm_rot")):
        names += [f"{base}{name}_{s}/value", f"{base}{name}_{s}/speed"]
        columns += [np.radians(rajagopal_values(truth)[:, k]), 0 * truth.t]
    rows = np.stack(columns, axis=1).tolist()
    return lines(folder / "states.sto", opensim_head(len(rows), 7, "no"), names, rows, "\t"), {}


def trunk(truth):
    """The trunk against the ground: it faces 130° and sways once the arm moves."""
    sway = np.clip(truth.t - 0.8, 0, None)
    return Rotation.from_euler("zy", np.c_[130 + 4 * sway, 3 * np.sin(2 * sway)], degrees=True)


#: Where sensors sit: on the trunk z forward, x up; on the arms anyhow.
ON_TRUNK = Rotation.from_matrix([[0, 0, 1], [0, -1, 0], [1, 0, 0]])
ON_ARM = Rotation.from_euler("xyz", [25, -70, 40], degrees=True)
ON_FOREARM = Rotation.from_euler("xyz", [-80, 20, 100], degrees=True)


def sensors(truth):
    """Readings of the sensors on trunk, arm and forearm, against the ground."""
    body = trunk(truth)
    arm = body * truth.poses
    forearm = arm * Rotation.from_euler("y", -truth.elbow[:, None], degrees=True)
    return {"trunk": body * ON_TRUNK, "arm": arm * ON_ARM, "forearm": forearm * ON_FOREARM}


def wxyz(rotations):
    return rotations.as_quat(scalar_first=True)


def opensense(folder, truth, names=("torso_imu", "humerus_{s}_imu", "radius_{s}_imu")):
    labels = [name.format(s=truth.side[0]) for name in names]
    parts = [wxyz(each) for each in sensors(truth).values()]
    rows = [[float(t), *(",".join(f"{x:.8f}" for x in part[k]) for part in parts)] for k, t in enumerate(truth.t)]
    head = ["DataRate=100.000000", "DataType=Quaternion", "version=3", "OpenSimVersion=4.1", "endheader"]
    return lines(folder / "orientations.sto", head, ("time", *labels), rows, "\t"), {"forward": "z"}


def dot_file(path, rotations, t, start=4_294_000_000):
    ticks = [(start + round(1e6 * float(each))) % 2**32 for each in t]
    rows = [
        [k + 1, tick, *map(float, q), 0.0, 0.0, 0.0, 0]
        for k, (tick, q) in enumerate(zip(ticks, wxyz(rotations), strict=True))
    ]
    head = [
        "sep=,",
        "DeviceTag:,ydt",
        "FirmwareVersion:,1.6",
        "OutputRate:,100Hz",
        "StartTime: ,12:00",
        "© Movella",
        "",
    ]
    names = ["PacketCounter", "SampleTimeFine", *(f"Quat_{x}" for x in "WXYZ"), "FreeAcc_X", "FreeAcc_Y", "FreeAcc_Z"]
    return lines(path, head, [*names, "Status"], rows)


def dot(folder, truth):
    parts = sensors(truth)
    for name in ("trunk", "forearm"):
        dot_file(folder / f"{name}.csv", parts[name], truth.t)
    chosen = {name: str(folder / f"{name}.csv") for name in ("trunk", "forearm")}
    return dot_file(folder / "arm.csv", parts["arm"], truth.t), {"sensors": chosen, "forward": "z"}


def awinda_file(path, rotations, rate=100.0):
    """Mat[row][column], columns first."""
    names = [f"Mat[{i}][{j}]" for j in "123" for i in "123"]
    rows = [[k % 65536, "", *map(float, matrix.T.ravel())] for k, matrix in enumerate(rotations.as_matrix(), 65_400)]
    head = ["// Start Time: Unknown", f"// Update Rate: {rate:.1f}Hz", "// Firmware Version: 4.0"]
    return lines(path, head, ("PacketCounter", "SampleTimeFine", *names), rows, "\t")


def awinda(folder, truth):
    parts, rate = sensors(truth), 1.0 / float(np.median(np.diff(truth.t)))
    awinda_file(folder / "mt_trunk.txt", parts["trunk"], rate)
    return awinda_file(folder / "mt_arm.txt", parts["arm"], rate), {
        "sensors": {"trunk": str(folder / "mt_trunk.txt")},
        "forward": "z",
    }


def apdm(folder, truth):
    places = {"trunk": "Sternum", "arm": f"{truth.side.title()} Upper Arm", "forearm": f"{truth.side.title()} Forearm"}
    names, columns = ["Time"], [truth.t]
    units = ["s"]
    for role, rotations in sensors(truth).items():
        names += [f"{places[role]}/Orientation/{part}" for part in ("Scalar", "X", "Y", "Z")]
        columns.append(wxyz(rotations))
        units += [""] * 4
    head = ["Test Name:,lift", "Sample Rate:,100"]
    rows = [units, *np.column_stack(columns).tolist()]
    return lines(folder / "apdm.csv", head, names, rows), {"forward": "z"}


def mvnx(folder, truth):
    back = Rotation.from_euler("x", 90 if truth.side == "right" else -90, degrees=True)
    body = trunk(truth)
    arm = body * truth.poses
    forearm = arm * Rotation.from_euler("y", -truth.elbow[:, None], degrees=True)
    side = truth.side.title()
    own = {"T8": wxyz(body), f"{side}UpperArm": wxyz(arm * back), f"{side}ForeArm": wxyz(forearm * back)}
    still = " ".join(["1 0 0 0"] * len(SEGMENTS))
    frame = '<frame time="{}" index="{}" type="{}"><orientation>{}</orientation></frame>'
    body_of = [
        frame.format(
            round(1e3 * t), k, "normal",
            " ".join(" ".join(f"{x:.7f}" for x in own[name][k]) if name in own else "1 0 0 0" for name in SEGMENTS),
        )
        for k, t in enumerate(truth.t)
    ]  # fmt: skip
    segments = "".join(f'<segment label="{name}" id="{k}"/>' for k, name in enumerate(SEGMENTS, 1))
    path = folder / "take.mvnx"
    path.write_text(
        '<?xml version="1.0" encoding="UTF-8"?><mvnx xmlns="http://www.xsens.com/mvn/mvnx" version="4">'
        f'<subject frameRate="100"><segments>{segments}</segments><frames>'
        + "".join(frame.format("", "", kind, still) for kind in ("identity", "tpose", "tpose-isb"))
        + "".join(body_of)
        + "</frames></subject></mvnx>"
    )
    return path, {}


MAP = """schema = 1
[columns]
time_ms = "Zeit"
flexion_deg = "-Anteversion"
abduction_deg = "Abd"
internal_rotation_deg = "Rot"
"""


def mapped(folder, truth):
    (folder / "map.toml").write_text(MAP)
    rows = [[float(1e3 * t), -f, a, i] for t, (f, a, i) in zip(truth.t, truth.angles.tolist(), strict=True)]
    names = ("Zeit", "Anteversion", "Abd", "Rot")
    return lines(folder / "map.csv", [], names, rows, ";", ","), {"columns": str(folder / "map.toml")}


WRITERS = {
    each.__name__: each
    for each in (
        clinical, semicolons, tabs, utf16, iso, epoch, frames, thesis, isb, quaternions, matrices, rajagopal, states,
        opensense, dot, awinda, apdm, mvnx, mapped,
    )
}  # fmt: skip
#: Formats with the elbow.
WITH_ELBOW = {"rajagopal", "opensense", "dot", "apdm", "mvnx"}


def special_movements(side):
    """Movements of an arm that look least like a raise from hanging and back, by name."""
    t = np.arange(500) / 100
    s = np.sin(np.pi * t / 5) ** 2
    rng = np.random.default_rng(7)
    zero = 0 * s
    slow = np.sin(2 * np.pi * 0.3 * t)
    angles = {
        "extension": (-45 * s, 8 * s, 10 * s),
        "hand to the back": (-30 * s, 15 * s, 65 * s),
        "overhead forward": (165 * s, 8 * s, zero),
        "overhead sideways": (zero, 165 * s, zero),
        "across the body": (95 * s, -25 * s, 50 * s),
        "throwing": (10 + 20 * s, 80 + zero, -80 * s),
        "rotation with the elbow bent": (5 + zero, 5 + zero, 60 * slow),
        "drawing, arm held": (60 + 4 * slow, 30 + 3 * slow, 10 + zero),
        "hanging, swaying": (0.8 * slow, 0.5 * slow, zero),
        "held still": (70 + zero, 20 + zero, zero),
        "lowered from overhead": (160 - 150 * s, 10 + zero, zero),
        "begins sideways": (zero, 95 - 60 * s, zero),
        "begins across": (90 + 10 * slow, -30 + zero, 40 + zero),
        "quick": (20 + 45 * np.sin(2 * np.pi * 1.5 * t), 10 + zero, zero),
    }
    return {
        name: Truth(t, np.stack(each, axis=1) + 0.08 * rng.normal(size=(len(t), 3)), side, zero)
        for name, each in angles.items()
    }
