"""The mechanism that the queries are about."""

from __future__ import annotations

from ..core.records import Record
from ..design import Mechanism, WristGeometry


class Subject(Record):
    """A design, as the questions see it; :class:`exo_pin.ShoulderExo` provides it."""

    _mechanism: Mechanism

    @property
    def mechanism(self) -> Mechanism:
        """The frozen record of the design."""
        return self._mechanism

    @property
    def device(self) -> Mechanism:
        """What is asked: the mechanism of a wrist, the :class:`exo_pin.device.ChainDevice` of any other device."""
        return self.mechanism

    @property
    def side(self) -> str:
        """Side of the body."""
        return self.mechanism.side

    @property
    def geometry(self) -> WristGeometry:
        """Joint centres and frames, which a robot may have whose masses no record can hold."""
        return self.mechanism.geometry
