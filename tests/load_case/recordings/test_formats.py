"""Recordings of other programs: each format against movements that are known, and against the programs themselves."""

import foreign_records as foreign
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import exo_pin as ep


def check(folder, writer, truth):
    path, options = writer(folder, truth)
    found = ep.read_movement(path, truth.side, smoothing=None, reading=ep.RecordingOptions(**options))
    # Sensors are set to zero by half a second with noise of 0.1°.
    most = 0.1 if options.get("forward") else 5e-4
    assert np.degrees((found.poses * truth.poses.inv()).magnitude().max()) < most
    np.testing.assert_allclose(found.times - found.times[0], truth.t - truth.t[0], atol=6e-4)
    # Samples as they are, with the noise of their digits, accelerate more than an arm.
    assert all("accelerates" in text for text in found.cautions)
    assert (found.elbow_flexion is not None) == (writer.__name__ in foreign.WITH_ELBOW)
    if found.elbow_flexion is not None:
        np.testing.assert_allclose(np.degrees(found.elbow_flexion), truth.elbow, atol=2e-3)


@pytest.mark.parametrize("name", ["semicolons", "iso", "isb", "rajagopal", "dot", "apdm", "mvnx"])
def test_formats_hold_what_was_written(tmp_path, name):
    check(tmp_path, foreign.WRITERS[name], foreign.movement(len(name), ("left", "right")[len(name) % 2]))


@pytest.mark.full
@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("name", foreign.WRITERS)
def test_formats_hold_what_was_written_in_more_records(tmp_path, name, side):
    for seed in range(2):
        check(tmp_path, foreign.WRITERS[name], foreign.movement(seed, side))


def test_segments_of_a_published_file(tmp_path):
    """Frame 0 of test_mocap.mvnx of blender-mvnx-io, and what its own joint angles say."""
    segments = {
        "T8": (0.996241, 0.000834, 0.066993, -0.054903),
        "RightUpperArm": (0.760222, 0.645065, -0.071796, 0.028242),
        "LeftUpperArm": (0.635001, -0.522988, 0.149271, -0.548612),
    }
    orientation = " ".join(" ".join(map(str, numbers)) for numbers in segments.values())
    frames = "".join(
        f'<frame time="{1000 * k / 60:.0f}" type="normal"><orientation>{orientation}</orientation></frame>'
        for k in range(4)
    )
    path = tmp_path / "mocap.mvnx"
    path.write_text(
        '<mvnx xmlns="http://www.xsens.com/mvn/mvnx"><segments>'
        + "".join(f'<segment label="{name}"/>' for name in segments)
        + f"</segments><frames>{frames}</frames></mvnx>"
    )
    # The file's own angles are abduction, internal rotation and flexion: 8.324 3.360 16.569, -4.828 54.498 41.431.
    for side, expected in {"right": (16.569, 8.324, 3.360), "left": (41.431, -4.828, 54.498)}.items():
        poses = ep.read_movement(path, side, smoothing=None).poses
        np.testing.assert_allclose(ep.shoulder_angles(poses[0], side, degrees=True), expected, atol=2e-3)
    quaternion = ep.read_movement(path, "right", smoothing=None).poses[0].as_quat(scalar_first=True)
    np.testing.assert_allclose(quaternion, (0.986838, -0.076004, -0.141538, 0.018479), atol=1e-6)
    path.write_text('<!DOCTYPE mvnx [<!ENTITY a "b">]><mvnx/>')
    with pytest.raises(ep.FileFormatError, match="declares entities"):
        ep.read_movement(path, "left")


@pytest.mark.parametrize(
    ("isb", "order", "expected"),
    [
        ((90, 60, -90), "YXZ", (-60, 0, 0)),
        ((90, 60, 0), "YXZ", (-60, 0, -90)),
        ((45, 70, -20), "YXZ", (-62.764, 41.641, -51.118)),
        ((45, 70, -20), "XYZ", (62.764, -41.641, 1.118)),
    ],
)
def test_isb_angles_of_a_left_arm(isb, order, expected):
    pose = ep.isb_rotation(*isb, degrees=True)
    np.testing.assert_allclose(pose.as_euler(order, degrees=True), expected, atol=1e-3)
    np.testing.assert_allclose(ep.isb_angles(pose, degrees=True), isb, atol=1e-9)


def test_isb_angles_are_those_of_its_own_axes_and_their_locks_are_poses(tmp_path):
    poses = Rotation.random(100, rng=np.random.default_rng(5))
    for side in ("left", "right"):
        angles = ep.isb_angles(poses, side)
        assert (angles[:, 1] >= 0.0).all()
        assert (ep.isb_rotation(*angles.T, side) * poses.inv()).magnitude().max() < 1e-14
    # X forward, Y up, Z right: a right arm turns about Y, X and Y again, and rises about -X.
    angles = ep.isb_angles(poses, "right")
    own = Rotation.from_euler("YXY", angles * [1, -1, 1])
    assert (foreign.C * poses * foreign.C.inv() * own.inv()).magnitude().max() < 1e-14
    for elevation, axial in ((0.0, 50.0), (180.0, -10.0)):
        pose = ep.isb_rotation(30.0, elevation, 20.0, degrees=True)
        np.testing.assert_allclose(ep.isb_angles(pose, degrees=True), [0.0, elevation, axial], atol=1e-9)
        assert (ep.isb_rotation(0.0, elevation, axial, degrees=True) * pose.inv()).magnitude() < 1e-12


@pytest.mark.parametrize("side", ["left", pytest.param("right", marks=pytest.mark.full)])
@pytest.mark.parametrize("ending", [pytest.param("csv", marks=pytest.mark.full), "mot", "sto"])
def test_what_is_written_is_read_back(tmp_path, side, ending):
    truth = foreign.movement(6, side, noise=0.0)
    movement = ep.Movement.from_samples(truth.t, truth.poses)
    for angles in ("clinical", "thesis", "isb", "quaternions") if ending == "csv" else ("clinical",):
        ep.write_movement(tmp_path / f"a.{ending}", movement, side, angles)
        reading = ep.RecordingOptions(forward="x") if ending == "sto" else None
        again = ep.read_movement(tmp_path / f"a.{ending}", side, reading=reading)
        assert (again.poses * truth.poses.inv()).magnitude().max() < 1e-6
        assert not again.cautions


def _shoulder(path, side):
    """Rajagopal's shoulder: flexion about z, adduction about x, rotation about y; the last two turn on the left."""
    sign = 1 if side == "right" else -1
    names = [f"arm_{name}_{side[0]}" for name in ("flex", "add", "rot")]
    axes = ["0 0 1", f"{sign} 0 0", f"0 {sign} 0"]
    coordinates = "".join(f'<Coordinate name="{name}"><range>-7 7</range></Coordinate>' for name in names)
    linear = "<LinearFunction><coefficients>1 0</coefficients></LinearFunction>"
    turns = "".join(
        f'<TransformAxis name="rotation{k}"><coordinates>{name}</coordinates><axis>{axis}</axis>{linear}'
        "</TransformAxis>"
        for k, (name, axis) in enumerate(zip(names, axes, strict=True), 1)
    )
    shifts = "".join(
        f'<TransformAxis name="translation{k}"><axis>{axis}</axis><Constant><value>0</value></Constant></TransformAxis>'
        for k, axis in enumerate(("1 0 0", "0 1 0", "0 0 1"), 1)
    )
    path.write_text(
        '<?xml version="1.0"?><OpenSimDocument Version="40000"><Model name="arm"><Ground name="ground"/>'
        '<BodySet><objects><Body name="humerus"><mass>1</mass><inertia>1 1 1 0 0 0</inertia></Body></objects></BodySet>'
        '<JointSet><objects><CustomJoint name="shoulder">'
        "<socket_parent_frame>/ground</socket_parent_frame><socket_child_frame>/bodyset/humerus</socket_child_frame>"
        f"<coordinates>{coordinates}</coordinates><SpatialTransform>{turns}{shifts}</SpatialTransform>"
        "</CustomJoint></objects></JointSet></Model></OpenSimDocument>"
    )
    return str(path)


@pytest.mark.full
@pytest.mark.parametrize("side", ["left", "right"])
def test_opensim_loads_what_is_written(tmp_path, side, monkeypatch):
    osim = pytest.importorskip("opensim", reason="a check with OpenSim: pip install opensim")
    monkeypatch.chdir(tmp_path)
    osim.Logger.setLevelString("Off")
    truth = foreign.movement(3, side, noise=0.0)
    ep.write_movement("arm.mot", ep.Movement.from_samples(truth.t, truth.poses), side)
    ep.write_movement("arm.sto", ep.Movement.from_samples(truth.t, truth.poses), side)
    model = osim.Model(_shoulder(tmp_path / "arm.osim", side))
    state = model.initSystem()
    humerus = model.getBodySet().get("humerus")
    table = osim.TimeSeriesTable("arm.mot")
    assert table.getTableMetaDataString("inDegrees") == "yes"
    for row in (0, 100, table.getNumRows() // 2):
        for k in range(3):
            name = table.getColumnLabel(k)
            value = table.getDependentColumn(name)[row]
            model.getCoordinateSet().get(name).setValue(state, np.radians(value))
        model.realizePosition(state)
        turn = humerus.getTransformInGround(state).R()
        matrix = np.array([[turn.get(i, j) for j in range(3)] for i in range(3)])
        pose = foreign.C.inv() * Rotation.from_matrix(matrix) * foreign.C
        assert (pose * truth.poses[row].inv()).magnitude() < 1e-6
    sensors = osim.TimeSeriesTableQuaternion("arm.sto")
    assert list(sensors.getColumnLabels()) == ["torso_imu", f"humerus_{side[0]}_imu"]
    cell = sensors.getRowAtIndex(150).getElt(0, 1)
    found = [cell.get(k) for k in range(4)]
    expected = truth.poses[150].as_quat(scalar_first=True)
    assert min(np.abs(found - expected).max(), np.abs(found + expected).max()) < 1e-6


@pytest.mark.full
def test_coordinates_of_mobl_are_those_of_myoarm(tmp_path):
    mujoco, myo_sim = pytest.importorskip("mujoco"), pytest.importorskip("myo_sim")
    with pytest.warns(UserWarning, match="empty prefix"):
        model = myo_sim.load_spec("myoarm_r").compile()
    data, rng = mujoco.MjData(model), np.random.default_rng(4)
    coordinates = np.sort(rng.uniform([0, 5, -40], [100, 120, 60], (8, 3)), axis=0)
    names = ("elv_angle", "shoulder_elv", "shoulder_rot")
    rows = np.c_[np.arange(8) * 0.5, coordinates].tolist()
    path = foreign.lines(tmp_path / "a.mot", foreign.opensim_head(8, 4), ("time", *names), rows, "\t")
    poses = ep.read_movement(path, "right", smoothing=None, reading="as-named").poses
    root = model.body(model.body_parentid[model.body("clavicle_r").id]).name
    for values, pose in zip(np.radians(coordinates), poses, strict=True):
        data.qpos[:] = model.qpos0
        for name, value in zip(names, values, strict=True):
            data.qpos[model.joint(f"{name}_r").qposadr[0]] = value
        for k in np.flatnonzero(model.eq_type == mujoco.mjtEq.mjEQ_JOINT):
            own, other = model.jnt_qposadr[model.eq_obj1id[k]], model.jnt_qposadr[model.eq_obj2id[k]]
            along = data.qpos[other] - model.qpos0[other] if model.eq_obj2id[k] >= 0 else 0.0
            data.qpos[own] = model.qpos0[own] + np.polyval(model.eq_data[k][4::-1], along)
        mujoco.mj_kinematics(model, data)
        torso, humerus = (Rotation.from_quat(data.body(name).xquat, scalar_first=True) for name in (root, "humerus_r"))
        found = foreign.C.inv() * torso.inv() * humerus * foreign.C
        assert np.degrees((found * pose.inv()).magnitude()) < 1e-3


def test_arm26_turns_about_its_axis(tmp_path):
    rows = np.c_[np.arange(20) / 20, np.linspace(0, 60, 20), np.linspace(10, 50, 20)].tolist()
    names = ("time", "r_shoulder_elev", "r_elbow_flex")
    path = foreign.lines(tmp_path / "a.mot", foreign.opensim_head(20, 3), names, rows, "\t")
    found = ep.read_movement(path, "right")
    axis = np.array([-0.058898, 0.0023, 0.998261])
    expected = foreign.C.inv() * Rotation.from_rotvec(np.radians(60) * axis / np.linalg.norm(axis)) * foreign.C
    assert (found.poses[-1] * expected.inv()).magnitude() < 1e-6
    assert np.degrees(found.elbow_flexion[-1]) == pytest.approx(50.0)
    with pytest.raises(ep.FileFormatError, match="--side right"):
        ep.read_movement(path, "left")


def test_points_of_c3d_by_a_map(tmp_path):
    ezc3d = pytest.importorskip("ezc3d", reason="needs the extra recordings: pip install '.[recordings]'")
    truth = foreign.movement(2, "left", noise=0.0)
    file = ezc3d.c3d()
    file["parameters"]["POINT"]["LABELS"]["value"] = ("LShoulderAngles",)
    file["parameters"]["POINT"]["RATE"]["value"] = [100]
    file["parameters"]["POINT"]["UNITS"]["value"] = ["deg"]
    points = np.ones((4, 1, len(truth.t)))
    points[:3, 0] = (truth.angles * [1, -1, 1]).T
    file["data"]["points"] = points
    file.write(str(tmp_path / "a.c3d"))
    (tmp_path / "map.toml").write_text(
        'schema = 1\n[columns]\nflexion_deg = "LShoulderAngles.x"\n'
        'abduction_deg = "-LShoulderAngles.y"\ninternal_rotation_deg = "LShoulderAngles.z"\n'
    )
    found = ep.read_movement(tmp_path / "a.c3d", reading=ep.RecordingOptions(columns=tmp_path / "map.toml"))
    # C3D holds single precision.
    assert np.degrees((found.poses * truth.poses.inv()).magnitude().max()) < 1e-2
    with pytest.raises(ep.FileFormatError, match="expected one of these sets of columns"):
        ep.read_movement(tmp_path / "a.c3d")


@pytest.mark.parametrize("side", ["left", "right"])
def test_rotations_of_c3d_are_those_of_trunk_and_arm(tmp_path, side):
    ezc3d = pytest.importorskip("ezc3d", reason="needs the extra recordings: pip install '.[recordings]'")
    truth, trunk = foreign.movement(3, side, noise=0.0), Rotation.from_euler("z", 0.7)
    file, turned = ezc3d.c3d(), np.tile(np.eye(4)[..., None, None], (1, 1, 2, len(truth.t)))
    for k, each in enumerate((trunk.as_matrix()[..., None], np.moveaxis((trunk * truth.poses).as_matrix(), 0, -1))):
        turned[:3, :3, k] = each
    file["parameters"]["POINT"]["RATE"]["value"] = [100]
    file["parameters"]["POINT"]["LABELS"]["value"] = ("mark",)
    for name, value in (("USED", [2]), ("RATE", [100.0]), ("LABELS", ["trunk", "upperarm"])):
        file.add_parameter("ROTATION", name, value)
    file["data"]["points"], file["data"]["rotations"] = np.ones((4, 1, len(truth.t))), turned
    file.write(str(tmp_path / "a.c3d"))
    found = ep.read_movement(tmp_path / "a.c3d", side, reading=ep.RecordingOptions(forward="x"))
    assert np.degrees((found.poses * truth.poses.inv()).magnitude().max()) < 1e-2
