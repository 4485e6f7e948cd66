"""The person in the scene: its shoulder, its stature, and what is said without it."""

import importlib.metadata
from dataclasses import replace

import numpy as np
import pytest
from scenes import needs_human, panel, place, placements, pose
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.core import errors
from exo_pin.view import Scene, human_urdf
from exo_pin.view.figure import figure as human_figure


@needs_human
@pytest.mark.parametrize("side", ["left", "right"])
def test_the_humans_shoulder_is_at_O_and_its_arm_follows(exo, side):
    design = exo if side == "left" else exo.mirrored()
    # Of the mannequin's own height, 1.787 m.
    scene = Scene(design.worn_by(ep.Wearer(1.787, 75, "male", elbow_flexion=np.pi / 2)), human=True)
    root = place(scene, "/meshcat/human")
    for angles in ((0, 0, 0), (70, 20, 0), (30, 80, 40)):
        R = pose(*angles, side=side)
        scene.show(R)
        upper = place(scene, "/meshcat/bust") @ place(scene, "/meshcat/bust/shoulder")
        fore = root @ place(scene, f"/meshcat/human/visuals/{side}_lowerarm_1")
        np.testing.assert_allclose(upper[:3, 3], 0.0, atol=1e-12)
        # The elbow lies down the arm; a bent forearm leaves it forward, where the arm frame's x points.
        elbow = fore[:3, 3]
        np.testing.assert_allclose(elbow / np.linalg.norm(elbow), R.as_matrix() @ [0, 0, -1], atol=1e-9)
        hand = (root @ place(scene, f"/meshcat/human/visuals/{side}_hand_0"))[:3, 3] - elbow
        np.testing.assert_allclose(hand / np.linalg.norm(hand), R.as_matrix() @ [1, 0, 0], atol=1e-9)
    # It stands upright: the head above O, the other shoulder across the body at the same height.
    nose = (place(scene, "/meshcat/bust") @ place(scene, "/meshcat/bust/feature_0"))[:3, 3]
    assert nose[2] > 0.1
    across = (place(scene, "/meshcat/bust") @ place(scene, "/meshcat/bust/other_shoulder"))[:3, 3]
    np.testing.assert_allclose(across, [0.0, -0.42 if side == "left" else 0.42, 0.0], atol=1e-9)
    # The bust's shoulders are the figure's.
    other = "right" if side == "left" else "left"
    lower = (root @ place(scene, f"/meshcat/human/visuals/{other}_lowerarm_1"))[:3, 3]
    np.testing.assert_allclose(lower[:2], across[:2], atol=1e-9)


@pytest.mark.full
@needs_human
def test_figure_has_the_stature_of_the_wearer(exo):
    """Scaled about the shoulder: head above O and the other shoulder across the body, in proportion."""
    places = {}
    for stature in (None, 1.60, 1.92):
        unknown = exo.replace(arm=replace(exo.arm, wearer=None))
        scene = Scene(unknown if stature is None else exo.worn_by(ep.Wearer(stature, 75, "male")), human=True)
        scene.show(pose(60, 30, 0))
        root = place(scene, "/meshcat/human")
        bust = place(scene, "/meshcat/bust")
        own = ("shoulder", "other_shoulder", "feature_0")
        places[stature] = [(bust @ place(scene, f"/meshcat/bust/{name}"))[:3, 3] for name in own]
        names = ("left_foot_0", "left_hand_0")
        places[stature] += [(root @ place(scene, f"/meshcat/human/visuals/{name}"))[:3, 3] for name in names]
        np.testing.assert_allclose(places[stature][0], 0.0, atol=1e-12)
    np.testing.assert_allclose(np.array(places[1.92]), 1.2 * np.array(places[1.60]), atol=1e-12)
    np.testing.assert_allclose(np.array(places[1.60]), 1.60 / 1.787 * np.array(places[None]), atol=1e-12)
    # The soles' joint to the crown, roughly: a person of 1.6 m has about 1.4 m between ankle and head's middle.
    assert 1.2 < places[1.60][2][2] - places[1.60][3][2] < 1.6


def test_without_the_human_figure_there_is_a_message(exo, no_human):
    scene = Scene(exo)
    assert any("the extra 'human'" in message for message in scene.messages)
    assert any("the extra 'human'" in note["text"] for note in panel(scene, "numbers")["notes"])
    with pytest.raises(errors.MissingExtra, match=r"\.\[human\]"):
        Scene(exo, human=True)
    # Chest and head stand alone, with the mechanism's own arm.
    drawn = placements(scene)
    assert "/meshcat/bust/shoulder" in drawn
    assert "/meshcat/exo/visuals/arm_0" in drawn
    assert not any(path.startswith("/meshcat/bust") for path in placements(Scene(exo, human=False)))


def test_a_figure_without_its_meshes_is_as_one_that_is_missing(exo, monkeypatch, tmp_path):
    """As installed where large files were left out."""
    urdf = tmp_path / "share/example-robot-data/robots/human_description/robots/human.urdf"
    urdf.parent.mkdir(parents=True)
    urdf.write_text(
        '<robot name="human"><link name="body"><visual><geometry><mesh filename="package://no/a.stl"/></geometry>'
        "</visual></link></robot>"
    )
    monkeypatch.setattr(human_figure, "human_urdf", lambda: urdf)
    assert any("the extra 'human'" in message for message in Scene(exo).messages)
    with pytest.raises(errors.MissingExtra):
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


@pytest.mark.full
def test_a_motion_through_the_lock_of_the_human_figures_angles(exo):
    """The figure's own Euler angles lock within reach; the drawing goes on, and so do the forces."""
    scene = Scene(exo)
    for turn in Rotation.from_euler("YXZ", [[0, 90, 0], [-90, 90, 0], [-45, 89.999, 30]], degrees=True):
        assert scene.show(turn) is not None
