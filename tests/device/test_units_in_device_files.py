"""What a device file says: keys with the units of hinge, slide or route, efforts by their sign, and the same again."""

import tomllib
from dataclasses import replace

import numpy as np
import pytest
from places import URDF

import exo_pin as ep
from exo_pin.device import Brake, ConstantForce, Drive, GasSpring, LinearSpring, Route, Spring, TableLaw

HINGE, SLIDE = "limb_1_hinge", "limb_2_slide"
WAY = Route.over(("universe", (0.0, 0.2, 0.1)), ("arm", (0.0, 0.04, -0.2)))
TABLE = TableLaw((0.1, 0.4, 0.9), (4.0, -2.0, 7.0))


@pytest.fixture(scope="module")
def device():
    return ep.load(URDF / "3rps-passive-ball.urdf").device


def written(device, folder):
    """The tables of a saved device's file, and the device that is read from it."""
    exo = ep.ShoulderExo.from_device(device)
    exo.save(folder / "mine.toml")
    return tomllib.loads((folder / "mine.device.toml").read_text()), ep.load(folder / "mine.toml").device


@pytest.mark.parametrize(
    ("law", "place", "want"),
    [
        (ConstantForce(12.0), HINGE, {"law": "constant", "effort_N_m": -12.0}),
        (ConstantForce(12.0), SLIDE, {"law": "constant", "effort_N": -12.0}),
        (ConstantForce(12.0), None, {"law": "constant", "force_N": 12.0}),
        (LinearSpring(30.0, 0.2), HINGE, {"stiffness_N_m_rad": 30.0, "slack_rad": 0.2, "only_pulls": False}),
        (LinearSpring(30.0, 0.2), SLIDE, {"stiffness_N_m": 30.0, "slack_m": 0.2, "only_pulls": False}),
        (LinearSpring(30.0, 0.2, True), None, {"law": "linear", "slack_m": 0.2, "only_pulls": True}),
        (TABLE, HINGE, {"law": "table", "coordinates_rad": [0.1, 0.4, 0.9], "efforts_N_m": [-4.0, 2.0, -7.0]}),
        (TABLE, SLIDE, {"coordinates_m": [0.1, 0.4, 0.9], "efforts_N": [-4.0, 2.0, -7.0]}),
        (TABLE, None, {"coordinates_m": [0.1, 0.4, 0.9], "forces_N": [4.0, -2.0, 7.0]}),
        (
            GasSpring(150.0, 0.6, 0.5, 1.4),
            None,
            {"extended_force_N": 150.0, "extended_length_m": 0.6, "gas_height_m": 0.5, "exponent": 1.4},
        ),
    ],
)
def test_springs_have_the_units_of_their_place(device, tmp_path, law, place, want):
    spring = Spring("mine", law, joint=place, route=None if place else WAY)
    tables, again = written(device.replace(springs=[spring]), tmp_path)
    (own,) = tables["springs"]
    assert own.items() >= want.items()
    assert (own.get("joint"), "points" in own) == (place, place is None)
    assert again.springs == (spring,)
    if place is None:
        assert [(point["link"], tuple(point["point_m"])) for point in own["points"]] == [
            (point.link, point.point) for point in WAY.points
        ]


def test_drives_and_brakes_have_the_units_of_their_place(device, tmp_path):
    limits = {"lower": -8.0, "upper": 9.0, "least": -0.3, "greatest": 0.5, "speed_limit": 0.7, "power_limit": 20.0,
              "play": 0.001, "resolution": 0.002}  # fmt: skip
    slide = next(drive for drive in device.drives if drive.joint == SLIDE)
    cable = Drive("cable", route=WAY, lower=5.0, upper=300.0, speed_limit=0.4)
    muscle = Drive("muscle", route=WAY, actuator=ep.Actuator("cable", pull_limit=200.0))
    drives = [replace(slide, **limits), Drive("knee", joint=HINGE, **limits), cable, muscle]
    brakes = [Brake("a", "limb_3_hinge", 3.0), Brake("b", "limb_3_slide", 4.0), Brake("c", "limb_1_slide", None)]
    tables, again = written(device.replace(drives=drives, brakes=brakes), tmp_path)
    assert again.drives == tuple(drives)
    assert again.brakes == tuple(brakes)
    own = {table["name"]: table for table in tables["drives"]}
    for name, effort, at, rate in ((SLIDE, "N", "m", "m_s"), ("knee", "N_m", "rad", "rad_s")):
        assert own[name].items() >= {
            f"lower_{effort}": -8.0, f"upper_{effort}": 9.0, f"least_{at}": -0.3, f"greatest_{at}": 0.5,
            f"speed_{rate}": 0.7, "power_W": 20.0, f"play_{at}": 0.001, f"resolution_{at}": 0.002,
        }.items()  # fmt: skip
    assert own["cable"].items() >= {"lower_N": 5.0, "upper_N": 300.0, "speed_m_s": 0.4}.items()
    assert not {"least_m", "pulls", "zero_length_m"} & own["cable"].keys()
    assert "push_limit_N" not in own["muscle"]["actuator"]
    assert own["muscle"]["actuator"]["pull_limit_N"] == 200.0
    assert tables["drives_are_complete"]
    assert {table["name"]: set(table) - {"name", "joint"} for table in tables["brakes"]} == {
        "a": {"limit_N_m"}, "b": {"limit_N"}, "c": set(),
    }  # fmt: skip


def test_what_else_a_device_has_comes_back(device, tmp_path):
    K = np.diag([4e3, 3e3, 2e3, 10.0, 12.0, 3.0])
    soft = ep.Interfaces(cuff=ep.Interface(K, at=[0, 0, -0.19]), harness=ep.Interface(2.0 * K), cuff_area=0.012)
    other = device.replace(
        interfaces=soft, shoulder=ep.Shoulder(stiffness=2e4), title="A device", name="other", sources={"cuff": "a book"}
    )
    tables, again = written(other, tmp_path)
    assert (again.name, again.title, dict(again.sources)) == ("other", "A device", {"cuff": "a book"})
    assert again.interfaces.cuff_area == tables["cuff_area_m2"] == 0.012
    for name, factor in (("cuff", 1.0), ("harness", 2.0)):
        np.testing.assert_allclose(getattr(again.interfaces, name).stiffness, factor * K)
    np.testing.assert_allclose(again.interfaces.cuff.at, [0, 0, -0.19])
    np.testing.assert_allclose(again.shoulder.stiffness, 2e4 * np.eye(3))
    assert "side" not in tables
    right, mirrored = written(other.mirrored(), tmp_path)
    assert right["side"] == mirrored.side == "right"
    # Whose arm it is: of the robot's file alone nobody's.
    man = ep.Wearer(1.8, 80.0, "male")
    worn = ep.ShoulderExo.from_device(device).worn_by(man).device
    tables, again = written(worn, tmp_path)
    assert "arm" in tables
    assert again.arm.wearer.height == pytest.approx(1.8)
    assert "arm" not in written(device, tmp_path)[0]


def test_a_cable_only_pulls_and_needs_a_direction():
    """Whatever is left out of it; where two points of its way coincide in a pose, the answer says so."""
    assert Drive("rope", route=WAY, upper=30.0).lower == 0.0
    assert Drive("motor", joint=HINGE).lower is None
    exo = ep.load(URDF / "spring-support.urdf")
    pose = exo.pose(40.0)
    here = tuple(pose.apply([0.0, 0.04, -0.2]).tolist())
    folded = Route.over(("universe", here), ("arm", (0.0, 0.04, -0.2)))
    answer = exo.replace(springs=[Spring("strut", ConstantForce(5.0), route=folded)]).reaction(pose)
    assert str(answer.status) == "not_evaluated"
    assert 'spring "strut" has no direction, because two points of its route coincide' in answer.verdict


def test_a_device_is_saved_where_there_is_room_alone(device, tmp_path):
    exo = ep.ShoulderExo.from_device(device)
    with pytest.raises(ep.InvalidInput, match="none"):
        exo.save(tmp_path / "none" / "mine.toml")
    assert not list(tmp_path.iterdir())
