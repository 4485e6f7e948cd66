"""The edges of what is read of SDF: which joints close a loop, limits, axes, frames, numbers of the geometry."""

import numpy as np
import pytest

from exo_pin import FileFormatError
from exo_pin.chain import ClosedChain

FREEDOMS = {"revolute": 1, "prismatic": 1, "continuous": 1, "universal": 2, "revolute2": 2, "ball": 3}


def joint(name, kind, axis="", parent="world", child="b", place=""):
    axes = f"<axis>{axis}<xyz>1 0 0</xyz></axis>" if kind != "ball" else ""
    axes += "<axis2><xyz>0 1 0</xyz></axis2>" if FREEDOMS[kind] == 2 else ""
    return f'<joint name="{name}" type="{kind}">{place}<parent>{parent}</parent><child>{child}</child>{axes}</joint>'


def model(*joints, links='<link name="b"/>'):
    return f'<sdf version="1.11"><model name="m">{links}{"".join(joints)}</model></sdf>'


@pytest.mark.parametrize("first", ["one", "two", "three"])
def test_a_joint_that_is_asked_for_is_in_the_tree_before_all_others(first):
    limited = "<limit><upper>1</upper></limit>"
    text = model(joint("one", "ball"), joint("two", "revolute", limited), joint("three", "revolute"))
    chain = ClosedChain.from_sdf(text, first_joint=first)
    assert set(chain.model.names) == {"universe", "two", first}
    # The others close loops, that with a limit by an end of its own.
    left = [f"{name}_closure" if name == "two" else name for name in ("one", "two", "three") if name != first]
    assert [closure.name for closure in chain.closures] == left
    np.testing.assert_allclose(chain.residual(chain.neutral()), 0.0, atol=1e-15)
    with pytest.raises(FileFormatError, match="unknown first joint of the tree 'four'"):
        ClosedChain.from_sdf(text, first_joint="four")
