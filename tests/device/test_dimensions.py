"""Dimensions of devices by name: changed ones are those of a robot's file with other numbers in it."""

import re
import shutil

import numpy as np
import pytest
from places import URDF

import exo_pin as ep
from exo_pin import InvalidInput


def rewritten(tmp_path, name, changes, suffix=".urdf"):
    """A device of the folder ``urdf`` with other text in one of its files."""
    for path in URDF.glob(f"{name}.*"):
        shutil.copy(path, tmp_path / path.name)
    path = tmp_path / f"{name}{suffix}"
    text = path.read_text()
    for old, new in changes:
        text, count = re.subn(old, new, text, count=1, flags=re.S)
        assert count == 1
    path.write_text(text)
    return ep.load(tmp_path / f"{name}.urdf")


def changed(name, **values):
    exo = ep.load(URDF / f"{name}.urdf")
    return ep.ShoulderExo.from_device(exo.device.with_dimensions(**values))


def assert_same_answers(one, other, poses, limits="none"):
    a, b = (exo.reaction(poses, limits=limits) for exo in (one, other))
    assert (a.status == b.status).all()
    assert np.isfinite(a.magnitude).any()
    np.testing.assert_allclose(a.actuator_forces, b.actuator_forces, rtol=1e-7, atol=1e-7)
    np.testing.assert_allclose(a.shoulder_force, b.shoulder_force, rtol=1e-7, atol=1e-7)


def test_an_axis_of_a_serial_device(tmp_path):
    azimuth, elevation = np.radians([75.0, 12.0])
    level = np.cos(elevation)
    axis = " ".join(map(repr, map(float, (level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)))))
    file = rewritten(tmp_path, "nesm", [(r'(name="flexion".*?<axis xyz=")[^"]*', rf"\g<1>{axis}")])
    values = {"axis[flexion].azimuth_deg": 75.0, "axis[flexion].elevation_deg": 12.0}
    device = changed("nesm", **values)
    poses = device.pose([20.0, 40.0, 60.0], [10.0, 30.0, 50.0], [0.0, 20.0, -5.0])
    assert_same_answers(device, file, poses)
    # It is another device.
    old = ep.load(URDF / "nesm.urdf").reaction(poses, limits="none")
    assert np.abs(old.actuator_forces - file.reaction(poses, limits="none").actuator_forces).max() > 0.1
    assert device.device.dimensions() == pytest.approx(file.device.dimensions(), abs=1e-12)


def test_the_base_of_a_3rps(tmp_path):
    own = "-0.0383632953282309, 0.26559141027112976, 0.08929983405220508"
    new = "-0.0483632953282309, 0.25559141027112976, 0.09929983405220508"
    file = rewritten(tmp_path, "3rps-passive-ball", [(re.escape(own), new)], ".closures.toml")
    x, y, z = map(float, new.split(","))
    names = ("end_b[limb_1_base].x_m", "end_b[limb_1_base].y_m", "end_b[limb_1_base].z_mm")
    device = changed("3rps-passive-ball", **dict(zip(names, (x, y, 1e3 * z), strict=True)))
    assert_same_answers(device, file, device.pose([20.0, 40.0, 60.0], [10.0, 30.0, 50.0]))


def test_the_anchor_and_the_law_of_a_support(tmp_path):
    file = rewritten(
        tmp_path, "spring-support", [(r"0\.0,\s+0\.0,\s+-0\.466915541", "0.05, 0.0, -0.47")], ".device.toml"
    )
    device = changed("spring-support", **{"spring[strut,1].z_mm": -470.0, "spring[strut,1].x_m": 0.05})
    poses = device.pose([30.0, 60.0, 80.0])
    assert_same_answers(device, file, poses)
    spring = ep.device.Spring("extra", ep.device.LinearSpring(400.0, slack=0.1), route=device.device.springs[0].route)
    two = device.device.replace(springs=[*device.device.springs, spring])
    stiff = two.with_dimensions(**{"law[extra].stiffness_N_m": 800.0, "law[extra].slack_mm": 150.0})
    assert stiff.springs[1].law == ep.device.LinearSpring(800.0, slack=0.15)
    assert stiff.springs[0] == two.springs[0]


#: The joint on the torso of one limb of the 3RPS, as its file has it, and elsewhere.
BASE = "-0.0383632953282309, 0.26559141027112976, 0.08929983405220508"
MAN = ep.Wearer(1.755, 85.0, "male")


def base_at(tmp_path, x_mm):
    new = BASE.replace("-0.0383632953282309", repr(1e-3 * x_mm))
    return rewritten(tmp_path, "3rps-passive-ball", [(re.escape(BASE), new)], ".closures.toml").worn_by(MAN)


def test_an_uncertain_dimension_is_a_file_with_another_number(tmp_path):
    exo = ep.load(URDF / "3rps-passive-ball.urdf").worn_by(MAN)
    name, pose = "end_b[limb_1_base].x_mm", exo.pose(40.0, 30.0)
    certain = dict.fromkeys(("offset_mm", "pose_deg", "joint_mm", "end_b_mm", "mass_percent", "centre_of_mass_mm"), 0.0)
    found = exo.uncertainty(pose, limits="none", uncertainties=certain | {name: 5.0})
    (effect,) = found.effects
    own = 1e3 * exo.device.dimensions()["end_b[limb_1_base].x_m"]
    sizes = [float(base_at(tmp_path, own + step).reaction(pose, limits="none").magnitude) for step in (-5.0, 5.0)]
    np.testing.assert_allclose(
        [effect.least, effect.greatest], [min(*sizes, found.magnitude), max(*sizes, found.magnitude)], rtol=1e-7
    )
    assert effect.name == name
    assert max(sizes) - min(sizes) > 1e-3
    with pytest.raises(InvalidInput, match=r"uncertain quantity or dimension 'loop_mm'.*end_b_mm"):
        exo.uncertainty(pose, uncertainties={"loop_mm": 3.0})


def test_any_device_carries_a_payload_and_leans():
    exo = ep.load(URDF / "spring-support.urdf").worn_by(MAN)
    poses, hand = exo.pose([30.0, 60.0]), np.array([0.0, 0.0, -0.6])
    payload, lean = exo.device.parameters(["payload_kg", "lean_forward_deg"])
    device = exo.device.with_values({payload: 2.0, lean: np.radians(20.0)}, hand)
    # The trunk leans forward: in its axes gravity points forward, too.
    down = 9.81 * np.array([np.sin(np.radians(20.0)), 0.0, -np.cos(np.radians(20.0))])
    np.testing.assert_allclose(device.gravity, down, atol=1e-9)
    answer = ep.ShoulderExo.from_device(device).reaction(poses, limits="none")
    weight = ep.Load(2.0 * down, at=hand)
    apart = [exo.replace(gravity=down).reaction(pose, None, weight, limits="none") for pose in poses]
    np.testing.assert_allclose(answer.magnitude, [float(each.magnitude) for each in apart], rtol=1e-9)
