"""What is given to the page stays within its folder."""

from pathlib import Path

import pytest

from exo_pin.app.files import PageFiles


@pytest.fixture
def files():
    made = PageFiles()
    yield made
    made.close()


@pytest.mark.parametrize(
    "name", ["../../evil.toml", "/etc/evil.toml", "C:\\evil.toml", "a/b/../evil.toml", "evil.toml"]
)
def test_a_given_file_stays_within_its_folder(files, name):
    path = Path(files.keep(name, b""))
    assert path.name == "evil.toml"
    assert "exo_pin_app_" in path.parts[-3]
    files.close()
    assert not path.exists()
