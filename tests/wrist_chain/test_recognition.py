"""A robot from its files: what it can answer, what it says it cannot."""

import dataclasses
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from mechanisms import parallelogram, planar_3rrr, random_wrist
from scipy.spatial.transform import Rotation
from spatial_mechanisms import delta, stewart

import exo_pin as ep
from exo_pin import NotAWrist
from exo_pin.chain import ClosedChain, write_closures
from exo_pin.consistency import check_chain
from exo_pin.wrist_chain import mechanism_urdf, wrist_of

POSE = ep.shoulder_rotation(30, 20, 0, degrees=True)
ROBOTS = {"delta": delta(), "stewart": stewart(), "3rrr": planar_3rrr(), "parallelogram": parallelogram()}


def written(named, folder):
    (folder / "mine.urdf").write_text(named.urdf)
    write_closures(named.closures, folder / "mine.closures.toml")
    return folder / "mine.urdf"


@pytest.mark.parametrize("name", ROBOTS)
def test_a_robot_that_is_no_wrist(name, tmp_path):
    named = ROBOTS[name]
    exo = ep.load(written(named, tmp_path))
    assert exo.name == named.closures.name
    assert named.closures.name in repr(exo)
    q = exo.chain.close(named.q)
    assert exo.chain.mobility(q).locked.degrees_of_freedom == 0
    report = exo.check()
    assert report.passed
    assert {"loops", "closure Jacobian", "mobility", "joint limits", "inertia"} == {f.name for f in report.findings}
    # What needs limbs between two joint centres is no attribute; what needs an arm says that there is none.
    for name in ("mechanism", "geometry", "forward_kinematics", "limbs"):
        assert not hasattr(exo, name)
        assert name not in dir(exo)
    assert (exo.mirrored().side, exo.mirrored().name) == ("right", exo.name)
    with pytest.raises(AttributeError, match=r"its record is \.device"):
        _ = exo.mechanism
    for ask in (
        lambda: exo.device,
        lambda: exo.jacobian(POSE),
        lambda: exo.reaction(POSE),
        lambda: ep.solve(exo, ep.Case(POSE)),
        lambda: ep.workspace.workspace(exo, POSE),
        lambda: exo.singularity(POSE),
        lambda: exo.track("flexion"),
    ):
        with pytest.raises(ep.InvalidInput, match=r"names no arm among its roles|on a spherical joint"):
            ask()


@pytest.mark.parametrize("part", ["whole", "wrist", "floating"])
@pytest.mark.parametrize("kinds", ["UUU", "USUSU"])
def test_a_wrist_of_known_masses_comes_back_whole(part, kinds, tmp_path):
    mechanism = random_wrist(41, kinds, with_masses=True)
    mechanism = mechanism.replace(geometry=mechanism.geometry.replace(neutral=Rotation.from_rotvec([0.2, -0.1, 0.3])))
    given = ep.ShoulderExo.from_mechanism(mechanism)
    exo = ep.load(given.to_urdf(tmp_path, part, assumed=None))
    assert exo.chain.description.name.endswith(part)
    np.testing.assert_allclose(exo.jacobian(POSE), given.jacobian(POSE), atol=1e-14)
    np.testing.assert_allclose(exo.reaction(POSE).shoulder_force, given.reaction(POSE).shoulder_force, rtol=1e-9)
    assert [limb.kind for limb in exo.limbs] == [limb.kind for limb in given.limbs]


def test_masses_that_the_record_cannot_hold_leave_the_kinematics(tmp_path):
    prototype = ep.load("prototype")
    exo = ep.load(prototype.to_urdf(tmp_path))
    np.testing.assert_allclose(exo.jacobian(POSE), prototype.jacobian(POSE), atol=1e-14)
    np.testing.assert_allclose(
        exo.inverse_kinematics(POSE).lengths, prototype.inverse_kinematics(POSE).lengths, atol=1e-14
    )
    assert "masses of" in exo.wrist.beyond_record
    # Forces are those of the chain, with all masses that the file has: the limbs' weight is a tenth of the arm's.
    heavy, light = exo.reaction(POSE, limits="none"), prototype.reaction(POSE, limits="none")
    assert 0.05 < abs(heavy.magnitude / light.magnitude - 1.0) < 0.5
    assert heavy.residual < 1e-12


def test_the_side_of_a_urdf_is_the_given_one(tmp_path):
    path = ep.load("prototype").to_urdf(tmp_path, assumed=None)
    assert ep.load(path).side == "left"
    assert ep.load(path, side="right").side == "right"
    with pytest.raises(ep.InvalidInput):
        ep.load(path, side="middle")


@pytest.mark.parametrize(("joint", "what"), [("limb_1_base_x", "axis"), ("limb_2_slide", "origin")])
def test_an_axis_or_a_joint_out_of_place_is_no_wrist(joint, what):
    urdf, closures = mechanism_urdf(ep.load("prototype").mechanism)
    tree = ET.fromstring(urdf)
    element = next(item for item in tree.findall("joint") if item.get("name") == joint).find(what)
    numbers = [float(number) for number in element.get("xyz").split()]
    element.set("xyz", " ".join(repr(number + 0.01) for number in numbers))
    with pytest.raises(NotAWrist, match="otherwise"):
        wrist_of(ClosedChain.from_urdf(ET.tostring(tree, encoding="unicode"), closures))


def test_checks_find_a_robot_that_cannot_close():
    named = delta("rigid")
    far = tuple(
        dataclasses.replace(closure, placement_b=dataclasses.replace(closure.placement_b, translation=(0.0, 0.0, 3.0)))
        for closure in named.closures.closures
    )
    chain = ClosedChain.from_urdf(named.urdf, dataclasses.replace(named.closures, closures=far))
    report = check_chain(chain)
    assert not report.passed
    assert "stay open" in str(report)


def test_checks_note_a_singular_start_and_limits():
    report = check_chain(planar_3rrr(radial=True).chain())
    assert "singular: output" in str(report)
    named = stewart()
    chain = named.chain()
    part = chain.configuration_slice("base_0_x")
    chain.model.lowerPositionLimit[part] = 2.0
    assert "base_0_x beyond" in str(check_chain(chain))
