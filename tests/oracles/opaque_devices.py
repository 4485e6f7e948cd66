"""Devices of which nothing is known but the names of the protocol."""

from dataclasses import fields

import exo_pin as ep
from exo_pin.device import Device

#: What a door may ask of a device.
NAMES = frozenset(name for name in vars(Device) if not name.startswith("_"))


class Opaque:
    """A device behind the names of the protocol alone; others raise, and stand in ``beyond``.

    Parameters
    ----------
    device : Device
        What answers.
    fast : bool
        Whether its closed forms may answer.
    beyond : set of str, optional
        Where names beyond the protocol are recorded; copies write to the same.
    """

    def __init__(self, device, fast=True, beyond=None):
        self._own, self._fast = device, fast
        self.beyond = set() if beyond is None else beyond

    def __getattr__(self, name):
        if not name.startswith("__"):
            self.beyond.add(name)
        raise AttributeError(f"a device has no {name!r}", name=name, obj=self)

    def accelerate(self, question):
        found = self._own.accelerate(question) if self._fast else None
        return found and ep.Mechanism.made_of(**{item.name: getattr(found, item.name) for item in fields(ep.Mechanism)})

    def replace(self, **changes):
        return Opaque(self._own.replace(**changes), self._fast, self.beyond)

    def mirrored(self):
        return Opaque(self._own.mirrored(), self._fast, self.beyond)

    def with_values(self, values, payload_at=None):
        return Opaque(self._own.with_values(values, payload_at), self._fast, self.beyond)

    def with_dimensions(self, **values):
        return Opaque(self._own.with_dimensions(**values), self._fast, self.beyond)

    def with_place(self, name, point):
        return Opaque(self._own.with_place(name, point), self._fast, self.beyond)

    def stiffened(self, parts, more):
        found = self._own.stiffened(parts, more)
        return None if found is None else Opaque(found, self._fast, self.beyond)


def _handed_on(name):
    return property(lambda self: getattr(self._own, name))


for _name in NAMES - vars(Opaque).keys():
    setattr(Opaque, _name, _handed_on(_name))
