"""Links that are welded to the arm's: their mass stays theirs, through a file of each kind."""

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from exo_pin.chain import ClosedChain, Closures, Roles
from exo_pin.chain.formats.bodies import welded_to_arm, without
from exo_pin.chain.formats.urdf.urdf_writing import COLOURS, Body, Document


def body(rng, mass):
    spread = rng.normal(size=(3, 3)) * 0.05
    spread = mass * (spread @ spread.T + 1e-3 * np.eye(3))
    return Body(mass, rng.normal(size=3) * 0.1, np.trace(spread) * np.eye(3) - spread)


def chain_of(arm="arm", arm_mass=2.0, masses=(0.3, 0.0)):
    """Upper arm, forearm on it by a hinge; a cuff with mass and a mark without are welded to the upper arm."""
    rng = np.random.default_rng(240)
    document = Document("arms")
    document.link("trunk", None)
    document.link("arm", body(rng, arm_mass) if arm_mass else None)
    document.joint("shoulder", "revolute", "trunk", "arm", np.zeros(3), (0.0, 1.0, 0.0), [-3, 3])
    document.link("forearm", body(rng, 1.0))
    document.joint("elbow", "revolute", "arm", "forearm", np.array([0.0, 0.0, -0.3]), (0.0, 1.0, 0.0), [-3, 3])
    turns, places = Rotation.random(2, rng), rng.normal(size=(2, 3)) * 0.1
    for k, name in enumerate(("cuff", "mark")):
        document.link(name, body(rng, masses[k]) if masses[k] else None)
        document.joint(f"{name}_weld", "fixed", "arm", name, places[k], (1.0, 0.0, 0.0), rotation=turns[k].as_matrix())
    roles = Roles(arm=arm) if arm else Roles()
    return ClosedChain.from_urdf(document.text(), Closures("arms", roles=roles)), turns, places


def test_the_link_with_mass_is_found_where_it_was_welded():
    chain, turns, places = chain_of()
    (found,) = welded_to_arm(chain._state)
    joint = chain.model.getJointId("shoulder")
    assert (found.name, found.on, found.inertia.mass) == ("cuff", joint, pytest.approx(0.3))
    np.testing.assert_allclose(found.placement.translation, places[0], atol=1e-12)
    np.testing.assert_allclose(found.placement.rotation, turns[0].as_matrix(), atol=1e-12)
    # Without it the body is that of an arm to which nothing of mass is welded.
    bare, _, _ = chain_of(masses=(0.0, 0.0))
    left = without(chain.model.inertias[joint], joint, [found])
    assert left.isApprox(bare.model.inertias[joint], 1e-12)
    elbow = chain.model.getJointId("elbow")
    assert without(chain.model.inertias[elbow], elbow, [found]) == chain.model.inertias[elbow]


def test_both_links_with_mass_are_found():
    chain, _, _ = chain_of(masses=(0.3, 0.2))
    found = welded_to_arm(chain._state)
    assert [(part.name, round(part.inertia.mass, 12)) for part in found] == [("cuff", 0.3), ("mark", 0.2)]


@pytest.mark.parametrize("arm", [None, "forearm", "trunk"])
def test_what_is_on_another_link_is_not_welded_to_the_arm(arm):
    assert welded_to_arm(chain_of(arm)[0]._state) == []


def test_an_arm_without_a_mass_of_its_own_keeps_all():
    """Then there is no wearer's arm to tell the device's link from."""
    assert welded_to_arm(chain_of(arm_mass=0.0)[0]._state) == []
    assert len(welded_to_arm(chain_of(arm_mass=1e-3)[0]._state)) == 1


@pytest.mark.parametrize("kind", ["urdf", "mjcf", "sdf"])
def test_a_file_keeps_the_mass_of_the_link_apart(kind, tmp_path):
    chain, _, places = chain_of()
    again = getattr(ClosedChain, f"from_{kind}")(getattr(chain, f"to_{kind}")(tmp_path))
    q = np.array([0.3, -0.8])
    masses = [pin.crba(one.model, one.model.createData(), q) for one in (chain, again)]
    np.testing.assert_allclose(masses[1], masses[0], rtol=1e-9)
    if kind == "urdf":
        (found,) = welded_to_arm(again._state)
        assert (found.name, found.inertia.mass) == ("cuff", pytest.approx(0.3))
        np.testing.assert_allclose(found.placement.translation, places[0], atol=1e-9)


def test_colours_are_opaque_and_told_apart():
    values = np.array(list(COLOURS.values()))
    assert (values.min(), values.max()) >= (0.0, 0.0)
    assert values.max() <= 1.0
    np.testing.assert_array_equal(values[:, 3], 1.0)
    apart = np.linalg.norm(values[:, None] - values, axis=-1)
    assert apart[np.triu_indices(len(values), 1)].min() > 0.1
