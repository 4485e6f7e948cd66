"""Dimensions of devices by name: changed ones are those of a robot's file with other numbers in it."""

import re
import shutil

import numpy as np
import pinocchio as pin
import pytest
from places import URDF

import exo_pin as ep
from exo_pin import InvalidInput, UnknownName


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


def test_an_offset_of_a_serial_device(tmp_path):
    change = [(r'(name="flexion".*?<origin xyz=")[^"]*', r"\g<1>0.01 0.04 0.0")]
    file, device = (
        rewritten(tmp_path, "nesm", change),
        changed("nesm", **{"joint[flexion].y_mm": 40.0, "joint[flexion].x_m": 0.01}),
    )
    assert device.device.dimensions() == pytest.approx(file.device.dimensions(), abs=1e-12)
    rng = np.random.default_rng(5)
    chain, other = device.chain, file.chain
    turns = rng.uniform(-1.0, 1.0, chain.model.nv)
    q, same = (pin.integrate(each.model, each.neutral(), turns) for each in (chain, other))
    for frame in chain.model.frames:
        there, here = other.placement(same, frame.name), chain.placement(q, frame.name)
        np.testing.assert_allclose(here.homogeneous, there.homogeneous, atol=1e-12)


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


def test_a_sweep_varies_dimensions_of_any_device():
    exo = ep.load(URDF / "spring-support.urdf")
    values = [0.0, 0.03, 0.06]
    poses = exo.pose([30.0, 60.0, 80.0])
    table = ep.sweep(exo, {"spring[strut,1].x_m": values}, poses)
    assert table["spring[strut,1].x_m"].tolist() == values
    for row, value in enumerate(values):
        design = ep.ShoulderExo.from_device(exo.device.with_dimensions(**{"spring[strut,1].x_m": value}))
        answer = design.reaction(poses, limits="none")
        assert table["error"][row] == ""
        assert table["peak_F_s_N"][row] == pytest.approx(answer.magnitude.max(), rel=1e-9)
    assert np.ptp(table["peak_F_s_N"]) > 0.1


def test_every_dimension_is_put_back_as_it_was():
    for name in ("nesm", "3rps-passive-ball", "spherical-3rrr", "spring-support"):
        device = ep.load(URDF / f"{name}.urdf").device
        own = device.dimensions()
        assert len(own) > 5
        again = device.with_dimensions(**own)
        assert again.dimensions() == pytest.approx(own, abs=1e-12)
        rng = np.random.default_rng(2)
        for key in rng.choice(sorted(own), 6, replace=False):
            if key.startswith("axis") and abs(own[key.split(".")[0] + ".elevation_rad"]) > 1.5:
                continue  # along z: its azimuth is any
            moved = device.with_dimensions(**{key: own[key] + 0.003}).dimensions()
            assert moved == pytest.approx(own | {key: own[key] + 0.003}, abs=1e-12)


def test_what_is_no_dimension():
    device = ep.load(URDF / "nesm.urdf").device
    with pytest.raises(UnknownName, match="joint"):
        device.with_dimensions(**{"joint[knee].x_m": 0.1})
    with pytest.raises(UnknownName):
        device.with_dimensions(**{"joint[flexion].x_deg": 0.1})
    with pytest.raises(InvalidInput, match="twice"):
        device.with_dimensions(**{"joint[flexion].x_m": 0.1, "joint[flexion].x_mm": 100.0})
    with pytest.raises(InvalidInput):
        device.with_dimensions(**{"joint[flexion].x_m": np.nan})
