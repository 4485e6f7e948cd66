"""The person in the scene: its shoulder, its stature, and what is said without it."""

import importlib.metadata

import numpy as np
import pytest
from scenes import needs_human, panel, place, pose
from scipy.spatial.transform import Rotation

from exo_pin.core import errors
from exo_pin.view import Scene, human_urdf


@needs_human
@pytest.mark.parametrize("side", ["left", "right"])
def test_the_humans_shoulder_is_at_O_and_its_arm_follows(exo, side):
    design = exo if side == "left" else exo.mirrored()
    scene = Scene(design, human=True, elbow_flexion=np.pi / 2)
    root = place(scene, "/meshcat/human")
    for angles in ((0, 0, 0), (70, 20, 0), (30, 80, 40)):
        R = pose(*angles, side=side)
        scene.show(R)
        upper = root @ place(scene, f"/meshcat/human/visuals/{side}_upperarm_0")
        fore = root @ place(scene, f"/meshcat/human/visuals/{side}_lowerarm_1")
        np.testing.assert_allclose(upper[:3, 3], 0.0, atol=1e-12)
        # The elbow lies down the arm; a bent forearm leaves it forward, where the arm frame's x points.
        elbow = fore[:3, 3]
        np.testing.assert_allclose(elbow / np.linalg.norm(elbow), R.as_matrix() @ [0, 0, -1], atol=1e-9)
        hand = (root @ place(scene, f"/meshcat/human/visuals/{side}_hand_0"))[:3, 3] - elbow
        np.testing.assert_allclose(hand / np.linalg.norm(hand), R.as_matrix() @ [1, 0, 0], atol=1e-9)
    # It stands upright: the head above O, the other shoulder across the body at the same height.
    head = (root @ place(scene, "/meshcat/human/visuals/middle_head_0"))[:3, 3]
    assert head[2] > 0.1
    other = "right" if side == "left" else "left"
    across = (root @ place(scene, f"/meshcat/human/visuals/{other}_upperarm_0"))[:3, 3]
    np.testing.assert_allclose(across, [0.0, -0.42 if side == "left" else 0.42, 0.0], atol=1e-9)


@needs_human
def test_figure_has_the_given_stature(exo):
    """Scaled about the shoulder: head above O and the other shoulder across the body, in proportion."""
    places = {}
    for stature in (None, 1.60, 1.92):
        scene = Scene(exo, human=True, stature=stature)
        scene.show(pose(60, 30, 0))
        root = place(scene, "/meshcat/human")
        names = ("left_upperarm_0", "right_upperarm_0", "middle_head_0", "left_foot_0", "left_hand_0")
        places[stature] = [(root @ place(scene, f"/meshcat/human/visuals/{name}"))[:3, 3] for name in names]
        np.testing.assert_allclose(places[stature][0], 0.0, atol=1e-12)
    np.testing.assert_allclose(np.array(places[1.92]), 1.2 * np.array(places[1.60]), atol=1e-12)
    np.testing.assert_allclose(np.array(places[1.60]), 1.60 / 1.787 * np.array(places[None]), atol=1e-12)
    # The soles' joint to the crown, roughly: a person of 1.6 m has about 1.4 m between ankle and head's middle.
    assert 1.2 < places[1.60][2][2] - places[1.60][3][2] < 1.6
    with pytest.raises(errors.InvalidInput, match="stature"):
        Scene(exo, stature=-1.7)


def test_without_the_human_figure_there_is_a_message(exo, no_human):
    scene = Scene(exo)
    assert any("exo_pin[human]" in message for message in scene.messages)
    assert any("exo_pin[human]" in note["text"] for note in panel(scene, "numbers")["notes"])
    with pytest.raises(errors.MissingExtra, match=r"exo_pin\[human\]"):
        Scene(exo, human=True)


def test_figure_without_distribution_is_found_elsewhere(monkeypatch, tmp_path):
    def missing(_):
        raise importlib.metadata.PackageNotFoundError

    monkeypatch.setattr(importlib.metadata, "files", missing)
    urdf = tmp_path / "share/example-robot-data/robots/human_description/robots/human.urdf"
    urdf.parent.mkdir(parents=True)
    urdf.touch()
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path))
    assert human_urdf() == urdf


def test_a_motion_through_the_lock_of_the_human_figures_angles(exo):
    """The figure's own Euler angles lock within reach; the drawing goes on, and so do the forces."""
    scene = Scene(exo)
    for turn in Rotation.from_euler("YXZ", [[0, 90, 0], [-90, 90, 0], [-45, 89.999, 30]], degrees=True):
        assert scene.show(turn) is not None
