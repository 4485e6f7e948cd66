"""Data of joints in a closures file: read, refused, and back bit for bit."""

import dataclasses
import re

import numpy as np
import pytest
from joint_arrays import ARRAYS
from mechanisms import five_bar
from places import page

import exo_pin as ep
from exo_pin import FileFormatError, InvalidInput
from exo_pin.chain import ClosedChain, Closures, JointProperties, read_closures, write_closures
from exo_pin.wrist_chain import wrist_of


@pytest.mark.parametrize("seed", range(20))
def test_closures_files_load_back_bit_for_bit(seed, tmp_path):
    rng = np.random.default_rng(seed)
    joints = tuple(
        JointProperties(
            f"joint {k} é",
            float(rng.normal() * 10.0 ** rng.integers(-12, 12)),
            None if rng.random() < 0.5 else tuple((rng.normal(size=4) * 10.0 ** rng.integers(-12, 12)).tolist()),
            None if rng.random() < 0.5 else tuple(rng.uniform(0, 1, size=3).tolist()),
            (None, "m", "rad")[int(rng.integers(3))],
        )
        for k in range(5)
    )
    given = Closures("r", joints=joints)
    write_closures(given, tmp_path / "r.toml")
    back = read_closures(tmp_path / "r.toml")
    # A unit is told by a key; the joint without data keeps none.
    assert back == given


WELD = """<link name="tip_b"/><joint name="weld_b" type="fixed"><parent link="right_forearm"/><child link="tip_b"/>
  <origin xyz="0.275 0 0"/></joint></robot>"""


def yaml_robot(tmp_path, dynamics):
    xml = five_bar().urdf.replace("</robot>", WELD)
    for name, entry in dynamics.items():
        at = xml.index("</joint>", xml.index(f'<joint name="{name}"'))
        xml = f"{xml[:at]}<dynamics {entry}/>{xml[at:]}"
    (tmp_path / "robot.urdf").write_text(xml)
    (tmp_path / "robot.yaml").write_text(
        'closed_loop: [["tip", "tip_b"]]\ntype: ["3d"]\nname_mot: ["left_crank_hinge"]\n'
        'joint_name: ["left_forearm_hinge", "right_crank_hinge"]\njoint_type: ["UJOINT_ZX", "FIXED"]\n'
    )
    return tmp_path


def test_a_robot_yaml_keeps_the_data_of_the_joints_it_does_not_change(tmp_path):
    entry = 'damping="0.5" friction="0.25"'
    folder = yaml_robot(tmp_path, {"left_crank_hinge": entry, "right_forearm_hinge": entry})
    chain = ClosedChain.from_parallel_robot(folder)
    plain = ClosedChain.from_urdf(folder / "robot.urdf", Closures("plain"))
    for name in ("left_crank_hinge", "right_forearm_hinge"):
        here, there = chain.velocity_slice(name), plain.velocity_slice(name)
        for array in ARRAYS[:8]:
            np.testing.assert_array_equal(getattr(chain.model, array)[here], getattr(plain.model, array)[there], array)
        assert chain.model.damping[here] == 0.5
        assert chain.model.upperDryFrictionLimit[here] == 0.25
    for joint in ("left_forearm_hinge", "right_crank_hinge"):
        with pytest.raises(InvalidInput, match=f"damping and friction of joint '{joint}'"):
            ClosedChain.from_parallel_robot(yaml_robot(tmp_path, {joint: entry}))


def test_a_key_twice_in_a_robot_yaml_is_refused(tmp_path):
    folder = yaml_robot(tmp_path, {})
    with open(folder / "robot.yaml", "a") as file:
        file.write('name_mot: ["right_forearm_hinge"]\n')
    with pytest.raises(FileFormatError, match="'name_mot' is given twice"):
        ClosedChain.from_parallel_robot(folder)


@pytest.mark.parametrize("what", ["damping", "friction", "armature", "spring"])
def test_a_wrist_with_data_that_its_record_cannot_hold_is_answered_as_a_chain(what, tmp_path):
    path = ep.load("prototype").to_urdf(tmp_path, assumed=None)
    chain = ClosedChain.from_urdf(path)
    assert wrist_of(chain).unheld == ()
    pose = ep.shoulder_rotation(30, 20, 0, degrees=True)
    before = ep.load(path)
    joint = "limb_2_slide"
    if what in ("damping", "friction"):
        xml = path.read_text()
        at = xml.index("</joint>", xml.index(f'<joint name="{joint}"'))
        path.write_text(f'{xml[:at]}<dynamics {what}="0.5"/>{xml[at:]}')
    else:
        given = JointProperties(joint, 5.0) if what == "spring" else JointProperties(joint, armature=(0.1,))
        write_closures(dataclasses.replace(chain.description, joints=(given,)), path.with_suffix(".closures.toml"))
    exo = ep.load(path)
    np.testing.assert_array_equal(exo.jacobian(pose), before.jacobian(pose))
    assert wrist_of(exo.chain).unheld == (f"{what} of {joint}",)
    assert exo.wrist.beyond_record == f"the {what} of {joint}"
    # At rest damping, friction and armature do nothing, and the spring pulls in its slide alone.
    change = exo.reaction(pose, limits="none").actuator_forces - before.reaction(pose, limits="none").actuator_forces
    stretch = exo.configurations(pose)[exo.chain.configuration_slice(joint)][0]
    expected = -5.0 * stretch if what == "spring" else 0.0
    np.testing.assert_allclose(change, [0.0, expected, 0.0], atol=1e-9)


SLIDER_CRANK = """<robot name="robot"><link name="base"/>
<link name="crank"/><link name="rod"/><link name="slider"/>
<joint name="crank_hinge" type="continuous"><parent link="base"/><child link="crank"/><axis xyz="0 1 0"/></joint>
<joint name="rod_hinge" type="continuous"><parent link="crank"/><child link="rod"/><origin xyz="0 0 0.1"/>
<axis xyz="0 1 0"/></joint>
<joint name="slide" type="prismatic"><parent link="base"/><child link="slider"/><axis xyz="1 0 0"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>"""


def test_the_closures_file_of_the_documentation_closes_a_slider_crank(tmp_path):
    text = next(block for block in re.findall(r"```toml\n(.*?)```", page("formats"), re.DOTALL) if "schema" in block)
    (tmp_path / "robot.urdf").write_text(SLIDER_CRANK)
    tree = ClosedChain.from_urdf(tmp_path / "robot.urdf")
    assert tree.closures == ()
    (said,) = tree.description.left_out
    assert said.startswith("closures: there is no robot.closures.toml: read as a tree (no effect: ")
    (tmp_path / "robot.closures.toml").write_text(text)
    chain = ClosedChain.from_urdf(tmp_path / "robot.urdf")
    assert chain.roles.actuated == ("crank_hinge",)
    q = chain.close(chain.neutral())
    assert chain.mobility(q).degrees_of_freedom == 1
    start = 0.1 * chain.placement(q, "crank").rotation[:, 2]
    np.testing.assert_allclose(np.linalg.norm(chain.placement(q, "slider").translation - start), 0.3, atol=1e-12)


FULL = """schema = 1
name = "r"
geometry_tolerance = 1e-6
left_out = ["fluid: air"]
[root]
joint = "spherical"
name = "ball"
gravity_m_s2 = [0.0, 1.0, 2.0]
[[closures]]
name = "loop"
type = "revolute"
frame_a = "a"
frame_b = "b"
translation_a_m = [1.0, 2.0, 3.0]
quaternion_a_xyzw = [0.0, 1.0, 0.0, 0.0]
translation_b_m = [4.0, 5.0, 6.0]
quaternion_b_xyzw = [1.0, 0.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
[[closures]]
name = "gear"
type = "coupling"
joint_a = "j"
joint_b = "k"
polynomial = [0.0, 2.0]
references = [0.1, 0.2]
[roles]
actuated = ["j"]
shoulder = "ball"
arm = "a"
reference_point = "a"
cuff = "b"
"""
#: What a line that is left out stands for.
DEFAULTS = {
    "geometry_tolerance": ("tolerance", 0.0), "left_out": ("left_out", ()), "joint ": ("root.joint", "fixed"),
    "name ": ("root.name", Closures("r").root.name), "gravity_m_s2": ("root.gravity", (0.0, 0.0, -9.81)),
    "translation_a_m": ("closures.0.placement_a.translation", (0.0, 0.0, 0.0)),
    "quaternion_a_xyzw": ("closures.0.placement_a.quaternion", (0.0, 0.0, 0.0, 1.0)),
    "translation_b_m": ("closures.0.placement_b.translation", (0.0, 0.0, 0.0)),
    "quaternion_b_xyzw": ("closures.0.placement_b.quaternion", (0.0, 0.0, 0.0, 1.0)), "axis": ("closures.0.axis", None),
    "references": ("closures.1.references", (0.0, 0.0)), "actuated": ("roles.actuated", ()),
    "shoulder": ("roles.shoulder", None), "arm": ("roles.arm", None),
    "reference_point": ("roles.reference_point", None), "cuff": ("roles.cuff", None),
}  # fmt: skip


def part(closures, path):
    for key in path.split("."):
        closures = closures[int(key)] if key.isdigit() else getattr(closures, key)
    return closures


@pytest.mark.parametrize("key", DEFAULTS)
def test_what_a_closures_file_leaves_out_has_its_default(key, tmp_path):
    (tmp_path / "full.toml").write_text(FULL)
    full = read_closures(tmp_path / "full.toml")
    head, _, rest = FULL.partition("[root]") if key in ("joint ", "name ") else ("", "", FULL)
    lines = rest.splitlines(keepends=True)
    at = next(k for k, line in enumerate(lines) if line.startswith(key))
    (tmp_path / "less.toml").write_text(head + ("[root]" if head else "") + "".join(lines[:at] + lines[at + 1 :]))
    less, (path, default) = read_closures(tmp_path / "less.toml"), DEFAULTS[key]
    assert part(less, path) == default != part(full, path)
    # And nothing else is another.
    for other, _ in DEFAULTS.values():
        assert other == path or part(less, other) == part(full, other)
    # What is written of each is read again.
    for each in (full, less):
        write_closures(each, tmp_path / "again.toml")
        assert read_closures(tmp_path / "again.toml") == each


@pytest.mark.parametrize("key", ["name", "schema", "name ", "type", "frame_a", "frame_b", "joint_b"])
def test_what_a_closures_file_needs_is_named(key, tmp_path):
    head, _, rest = FULL.partition("[[closures]]\n") if key == "name " else ("", "", FULL)
    line = next(line for line in rest.splitlines() if line.startswith(key))
    (tmp_path / "less.toml").write_text(head + ("[[closures]]\n" if head else "") + rest.replace(f"{line}\n", "", 1))
    with pytest.raises(FileFormatError, match=key.strip()):
        read_closures(tmp_path / "less.toml")


def test_a_coupling_without_a_first_joint_holds_the_second(tmp_path):
    (tmp_path / "held.toml").write_text(FULL.replace('joint_a = "j"\n', "").replace("[0.0, 2.0]", "[0.3]"))
    _, held = read_closures(tmp_path / "held.toml").closures
    assert (held.frame_a, held.frame_b, held.polynomial) == ("universe", "k", (0.3,))
