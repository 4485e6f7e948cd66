"""A link of a device that gives way where its joint carries it.

A telescopic limb of a device whose guide bends and twists, or that has none.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.validation import require_type
from ...design import Interface, LimbGuide


@checked
@dataclass(frozen=True)
class SoftLink:
    """A spring of six freedoms between a link of the device and the joint that carries it.

    It stands for the joint's bearings and for the link's own bending and twist, as they are seen at the point of the
    spring; see :class:`exo_pin.Interface`.

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


@checked
@dataclass(frozen=True)
class GuidedSlide:
    """What resists across a telescopic limb between two universal joints, and against its twist.

    The guide runs from the joint that carries the slide to the joint that the slide carries. The force of the slide's
    drive acts along the line between the two, beside the guide, as of a muscle. A limb that is not listed is rigid.

    Attributes
    ----------
    slide : str
        The slide of the limb.
    guide : LimbGuide or None
        Its guide. None, and a guide that does not resist twist, lets the two halves of the limb turn against each
        other: the limb then carries no side force.

    Examples
    --------
    >>> from exo_pin.device import ChainDevice, GuidedSlide
    >>> exo, tube = ep.load("prototype"), ep.LimbGuide(bending_rigidity=65.0, torsional_rigidity=50.0)  # N m²
    >>> device = ChainDevice.from_chain(exo.chain).replace(shoulder=ep.Shoulder(stiffness=20e3))
    >>> device = device.replace(guided_slides=[GuidedSlide(f"limb_{i}_slide", tube) for i in (1, 2, 3)])
    >>> case = ep.Case(exo.pose(30, 30), centre_offset=[0.0, 0.0, 0.01])
    >>> answer = ep.solve(device, case, ep.Assumptions("elastic", limits="none"))
    >>> (1e3 * answer.centre_displacement).round(2)  # mm; as of the design "prototype" with such guides
    array([1.28, 2.15, 1.36])
    """

    slide: str
    guide: LimbGuide | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.slide, str) or not self.slide:
            raise InvalidInput(f"expected the name of a slide, got {self.slide!r}")
        require_type("guide", self.guide, LimbGuide | None)

    @property
    def resists(self) -> bool:
        """Whether the limb carries side forces."""
        return self.guide is not None and self.guide.bending_rigidity > 0.0 and self.guide.torsional_rigidity > 0.0
