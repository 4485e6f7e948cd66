"""The edges of what is read and written of MJCF: sizes, versions, places, moments, efforts, names of files."""

import warnings

import numpy as np
import pinocchio as pin
import pytest
from mjcf_arm import flag, read
from rubbing_chains import slide
from written_robots import text_of

from exo_pin import FileFormatError, InvalidInput
from exo_pin.chain import ClosedChain, Closures, JointProperties

pytestmark = pytest.mark.usefixtures("plain")

INF = np.inf


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
                assert read(**parts).model.nv > 0
                continue
            with pytest.raises(FileFormatError, match=r"expected at most 1e\+10"):
                read(**parts)


@pytest.mark.parametrize(
    "effort", [(0.0, 0.0), (-3.0, 3.0), (-INF, INF), (0.0, 2.0), (-2.0, 0.0), (-INF, 2.0), (-2.0, INF)]
)
def test_efforts_are_limited_alike_in_both_directions_where_they_were(effort):
    """A joint that cannot push is written as one that pushes by the least double either way."""
    chain = slide(0.4)
    model = chain.model
    model.lowerEffortLimit, model.upperEffortLimit = (np.array([limit]) for limit in effort)
    chain = ClosedChain(model, chain.description)
    again = ClosedChain.from_mjcf(text_of(chain, "mjcf", np.zeros(1))).model
    tiny = np.finfo(float).tiny
    limits = again.lowerEffortLimit[0], again.upperEffortLimit[0]
    found = [limit if abs(limit) < 1e300 else np.copysign(INF, limit) for limit in limits]
    assert found == [min(effort[0], -tiny), max(effort[1], tiny)]


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
            text_of(chain, "mjcf", chain.neutral())
        return
    again = ClosedChain.from_mjcf(text_of(chain, "mjcf", chain.neutral()))
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
    text = text_of(chain, "mjcf", chain.neutral())
    assert ("A chain has no contact" in text) == ('contact="disable"' in text) == (role != "visual")
    assert ClosedChain.from_mjcf(text).description.shapes == (shape,)


def test_geoms_that_touch_nothing_are_no_contact():
    for given, option, said in (("", "", True), ("", flag("contact"), False), ("", flag("constraint"), False)):
        left = read(option=option).description.left_out
        assert any(text.startswith("contact: 3 geoms") for text in left) == said, given
