"""The wearer's bones and muscles."""

import numpy as np
import pytest

import exo_pin as ep
from exo_pin import InvalidInput
from exo_pin.core.errors import MissingExtra
from exo_pin.person import MUSCLES
from exo_pin.person.limb.limb_state import limb_state
from exo_pin.person.limb.skeleton import BONES, bone_meshes, limb_shape

pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")
pytest.importorskip("clarabel", reason="needs the extra person: pip install '.[person]'")

WEARER = ep.Person(1.75, 75, "male", elbow_flexion=20, degrees=True)


@pytest.fixture(scope="module")
def device():
    return ep.load("four-cables")


@pytest.mark.parametrize("left", [False, True])
def test_paths_are_as_long_as_the_muscles(left):
    """Where a path does not wrap, its length is that of the muscle; around a bone it is drawn straight."""
    side = "left" if left else "right"
    rotations = ep.shoulder_rotation([0, 30, 70], [10, 50, 20], [0, 10, -20], side=side, degrees=True)
    state = limb_state(rotations.as_matrix(), 0.4, 0.1, 0.95, left)
    exact = 0
    for row, matrix in enumerate(rotations.as_matrix()):
        shape = limb_shape(matrix, 0.4, 0.1, 0.95, left)
        for k, path in enumerate(shape.paths):
            length = np.linalg.norm(np.diff(path, axis=0), axis=1).sum()
            assert length <= state.length[row, k] + 1e-9, MUSCLES[k]
            assert length > 0.8 * state.length[row, k], MUSCLES[k]
            exact += abs(length - state.length[row, k]) < 1e-9
        np.testing.assert_allclose(shape.socket_axes, state.glenoid[row], atol=1e-12)
    assert exact >= 10


def test_meshes_that_all_figures_share_cannot_be_changed():
    shared = bone_meshes("right")
    with pytest.raises(ValueError, match="read-only"):
        shared["scapula"][0][0] = 0.0
    shared.clear()
    assert set(bone_meshes("right")) == set(BONES)
    with pytest.raises(ep.UnknownName, match="side"):
        bone_meshes("both")


@pytest.mark.parametrize("side", ["left", "right"])
def test_bones_are_closed_skins_that_face_outwards(side):
    """The volume inside, by the divergence theorem, is positive, and for the humerus of a known size."""
    for name, (vertices, faces) in bone_meshes(side).items():
        a, b, c = (vertices[faces[:, k]] for k in range(3))
        volume = np.einsum("ti,ti->", a, np.cross(b, c)) / 6.0
        assert volume > 0.0, name
        if name == "humerus":
            assert 1e-4 < volume < 3e-4


def test_wrong_calls_are_refused(device, monkeypatch):
    with pytest.raises(InvalidInput, match="Person"):
        device.view(person=WEARER.arm)
    monkeypatch.setattr("exo_pin.person.limb.skeleton.myoarm", _missing)
    monkeypatch.setattr("exo_pin.person.limb.skeleton._right_meshes", _missing)
    with pytest.raises(MissingExtra):
        device.view(person=WEARER)


def _missing(**_):
    raise MissingExtra("person", "myo_sim and mujoco")
