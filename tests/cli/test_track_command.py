"""``exo-pin track``."""

import json

import numpy as np
import pytest
from command_line import run
from scipy.spatial.transform import Rotation

import exo_pin as ep


@pytest.mark.full
def test_a_person_wears_what_moves(capsys, tmp_path):
    pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")
    lift, table = tmp_path / "lift.csv", tmp_path / "run.csv"
    lift.write_text(
        "time_s,flexion_deg,abduction_deg,internal_rotation_deg\n0,0,0,0\n0.1,1,0,0\n0.2,2,0,0\n0.3,3,0,0\n"
    )
    person = ("--person", "1.70,65,female", "--payload", "1")
    status, out, _ = run(
        capsys, "track", "four-cables", "--trajectory", str(lift), *person, "--out", str(table), "--json"
    )
    assert status == 0
    arm = ep.load("four-cables").worn_by(ep.Arm.from_anthropometry(1.70, 65, "female", payload=1.0)).arm
    assert json.loads(table.with_suffix(".json").read_text())["moving_mass_kg"] == pytest.approx(arm.mass)
    assert "joint" in out


@pytest.mark.full
def test_forces_and_energies_of_the_table_balance(capsys, tmp_path):
    table = tmp_path / "run.csv"
    run(capsys, "track", "--experiment", "held-abduction", "--no-progress", "--out", str(table))
    lines = table.read_text().splitlines()
    rows = np.array([[float(value) for value in line.split(",")] for line in lines[1:]])
    named = dict(zip(lines[0].split(","), rows.T, strict=True))

    def vectors(name):
        return np.stack([named[name.format(axis)] for axis in "xyz"], axis=1)

    # The file beside it gives the mass; the geometry is Table 5-3's. Nothing else of the package is used.
    beside = json.loads(table.with_suffix(".json").read_text())
    mass, centre = beside["moving_mass_kg"], beside["centre_of_mass_mm"]
    turns = Rotation.from_euler(
        "YXZ",
        np.stack([-named["flexion_deg"], named["abduction_deg"], -named["internal_rotation_deg"]], axis=1),
        degrees=True,
    )
    geometry = ep.load("prototype").geometry
    ends = zip(geometry.base_points, geometry.platform_points.copy(), strict=True)
    span = np.stack([turns.apply(B) - A for A, B in ends])
    lengths = np.linalg.norm(span, axis=2)
    np.testing.assert_allclose(lengths, [named[f"length_{i}_m"] for i in (1, 2, 3)], atol=1e-8)
    pull = sum(named[f"tension_{i}_N"][:, None] * span[i - 1] / lengths[i - 1][:, None] for i in (1, 2, 3))
    C, omega = turns.apply(1e-3 * np.array(centre)), vectors("angular_velocity_{}_rad_s")
    eta = vectors("angular_acceleration_{}_rad_s2")
    acceleration = np.cross(eta, C) + np.cross(omega, np.cross(omega, C))
    up = np.array([0.0, 0.0, 9.81])
    np.testing.assert_allclose(vectors("F_s_{}_N"), mass * (acceleration + up) + pull, atol=1e-6)
    arm, R = ep.experiment("held-abduction").mechanism.arm, turns.as_matrix()
    about_O = R @ (arm.inertia + mass * (np.dot(arm.centre_of_mass, arm.centre_of_mass) * np.eye(3)
                   - np.outer(arm.centre_of_mass, arm.centre_of_mass))) @ R.transpose(0, 2, 1)  # fmt: skip
    spin = np.einsum("nij,nj->ni", about_O, eta) + np.cross(omega, np.einsum("nij,nj->ni", about_O, omega))
    ends = np.stack([turns.apply(B) for B in geometry.platform_points.copy()])
    moment = sum(
        np.cross(ends[i], -named[f"tension_{i + 1}_N"][:, None] * span[i] / lengths[i][:, None]) for i in range(3)
    )
    moment += np.cross(C, -mass * up) + vectors("shoulder_moment_{}_N_m")
    np.testing.assert_allclose(spin, moment, atol=1e-6)
    gained = named["kinetic_energy_J"] + named["potential_energy_J"]
    gained -= gained[0]
    assert named["shoulder_loss_J"][-1] > 1e-3
    work = named["tension_work_J"] - named["shoulder_loss_J"]
    np.testing.assert_allclose(gained, work, atol=1e-4 * np.abs(named["tension_work_J"]).max())
