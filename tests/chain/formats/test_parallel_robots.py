"""The robot.yaml layout: joints, closures, and refusals."""

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from exported_robots import exported
from mechanisms import five_bar
from scipy.spatial.transform import Rotation

from exo_pin import InvalidInput, UnknownName
from exo_pin.chain import ClosedChain

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
def test_robot_yaml(kind, tmp_path, monkeypatch):
    folder = parallel_robot(tmp_path, YAML.replace('"3d"', f'"{kind}"'))
    monkeypatch.chdir(folder)
    for path in (folder, folder / "robot.yaml", Path("robot.yaml")):
        chain = ClosedChain.from_parallel_robot(path)
        # It is called after its folder, if the path has one.
        assert chain.description.name == (folder.name if path.is_absolute() else "robot")
        assert chain.roles.actuated == ("left_crank_hinge", "right_crank_hinge")
        assert chain.row_count == int(kind[0])
    if kind != "6d":
        named = five_bar()
        assert np.abs(chain.residual(named.q)).max() < 1e-15
        closed = chain.close(named.q + 0.1, hold=chain.roles.actuated)
        ours = named.chain().close(named.q + 0.1, hold=chain.roles.actuated)
        np.testing.assert_allclose(closed, ours, atol=1e-12)


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
    # Every joint's frame hangs on one of the body that carries it, any other frame on that of its joint.
    for frame in list(chain.model.frames)[1:]:
        carrier = chain.model.frames[frame.parentFrame].parentJoint
        is_joint = frame.type == pin.FrameType.JOINT
        assert carrier == (chain.model.parents[frame.parentJoint] if is_joint else frame.parentJoint)
    masses = [sum(inertia.mass for inertia in item.model.inertias) for item in (chain, five_bar().chain())]
    assert masses[0] == pytest.approx(masses[1])
    welded = YAML + 'joint_name: ["left_forearm_hinge"]\njoint_type: ["FIXED"]\n'
    assert ClosedChain.from_parallel_robot(parallel_robot(tmp_path, welded)).model.nv == 3


@pytest.mark.parametrize(
    "kind", ["CARDAN", *(f"UJOINT_{one}{other}" for one in "XYZ" for other in "XYZ" if one != other)]
)
def test_a_cross_of_any_two_axes(kind, tmp_path):
    changed = YAML + f'joint_name: ["left_forearm_hinge"]\njoint_type: ["{kind}"]\n'
    chain = ClosedChain.from_parallel_robot(parallel_robot(tmp_path, changed))
    first, second = "XY" if kind == "CARDAN" else kind[-2:]
    names = [f"left_forearm_hinge_{letter}" for letter in (first, second)]
    assert list(chain.model.names)[2:4] == names
    # Where the hinge was; first about one axis, then about the other, of the joint's own frame.
    q, still = chain.neutral(), chain.neutral()
    angles = dict(zip(names, (0.3, -0.5), strict=True))
    for name, angle in angles.items():
        q[chain.configuration_slice(name)] = angle
    turned = Rotation.from_euler(f"{first}{second}", list(angles.values())).as_matrix()
    # The joint that was is still a frame, which loops may name.
    for frame in ("left_forearm", "left_forearm_hinge"):
        start, there = chain.placement(still, frame), chain.placement(q, frame)
        np.testing.assert_allclose(there.translation, start.translation, atol=1e-15)
        np.testing.assert_allclose(there.rotation, start.rotation @ turned, atol=1e-15)


def test_a_cross_of_one_axis_is_refused(tmp_path):
    changed = YAML + 'joint_name: ["left_forearm_hinge"]\njoint_type: ["UJOINT_XX"]\n'
    with pytest.raises(UnknownName, match="UJOINT_XY"):
        ClosedChain.from_parallel_robot(parallel_robot(tmp_path, changed))


@pytest.mark.parametrize("root", [None, "fixed", "free_flyer", "planar"])
def test_the_root_joint_of_a_robot_yaml(root, tmp_path):
    # Walking robots in this layout are loaded on a free base; the layout does not say so.
    chain = ClosedChain.from_parallel_robot(parallel_robot(tmp_path), root_joint=root)
    assert chain.model.nv == 4 + {None: 0, "fixed": 0, "free_flyer": 6, "planar": 3}[root]
    changed = YAML + 'joint_name: ["left_forearm_hinge"]\njoint_type: ["SPHERICAL"]\n'
    chain = ClosedChain.from_parallel_robot(parallel_robot(tmp_path, changed), root_joint=root)
    assert chain.model.nv == 6 + {None: 0, "fixed": 0, "free_flyer": 6, "planar": 3}[root]
    if root == "planar":
        with pytest.raises(UnknownName, match="free_flyer"):
            ClosedChain.from_parallel_robot(parallel_robot(tmp_path), root_joint="rolling")


@pytest.mark.parametrize(
    ("loops", "more", "rows", "freedoms"),
    [
        # The loop's ends are joints: two hinges in a row with a rigid closure between them.
        ("closed_loop: [['loop1_A', 'loop1_B']]\ntype: ['6d']\n", "joint_name: []\njoint_type: []\n", 6, 3),
        ("closed_loop: [['loop1_B', 'loop1_A']]\ntype: ['3D']\n", "", 3, 4),
        ("closed_loop: [['tip_A', 'tip_B']]\ntype: ['3d']\n", "joint_name:\njoint_type:\n", 3, None),
        ("closed_loop: []\ntype: []\n", "joint_name: ['free1']\njoint_type: ['SPHERICAL']\n", 0, 8),
        (
            "closed_loop: [['loop1_A', 'loop1_B']]\ntype: ['6d']\n",
            "joint_name: ['loop1_A', 'free2', 'free1']\njoint_type: ['SPHERICAL', 'UJOINT_ZY', 'CARDAN']\n",
            6,
            4,
        ),
    ],
)
def test_robots_as_exporters_write_them_load_and_close(loops, more, rows, freedoms, tmp_path):
    chain = ClosedChain.from_parallel_robot(exported(tmp_path, loops, more))
    assert chain.row_count == rows
    assert chain.roles.actuated == ("mot1", "mot2")
    # Limits that are not stated are 0 to 0 in URDF; closing does not look at them.
    rng = np.random.default_rng(0)
    q = chain.close(pin.integrate(chain.model, chain.neutral(), rng.uniform(-0.1, 0.1, chain.model.nv)))
    assert np.abs(chain.residual(q)).max(initial=0.0) < 1e-12
    if freedoms is not None:
        assert chain.mobility(q, actuated=()).degrees_of_freedom == freedoms


def test_friction_beside_a_joint_is_not_read_silently(tmp_path):
    folder = exported(tmp_path, "closed_loop: [['loop1_A', 'loop1_B']]\ntype: ['6d']\n")
    text = (folder / "robot.urdf").read_text()
    (folder / "robot.urdf").write_text(text.replace('friction="0.0"', 'friction="0.3"', 1))
    with pytest.warns(RuntimeWarning, match='friction="0.3" is not read'):
        ClosedChain.from_parallel_robot(folder)


def test_a_link_and_a_joint_of_one_name_in_two_places(tmp_path):
    """Exporters write links and joints of one name that are not each other's."""
    folder = exported(tmp_path, "closed_loop: [['loop1_A', 'loop1_B']]\ntype: ['6d']\n")
    plain = ClosedChain.from_parallel_robot(folder)
    text = (folder / "robot.urdf").read_text()
    (folder / "robot.urdf").write_text(text.replace('"rod_3"', '"mot1"'))
    chain = ClosedChain.from_parallel_robot(folder)
    q = chain.close(np.linspace(0.1, 0.5, chain.model.nq))
    assert list(chain.model.names) == list(plain.model.names)
    np.testing.assert_array_equal(q, plain.close(np.linspace(0.1, 0.5, chain.model.nq)))
    assert "mot1" not in chain.placements(q)
    # Joints are found by their names; a frame of that name could be either.
    forces, theirs = (item.inverse_dynamics(q, actuated=["mot1", "mot2", "free1"]) for item in (chain, plain))
    assert forces.effort("mot1") == theirs.effort("mot1")
    for call in (
        lambda: chain.placement(q, "mot1"),
        lambda: chain.inverse_dynamics(q, external={"mot1": np.zeros(6)}),
        lambda: forces.wrench_on("mot1"),
        lambda: forces.joint_reaction("free1", in_frame="mot1"),
        lambda: ClosedChain.from_parallel_robot(exported_with(folder, "closed_loop: [['mot1', 'loop1_B']]")),
    ):
        with pytest.raises(InvalidInput, match="two frames in different places have the name 'mot1'"):
            call()


def exported_with(folder, loops):
    """The same folder with another loop."""
    (folder / "robot.yaml").write_text(f"{loops}\ntype: ['6d']\nname_mot: ['mot1']\n")
    return folder
