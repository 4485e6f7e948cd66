from dataclasses import replace

import pytest

import exo_pin as ep
from exo_pin import FileFormatError, InvalidInput, UnknownName
from exo_pin.design import ACTUATOR_FAMILIES


def test_muscles_and_cables_only_pull():
    pulls = {family: ep.Actuator(family).pulls_only for family in ACTUATOR_FAMILIES}
    assert pulls == {"pneumatic muscle": True, "cable": True, "linear": False}
    assert ep.Actuator("cable").push_limit == 0.0
    assert ep.Actuator("linear").push_limit is None


@pytest.mark.parametrize(
    ("fields", "error"),
    [
        ({"family": "spring"}, UnknownName),
        ({"family": "cable", "push_limit": 5.0}, InvalidInput),
        ({"family": "cable", "pull_limit": -1.0}, InvalidInput),
        ({"family": "linear", "force_law": "best", "supply_pressure": 4e5}, InvalidInput),
        ({"family": "pneumatic muscle", "force_law": "best"}, InvalidInput),
        ({"family": "pneumatic muscle", "supply_pressure": 4e5}, InvalidInput),
        ({"family": "linear", "push_limit": float("nan")}, InvalidInput),
    ],
)
def test_wrong_actuators_are_refused(fields, error):
    with pytest.raises(error):
        ep.Actuator(**fields)


def test_limb_takes_an_actuator_only():
    with pytest.raises(InvalidInput, match="Actuator"):
        ep.Limb(actuator="muscle")


def test_actuators_survive_a_file(tmp_path):
    exo = ep.load("prototype")
    kinds = [
        ep.Actuator("cable", pull_limit=250.0),
        ep.Actuator("linear", pull_limit=100.0, push_limit=80.0),
        exo.limbs[2].actuator,
    ]
    exo = exo.replace(limbs=[replace(limb, actuator=kind) for limb, kind in zip(exo.limbs, kinds, strict=True)])
    exo.save(tmp_path / "mine.toml")
    again = ep.load(tmp_path / "mine.toml")
    assert [limb.actuator for limb in again.limbs] == kinds
    assert again.mechanism.sources["limbs[2].actuator"].endswith("Table 3-3c; Appendix A")


def test_unit_in_the_key_counts(tmp_path):
    text = (
        'schema = 1\nname = "mine"\n[geometry.circles]\nbase_radius_mm = 136.3\nplatform_radius_mm = 118.8\n'
        "base_height_mm = 78.0\nplatform_height_mm = 200.0\nbase_angles_deg = [31.3, 59.6, 119.8]\n"
    ) + 3 * '[[limbs]]\nkind = "UPU"\nactuator = { family = "linear", pull_limit_kN = 0.3, push_limit_N = 20 }\n'
    path = tmp_path / "mine.toml"
    path.write_text(text)
    assert ep.load(path).limbs[0].actuator == ep.Actuator("linear", 300.0, 20.0)
    path.write_text(text.replace("push_limit_N", "push_limit_bar"))
    with pytest.raises(FileFormatError, match="push_limit_bar"):
        ep.load(path)


def test_presets_of_the_thesis_name_their_muscles():
    assert all(limb.actuator.force_law == "tang-optimised" for limb in ep.load("prototype").limbs)
    for name in ("optimised-table-5-3", "optimised-table-c-2"):
        assert all(limb.actuator.pulls_only for limb in ep.load(name).limbs)
