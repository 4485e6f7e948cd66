"""That nothing of MuJoCo's model is forgotten."""

import fnmatch

import mujoco
import yaml
from places import REPOSITORY

FIELDS = REPOSITORY / "tests" / "chain" / "formats" / "mjcf" / "mujoco_fields.yaml"
READ, REFUSED, IRRELEVANT = (
    [name for names in yaml.safe_load(FIELDS.read_text(encoding="utf-8"))[key] for name in names]
    for key in ("read", "refused", "irrelevant")
)


def fields():
    model = mujoco.MjModel.from_xml_string("<mujoco/>")
    names = [name for name in dir(model) if not name.startswith("_") and not callable(getattr(model, name))]
    return [name for name in names if name != "opt"] + [f"opt.{x}" for x in dir(model.opt) if not x.startswith("_")]


def test_every_field_of_mujocos_model_is_read_irrelevant_or_refused():
    there = fields()
    assert len(there) > 500
    assert set(READ) <= set(there)
    for name in there:
        groups = [any(fnmatch.fnmatchcase(name, item) for item in group) for group in (READ, REFUSED, IRRELEVANT)]
        assert any(groups), f"{name} is in no group"
    for item in (*REFUSED, *IRRELEVANT):
        # Plastic springs came with MuJoCo 4.
        known = item in ("buffer", "jnt_springyield", "jnt_plasticadr") or fnmatch.filter(there, item)
        assert known, f"{item} is no field"
