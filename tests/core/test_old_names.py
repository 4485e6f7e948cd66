"""Old names raise and name the new ones."""

import pytest

import exo_pin as ep
import exo_pin.chain
import exo_pin.view
from exo_pin import InvalidInput


def test_an_old_table_raises_and_names_the_new_one():
    with pytest.raises(InvalidInput, match=r"exo_pin.study.PARAMETERS is called exo_pin.design.PARAMETERS now"):
        from exo_pin.study import PARAMETERS  # noqa: F401
    with pytest.raises(InvalidInput, match=r"exo_pin.workspace.UNITS is called CRITERIA\[name\].unit now"):
        from exo_pin.workspace import UNITS  # noqa: F401


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


def test_old_methods_raise_and_name_the_new_ones():
    exo = ep.load("prototype")
    with pytest.raises(InvalidInput, match=r"ShoulderExo.holding_reaction is called reaction, which keeps the limits"):
        exo.holding_reaction  # noqa: B018
    with pytest.raises(InvalidInput, match=r"Workspace.index_by_measure is called volume_share now"):
        exo.workspace(60.0, ["stroke"]).index_by_measure  # noqa: B018
    with pytest.raises(AttributeError, match="no attribute 'no_such_name'"):
        exo.no_such_name  # noqa: B018
    assert not hasattr(exo, "_repr_pretty_")
