"""Designs as files of every sort: what is written is read as the same device, on either side."""

import numpy as np
import pytest
from places import URDF

import exo_pin as ep

SERIAL, SUPPORT = URDF / "serial-y-x-z.urdf", URDF / "spring-support.urdf"


def forces(exo):
    return exo.reaction(exo.pose([20.0, 50.0], [30.0, 40.0]), limits="none").shoulder_force


@pytest.mark.parametrize("source", ["prototype", SERIAL, SUPPORT])
def test_a_saved_design_is_the_same_on_either_side(source, tmp_path):
    for side in ("left", "right"):
        exo = ep.load(source, side=side)
        assert exo.side == side
        np.testing.assert_allclose(
            forces(exo) * ([1, -1, 1] if side == "right" else 1), forces(ep.load(source)), atol=1e-9
        )
        exo.save(tmp_path / f"{side}.toml")
        again = ep.load(tmp_path / f"{side}.toml")
        assert (again.side, again.name) == (side, exo.name)
        np.testing.assert_allclose(forces(again), forces(exo), atol=1e-9)
        other = ep.load(tmp_path / f"{side}.toml", side="left")
        assert other.side == "left"
        np.testing.assert_allclose(forces(other), forces(ep.load(source)), atol=1e-8)
    if source != "prototype":
        direct = ep.load(tmp_path / "right.device.toml")
        np.testing.assert_allclose(forces(direct), forces(exo), atol=1e-9)
        # Without any change of the side the robot is the one of the file, with its looks.
        assert str(ep.load(source, side="left").urdf) == str(ep.load(source).urdf) == str(source)


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_urdf_has_the_device_file_that_is_due(side, tmp_path):
    exo = ep.load("prototype", side=side)
    for part in ("whole", "wrist", "shoulder", "floating"):
        path = exo.to_urdf(tmp_path / part, part)
        beside = path.with_suffix(".device.toml")
        assert beside.exists() == (part == "whole" or side == "right")
        assert not beside.exists() or side == "left" or 'side = "right"' in beside.read_text()
        assert ep.load(path).side == side
    # What simulators need beyond the design's own masses is left out on request.
    bare, heavy = exo.to_urdf(tmp_path / "bare", assumed=None), tmp_path / "whole" / "prototype.urdf"
    again = ep.load(bare)
    np.testing.assert_allclose(forces(again), forces(exo), atol=1e-8)
    # What the device file says of limbs and actuators a wrist's record holds; other limits of a drive it does not.
    assert not again.wrist.beyond_record
    for one, other in zip(again.limbs, exo.limbs, strict=True):
        assert (one.actuator, one.stroke) == (other.actuator, other.stroke)
    text, beside = bare.with_suffix(".device.toml").read_text(), bare.with_suffix(".device.toml")
    beside.write_text(text.replace("[[drives]]", "[[drives]]\nspeed_m_s = 0.2", 1))
    assert "device file" in ep.load(bare).wrist.beyond_record
    assert np.abs(forces(ep.load(heavy)) - forces(exo)).max() > 1.0
    other = ep.load(SERIAL, side=side)
    path = other.to_urdf(tmp_path / "serial")
    assert path.with_suffix(".device.toml").exists() == (side == "right")
    np.testing.assert_allclose(forces(ep.load(path)), forces(other), atol=1e-9)
    with pytest.raises(ep.UnknownName, match="part"):
        other.to_urdf(tmp_path / "none", "wrist")


def test_exports_name_what_they_hold(tmp_path):
    exo = ep.load("prototype", side="right")
    for make, error, words in (
        (lambda: exo.export(tmp_path / "robot.stl"), ep.InvalidInput, "urdf"),
        (lambda: exo.export(tmp_path / "none" / "robot.urdf"), ep.InvalidInput, "none"),
        (lambda: exo.export(tmp_path / "robot.urdf", "half"), ep.UnknownName, "half"),
    ):
        with pytest.raises(error, match=words):
            make()
    for ending in ("xml", "sdf"):
        assert [file.name for file in exo.export(tmp_path / f"part.{ending}", "wrist")] == [f"part.{ending}"]
    whole = exo.export(tmp_path / "whole.xml")
    assert [file.name for file in whole] == ["whole.xml", "whole.device.toml"]
    assert "the limits, actuators and stiffnesses of its limbs" in whole.statement
    serial = ep.load(SERIAL, side="right")
    for ending in ("urdf", "xml", "sdf"):
        (robot, *_) = serial.export(tmp_path / f"serial.{ending}")
        np.testing.assert_allclose(forces(ep.load(robot)), forces(serial), atol=1e-6)
    # A robot whose roles name no arm keeps its side beside a URDF alone.
    bare = ep.load(URDF / "prototype-wrist.urdf", side="right")
    assert (bare.has_arm, bare.side) == (False, "right")
    names = [[file.name for file in bare.export(tmp_path / f"bare.{ending}")] for ending in ("urdf", "xml")]
    assert names == [["bare.urdf", "bare.closures.toml", "bare.device.toml"], ["bare.xml"]]
    assert ep.load(tmp_path / "bare.urdf").side == "right"


def test_a_devices_file_has_to_be_of_its_robot(tmp_path):
    exo = ep.load("prototype")
    robot = exo.export(tmp_path / "one.urdf")[0]
    loaded = ep.load(robot)
    assert not loaded.wrist.beyond_record
    assert [limb.stroke for limb in loaded.limbs] == [limb.stroke for limb in exo.limbs]
    np.testing.assert_allclose(forces(loaded), forces(exo), atol=1e-9)
    chain = loaded.chain
    with pytest.raises(ep.FileFormatError, match="for the left shoulder, and a robot is not mirrored"):
        ep.ShoulderExo.from_chain(chain, "right", None, robot.with_suffix(".device.toml"))
    assert ep.ShoulderExo.from_chain(chain, "left", None, robot.with_suffix(".device.toml")).side == "left"
    other = ep.load("optimised-table-5-3").chain
    with pytest.raises(ep.FileFormatError, match="this design differ in"):
        ep.ShoulderExo.from_chain(other, None, None, robot.with_suffix(".device.toml"))
    # Limbs with masses of their own are beyond a wrist's record; its closed forms stay.
    heavy = ep.ShoulderExo.from_chain(exo.chain_with_masses())
    assert heavy.name == heavy.chain.description.name == "prototype"
    assert heavy.wrist.beyond_record
    assert not hasattr(heavy, "mechanism")
    pose = exo.pose(30.0, 20.0)
    np.testing.assert_allclose(heavy.inverse_kinematics(pose).lengths, exo.inverse_kinematics(pose).lengths, atol=1e-9)
    # With other drives than its limbs it is no wrist any more.
    moved = heavy.replace(drives=[heavy.device.drives[k] for k in (1, 0, 2)])
    assert moved.wrist is None
    assert heavy.replace(name="other").wrist is not None
    assert moved.mirrored().wrist is None
    assert heavy.mirrored().wrist.geometry.base_points[0] == pytest.approx(exo.geometry.base_points[0] * [1, -1, 1])


def test_what_is_loaded_has_to_be_there_and_readable(tmp_path):
    for source, error, words in (
        (3, ep.InvalidInput, "name of a preset"),
        ("prototyp", ep.UnknownName, "prototype"),
        ("robot.step", ep.UnknownName, "MJCF"),
    ):
        with pytest.raises(error, match=words):
            ep.load(source)
    # A law that cannot be read is refused at once.
    muscles = ep.load("four-muscle-cables")
    muscles.save(tmp_path / "muscles.toml")
    text = (tmp_path / "muscles.toml").read_text()
    assert 'force_law = "' in text
    law = text.split('force_law = "')[1].split('"')[0]
    (tmp_path / "wrong.toml").write_text(text.replace(f'force_law = "{law}"', 'force_law = "none-such"'))
    with pytest.raises(ep.ExoPinError, match="none-such"):
        ep.load(tmp_path / "wrong.toml")


def test_looks_of_a_device_and_of_a_configuration():
    exo, bare = ep.load(SUPPORT), ep.load(URDF / "dummy-shoulder.urdf")
    q = exo.configurations(exo.pose(30.0))
    assert type(exo.view(human=False)).__name__ == "Scene"
    assert type(exo.view(q=q, labels=True)).__name__ == type(bare.view()).__name__ == "ChainScene"
    for make, words in (
        (lambda: exo.view(labels=True), "labels name joints"),
        (lambda: exo.view(q=q, human=False), "a configuration q is drawn without person and forces"),
        (
            lambda: bare.view(human=False),
            "has no arm: it is drawn without person and forces, so there is no option human",
        ),
    ):
        with pytest.raises(ep.InvalidInput, match=words):
            make()


def test_a_robot_without_an_arm_says_what_it_is(tmp_path):
    bare = ep.load(URDF / "prototype-wrist.urdf")
    with pytest.raises(ep.InvalidInput, match="arm"):
        _ = bare.device
    assert not hasattr(bare, "track") or bare.wrist is not None
    assert bare.check().passed
    assert bare.name in repr(bare)
    assert bare.mirrored().side == "right"
    assert bare.mirrored().mirrored().side == "left"
    assert not bare.mirrored().has_arm
    with pytest.raises(ep.InvalidInput, match="spherical joint of the torso"):
        ep.ShoulderExo.from_device(bare)
    with pytest.raises(ep.InvalidInput, match="mechanism"):
        ep.ShoulderExo.from_mechanism(ep.load("prototype"))
