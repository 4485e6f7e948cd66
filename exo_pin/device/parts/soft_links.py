"""A link of a device that gives way where its joint carries it."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.validation import require_type
from ...design import Interface


@checked
@dataclass(frozen=True)
class SoftLink:
    """A spring of six freedoms between a link of the device and the joint that carries it.

    It stands for the joint's bearings and for the link's own bending and twist, as they are seen at the point of the
    spring; see :meth:`exo_pin.design.Interface`.

    Attributes
    ----------
    link : str
        A link that moves: neither the arm, whose give is that of the cuff, nor the torso, whose is the harness's. The
        whole link is beyond the spring, with its mass, its other joints and its closures.
    spring : Interface
        Its stiffness; axes and point are those of the link.

    Examples
    --------
    >>> from exo_pin.device import SoftLink
    >>> bearing = SoftLink("fork", ep.Interface.of(1e5, 500.0, at=(0.1, 0.0, 0.0)))
    >>> float(bearing.spring.compliance[0, 0] * 20.0)  # m that 20 N along x of the link move it
    0.0002
    """

    link: str
    spring: Interface

    def __post_init__(self) -> None:
        if not isinstance(self.link, str) or not self.link:
            raise InvalidInput(f"expected the name of a link that gives way, got {self.link!r}")
        require_type("spring", self.spring, Interface)

    def mirrored(self) -> SoftLink:
        """Mirror image in the x-z plane: axes and point are those of the link, which goes with it.

        Returns
        -------
        SoftLink

        Examples
        --------
        >>> from exo_pin.device import SoftLink
        >>> bearing = SoftLink("fork", ep.Interface.of(1e5, 500.0, at=(0.1, 0.02, 0.0)))
        >>> float(bearing.mirrored().spring.at[1])  # m
        -0.02
        """
        return replace(self, spring=self.spring.mirrored())
