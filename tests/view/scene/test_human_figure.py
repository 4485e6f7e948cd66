"""What is said and drawn without the figure of the person, and where it is found."""

import importlib.metadata

import pytest
from scenes import panel, placements

from exo_pin.core import errors
from exo_pin.view import Scene, human_urdf
from exo_pin.view.figure import figure as human_figure


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
