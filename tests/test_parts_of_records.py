"""A record that is made of others takes no other thing in place of one: it would fail later, far from its cause."""

import dataclasses
from pathlib import Path

import pytest

import exo_pin as ep
from exo_pin import ExoPinError

URDF = Path(__file__).parents[1] / "urdf"


class Other:
    """Of no class of the package."""


def records(thing, above=()):
    """All records in a record, and the first ones of sequences in it; of one in itself the outer one."""
    if isinstance(thing, tuple):
        for part in thing[:6]:
            yield from records(part, above)
    elif dataclasses.is_dataclass(thing) and type(thing).__module__.startswith("exo_pin.") and id(thing) not in above:
        yield thing
        for field in dataclasses.fields(thing):
            yield from records(getattr(thing, field.name), (*above, id(thing)))


def fields_made_of_records():
    """By class and field: a record, and whether the field holds several."""
    chain = ep.load(URDF / "serial-y-x-z.urdf")
    given = [chain.device, chain.chain.description, ep.experiment("held-abduction-lost-imu", "model")]
    for name in ("four-cables", "prototype", "four-linear-actuators-worn"):
        exo = ep.load(name)
        given += [exo.mechanism, exo.chain.description]
    found = {}
    for record in (each for thing in given for each in records(thing)):
        for field in dataclasses.fields(record):
            held = getattr(record, field.name)
            parts = held if isinstance(held, tuple) else (held,)
            if field.init and any(type(part).__module__.startswith("exo_pin.") for part in parts):
                found[type(record).__name__, field.name] = record, isinstance(held, tuple)
    return found


def test_a_part_of_another_class_is_refused():
    found = fields_made_of_records()
    assert len(found) > 30
    for (kind, name), (record, several) in found.items():
        for part in (Other(), 3, "text"):
            with pytest.raises(ExoPinError):
                pytest.fail(
                    f"{kind}.{name} takes {dataclasses.replace(record, **{name: (part,) if several else part})}"
                )
