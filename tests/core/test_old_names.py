"""Old names raise and name the new ones."""

import pytest

import exo_pin.chain
import exo_pin.view
from exo_pin import InvalidInput


@pytest.mark.parametrize(
    ("package", "old", "new"),
    [(exo_pin.chain, "Split", "CoordinateSplit"), (exo_pin.view, "Recording", "SceneRecording")],
)
def test_an_old_name_raises_and_names_the_new_one(package, old, new):
    with pytest.raises(InvalidInput, match=f"{package.__name__}.{old} is called {new} now"):
        getattr(package, old)
    assert old not in dir(package)
    assert getattr(package, new).__name__ == new
    with pytest.raises(AttributeError):
        package.no_such_name  # noqa: B018
