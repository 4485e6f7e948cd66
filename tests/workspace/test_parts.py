"""The list of parts: what drives must do, products that fit, and masses."""

import csv
from dataclasses import replace

import numpy as np
import pytest
from places import URDF
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.cli import main
from exo_pin.design.holding_frame import estimated_cuff, estimated_frame_mass
from exo_pin.workspace.parts import PRODUCTS, parts_list, parts_sheet

HELD = ep.Criteria(names=("forces",))


def light():
    """A design whose drives hold 0.3 kg."""
    exo = ep.load("four-linear-actuators")
    return exo.replace(arm=ep.Arm(0.3, (0.0, 0.0, -0.2)))


def test_speeds_and_powers_are_those_of_lengths_that_change():
    exo, rate, small = ep.load("four-linear-actuators"), 0.7, 1e-5
    found = exo.workspace(exo.pose(flexion=[10.0, 40.0, 70.0], abduction=[0.0, 20.0, 50.0]), HELD)
    assert found.inside.all()
    table = parts_list(exo.device, found, rate)
    turned = (Rotation.from_rotvec(small * axis) * found.poses for axis in (*np.eye(3), *-np.eye(3)))
    lengths = np.array([exo.inverse_kinematics(poses).lengths for poses in turned])
    rates = np.linalg.norm((lengths[:3] - lengths[3:]) / (2.0 * small), axis=0)
    np.testing.assert_allclose(table["speed"][:4], rate * rates.max(axis=0), rtol=1e-7)
    np.testing.assert_allclose(table["power_W"][:4], rate * (rates * np.abs(found.tensions)).max(axis=0), rtol=1e-7)
    with pytest.raises(ep.InvalidInput, match="rate"):
        parts_list(exo.device, found, 0.0)


def test_the_smallest_product_that_has_force_and_travel_is_named():
    exo = light()
    found = exo.workspace(exo.pose(flexion=[0.0, 10.0, 20.0]), HELD)
    table = parts_list(exo.device, found)
    for k in range(4):
        effort = np.abs([table["effort_from"][k], table["effort_to"][k]]).max()
        travel = table["longest"][k] - table["shortest"][k]
        fit = [each for each in PRODUCTS if each.unit == "N" and each.effort >= effort and each.strokes[1] >= travel]
        best = min(fit, key=lambda each: (each.effort, each.strokes[1]))
        assert table["order"][k].startswith(best.name)
        assert table["mass_kg"][k] == best.mass < 0.1
        # So fast that the drive of the worst axis turns at its own speed.
        slow = 30.0 * best.speed / table["speed"][k]
        assert (f"turns the arm at {slow:.1f}°/s at most" in table["order"][k]) == (slow < 30.0)
    text = " ".join(parts_sheet(exo.device, table).split())
    assert f"Mass of these parts: {table['mass_kg'].sum():.2f} kg. In answers limbs and drives weigh nothing" in text


def test_masses_are_those_of_frame_cuff_and_stated_limbs():
    exo = light()
    half = ep.LimbBody(mass=0.2, centre=0.1, transverse_inertia=1e-3, axial_inertia=1e-5)
    heavy = exo.replace(limbs=[replace(limb, base_body=half, platform_body=half) for limb in exo.limbs])
    table = parts_list(heavy.device, heavy.workspace(heavy.pose([0.0]), HELD))
    assert table["mass_kg"][:4].tolist() == [0.4] * 4
    own = estimated_frame_mass(exo.geometry) + estimated_cuff(exo.geometry).mass
    assert table["mass_kg"][4:].sum() == pytest.approx(own, rel=1e-12)
    assert "weigh nothing" not in parts_sheet(heavy.device, table)


@pytest.mark.full
def test_a_device_of_hinges_has_motors_and_links():
    exo = ep.load(URDF / "serial-y-x-z.urdf")
    table = parts_list(exo.device, exo.workspace(exo.pose(30.0, [10.0, 20.0]), HELD))
    for k, text in enumerate(table["order"][:3]):
        effort = max(abs(table["effort_from"][k]), abs(table["effort_to"][k]))
        fit = [each for each in PRODUCTS if each.unit == "N m" and each.effort >= effort]
        # Of those that are strong enough the first whose mass is known.
        assert text.startswith(next(each.name for each in fit if each.mass == each.mass))
    # The first hinge turns as the arm does about its axis, and no slower than the arm about any.
    assert (table["speed"][:3] >= np.radians(30.0) * (1 - 1e-9)).all()
    assert table["mass_kg"][3:].sum() == pytest.approx(1.66 + 10.29, abs=0.01)


def test_the_command_writes_what_it_prints(capsys, tmp_path):
    path = tmp_path / "parts.csv"
    assert main(["parts", "four-cables", "--step", "40", "--out", str(path)]) == 0
    text = capsys.readouterr().out
    rows = list(csv.DictReader(path.read_text(encoding="utf-8").splitlines()))
    assert [row["part"] for row in rows[:4]] == [f"drive of limb {k}" for k in range(1, 5)]
    # 400 N on a drum of 20 mm are 8 N m at most.
    assert float(rows[0]["mass_kg"]) in (0.710, 0.853)
    assert "with a drum of 40 mm" in rows[0]["order"]
    for row in rows:
        assert row["part"] in text
        assert row["order"] in text
    assert "In answers limbs and drives weigh nothing" in " ".join(text.split())


@pytest.mark.full
def test_a_design_whose_drives_have_mass_is_heavier_by_their_moment(tmp_path):
    """Balance of the arm by hand: each limb hangs on two joints, and its weight on the cuff is by the lever rule."""
    path = tmp_path / "heavy.toml"
    assert main(["parts", "--step", "40", "--drive-mass", "0.4", "--with-masses", str(path)]) == 0
    light, heavy = ep.load("four-linear-actuators-worn"), ep.load(path)
    pose = heavy.pose(50.0, 20.0)
    answer, R = heavy.reaction(pose, limits="none"), pose.as_matrix()
    A, B = light.geometry.base_points, light.geometry.platform_points @ R.T
    arm, down = light.mechanism.arm, np.array([0.0, 0.0, -9.81])
    moment = np.cross(R @ arm.centre_of_mass, arm.mass * down)
    for a, b, limb in zip(A, B, light.limbs, strict=True):
        stroke, length = limb.stroke, np.linalg.norm(b - a)
        short = stroke.nominal_length * stroke.shortest + stroke.end_fitting
        # The case hangs from the frame, the rod from the cuff; both are as long as the retracted limb.
        share = 0.4 * (0.85 * short / 2.0 + 0.15 * (length - short / 2.0)) / length
        along = (down @ (b - a)) * (b - a) / length**2
        # Along the limb the cuff carries the rod alone, and the drive is between.
        moment = moment + np.cross(b, share * (down - along) + 0.15 * 0.4 * along)
    pull = np.cross(B, (A - B) / np.linalg.norm(A - B, axis=1)[:, None])
    np.testing.assert_allclose(pull.T @ answer.actuator_forces + moment, 0.0, atol=1e-8)
    assert np.abs(pull.T @ light.reaction(pose, limits="none").actuator_forces + moment).max() > 0.1
