"""The one object a user holds: its kinematics, files and contact, for a wrist and for another device."""

import inspect
from dataclasses import replace

import numpy as np
import pytest
from places import URDF
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.report.design_report import design_report

MAN = ep.Person(1.75, 75, "male")
SERIAL = URDF / "serial-y-x-z.urdf"
SERIAL_EXO = ep.load(SERIAL)


@pytest.fixture(scope="module")
def worn():
    return ep.load("four-linear-actuators-worn").worn_by(MAN)


@pytest.mark.parametrize("name", ["four-linear-actuators-worn", SERIAL])
def test_rates_are_those_of_the_positions(name):
    exo = ep.load(name)
    pose, step = exo.pose(50, 30, 10), 1e-6
    turns = Rotation.from_rotvec(step * np.concatenate([np.eye(3), -np.eye(3)]))
    positions = exo.inverse_kinematics(turns * pose).positions
    rates = (positions[:3] - positions[3:]) / (2.0 * step)
    np.testing.assert_allclose(exo.jacobian(pose), rates.T, atol=1e-6)
    q = exo.configurations(Rotation.concatenate([pose, exo.pose()]))
    assert np.abs(exo.assembly_modes(pose, starts=4)[0] - q[0]).max() < 1e-6
    for each in q:
        assert np.abs(exo.chain.residual(each)).max() < 1e-9
    assert exo.accuracy(pose, twins=False).rate == pytest.approx(np.linalg.svd(rates, compute_uv=False)[-1], rel=1e-4)


def test_long_work_says_how_far_it_is(worn, capsys):
    """On request, at each method that may take long; nothing of what is printed goes to the answer's own stream."""
    poses = worn.pose(np.linspace(0.0, 60.0, 8), 20.0)
    asked = {
        "reaction": lambda **more: SERIAL_EXO.reaction(SERIAL_EXO.pose(np.linspace(0.0, 60.0, 8)), **more),
        "joint_contact": lambda **more: worn.joint_contact(poses, MAN, **more),
        "compare": lambda **more: worn.compare(worn, poses=poses, **more),
        "total_uncertainty": lambda **more: worn.total_uncertainty(poses[3], draws=12, **more),
    }
    for name, ask in asked.items():
        ask()
        quiet = capsys.readouterr()
        ask(progress=True)
        said = capsys.readouterr()
        assert (quiet.err, said.out) == ("", ""), name
        assert said.err, name


def test_the_speed_of_a_report_is_that_of_its_record():
    asked, own = (inspect.signature(each).parameters["arm_speed"] for each in (ep.ShoulderExo.report, design_report))
    assert asked.default == own.default


def test_a_law_that_is_none_is_refused_with_its_design(tmp_path):
    """Also of a muscle that pulls by a tackle, when the file is read and not at the first question."""
    exo = ep.load("prototype")
    tackle = ep.design.Tackle(ratio=2.0, muscle_length=0.3, force_law="tang-optimised", supply_pressure=4e5)
    for actuator in (exo.limbs[0].actuator, ep.Actuator("cable", tackle=tackle)):
        limbs = [replace(limb, actuator=actuator) for limb in exo.limbs]
        exo.replace(limbs=limbs).save(tmp_path / "own.toml")
        text = (tmp_path / "own.toml").read_text(encoding="utf-8")
        (tmp_path / "wrong.toml").write_text(text.replace("tang-optimised", "tang-best"), encoding="utf-8")
        assert ep.load(tmp_path / "own.toml").limbs[0].actuator == actuator
        with pytest.raises(ep.UnknownName, match="unknown muscle model 'tang-best'"):
            ep.load(tmp_path / "wrong.toml")
