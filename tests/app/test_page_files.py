"""Files of the page: what is given stays within its folder, what is saved is read back, and all is gone in the end."""

import io
import zipfile
from pathlib import Path

import pytest
from places import URDF

import exo_pin as ep
from exo_pin.app.asked import Asked
from exo_pin.app.dimensions import dimensions_of
from exo_pin.app.files import LARGEST_DESIGN, PageFiles
from exo_pin.core.errors import InvalidInput


@pytest.fixture
def files():
    made = PageFiles()
    yield made
    made.close()


def test_a_design_comes_back_with_its_changes(files):
    asked = Asked("four-cables", (("cuff_height_mm", 200.0),))
    name, content = files.design(asked)
    path = files.keep(name, content)
    assert name == "four-cables.toml"
    assert -1e3 * ep.load(path).geometry.platform_points[:, 2].mean() == pytest.approx(200.0)
    # The page's person is none of the design.
    assert ep.load(path).arm.mass == ep.load("four-cables").arm.mass


def test_a_device_of_several_files_comes_as_an_archive(files, tmp_path):
    name, content = files.design(Asked(str(URDF / "spring-support.urdf")))
    assert name == "spring-support.zip"
    zipfile.ZipFile(io.BytesIO(content)).extractall(tmp_path)
    own = Asked(str(URDF / "spring-support.urdf")).exo
    read = ep.load(tmp_path / "spring-support.toml").worn_by(Asked().person)
    pose = own.pose(50, 10, 0)
    assert float(read.reaction(pose).magnitude) == pytest.approx(float(own.reaction(pose).magnitude), rel=1e-6)


@pytest.mark.parametrize(
    "name", ["../../evil.toml", "/etc/evil.toml", "C:\\evil.toml", "a/b/../evil.toml", "evil.toml"]
)
def test_a_given_file_stays_within_its_folder(files, name):
    path = Path(files.keep(name, b""))
    assert path.name == "evil.toml"
    assert "exo_pin_app_" in path.parts[-3]
    files.close()
    assert not path.exists()


@pytest.mark.parametrize("name", ["", ".toml", "device.urdf", "..", "device.toml.exe"])
def test_other_files_are_refused(files, name):
    with pytest.raises(InvalidInput, match=r"\.toml file"):
        files.keep(name, b"")


def test_a_large_design_is_refused(files):
    with pytest.raises(InvalidInput, match="at most"):
        files.keep("device.toml", bytes(LARGEST_DESIGN + 1), most=LARGEST_DESIGN)


@pytest.mark.parametrize("design", ["four-cables", "prototype", str(URDF / "spring-support.urdf")])
def test_every_dimension_can_be_changed_to_both_ends_of_its_slider(design):
    asked = Asked(design)
    known = dimensions_of(asked.exo.device)
    assert (known[0].name == "cuff_height_mm") == design.startswith(("four", "proto"))
    for each in known[:6]:
        assert each.low < each.value < each.high
        changed = {own.name: own.value for own in dimensions_of(asked.changed(each.name, each.value + 2.0).exo.device)}
        assert changed[each.name] == pytest.approx(each.value + 2.0, abs=0.06)
