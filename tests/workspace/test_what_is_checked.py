"""Which criteria are checked and why others are not, starts of a search, and numbers of a workspace by hand."""

from types import MappingProxyType

import numpy as np
import pytest
from places import URDF
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.workspace import Criteria, Workspace

pytestmark = pytest.mark.usefixtures("plain")


def test_extremes_and_means_of_a_workspace_by_hand():
    """Of forces inside alone, and of offsets the furthest."""
    base = np.array([[0.0, 0.003, 0.004], [0.0, 0.0, 0.001], [0.0, 0.012, 0.005]])
    found = Workspace(
        "mine", "left", Rotation.from_rotvec(0.1 * np.eye(3)), Criteria(),
        MappingProxyType({"stroke": np.array([0.1, 0.2, 0.0]), "forces": np.array([1.0, 2.0, np.nan])}),
        MappingProxyType({}), np.ones((3, 4)), np.array([0.5, 2e-9, 0.5]), np.ones((3, 4)),
        np.array([[30.0, 0.0, 40.0], [0.0, 20.0, 0.0], [900.0, 0.0, 0.0]]), np.ones((3, 3)),
        ep.CentreOffset(base, base[::-1] / 2.0),
    )  # fmt: skip
    assert found.force_inside == {"mean": 35.0, "largest": 50.0}
    assert found.largest_offsets == pytest.approx({"base": 0.013, "cuff": 0.0065})
    assert found.unknown.tolist() == [False, False, True]
    np.testing.assert_array_equal(found.magnitude, [50.0, 20.0, 900.0])
    summary = found.summary()
    assert summary["unknown"] == pytest.approx(1.0 / 3.0)
    assert summary["largest_offsets"] == found.largest_offsets
    assert summary["one_by_one"]["together"].tolist() == pytest.approx([1.0, 2.0 / 3.0])
    for values, text in (([1e-10, 0.5, 0.5], [False, False, True]), ([0.5, 0.5, 5e-10], [False, False, False])):
        again = Workspace(**(vars_of(found) | {"margin": np.array(values)}))
        assert again.unknown.tolist() == text


def test_forces_of_several_persons_are_those_of_the_worst():
    persons, exo = (ep.Wearer(1.6, 55, "female"), ep.Wearer(1.9, 110, "male")), ep.load(URDF / "serial-y-x-z.urdf")
    poses = exo.pose([20.0, 75.0, 40.0], [35.0, 10.0, 70.0])
    both = exo.workspace(poses, Criteria(("forces",), wearers=persons))
    each = [exo.worn_by(person).workspace(poses, ["forces"]) for person in persons]
    np.testing.assert_allclose(both.margins["forces"], np.min([one.margins["forces"] for one in each], axis=0))
    largest = np.argmax([one.magnitude for one in each], axis=0)
    for name in ("shoulder_force", "tensions"):
        values = [getattr(one, name) for one in each]
        np.testing.assert_allclose(getattr(both, name), [values[k][row] for row, k in enumerate(largest)])


def vars_of(found):
    return {name: getattr(found, name) for name in type(found).__dataclass_fields__}
