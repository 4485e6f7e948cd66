"""Where a chain refuses, warns, sticks or rests is the same in any units of length and of mass."""

import numpy as np
import pytest
from mechanisms import four_bar
from other_units import Units

from exo_pin import ExoPinError
from exo_pin.chain import ClosedChain, Closure, Closures, Placement

#: Powers of two, so that the digits of all numbers stay.
UNITS = [Units(2.0**6, 2.0**-4), Units(2.0**-6, 2.0**5)]
both_units = pytest.mark.parametrize("units", UNITS, ids=("large", "small"))
ANGLES = 10.0 ** np.arange(-1.0, -13.0, -0.5)


def outcome(call, *given, **named):
    """What a call returns, or the type of its error."""
    try:
        return call(*given, **named)
    except ExoPinError as error:
        return type(error)


LINK = """<link name="{}"><inertial><origin xyz="0.05 0 0"/><mass value="1"/>
<inertia ixx="1e-4" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/></inertial></link>"""
JOINT = """<joint name="{}" type="{}"><parent link="{}"/><child link="{}"/><origin xyz="{!r} 0 0"/><axis xyz="{}"/>
<limit lower="-6.3" upper="6.3" effort="9" velocity="9"/></joint>"""


def built(joints, closure):
    """A chain of joints, each a name, type, parent, link, distance from the parent and axis."""
    links = '<link name="ground"/>' + "".join(LINK.format(link) for _, _, _, link, _, _ in joints)
    text = f'<robot name="some">{links}{"".join(JOINT.format(*joint) for joint in joints)}</robot>'
    return ClosedChain.from_urdf(text, Closures("some", closures=(closure,)))


def crank_slider(angle, lengths=(0.1, 0.3), cut="spherical"):
    """A crank and a coupler that push a slide along x, at an angle of the crank; weight along (-4, -9).

    With a rigid cut an end hangs on the coupler by one hinge more, so that the loop has a row in radians.
    """
    crank, coupler = lengths
    back = -np.arcsin(np.sin(angle) * crank / coupler)
    places = {"crank_hinge": angle, "coupler_hinge": back - angle, "end_hinge": -back}
    places["slide"] = crank * np.cos(angle) + coupler * np.cos(back)
    chained = [("crank", "ground", 0.0), ("coupler", "crank", crank), ("end", "coupler", coupler)]
    joints = [
        (f"{link}_hinge", "revolute", parent, link, along, "0 0 1")
        for link, parent, along in (chained if cut == "rigid" else chained[:2])
    ]
    at = Placement((0.0, 0.0, 0.0))
    last, there = ("end", at) if cut == "rigid" else ("coupler", Placement((coupler, 0.0, 0.0)))
    slide = ("slide", "prismatic", "ground", "block", 0.0, "1 0 0")
    chain = built([*joints, slide], Closure("pin", cut, last, "block", there, at))
    model = chain.model.copy()
    model.gravity.linear = np.array([-4.0, -9.0, 0.0])
    return ClosedChain(model, chain.description), np.array([places[str(name)] for name in list(model.names)[1:]])


def crossed_slides(angle):
    """Two slides that meet at a point, at an angle: at zero the loop loses a row."""
    axes = {"one": "1 0 0", "other": f"{np.cos(angle):.17g} {np.sin(angle):.17g} 0"}
    at = Placement((0.0, 0.0, 0.3))
    joints = [(f"slide_{name}", "prismatic", "ground", name, 0.0, axis) for name, axis in axes.items()]
    return built(joints, Closure("point", "spherical", "one", "other", at, at))


@both_units
def test_ranks_of_hardly_open_loops(units):
    # Open by 5e-11 m, hence of a rank that depends on the opening.
    for angle in ANGLES[14::2]:
        chain = crossed_slides(angle)
        other, v = units.chain(chain), np.array([1.0, -0.3])
        q, far = np.array([5e-11, 0.0]), units.metre * np.array([5e-11, 0.0])
        assert other.mobility(far).rank == chain.mobility(q).rank
        one = chain.project_velocity(q, v)
        np.testing.assert_allclose(other.project_velocity(far, units.metre * v) / units.metre, one, atol=1e-6)
        calls = [
            lambda chain, q: chain.dependent_motion(q, ["slide_one"], [0.0])[0].tolist(),
            lambda chain, q: len(chain.split(q).independent),
            lambda chain, q: chain.inverse_dynamics(q, actuated=["slide_one"]).undetermined,
            lambda chain, q: np.isfinite(chain.forward_dynamics(q).a).all(),
        ]
        for call in calls:
            assert outcome(call, other, far) == outcome(call, chain, q)


@both_units
@pytest.mark.parametrize("cut", ["spherical", "rigid"])
@pytest.mark.parametrize("name", ["slide", "crank_hinge"])
def test_forces_beside_a_dead_centre(units, cut, name):
    seen = set()
    for angle in ANGLES[::2]:
        # Crank and coupler in a line, which the slide cannot hold; or the coupler across the slide, which it locks.
        turn = angle if name == "slide" else np.arcsin(np.cos(angle) / 3.0)
        chain, q = crank_slider(turn, (0.1, 0.3) if name == "slide" else (0.3, 0.1), cut)
        other, far = units.chain(chain), q * units.motion(chain)
        one = outcome(chain.inverse_dynamics, q, actuated=[name])
        found = outcome(other.inverse_dynamics, far, actuated=[name])
        if isinstance(one, type):
            assert found is one
            seen.add(one)
            continue
        effort = one.effort(name)[0]
        factor = units.force(chain)[chain.velocity_indices([name])[0]]
        assert found.effort(name)[0] / factor == pytest.approx(effort, rel=1e-5)
        expected = [text.replace(f"{effort:.4g} in", f"{factor * effort:.4g} in") for text in one.cautions]
        if expected:
            assert [text.split("the largest")[0] for text in found.cautions] == ["the forces are ill-conditioned: "]
            assert found.cautions[0].split("because")[1] == expected[0].split("because")[1]
        assert len(found.cautions) == len(expected)
        seen.add(len(expected))
    assert len(seen) > 1


@both_units
@pytest.mark.parametrize("metric", ["closures", "reactions"])
def test_metrics_of_self_stresses_are_forces(units, metric):
    named = four_bar("link")
    chain = named.chain()
    one, other = chain.inverse_dynamics(named.q), units.chain(chain).inverse_dynamics(named.q)
    scale = units.multipliers(chain)
    found = other.equations.metric(scale * one.multipliers, scale[:, None] * one.self_stresses, metric)
    expected = one.equations.metric(one.multipliers, one.self_stresses, metric)
    np.testing.assert_allclose(found / units.newton, expected, rtol=1e-9, atol=1e-12)
