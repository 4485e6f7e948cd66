"""Weakest rates of drives and poses that look alike to them, recomputed from the design's file alone."""

import dataclasses
import tomllib
from pathlib import Path

import numpy as np
import pytest
from places import URDF
from scipy.optimize import least_squares, linprog
from scipy.spatial.transform import Rotation

import exo_pin as ep

FOUND = Path(ep.__file__).parent / "design" / "presets" / "found"
NAME = "four-linear-actuators-worn"
MM = np.pi / 180.0 * 1e3  # mm/° of m/rad


def lengths_of(name):
    """Lengths by rotation vector of the arm, m, from the points of the file."""
    points = tomllib.loads((FOUND / f"{name}.toml").read_text())["geometry"]["points"]
    base, platform = (1e-3 * np.array(points[f"{side}_mm"]) for side in ("base", "platform"))
    return lambda turn: np.linalg.norm(Rotation.from_rotvec(turn).apply(platform) - base, axis=1)


def own_rate(lengths, turn):
    """Least change of the lengths over a turn of the arm about any axis, by differences, mm/°."""
    here = Rotation.from_rotvec(turn)
    step = 1e-5
    columns = [
        (lengths((Rotation.from_rotvec(step * e) * here).as_rotvec())
         - lengths((Rotation.from_rotvec(-step * e) * here).as_rotvec())) / (2.0 * step)
        for e in np.eye(3)
    ]  # fmt: skip
    return np.linalg.svd(np.array(columns).T, compute_uv=False)[-1] * MM


def own_twin(lengths, turn, rng, starts=60, away=90.0):
    """Angle, degrees, and difference of lengths, mm, of the nearest look-alike 10 to ``away`` degrees off."""
    here, own = Rotation.from_rotvec(turn), lengths(turn)
    best = np.inf, np.nan
    for _ in range(starts):
        axis = rng.normal(size=3)
        begin = np.radians(rng.uniform(12.0, 40.0)) * axis / np.linalg.norm(axis)
        found = least_squares(lambda d: lengths((Rotation.from_rotvec(d) * here).as_rotvec()) - own, begin, xtol=1e-12)
        angle, difference = np.degrees(np.linalg.norm(found.x)), 1e3 * np.linalg.norm(found.fun)
        if 10.0 <= angle <= away:
            best = min(best, (difference, angle))
    return best[1], best[0]


@pytest.mark.parametrize(
    ("flexion", "away", "off"), [(80.0, 18.5, 0.34), (90.0, 21.6, 0.84)]
)  # degrees and mm, as were found by hand
def test_twins_and_rates_from_the_file_alone(flexion, away, off):
    exo, lengths = ep.load(NAME), lengths_of(NAME)
    pose = exo.pose(flexion)
    found = exo.accuracy(pose)
    angle, difference = own_twin(lengths, pose.as_rotvec(), np.random.default_rng(1))
    assert (round(angle, 1), round(difference, 2)) == (away, off)
    assert np.degrees(found.twin_angle) == pytest.approx(angle, abs=0.02)
    assert 2.0 * found.twin_difference == pytest.approx(difference, abs=1e-3)  # of 2 mm in all
    assert 1e3 * np.linalg.norm(found.differences) == pytest.approx(difference, abs=1e-3)
    assert found.has_twin
    twin = Rotation.from_matrix(found.twin_matrices)
    own = lengths(twin.as_rotvec()) - lengths(pose.as_rotvec())
    np.testing.assert_allclose(found.differences, own, atol=1e-9)
    assert found.mm_per_degree == pytest.approx(own_rate(lengths, pose.as_rotvec()), rel=1e-6)
    assert found.degrees_per_mm == pytest.approx(1.0 / found.mm_per_degree)


def test_stated_play_and_resolution_decide():
    """A twin at 0.34 mm in all is none for drives of 0.05 mm each, whatever way they are stated."""
    exo = ep.load(NAME)
    actuator = exo.limbs[0].actuator

    def with_play(**stated):
        limbs = [dataclasses.replace(limb, actuator=dataclasses.replace(actuator, **stated)) for limb in exo.limbs]
        return exo.replace(limbs=limbs)

    pose = exo.pose(80.0)
    fine, coarse = with_play(resolution=5e-5), with_play(play=4e-4, resolution=1e-4)
    assert not fine.accuracy(pose).has_twin
    found = coarse.accuracy(pose)
    assert found.has_twin
    assert found.twin_difference == pytest.approx(0.3448 / (0.5 * 2.0), abs=1e-3)  # rss over 0.5 mm of each of four
    assert np.isnan(exo.accuracy(pose).free_turn)
    # The largest turn within ±0.25 mm of every limb: a corner of its polytope, by linear programs.
    J, rng = exo.jacobian(pose), np.random.default_rng(2)
    ends = [
        linprog(rng.normal(size=3), np.vstack([J, -J]), [0.25e-3] * 8, bounds=[(None, None)] * 3).x for _ in range(40)
    ]
    assert found.free_turn == pytest.approx(np.linalg.norm(ends, axis=1).max(), rel=1e-6)


@pytest.mark.parametrize("name", ["four-linear-actuators-worn", "four-linear-actuators", "six-cables"])
def test_the_hand_gives_way_as_the_energy_of_the_cuff_says(name):
    """By hand: arm and cuff where the cuff's energy less the work of a force at the hand is least, lengths locked."""
    exo = ep.load(name).worn_by(ep.Wearer(1.755, 85, "male", elbow_flexion=0.5))
    geometry, man, pose = exo.geometry, exo.arm.wearer, exo.pose(60, 20)
    R, at = pose.as_matrix(), np.array([0.0, 0.0, geometry.platform_points[:, 2].mean()])
    K = ep.Interface.upper_arm_cuff(-at[2]).stiffness
    fore = man.forearm_length * np.array([np.sin(0.5), 0.0, -np.cos(0.5)])
    hand = R @ (fore - [0.0, 0.0, man.upper_arm_length])

    def lengths(x):
        on_arm = Rotation.from_rotvec(x[6:]).apply(geometry.platform_points - at) + at + x[3:6]
        return np.linalg.norm(Rotation.from_rotvec(x[:3]).apply(on_arm @ R.T) - geometry.base_points, axis=1)

    # Of second order in small motions: rows of locked lengths by central differences, then the saddle point.
    step = 1e-6 * np.eye(9)
    rows = np.array([(lengths(each) - lengths(-each)) / 2e-6 for each in step]).T
    energy = np.zeros((9, 9))
    energy[3:, 3:] = K
    saddle = np.block([[energy, rows.T], [rows, np.zeros((len(rows), len(rows)))]])
    work = np.concatenate([np.cross(hand, np.eye(3)), np.zeros((3, 6 + len(rows)))], axis=1)
    turns = np.linalg.lstsq(saddle, work.T, rcond=None)[0][:3].T
    gives = np.linalg.eigvalsh(np.cross(turns, hand))[-1]
    assert float(exo.accuracy(pose, twins=False).hand_stiffness) == pytest.approx(1.0 / gives, rel=1e-5)
    double = exo.replace(interfaces=ep.Interfaces(cuff=ep.Interface(2.0 * K, at)))
    assert double.accuracy(pose, twins=False).hand_stiffness * gives == pytest.approx(2.0, rel=1e-5)
    assert np.isnan(exo.replace(arm=ep.Arm(3.0, (0.0, 0.0, -0.3))).accuracy(pose, twins=False).hand_stiffness)


def test_words_of_an_accuracy_are_its_numbers():
    exo = ep.load(NAME).worn_by(ep.Wearer(1.755, 85, "male"))
    found, stack = exo.accuracy(exo.pose(80.0)), exo.accuracy(exo.pose([80.0, 20.0], 0.0))
    low, high = stack.mm_per_degree.min(), stack.mm_per_degree.max()
    share = stack.has_twin.mean()
    assert str(stack) == f"weakest rate {low:.2g} to {high:.2g} mm/°; twins of {100.0 * share:.0f} % of the poses"
    text = str(found)
    off, away = 1e3 * np.linalg.norm(found.differences), np.degrees(float(found.twin_angle))
    assert text.startswith(
        f"The weakest rate of the drives is {float(found.mm_per_degree):.2g} mm/°: 1 mm of the drives"
    )
    assert f"turns the arm by {1.0 / float(found.mm_per_degree):.2g}°" in text
    assert f"and a pose {away:.1f}° away has the same positions to {off:.2f} mm. A sensor" in text
    assert f"1 N at the hand move it by {1e3 / float(found.hand_stiffness):.2g} mm." in text
    assert "Play" not in text
    played = dataclasses.replace(found, free_turn=np.array(np.radians(1.3)), hand_stiffness=np.array(5.0))
    assert "Play and resolution leave the arm 1.3° to either side." in str(played)
    assert "move it by more than 100 mm." in str(played)
    assert stack.sensitivity(1).endswith("°") != stack.has_twin[1]
    serial = ep.load(URDF / "serial-y-x-z.urdf")
    hinges = serial.accuracy(serial.pose(20.0))
    assert "°/°: 1° of the drives turns the arm by 1" in str(hinges)
    assert "sensor" not in str(hinges)
    lost = dataclasses.replace(hinges, rate=np.array(np.nan))
    assert str(lost) == "How well the drives place the arm is not known here."


def test_slides_of_a_chain_count_by_their_lengths():
    exo = ep.load(URDF / "3rps-passive-ball.urdf")
    pose = exo.pose(30.0, 20.0)
    found = exo.accuracy(pose, twins=False)
    _, values, axes = np.linalg.svd(exo.jacobian(pose)[: len(exo.device.drives)])
    held = exo.device.driven_moments
    assert (found.rate, found.unit) == (pytest.approx(values[held - 1]), "mm/°")
    assert abs(axes[held - 1] @ found.axis) == pytest.approx(1.0)
    assert found.mm_per_degree == pytest.approx(values[held - 1] * MM)
    weak = dataclasses.replace(found, rate=np.array(0.29 / MM), twin_difference=np.array(np.inf))
    assert weak.is_doubtful
    assert not dataclasses.replace(weak, rate=np.array(0.31 / MM)).is_doubtful
    twin = dataclasses.replace(weak, rate=np.array(1.0), twin_difference=np.array(0.9), barrier=np.array(2.9))
    assert twin.is_doubtful
    assert not dataclasses.replace(twin, barrier=np.array(3.1)).is_doubtful
    assert not dataclasses.replace(twin, twin_difference=np.array(1.1)).is_doubtful
