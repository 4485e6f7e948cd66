import pytest

from exo_pin.chain import write_closures


@pytest.fixture
def robot(tmp_path):
    def written(named):
        (tmp_path / "mine.urdf").write_text(named.urdf)
        write_closures(named.closures, tmp_path / "mine.closures.toml")
        return tmp_path / "mine.urdf"

    return written
