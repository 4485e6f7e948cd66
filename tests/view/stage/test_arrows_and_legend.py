"""The scene's arrows, their scale, and its legend, without a browser."""

import numpy as np
import pytest
from scenes import panel, place, pose

import exo_pin as ep
from exo_pin.design.holding_frame import sleeve_size
from exo_pin.view import Scene

#: No arrow is longer, m.
LONGEST = 0.4


def test_arrows_are_the_forces_to_the_stated_scale(exo):
    scene = Scene(exo, human=False)
    answer = scene.show(pose(0, 0, 0))
    shaft = place(scene, "/meshcat/forces/shoulder/shaft")
    head = place(scene, "/meshcat/forces/shoulder/head_0")
    tip = head[:3, 3] + head[:3, 2]
    np.testing.assert_allclose(shaft[:3, 3], 0.0, atol=1e-12)
    np.testing.assert_allclose(tip, scene.metres_per_newton * answer.shoulder_force, atol=1e-12)
    # Labels keep clear of the arrows by their ends.
    label = next(label for label in panel(scene, "labels") if label["text"].startswith("shoulder"))
    np.testing.assert_allclose(label["arrow"], [np.zeros(3), tip], atol=1e-12)
    assert f"10 cm = {0.1 / scene.metres_per_newton:g} N" in panel(scene, "legend")["scale"]
    # Pull runs from the joint to the torso with one head, push ends at the joint with two.
    answer = scene.show(pose(60, 30, 0))
    assert (np.sign(answer.actuator_forces) == [-1, 1, -1]).all()
    state = exo.inverse_kinematics(pose(60, 30, 0))
    for i, (kind, last) in enumerate([("push", "head_1"), ("pull", "head_0"), ("push", "head_1")]):
        head = place(scene, f"/meshcat/forces/limb_{i + 1}/{kind}/{last}")
        line = head[:3, 2] / np.linalg.norm(head[:3, 2])
        np.testing.assert_allclose(line, (-1 if kind == "pull" else 1) * state.directions[i], atol=1e-9)
        other = {"push": "pull", "pull": "push"}[kind]
        assert np.linalg.norm(place(scene, f"/meshcat/forces/limb_{i + 1}/{other}/shaft")[:3, :3]) < 1e-5


@pytest.mark.parametrize("angles", [(0, 0, 0), (60, 30, 0), (30, 60, 20), (0, 6, 0)])
def test_the_largest_force_has_a_good_length(exo, angles):
    scene = Scene(exo, human=False)
    answer = scene.show(pose(*angles))
    largest = max(answer.magnitude, np.abs(answer.actuator_forces).max())
    assert 0.15 <= scene.metres_per_newton * largest <= 0.24 + 1e-9
    assert "cut" not in panel(scene, "legend")["scale"]
    assert not any("(cut)" in label["text"] for label in panel(scene, "labels"))


def test_a_motion_has_one_scale_and_cuts_what_is_near_singular(exo):
    scene = Scene(exo, human=False)
    lift = pose(np.linspace(0, 90, 46), 30.0, 0.0)
    recording = scene.record(lift, np.linspace(0, 2, 46))
    largest = np.fmax(recording.reaction.magnitude, np.abs(recording.reaction.actuator_forces).max(axis=-1))
    firm = largest[recording.reaction.equilibrium_status == "ok"]
    assert np.percentile(firm, 50) * scene.metres_per_newton < 0.24
    assert np.nanmax(largest) * scene.metres_per_newton > LONGEST
    assert f"cut at {LONGEST / scene.metres_per_newton:.4g} N" in panel(scene, "legend")["scale"]
    # Limbs pull and push on the way, and the legend says so in every frame.
    texts = [item["text"] for item in panel(scene, "legend")["items"]]
    assert {"limb pulls, f > 0", "limb pushes, f < 0"} <= set(texts)


def test_the_cuffs_pull_stands_beside_its_sleeve(exo):
    """Along the arm, to the stated scale, clear of sleeve and joints, with what it slips; nothing without a person."""
    soft = exo.replace(interfaces=ep.Interfaces(cuff=ep.Interface.upper_arm_cuff(0.2), cuff_area=0.01))
    scene = Scene(soft, human=False)
    for at in (pose(60, 30, 0), pose(10, 60, -20)):
        answer = scene.show(at)
        shaft, head = (place(scene, f"/meshcat/forces/cuff/{part}") for part in ("shaft", "head_0"))
        tip, start = head[:3, 3] + head[:3, 2], shaft[:3, 3]
        along = -at.as_matrix()[:, 2]
        np.testing.assert_allclose(tip - start, scene.metres_per_newton * answer.cuff_pull * along, atol=1e-12)
        start_in_arm = at.inv().apply(start)
        radius, bottom, top = sleeve_size(soft.geometry.platform_points)
        assert np.hypot(*start_in_arm[:2]) > radius
        assert bottom < start_in_arm[2] < top
        (text,) = (label["text"] for label in panel(scene, "labels") if label["text"].startswith("cuff"))
        slip = 1e3 * np.linalg.norm(answer.cuff_slip[:3])
        assert text == f"cuff {abs(answer.cuff_pull):.0f} N along the arm, slips {slip:.0f} mm"
        assert answer.cuff_text() in [note["text"] for note in panel(scene, "numbers")["notes"]]
    bare = Scene(exo.replace(arm=ep.Arm(3.0, (0.0, 0.0, -0.3), device=True)), human=False)
    bare.show(pose(60, 30, 0))
    assert not any(label["text"].startswith("cuff") for label in panel(bare, "labels"))


def test_a_long_arrow_is_cut_and_labelled(exo):
    scene = Scene(exo, human=False, metres_per_newton=0.1)
    answer = scene.show(pose(60, 30, 0))
    head = place(scene, "/meshcat/forces/shoulder/head_0")
    assert np.linalg.norm(head[:3, 3] + head[:3, 2]) == pytest.approx(LONGEST)
    texts = [label["text"] for label in panel(scene, "labels")]
    assert f"shoulder {answer.magnitude:.0f} N (cut)" in texts


@pytest.mark.parametrize("load", [100.0, 2e3, 3e7])
def test_sizes_have_few_digits(exo, load):
    scene = Scene(exo, human=False)
    size = scene.show(pose(60, 30, 0), load=ep.Load([0.0, 0.0, -load]), limits="none").magnitude
    said = f"{size:.1f} N" if size < 1e3 else f"{size:.0f} N" if size < 1e6 else f"{size:.3g} N"
    assert panel(scene, "numbers")["values"][0]["value"] == said
