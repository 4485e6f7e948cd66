"""A telescopic limb of a device whose guide bends and twists, or that has none."""

from __future__ import annotations

from dataclasses import dataclass

from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.validation import require_type
from ...design import LimbGuide


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
