"""The mechanism that the queries are about."""

from __future__ import annotations

from ..core.errors import NotAWrist
from ..core.records import Record
from ..design import Mechanism, WristGeometry


class Subject(Record):
    """A design, as the questions see it; :class:`exo_pin.ShoulderExo` provides it."""

    @property
    def mechanism(self) -> Mechanism:
        """The frozen record of the design."""
        raise NotAWrist(type(self).__name__, "it has no mechanism")

    @property
    def side(self) -> str:
        """Side of the body."""
        return self.mechanism.side

    @property
    def geometry(self) -> WristGeometry:
        """Joint centres and frames, which a robot may have whose masses no record can hold."""
        return self.mechanism.geometry
