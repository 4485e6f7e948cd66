"""Parts of an SDF by hand: truth values, what has no effect, quaternions, empty names, trees without the world."""

import itertools

import numpy as np
import pinocchio as pin
import pytest
from said_of_files import SAID
from scipy.spatial.transform import Rotation

from exo_pin import FileFormatError
from exo_pin.chain import ClosedChain, Closure, Closures


def test_what_is_left_out_is_counted_and_pictures_are_not():
    sensor = '<sensor name="{}" type="imu"/>'
    inside = sensor.format("a") + sensor.format("b") + '<visual name="v"/><visual name="w"/><collision name="c"/>'
    chain = ClosedChain.from_sdf(f'<sdf version="1.9"><model name="m"><link name="l">{inside}</link></model></sdf>')
    assert [text.partition(" (")[0] for text in chain.description.left_out][:2] == [
        "programs: <sensor> in <link>, 2 times", "contact: <collision> in <link>",
    ]  # fmt: skip


@pytest.mark.parametrize(
    "name", ['<model name="">', '<link name=""/>', '<link name="__l"/>', '<link name="__model__"/>']
)
def test_names_that_are_none_are_refused(name):
    text = '<sdf version="1.9"><model name="m"><link name="l"/></model></sdf>'
    old = '<model name="m">' if "model name" in name else '<link name="l"/>'
    with pytest.raises(FileFormatError, match=r"is empty|reserved name"):
        ClosedChain.from_sdf(text.replace(old, name))


@pytest.mark.parametrize(("given", "words", "said"), SAID["sdf_poses"])
def test_poses_are_angles_or_quaternions_of_length_one(given, words, said):
    text = f'<sdf version="1.9"><model name="m"><link name="l"><pose {given}>{words}</pose></link></model></sdf>'
    if said is not None:
        with pytest.raises(FileFormatError, match=said):
            ClosedChain.from_sdf(text)
        return
    place, values = ClosedChain.from_sdf(text).model.jointPlacements[1], [float(word) for word in words.split()]
    turn = values[3:] or [0.0] * 3
    in_degrees = "true" in given or 'degrees="1"' in given
    turned = Rotation.from_quat(turn) if "quat" in given else Rotation.from_euler("xyz", turn, in_degrees)
    np.testing.assert_allclose(place.rotation, turned.as_matrix(), atol=1e-15)
    np.testing.assert_array_equal(place.translation, values[:3] or [0.0] * 3)


def hinges(pairs):
    return "".join(
        f'<joint name="{a}{b}" type="revolute"><parent>{a}</parent><child>{b}</child><axis/></joint>' for a, b in pairs
    )


@pytest.mark.parametrize(
    ("names", "pairs", "bases"),
    [
        # Of bodies without a joint to the world the one that is no joint's child hangs on it.
        ("abc", ["ab", "bc"], ["a"]), ("abc", ["bc", "ab"], ["a"]), ("cba", ["ab", "bc"], ["a"]),
        ("abc", ["cb", "ba"], ["c"]),
        # All in a circle: the last joint closes the loop, and the first body of the others is that.
        ("abc", ["ab", "bc", "ca"], ["a"]), ("abc", ["bc", "ca", "ab"], ["b"]),
        ("abcd", ["ab", "cd"], ["a", "c"]), ("abcd", ["ab", "dc"], ["a", "d"]), ("abc", ["wa", "bc"], ["b"]),
        ("abc", ["ab"], ["a", "c"]), ("abc", ["ac", "bc"], ["a"]),
    ],
)  # fmt: skip
def test_what_hangs_on_the_world(names, pairs, bases):
    links = "".join(f'<link name="{name}"/>' for name in names)
    joints = hinges(pairs).replace("<parent>w</parent>", "<parent>world</parent>")
    chain = ClosedChain.from_sdf(f'<sdf version="1.9"><model name="m">{links}{joints}</model></sdf>')
    found = [name for name in chain.model.names if name.endswith("root_joint")]
    assert found == (["root_joint"] if len(bases) == 1 else [f"{base}_root_joint" for base in bases])
    for name, base in zip(found, bases, strict=True):
        link = chain.model.frames[chain.model.getFrameId(base)]
        assert chain.model.names[link.parentJoint] == name
    # A tree has as many joints as bodies on others.
    assert len(chain.closures) == max(len(pairs) - len(names) + len(bases), 0) == (1 if len(pairs) == 3 else 0)


def test_of_links_that_are_fixed_to_each_other_the_first_gives_its_name():
    links = "".join(f'<link name="{name}"/>' for name in "abc")
    weld = '<joint name="w" type="fixed"><parent>b</parent><child>a</child></joint>'
    for order in itertools.permutations([weld, hinges(["bc"])]):
        chain = ClosedChain.from_sdf(f'<sdf version="1.9"><model name="m">{links}{"".join(order)}</model></sdf>')
        assert list(chain.model.names)[1:] == ["root_joint", "bc"]
        assert [inertia.mass for inertia in chain.model.inertias] == [0.0, 2.0, 1.0]


@pytest.mark.parametrize("leader", [0.0, 0.4])
@pytest.mark.parametrize("polynomial", [(0.0, 1.0), (0.3, -2.0)])
def test_a_coupling_counts_from_where_the_file_stands(polynomial, leader, tmp_path):
    model = pin.Model()
    for k in range(2):
        model.addJoint(k, pin.JointModelRX(), pin.SE3(np.eye(3), np.array([0.0, 0.3 * k, 0.0])), f"hinge_{k}")
        model.appendBodyToJoint(k + 1, pin.Inertia(1.0, np.zeros(3), np.eye(3)), pin.SE3.Identity())
        model.addFrame(pin.Frame(f"link_{k}", k + 1, 0, pin.SE3.Identity(), pin.FrameType.BODY))
    gear = Closure("gear", "coupling", "hinge_0", "hinge_1", polynomial=polynomial, references=(0.1, 0.2))
    chain = ClosedChain(model, Closures("geared", closures=(gear,)))
    q = np.array([leader, 0.2 + polynomial[0] + polynomial[1] * (leader - 0.1)])
    again = ClosedChain.from_sdf(chain.to_sdf(tmp_path, q))
    for moved in (-0.7, 0.0, 1.1):
        there = np.array([moved, polynomial[1] * moved])
        np.testing.assert_allclose(chain.residual(q + there), 0.0, atol=1e-15)
        np.testing.assert_allclose(again.residual(there), 0.0, atol=1e-15)
        for each, at in ((chain, q + there), (again, there)):
            np.testing.assert_allclose(np.abs(each.residual(at + np.array([0.0, 0.25]))), 0.25, atol=1e-15)


@pytest.mark.parametrize("tag", ["parent", "child"])
@pytest.mark.parametrize("relative", ["", "ab"])
def test_a_joint_has_two_ends(tag, relative):
    links = f'<link name="a"/><link name="b"><pose relative_to="{relative}">0 0 0 0 0 0</pose></link><link name="c"/>'
    text = f'<sdf version="1.9"><model name="m">{links}{hinges(["ab"]).replace("<child>b", "<child>c")}</model></sdf>'
    assert ClosedChain.from_sdf(text).model.njoints > 1
    end = "<parent>a</parent>" if tag == "parent" else "<child>c</child>"
    with pytest.raises(FileFormatError, match=f"joint 'ab': <{tag}> is missing"):
        ClosedChain.from_sdf(text.replace(end, ""))
    with pytest.raises(FileFormatError, match="there is no link, joint, frame or model ''"):
        ClosedChain.from_sdf(text.replace(end, f"<{tag}/>"))


@pytest.mark.parametrize(
    ("inside", "given", "link"),
    [
        ('<link name="a"/><link name="b"/>', "", "in::a"),
        ('<link name="a"/><link name="b"/>', 'canonical_link="b"', "in::b"),
        ('<model name="deep"><link name="c"/><link name="d"/></model>', "", "in::deep::c"),
        ('<model name="deep"><link name="c"/></model><link name="b"/>', "", "in::b"),
        ('<model name="deep"><link name="c"/></model><link name="b"/>', 'canonical_link="deep::c"', "in::deep::c"),
        ('<model name="empty"/>', "", None), ("", "", None),
    ],
    ids=range(7),
)  # fmt: skip
def test_a_joint_to_a_model_is_on_its_canonical_link(inside, given, link):
    """The one that it names, or else the first of its own, or else of the first model in it."""
    inner = f'<model name="in" {given}><pose>1 0 0 0 0 0</pose>{inside}</model>'
    tie = '<joint name="tie" type="revolute"><parent>base</parent><child>in</child><axis/></joint>'
    text = f'<sdf version="1.9"><model name="m"><link name="base"/>{inner}{tie}</model></sdf>'
    if link is None:
        with pytest.raises(FileFormatError, match="expected at least one link"):
            ClosedChain.from_sdf(text)
        return
    chain = ClosedChain.from_sdf(text)
    carried = chain.model.frames[chain.model.getFrameId(link)]
    assert chain.model.names[carried.parentJoint] == "tie"
    place = chain.placement(chain.neutral(), "tie").translation - chain.placement(chain.neutral(), "base").translation
    np.testing.assert_allclose(place, [1.0, 0.0, 0.0], atol=1e-15)
