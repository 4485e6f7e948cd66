"""The edges of what is read and written of MJCF: sizes, versions, places, moments, efforts, names of files."""

import os
import warnings
import xml.etree.ElementTree as ET
from dataclasses import replace

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from mjcf_arm import arm, flag, read
from rubbing_chains import slide

from exo_pin import FileFormatError, InvalidInput
from exo_pin.chain import ClosedChain, Closures, JointProperties
from exo_pin.chain.formats.joint_data import joint_data
from exo_pin.chain.formats.leaving_out import LeftOut
from exo_pin.chain.formats.mjcf import mjcf_compiling
from exo_pin.chain.formats.mjcf.mjcf_compiling import outline
from exo_pin.chain.formats.mjcf.mjcf_joints import write_inertial
from exo_pin.chain.formats.mjcf.mjcf_reading import _evaluate
from exo_pin.chain.formats.mjcf.mjcf_settling import settle
from exo_pin.chain.formats.mjcf.mjcf_writing import mjcf_text
from exo_pin.chain.structure.description import Shape
from exo_pin.core.errors import MissingExtra

pytestmark = pytest.mark.usefixtures("plain")

INF = np.inf


@pytest.mark.parametrize(
    "text",
    [
        # A replicate counts as often as what is in it; four elements of a kilobyte are around.
        '<worldbody><replicate count="{}"><geom/></replicate></worldbody>',
        '<worldbody><composite count="1 {} 2"/></worldbody>',
        '<worldbody><flexcomp count="-2 {} 1"/></worldbody>',
        '<worldbody><replicate count="many"><replicate count="{}"><body/></replicate></replicate></worldbody>',
        '<worldbody><replicate count="0"><replicate count="{}"><body/></replicate></replicate></worldbody>',
        '<size nuser_geom="{}" nuser_body="49900" njmax="1000000000"/>',
        '<asset><texture width="2000" height="{}"/><mesh count="1000000000"/></asset>',
        '<asset><hfield nrow="{}" ncol="2000"/></asset>',
    ],
)
def test_what_a_file_asks_for_is_counted(text):
    """A hundred megabytes at most: 1e5 elements of a kilobyte, or 1e8 cells."""
    for count, allowed in ((49_900, True), (50_100, False)):
        whole = f"<mujoco>{text.format(count)}</mujoco>"
        if allowed:
            assert outline(whole, None) == ("mujoco", (), ())
            continue
        with pytest.raises(FileFormatError, match=r"more than 1e\+08 bytes of elements"):
            outline(whole, None)


def test_a_file_may_ask_for_all_of_it():
    """Two elements of a kilobyte around, and a replicate with one in it."""
    text = '<mujoco><worldbody><replicate count="{}"><geom/></replicate></worldbody></mujoco>'
    assert outline(text.format(49_999), None)[0] == "mujoco"
    with pytest.raises(FileFormatError, match=r"line 1: mujoco|geom"):
        outline(text.format(50_000), None)


def test_files_that_are_included_are_counted_once_and_their_numbers_read(tmp_path):
    (tmp_path / "leg.xml").write_text(
        '<mujocoinclude><body pos="0.1234 0 1"/><asset><mesh file="bone.stl" refpos="1 0 0"/></asset>'
        '<include file="leg.xml"/><include file="none.xml"/><include/></mujocoinclude>'
    )
    text = '<mujoco><include file="leg.xml"/><include file="leg.xml"/><body pos="0.5 0 0"/></mujoco>'
    assert outline(text, tmp_path) == ("mujoco", ("0.5", "0", "0", "0.1234", "0", "1"), ("bone",))
    # Of text that has no folder nothing is included.
    assert outline(text, None) == ("mujoco", ("0.5", "0", "0"), ())


@pytest.mark.parametrize(
    ("mesh", "moved"),
    [
        ('name="a" file="b.stl" refpos="1 0 0"', ("a",)), ('file="c/b.stl" refquat="0 1 0 0"', ("b",)),
        ('name="a" file="b.stl"', ()), ('name="a" refpos="0 0 1" refquat="0 1 0 0"', ("a",)),
    ],
)  # fmt: skip
def test_meshes_that_mujoco_moves_are_told(mesh, moved):
    assert (
        outline(f'<mujoco><asset><mesh {mesh}/><texture name="t" refpos="1 0 0"/></asset></mujoco>', None)[2] == moved
    )


@pytest.mark.parametrize(
    ("version", "is_read"),
    [("3.9.9", False), ("3.10.0", True), ("3.17.2", True), ("4.99.0rc1", True), ("5.0.0", False), ("2.30.0", False)],
)
def test_versions_of_mujoco_that_are_read(version, is_read, monkeypatch):
    monkeypatch.setattr(mujoco, "__version__", version)
    if is_read:
        assert mjcf_compiling.compile_mjcf(arm()).model.njnt == 3
        return
    with pytest.raises(MissingExtra, match=f">=3.10,<5 .what is installed has version {version}"):
        mjcf_compiling.compile_mjcf(arm())


def test_a_child_of_a_fork_reads_while_its_parent_was_reading():
    with mjcf_compiling.mujoco_warnings(mujoco, []), warnings.catch_warnings():
        # Python warns of forks beside threads; this one takes a lock and ends.
        warnings.simplefilter("ignore", DeprecationWarning)
        child = os.fork()
        if child == 0:
            os._exit(0 if mjcf_compiling._HANDLER.acquire(blocking=False) else 1)
        assert os.waitpid(child, 0)[1] == 0


def test_contacts_are_not_computed_for_the_comparison_of_motions():
    source = mjcf_compiling.compile_mjcf(arm(world='<geom type="plane" size="1 1 1"/>', option=flag("spring")))
    data, flags = mujoco.MjData(source.model), source.model.opt.disableflags
    mujoco.mj_forward(source.model, data)
    contacts, M = data.ncon, _evaluate(source, data)
    assert contacts > 0
    assert (data.ncon, data.nefc, source.model.opt.disableflags) == (0, 0, flags)
    np.testing.assert_allclose(np.diag(M)[-3:], source.model.body_inertia[-1])


@pytest.mark.parametrize("field", ["body", "site", "anchor"])
def test_places_are_within_ten_million_kilometres(field):
    for place, allowed in (("9e9", True), ("-1.1e10", False)):
        parts = {
            "body": {"world": f'<body pos="0 {place} 0"><joint/><geom size="1"/></body>'},
            "site": {"world": f'<site pos="0 {place} 0"/>'},
            "anchor": {"more": f'<equality><connect body1="a" body2="c" anchor="0 {place} 0"/></equality>'},
        }[field]
        # MuJoCo itself warns of what is large.
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)
            if allowed:
                settle(mjcf_compiling.compile_mjcf(arm(**parts)), LeftOut())
                continue
            with pytest.raises(FileFormatError, match=r"expected at most 1e\+10"):
                read(**parts)


def test_plates_are_read_by_mujoco_whatever_their_last_digit():
    """The moment about a plate's normal is the sum of the others, and MuJoCo reads none that is larger by one bit."""
    rng = np.random.default_rng(3)
    for number in range(60):
        one, other = rng.uniform(0.1, 1.0, 2)
        largest = (one + other) * (1.0 + 1e-15 * rng.uniform(-1.0, 2.0))
        body = ET.Element("body", name="plate")
        write_inertial(body, "plate", pin.Inertia(2.0, np.array([0.1, 0.2, 0.3]), np.diag([one, other, largest])))
        (inertial,) = body  # and no comment: nothing is mended but the last digit
        moments = np.array(inertial.get("diaginertia").split(), dtype=float)
        np.testing.assert_allclose(np.sort(moments), np.sort([one, other, largest]), rtol=1e-14)
        assert moments[2] <= moments[0] + moments[1]
        if number < 3:
            ET.SubElement(body, "freejoint")
            text = f"<mujoco><worldbody>{ET.tostring(body, encoding='unicode')}</worldbody></mujoco>"
            np.testing.assert_allclose(mujoco.MjModel.from_xml_string(text).body_inertia[1], moments, rtol=1e-12)


@pytest.mark.parametrize(
    "effort", [(0.0, 0.0), (-3.0, 3.0), (-INF, INF), (0.0, 2.0), (-2.0, 0.0), (-INF, 2.0), (-2.0, INF)]
)
def test_efforts_are_limited_alike_in_both_directions_where_they_were(effort):
    """A joint that cannot push is written as one that pushes by the least double either way."""
    chain = slide(0.4)
    model = chain.model
    model.lowerEffortLimit, model.upperEffortLimit = (np.array([limit]) for limit in effort)
    chain = ClosedChain(model, chain.description)
    again = ClosedChain.from_mjcf(mjcf_text(chain._state, np.zeros(1))).model
    tiny = np.finfo(float).tiny
    assert joint_data(again, ())[1].effort.tolist() == [[min(effort[0], -tiny), max(effort[1], tiny)]]


@pytest.mark.parametrize(
    ("stiffness", "reference", "written"),
    [
        (3.0, None, True), (3.0, (0, 0, 0, 1), True), (3.0, (0, 0, 0, -1), True), (3.0, (0, 0.6, 0, 0.8), False),
        (1.0, (0, 0, 1, 0), False), (0.0, (0, 0, 1, 0), True),
    ],
)  # fmt: skip
def test_the_spring_of_a_ball_is_slack_in_its_neutral_configuration(stiffness, reference, written):
    model = pin.Model()
    model.addJoint(0, pin.JointModelSpherical(), pin.SE3.Identity(), "ball")
    model.appendBodyToJoint(1, pin.Inertia(1.0, np.zeros(3), np.eye(3)), pin.SE3.Identity())
    chain = ClosedChain(model, Closures("ball", joints=(JointProperties("ball", stiffness, reference),)))
    if not written:
        with pytest.raises(InvalidInput, match="MJCF cannot hold the spring reference of joint 'ball'"):
            mjcf_text(chain._state, chain.neutral())
        return
    again = ClosedChain.from_mjcf(mjcf_text(chain._state, chain.neutral()))
    q = pin.integrate(chain.model, chain.neutral(), np.array([0.3, -0.2, 0.1]))
    for each in (chain, again):
        assert each._state.passive.energy(q) == pytest.approx(0.5 * stiffness * 0.14)


APART = '<equality><{0} name="tie" site1="one" site2="two"/></equality>'


@pytest.mark.parametrize(("kind", "apart", "turned", "held"), [
    ("connect", 0.0, 0.0, True), ("connect", 1e-6, 0.0, False), ("connect", 0.0, 0.5, True),
    ("weld", 0.0, 0.0, True), ("weld", 1e-6, 0.0, False), ("weld", 0.0, 1e-6, False),
])  # fmt: skip
def test_an_equality_within_one_body_holds_if_its_places_are_one(kind, apart, turned, held):
    sites = '<site name="one" pos="0.1 0 0"/>'
    sites += f'<body pos="0.1 0 0"><site name="two" pos="{apart} 0 0" euler="{turned} 0 0"/></body>'
    parts = {"ina": sites, "more": APART.format(kind)}
    if held:
        chain = read(**parts)
        assert chain.closures == ()
        assert "rigid: equality 'tie' joins two frames of one rigid body (no effect: " in " ".join(
            chain.description.left_out
        )
        return
    with pytest.raises(FileFormatError, match="equality 'tie' joins two places of one rigid body that are apart"):
        read(**parts)


@pytest.mark.parametrize(
    ("geom", "colour"),
    [
        ("", None), ('rgba="0.5 0.5 0.5 1"', None), ('rgba="0.5 0.5 0.5 0.9"', (0.5, 0.5, 0.5, 0.9)),
        ('material="blue"', (0.0, 0.0, 1.0, 1.0)), ('material="blue" rgba="1 0 0 1"', (1.0, 0.0, 0.0, 1.0)),
    ],
)  # fmt: skip
def test_the_colour_of_a_geom_is_its_own_or_its_materials(geom, colour):
    text = f"""<mujoco><asset><material name="red" rgba="1 0 0 1"/><material name="blue" rgba="0 0 1 1"/></asset>
    <worldbody><body><joint/><geom size="1" {geom}/></body></worldbody></mujoco>"""
    (shape,) = ClosedChain.from_mjcf(text).description.shapes
    assert shape.colour == colour


@pytest.mark.parametrize(
    ("geom", "role"),
    [
        ("", "both"), ('contype="0"', "both"), ('conaffinity="0"', "both"), ('contype="0" conaffinity="0"', "visual"),
        ('group="2"', "both"), ('group="3"', "collision"), ('group="3" contype="0" conaffinity="0"', "collision"),
    ],
)  # fmt: skip
def test_a_geom_is_drawn_if_mujoco_shows_it_and_touches_if_it_may(geom, role):
    text = f'<mujoco><worldbody><body><joint/><geom size="1" {geom}/></body></worldbody></mujoco>'
    chain = ClosedChain.from_mjcf(text)
    (shape,) = chain.description.shapes
    assert (shape.role, shape.kind, shape.size) == (role, "sphere", (1.0,))
    written = mjcf_text(chain._state, chain.neutral())
    assert ("A chain has no contact" in written) == ('contact="disable"' in written) == (role != "visual")
    assert ClosedChain.from_mjcf(written).description.shapes == (shape,)


def test_shapes_of_every_kind_have_their_sizes_in_mujoco():
    chain, sizes = slide(0.4), {
        "box": ((0.2, 0.4, 0.6), (0.1, 0.2, 0.3)), "sphere": ((0.3,), (0.3,)), "cylinder": ((0.1, 0.8), (0.1, 0.4)),
        "capsule": ((0.2, 0.6), (0.2, 0.3)), "ellipsoid": ((0.1, 0.2, 0.3), (0.1, 0.2, 0.3)),
    }  # fmt: skip
    link = next(frame.name for frame in chain.model.frames if frame.type == pin.FrameType.BODY and frame.parentJoint)
    shapes = tuple(Shape(link, kind, size) for kind, (size, _) in sizes.items())
    chain = ClosedChain(chain.model, replace(chain.description, shapes=shapes))
    model = mujoco.MjModel.from_xml_string(mjcf_text(chain._state, np.zeros(1)))
    for geom, (kind, (_, size)) in enumerate(sizes.items()):
        assert mujoco.mjtGeom(int(model.geom_type[geom])).name == f"mjGEOM_{kind.upper()}"
        np.testing.assert_allclose(model.geom_size[geom][: len(size)], size)
    again = ClosedChain.from_mjcf(mjcf_text(chain._state, np.zeros(1))).description.shapes
    assert [(shape.kind, shape.size) for shape in again] == [(kind, size) for kind, (size, _) in sizes.items()]


def test_geoms_that_touch_nothing_are_no_contact():
    for given, option, said in (("", "", True), ("", flag("contact"), False), ("", flag("constraint"), False)):
        left = read(option=option).description.left_out
        assert any(text.startswith("contact: 3 geoms") for text in left) == said, given
