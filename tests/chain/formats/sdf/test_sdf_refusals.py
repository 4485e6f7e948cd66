"""What of SDF is read, left out by name, or refused by name."""

import warnings

import numpy as np
import pinocchio as pin
import pytest
from sdf_arm import ARM, ELBOW, SHOULDER
from sdf_mutations import mutated_sdf
from sdf_oracle import DrakeSdf

from exo_pin import FileFormatError, UnknownName
from exo_pin.chain import ClosedChain


def read(old="", new="", text=ARM):
    assert old in text
    return ClosedChain.from_sdf(text.replace(old, new, 1) if old else text)


def test_a_small_arm():
    chain = read()
    assert list(chain.model.names)[1:] == ["shoulder", "elbow"]
    assert chain.closures == ()
    assert chain.roles.actuated == ("shoulder", "elbow")
    # The specification's mass and inertia where the file states none.
    assert [inertia.mass for inertia in chain.model.inertias] == [1.0, 2.0, 1.0]
    np.testing.assert_array_equal(chain.model.inertias[2].inertia, np.eye(3))
    np.testing.assert_allclose(chain.placement(chain.neutral(), "tip").translation, [0.5, 0, 1])
    assert read('<axis><xyz>1 0 0</xyz>', '<axis><xyz>1 0 0</xyz><limit><effort>0</effort></limit>').roles.actuated == (
        "shoulder",
    )  # fmt: skip


def test_worlds_with_several_models():
    model = ARM[ARM.index("<model") : ARM.index("</sdf>")]
    free = '<model name="ball"><pose>1 2 3 0 0 0</pose><link name="core"/></model>'
    tie = '<joint name="tie" type="ball"><parent>arm::tip</parent><child>ball::core</child></joint>'
    text = f'<sdf version="1.10"><world name="w"><gravity>0 0 -1.6</gravity>{model}{free}</world></sdf>'
    chain = ClosedChain.from_sdf(text)
    assert list(chain.model.names)[1:] == ["arm::shoulder", "arm::elbow", "root_joint"]
    np.testing.assert_array_equal(chain.model.gravity.linear, [0, 0, -1.6])
    np.testing.assert_allclose(chain.placement(chain.neutral(), "ball::core").translation, [1, 2, 3])
    tied = ClosedChain.from_sdf(text.replace("</world>", f"{tie}</world>"))
    assert list(tied.model.names)[1:] == ["arm::shoulder", "arm::elbow", "tie"]
    twice = ClosedChain.from_sdf(text.replace("</world>", f"{free.replace('ball', 'cube')}</world>"))
    assert [name for name in twice.model.names if "root" in name] == ["ball::core_root_joint", "cube::core_root_joint"]
    plain = ClosedChain.from_sdf(text.replace("<gravity>0 0 -1.6</gravity>", ""))
    np.testing.assert_array_equal(plain.model.gravity.linear, [0, 0, -9.8])


def test_mimic_and_two_axes():
    damped = "<dynamics><damping>2</damping></dynamics>"
    cross = f"<axis><xyz>0 1 0</xyz></axis><axis2><xyz>1 0 0</xyz>{damped}</axis2>"
    text = ARM.replace('"shoulder" type="revolute"', '"shoulder" type="universal"').replace(SHOULDER, cross)
    follow = (
        '<axis><xyz>1 0 0</xyz><mimic joint="shoulder" axis="axis2"><multiplier>3</multiplier><offset>0.1</offset>'
        "<reference>0.2</reference></mimic></axis>"
    )
    chain = ClosedChain.from_sdf(text.replace(ELBOW, follow))
    assert list(chain.model.names)[1:] == ["shoulder_axis", "shoulder_axis2", "elbow"]
    assert chain.model.damping.tolist() == [0, 2, 0]
    (coupling,) = chain.closures
    assert (coupling.frame_a, coupling.frame_b) == ("shoulder_axis2", "elbow")
    np.testing.assert_allclose(chain.residual([0.0, 0.7, 1.0]), [1.0 - 3 * (0.7 - 0.2) - 0.1])


def test_what_is_left_out_is_listed():
    more = "<link name='base'><sensor name='s' type='imu'/><collision name='c'><geometry/></collision></link>"
    chain = read('<link name="base"/>', more)
    assert [text.partition(" (")[0] for text in chain.description.left_out] == [
        "programs: <sensor> in <link>", "contact: <collision> in <link>",
    ]  # fmt: skip
    with pytest.warns(RuntimeWarning, match="<drake:rotor_inertia> in <joint>, of other programs"):
        read("</joint>", '<drake:rotor_inertia xmlns:drake="d">1</drake:rotor_inertia></joint>')


def test_old_versions_mean_what_they_meant():
    """Up to 1.4 axes are the model's, up to 1.5 physics has gravity, up to 1.6 a joint may be called as a link."""
    turned = "<pose>0 0 1 0 0 1.5707963267948966</pose>"
    text = (
        ARM.replace(' relative_to="upper"', "")
        .replace(' attached_to="fore"', "")
        .replace("<pose>0 0 1 0 0 0</pose>", turned)
    )
    old = ClosedChain.from_sdf(text.replace('"1.9"', '"1.4"'))
    new = ClosedChain.from_sdf(text.replace("<xyz>", '<xyz expressed_in="__model__">'))
    plain = ClosedChain.from_sdf(text)
    q = np.array([0.3, 0.4])
    places = [each.placement(q, "upper").rotation for each in (old, new, plain)]
    np.testing.assert_allclose(places[0], places[1], atol=1e-15)
    assert np.abs(places[0] - places[2]).max() > 0.1
    both = text.replace('"1.9"', '"1.6"').replace('joint name="elbow"', 'joint name="fore"')
    named = ClosedChain.from_sdf(both)
    assert list(named.model.names)[1:] == ["shoulder", "fore_joint"]
    assert "renamed: joint 'fore' is 'fore_joint'" in named.description.left_out[0]
    model = text[text.index("<model") : text.index("</sdf>")]
    world = f'<world name="w"><physics type="ode"><gravity>0 0 -1</gravity></physics>{model}</world>'
    for version, gravity in (("1.5", -1.0), ("1.6", -9.8)):
        found = ClosedChain.from_sdf(f'<sdf version="{version}">{world}</sdf>').model.gravity.linear
        assert found.tolist() == [0, 0, gravity]


@pytest.mark.parametrize(
    ("geometry", "mass", "moments"),
    [
        ("<box><size>1 2 3</size></box>", 6000.0, np.array([13, 10, 5]) * 500.0),
        ("<sphere><radius>0.5</radius></sphere>", 1000 * np.pi / 6, np.full(3, 100 * np.pi / 6)),
        (
            "<cylinder><radius>0.5</radius><length>2</length></cylinder>",
            500 * np.pi,
            np.array([0.25 / 4 + 4 / 12, 0.25 / 4 + 4 / 12, 0.125]) * 500 * np.pi,
        ),
        ("<ellipsoid><radii>1 2 3</radii></ellipsoid>", 8000 * np.pi, np.array([13, 10, 5]) * 1600 * np.pi),
    ],
)
def test_inertia_of_the_collision_shapes(geometry, mass, moments):
    shape = f'<collision name="c"><pose>1 0 0 0 0 0</pose><geometry>{geometry}</geometry></collision>'
    for inertial, share in (
        ('<inertial auto="true"/>', 1.0), ('<inertial auto="true"><density>500</density></inertial>', 0.5),
        ('<inertial auto="true"><mass>3</mass></inertial>', 3.0 / mass),
    ):  # fmt: skip
        link = f'<link name="base"/><link name="core">{shape}{inertial}</link>'
        own = read('<link name="base"/>', link).model.inertias[-1]
        assert own.mass == pytest.approx(share * mass)
        np.testing.assert_allclose(own.lever, [1, 0, 0])
        np.testing.assert_allclose(own.inertia, share * np.diag(moments), rtol=1e-12, atol=1e-9)


def test_what_changes_the_mechanism_is_left_out_by_name_alone():
    for name, old, new in (
        ("gravcomp", '<link name="base"/>', '<link name="base"><gravity>0</gravity></link>'),
        ("kinematic", '<link name="base"/>', '<link name="base"><kinematic>1</kinematic></link>'),
        ("includes", "</model>", "<include><uri>model://hand</uri></include></model>"),
        ("fluid", "</model>", "<enable_wind>true</enable_wind></model>"),
        ("joint_types", '"elbow" type="prismatic"', '"elbow" type="screw"'),
    ):
        with pytest.raises(FileFormatError, match=rf'leave_out=\["{name}"\]'):
            read(old, new)
        chain = ClosedChain.from_sdf(ARM.replace(old, new), leave_out=[name])
        assert any(entry.startswith(f"{name}: ") for entry in chain.description.left_out)


def test_a_static_model_stands_and_a_fixed_joint_across_another_holds_it(tmp_path):
    table = '<model name="table"><static>true</static><link name="top"/><link name="leg"/></model>'
    model = ARM[ARM.index("<model") : ARM.index("</sdf>")]
    chain = ClosedChain.from_sdf(f'<sdf version="1.9"><world name="w">{table}{model}</world></sdf>')
    assert list(chain.model.names)[1:] == ["arm::shoulder", "arm::elbow"]
    hold = '<joint name="hold" type="fixed"><parent>upper</parent><child>fore</child></joint></model>'
    held = read("</model>", hold)
    assert [(loop.name, loop.type) for loop in held.closures] == [("hold", "rigid")]
    assert held.mobility(held.neutral()).degrees_of_freedom == 1
    again = ClosedChain.from_sdf(held.to_sdf(tmp_path))
    assert [(loop.name, loop.type) for loop in again.closures] == [("hold", "rigid")]


@pytest.mark.parametrize("name", ["elbow_axis2", "root_joint"])
def test_joints_that_would_have_one_name_in_the_chain_are_refused(name):
    # The spring of the one would act in the other.
    sprung = "<axis><xyz>0 1 0</xyz><dynamics><spring_stiffness>7</spring_stiffness></dynamics></axis>"
    text = ARM.replace('"shoulder"', f'"{name}"').replace(SHOULDER, sprung).replace("prismatic", "universal")
    text = text.replace(ELBOW, f"{ELBOW}<axis2><xyz>0 0 1</xyz></axis2>")
    weld = text[text.index('<joint name="weld"') : text.index(f'<joint name="{name}"')]
    free = text.replace(weld, "")
    with pytest.raises(FileFormatError, match=f"the chain has two joints '{name}': rename this one"):
        ClosedChain.from_sdf(free)
    assert ClosedChain.from_sdf(free.replace(f'"{name}"', '"other"')).description.joints[0].joint == "other"


def test_other_bad_input(tmp_path):
    with pytest.raises(UnknownName, match="free_flyer"):
        ClosedChain.from_sdf(ARM, root_joint="hinge")
    with pytest.raises(FileFormatError, match=r"nowhere\.sdf"):
        ClosedChain.from_sdf(tmp_path / "nowhere.sdf")
    with pytest.raises(
        FileFormatError, match=r"got <gazebo>, of version 1\.2 and before: convert the file \(gz sdf -p\)"
    ):
        ClosedChain.from_sdf("<gazebo version='1.2'/>")
    with pytest.raises(FileFormatError, match=r"\(XML needs quotes about the values of attributes\)"):
        ClosedChain.from_sdf("<sdf version='1.9'><model name=arm><link name='a'/></model></sdf>")
    with pytest.raises(FileFormatError, match="expected the root element <sdf>, got <robot>"):
        ClosedChain.from_sdf("<robot name='r'/>")
    with pytest.raises(FileFormatError, match="no document type"):
        ClosedChain.from_sdf("<!DOCTYPE sdf><sdf version='1.9'/>")
    with pytest.raises(FileFormatError, match="at least one link"):
        ClosedChain.from_sdf("<sdf version='1.9'><model name='m'/></sdf>")


@pytest.mark.parametrize(
    "seeds", [range(60), *(pytest.param(range(k, k + 200), marks=pytest.mark.full) for k in range(60, 2000, 200))]
)
def test_a_mutated_file_means_what_drake_reads_or_is_refused(seeds):
    read = 0
    for seed in seeds:
        text = mutated_sdf(seed)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)
            try:
                chain = ClosedChain.from_sdf(text)
            except FileFormatError:
                continue
        read += 1
        model = chain.model
        names = [frame.name.split("::")[-1] for frame in model.frames]
        if len(set(names)) < len(names):
            continue  # Drake's names cannot be told apart
        if not model.nv or any(closure.name.endswith("_closure") for closure in chain.closures):
            continue
        try:
            drake = DrakeSdf(text, chain)
        except RuntimeError:
            continue  # Drake refuses some that have a meaning, as a ball joint from the child to the parent
        q = pin.integrate(model, chain.neutral(), np.random.default_rng(seed).uniform(-1.0, 1.0, model.nv))
        M, _ = drake.mass_and_gravity(q)
        upper = np.triu(np.reshape(pin.crba(model, model.createData(), q), (model.nv, model.nv)))
        np.testing.assert_allclose(
            upper + np.triu(upper, 1).T, M, rtol=0, atol=1e-9 * np.abs(M).max(), err_msg=str(seed)
        )
    assert read > len(seeds) / 5
