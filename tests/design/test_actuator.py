import tomllib
from dataclasses import replace

import numpy as np
import pytest

import exo_pin as ep
from exo_pin import FileFormatError, InvalidInput, UnknownName
from exo_pin.core.files.toml_tables import toml_text
from exo_pin.design import ACTUATOR_FAMILIES
from exo_pin.muscle import muscle_model, save_parameters


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
        ({"family": "pneumatic muscle", "force_law": "", "supply_pressure": 4e5}, InvalidInput),
        ({"family": "pneumatic muscle", "force_law": "name = \n", "supply_pressure": 4e5}, FileFormatError),
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


def prototype_with(law, folder):
    """The prototype's file, its muscles with another law."""
    path = folder / "mine.toml"
    path.write_text(ep.design.preset_file("prototype").replace('force_law = "tang-optimised"', f"force_law = {law}"))
    return path


def test_a_law_of_ones_own_is_that_of_its_file(tmp_path):
    """A file beside the design, a table in it, and a text are the same law; it is saved with the design."""
    save_parameters(muscle_model("tang-optimised"), tmp_path / "law.toml")
    text = (tmp_path / "law.toml").read_text()
    published, own = ep.load("prototype"), ep.load(prototype_with('"law.toml"', tmp_path))
    (tmp_path / "law.toml").unlink()
    own.save(tmp_path / "again.toml")
    table = tmp_path / "table.toml"
    table.write_text(own_table(text))
    by_table, again = ep.load(table), ep.load(tmp_path / "again.toml")
    by_text = replace(published.limbs[0].actuator, force_law="# mine\n" + text)
    assert own.limbs == by_table.limbs == again.limbs
    assert own.limbs[0].actuator == by_text
    pose = published.pose(flexion=10, abduction=-10)
    limits = [exo.reaction(pose).source.poses.limits for exo in (published, own)]
    assert (limits[0].upper > 10.0).any()
    np.testing.assert_array_equal(limits[0].upper, limits[1].upper)
    said = {each.name: each for each in ep.Plant(own).assumptions}["force law"]
    assert said.value == "that of a muscle of 300 mm at equal strain (tang-optimised)"
    assert said.basis == muscle_model("tang-optimised").source


def own_table(text):
    """The prototype with the law as a table of each actuator."""
    design = tomllib.loads(ep.design.preset_file("prototype"))
    for limb in design["limbs"]:
        limb["actuator"]["force_law"] = tomllib.loads(text)
    return toml_text(design)


@pytest.mark.parametrize(
    ("law", "message"),
    [
        ('"law.toml"', "constants.k: missing"),
        ('"nowhere.toml"', "nowhere.toml: cannot be read"),
        ('"../law.toml"', "in the folder of the design or below it"),
        ('"/law.toml"', "in the folder of the design or below it"),
        ('"nonsense"', "unknown muscle model"),
        ('{ name = "mine" }', "form: missing"),
        ("3", "force_law: expected a table"),
    ],
)
def test_laws_that_cannot_be_read_are_refused_with_the_design(tmp_path, law, message):
    law_text = 'name = "braid"\nreference_length_m = 0.25\nform = "tondu-lopez"\n'
    law_text += "[validity]\nstrain = [0.0, 0.25]\npressure_bar = [0.0, 5.0]\n"
    (tmp_path / "law.toml").write_text(law_text + "[constants]\ndiameter_m = 0.01\nbraid_angle_deg = 25.0\n")
    with pytest.raises((FileFormatError, UnknownName), match=message):
        ep.load(prototype_with(law, tmp_path))


def test_presets_of_the_thesis_name_their_muscles():
    assert all(limb.actuator.force_law == "tang-optimised" for limb in ep.load("prototype").limbs)
    for name in ("optimised-table-5-3", "optimised-table-c-2"):
        assert all(limb.actuator.pulls_only for limb in ep.load(name).limbs)
