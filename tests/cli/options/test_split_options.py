"""Splits and offset on the command line."""

import json

import numpy as np
import pytest
from command_line import POSE, run

import exo_pin as ep

STIFF = ["--shoulder-stiffness", "20000", "--guide", "40", "30"]


def exo():
    limbs = tuple(ep.Limb(guide=ep.LimbGuide(40.0, 30.0)) for _ in range(3))
    return ep.load("prototype").replace(limbs=limbs, shoulder=ep.Shoulder(stiffness=2e4))


def test_compare_three_splits(capsys):
    status, out, _ = run(capsys, "reaction", "prototype", *POSE, "--compare", "spherical,minimal,elastic", *STIFF)
    assert status == 0
    header = next(line for line in out.splitlines() if "spherical" in line)
    assert header.split() == ["spherical", "minimal", "elastic"]
    force = next(line for line in out.splitlines() if line.startswith("shoulder force")).split()
    expected = exo().reaction(ep.shoulder_rotation(60, 30, 0, degrees=True), split="elastic").magnitude
    assert float(force[-1]) == pytest.approx(expected, abs=0.006)


def test_report_by_stiffness(capsys, monkeypatch):
    given = []
    monkeypatch.setattr(ep.ShoulderExo, "remedy", lambda *_, **options: given.append(options) or "Another pose.")
    elastic = ["--split", "elastic", *STIFF]
    status, out, _ = run(capsys, "reaction", "prototype", *POSE, *elastic, "--offset", "0", "5", "0", "--explain")
    assert status == 0
    assert "at the displaced geometry" in " ".join(out.split())
    assert max(len(line) for line in out.partition("\n\n")[2].splitlines()) <= 100
    answer = exo().reaction(ep.shoulder_rotation(60, 30, 0, degrees=True), split="elastic", centre_offset=[0, 5e-3, 0])
    lengths = [line.split()[1] for line in out.splitlines() if line.split()[:1] in (["1"], ["2"], ["3"])]
    assert lengths == [f"{1e3 * value:.0f}" for value in answer.limb_lengths]
    offset = given[0].pop("centre_offset")
    np.testing.assert_allclose([offset.base, offset.cuff], [[0.0, 5e-3, 0.0]] * 2)
    assert given == [{"split": "elastic", "limits": "design", "posture": None}]


@pytest.mark.full
def test_published_effect_of_an_offset(capsys):
    status, out, _ = run(
        capsys, "reaction", "prototype", "--compare", "spherical", "--offset", "0", "0", "20", "--json"
    )
    assert status == 0
    data = json.loads(out)
    assert data["centre_offset_mm"] == [0, 0, 20]
    np.testing.assert_allclose(data["spherical"]["actuator_forces"], [-2.26, 114.73, 113.16], atol=0.005)
    status, out, _ = run(capsys, "reaction", "prototype", "--offset", "0", "0", "-20", "--explain")
    assert "off the shoulder's by (0, 0, -20) mm" in out
    assert "Force of the shoulder on the arm: 11.8 N" in out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--compare", "elastic"], "shoulder stiffness"),
        (["--compare", "spherical,soft"], "soft"),
        (["--compare", "spherical", "--side-force-limit", "5"], "--side-force-limit"),
        (["--offset", "0", "0", "500"], "0.2 m"),
        (["--guide", "-1", "2"], "bending_rigidity"),
    ],
)
def test_invalid_arguments(capsys, arguments, message):
    status, out, error = run(capsys, "reaction", "prototype", *POSE, *arguments)
    assert status == 2
    assert out == ""
    assert message in error
