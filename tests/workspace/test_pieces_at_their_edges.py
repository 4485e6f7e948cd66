"""Needs, arms and grids of a workspace at the edges of what they may be."""

from types import SimpleNamespace

import numpy as np
import pytest
from places import URDF
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import InvalidInput
from exo_pin.workspace import Criteria, population, query, starting_design
from exo_pin.workspace import criterion as needs

pytestmark = pytest.mark.usefixtures("plain")

ARM = ep.Arm.from_anthropometry(1.75, 75, sex="male")
CABLE = ep.Actuator("cable", pull_limit=400.0)


def test_a_body_needs_shapes_or_routes_of_the_device():
    """The strut of a spring support may lie on the body, and its links have no shapes."""
    limits = Criteria(body=ep.BodyShape.of(ep.Wearer(1.75, 75, "male")))
    support = ep.load(URDF / "spring-support.urdf").device
    assert needs.body(support, limits, False) == ["shapes of the links"]
    serial = ep.load(URDF / "serial-y-x-z.urdf").device
    assert needs.body(serial, limits, False) == []
    who = "who wears it (worn_by, --person)"
    assert needs.body(serial.replace(arm=None), Criteria(), False) == [who]
    assert needs.body(support.replace(arm=None), Criteria(), False) == [who, "shapes of the links"]


def test_a_body_needs_a_radius_of_every_limb():
    limits = Criteria(body=ep.BodyShape.of(ep.Wearer(1.75, 75, "male")))
    some = ep.load("four-cables").replace(limbs=[ep.Limb("SPS", actuator=CABLE)] * 3 + [ep.Limb("SPS")]).mechanism
    assert needs.body(some, limits, False) == ["radius of limb 4 (family of the actuator, or limb_radius)"]
    assert needs.body(some, limits.replace(limb_radius=0.01), False) == []


def test_forces_need_the_lengths_of_limbs_with_a_law():
    """A muscle's pull depends on its length, which is known with its stroke; a cable's does not."""
    law = ep.Actuator("pneumatic muscle", force_law="best", supply_pressure=4e5)
    for actuators, lacking in (((CABLE, CABLE, CABLE), []), ((CABLE, law, CABLE), ["stroke or end fitting of limbs"])):
        own = starting_design(actuators, ARM)
        assert needs.forces(own, Criteria(), False) == lacking
    bare = own.replace(arm=None)
    assert needs.forces(bare, Criteria(), False)[0] == "arm mass"
    assert "arm mass" not in needs.forces(bare, Criteria(wearers=(ep.Wearer(1.75, 75, "male"),)), False)


@pytest.mark.parametrize("side", ["left", "right"])
def test_arms_of_wearers_are_those_of_the_design_on_them(side):
    """On either side of the body, with what the device moves besides, and in postures at most 45° apart."""
    exo = ep.load("four-linear-actuators-worn", side=side)
    wearer = ep.Wearer(1.62, 58.0, "female", elbow_flexion=0.7)
    (arm,) = Criteria(wearers=(wearer,)).arms(exo.mechanism)
    expected = exo.worn_by(wearer).mechanism.arm
    assert arm.mass == pytest.approx(expected.mass)
    np.testing.assert_allclose(arm.centre_of_mass, expected.centre_of_mass, atol=1e-12)
    np.testing.assert_allclose(arm.inertia, expected.inertia, atol=1e-12)
    for low, high, count in ((0.5, 1.0, 2), (-0.3, 0.4, 2), (1.2, 1.2, 1)):
        bent = Criteria(wearers=(wearer,), elbow_range=(low, high)).arms(exo.mechanism)
        np.testing.assert_allclose([each.wearer.elbow_flexion for each in bent], np.linspace(low, high, count))


def test_of_several_wearers_the_one_who_is_worse_off_counts():
    """In each pose, of what pulls at the socket, of pull and slip of the cuff and of the loss of a limb."""
    soft = ep.Interfaces(cuff=ep.Interface.upper_arm_cuff(0.2))
    exo = ep.load("four-linear-actuators").replace(interfaces=soft)
    poses = exo.pose([10.0, 40.0, 70.0], [10.0, 50.0, 20.0], [0.0, 20.0, -10.0])
    limits = Criteria(
        names=("forces", "socket", "cuff_pull", "cuff_slip", "limb_loss"), largest_pull_out=20.0,
        largest_cuff_pull=30.0, largest_cuff_slip=0.01, least_moment_without_limb=0.0,
        socket=ep.GlenoidCone(orientation=Rotation.identity()),
    )  # fmt: skip
    small, large = ep.Wearer(1.55, 50.0, "female"), ep.Wearer(1.9, 105.0, "male")
    alone = [exo.workspace(poses, limits.replace(wearers=(each,))).margins for each in (small, large)]
    both = exo.workspace(poses, limits.replace(wearers=(small, large))).margins
    for name, margin in both.items():
        np.testing.assert_allclose(margin, np.minimum(*(each[name] for each in alone)), rtol=1e-9, err_msg=name)
        assert (np.abs(alone[0][name] - alone[1][name]) > 1e-6).all()


def test_an_elbow_just_free_of_the_cuff_is_free():
    """A limit of 0 is one; the sleeve of these joints ends 152 mm below the shoulder."""
    exo = ep.load("four-linear-actuators-worn")
    woman = ep.Wearer(1.525, 51, "female")
    found = exo.workspace(exo.pose([0.0, 60.0]), Criteria(("elbow",), wearers=(woman,), least_above_elbow=0.0))
    np.testing.assert_allclose(found.margins["elbow"], woman.upper_arm_length - 0.152, atol=1e-9)


@pytest.mark.parametrize("step", [None, 12.0, 30])
def test_the_grid_is_of_four_degrees_unless_a_step_is_given(monkeypatch, step):
    exo, asked, own = ep.load("four-cables", side="right"), [], query._grid

    def grid(size, side):
        asked.append((size, side))
        return own(45.0, side)

    monkeypatch.setattr(query, "_grid", grid)
    found = exo.workspace(step, ["singularity"])
    assert asked == [(4.0 if step is None else float(step), "right")]
    assert found.inside.ndim == 3
    with pytest.raises(InvalidInput):
        exo.workspace(True, ["singularity"])
    assert len(asked) == 1


class Answering:
    """A design whose workspace is given."""

    side = "left"

    def __init__(self, name, lost, force):
        self.name, self.found = name, SimpleNamespace(index=0.75, lost_to=lost, force_inside=force)

    def worn_by(self, wearer):
        return self

    def workspace(self, *_, centre_offset):
        # Nobody said that the shoulder moves.
        assert centre_offset is None
        return self.found


def test_what_limits_a_design_on_a_person(capsys):
    designs = [
        Answering("firm", {"stroke": 0.0, "forces": 0.0}, {"mean": 20.0, "largest": 30.0}),
        Answering("weak", {"stroke": 0.05, "forces": 0.2}, {"mean": 25.0, "largest": 35.0}),
        Answering("free", {}, {}),
    ]
    table = population(designs, [ep.Wearer(1.6, 60.0, "female")], 30.0)
    # Nor that a bar should be shown.
    assert capsys.readouterr().err == ""
    assert table["design"].tolist() == ["firm", "weak", "free"]
    assert table["limited_by"].tolist() == ["", "forces", ""]
    np.testing.assert_array_equal(table["mean_F_s_N"], [20.0, 25.0, np.nan])
    np.testing.assert_array_equal(table["peak_F_s_N"], [30.0, 35.0, np.nan])
    assert (table["height_m"][0], table["mass_kg"][0], table["sex"][0]) == (1.6, 60.0, "female")
    for exos, persons in (([], [1]), (designs, [])):
        with pytest.raises(InvalidInput, match="expected designs and wearers"):
            population(exos, persons)
