"""The robot.yaml layout: joints, closures, and refusals."""

import numpy as np
import pytest
from mechanisms import five_bar
from scipy.spatial.transform import Rotation

from exo_pin.chain import ClosedChain
from exo_pin.core.errors import FileFormatError, UnknownName

YAML = """closed_loop: [["tip_a", "tip_b"]]
type: ["3d"]
name_mot: ["left_crank_hinge", "right_crank_hinge"]
"""


def parallel_robot(tmp_path, text=YAML):
    """The five-bar with a link at either forearm's tip, in the peers' layout."""
    urdf = five_bar().urdf
    tips = "".join(
        f'<link name="tip_{letter}"/><joint name="weld_{letter}" type="fixed"><parent link="{side}_forearm"/>'
        f'<child link="tip_{letter}"/><origin xyz="0.275 0 0"/></joint>'
        for letter, side in (("a", "left"), ("b", "right"))
    )
    (tmp_path / "robot.urdf").write_text(urdf.replace("</robot>", f"{tips}</robot>"))
    (tmp_path / "robot.yaml").write_text(text)
    return tmp_path


@pytest.mark.parametrize("kind", ["3d", "3D", "6d"])
def test_robot_yaml(kind, tmp_path):
    folder = parallel_robot(tmp_path, YAML.replace('"3d"', f'"{kind}"'))
    for path in (folder, folder / "robot.yaml"):
        chain = ClosedChain.from_parallel_robot(path)
        assert chain.roles.actuated == ("left_crank_hinge", "right_crank_hinge")
        assert chain.row_count == int(kind[0])
    if kind != "6d":
        named = five_bar()
        assert np.abs(chain.residual(named.q)).max() < 1e-15
        closed = chain.close(named.q + 0.1, hold=chain.roles.actuated)
        ours = named.chain().close(named.q + 0.1, hold=chain.roles.actuated)
        np.testing.assert_allclose(closed, ours, atol=1e-12)


@pytest.mark.parametrize(
    ("old", "new", "error", "said"),
    [
        ('"3d"', '"2d"', UnknownName, "type of a closed loop"),
        ('"3d"', "3", UnknownName, "3d, 6d"),
        ('["3d"]', '["3d", "6d"]', FileFormatError, "1 entries"),
        ('"tip_b"', '"tip_c"', UnknownName, "did you mean"),
        ('"tip_a", ', "", FileFormatError, "pairs"),
        ("name_mot", "motors", FileFormatError, "unknown key"),
        ('"left_crank_hinge", ', '"motor", ', UnknownName, "left_crank_hinge"),
        ("closed_loop: [", "closed_loop: [[", FileFormatError, "YAML"),
        ('type: ["3d"]', "", FileFormatError, "missing key 'type'"),
        ('type: ["3d"]', "type: 3d", FileFormatError, "list"),
        ("name_mot:", 'joint_name: ["a"]\njoint_type: ["HINGE"]\nname_mot:', UnknownName, "SPHERICAL"),
        ("name_mot:", 'joint_name: ["a"]\njoint_type: ["FIXED"]\nname_mot:', UnknownName, "joint 'a'"),
    ],
)
def test_a_bad_robot_yaml_is_refused(old, new, error, said, tmp_path):
    assert old in YAML
    with pytest.raises(error, match=said):
        ClosedChain.from_parallel_robot(parallel_robot(tmp_path, YAML.replace(old, new, 1)))


def test_robot_yaml_changes_joints(tmp_path):
    changed = (
        YAML + 'joint_name: ["left_forearm_hinge", "right_forearm_hinge"]\njoint_type: ["SPHERICAL", "UJOINT_ZX"]\n'
    )
    chain = ClosedChain.from_parallel_robot(parallel_robot(tmp_path, changed))
    names = list(chain.model.names)[1:]
    assert names == [
        "left_crank_hinge",
        "left_forearm_hinge",
        "right_crank_hinge",
        "right_forearm_hinge_Z",
        "right_forearm_hinge_X",
    ]
    assert chain.model.nv == 7
    # The same places, and a ball that turns about z as the hinge did.
    q5 = five_bar().q
    q = chain.neutral()
    for name in ("left_crank_hinge", "right_crank_hinge", "right_forearm_hinge_Z"):
        source = name.removesuffix("_Z")
        q[chain.configuration_slice(name)] = q5[five_bar().chain().configuration_slice(source)]
    q[chain.configuration_slice("left_forearm_hinge")] = Rotation.from_rotvec([0, 0, q5[1]]).as_quat()
    assert np.abs(chain.residual(q)).max() < 1e-14
    masses = [sum(inertia.mass for inertia in item.model.inertias) for item in (chain, five_bar().chain())]
    assert masses[0] == pytest.approx(masses[1])
    welded = YAML + 'joint_name: ["left_forearm_hinge"]\njoint_type: ["FIXED"]\n'
    assert ClosedChain.from_parallel_robot(parallel_robot(tmp_path, welded)).model.nv == 3
