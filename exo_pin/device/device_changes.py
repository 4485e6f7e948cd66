"""A device with something changed: its parts, its side, its stiffness."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from ..core.conventions import other_side, refuse_other_side
from ..core.errors import UnknownName
from ..core.validation import as_finite

if TYPE_CHECKING:
    from .chain_device import ChainDevice


def changed(self: ChainDevice, **changes: Any) -> ChainDevice:
    """A new device with some fields changed.

    Parameters
    ----------
    **changes
        Fields of the class, or ``gravity``, shape (3,), m/s².

    Returns
    -------
    ChainDevice

    Raises
    ------
    UnknownName
        If a name is no field.
    InvalidInput
        If it is another ``side``, which mirrors nothing: see :meth:`mirrored`.

    Examples
    --------
    >>> from exo_pin.device import ChainDevice
    >>> device = ChainDevice.from_chain(ep.load("prototype").chain)
    >>> lost = device.replace(drives=[device.drives[0].idle(), *device.drives[1:]])
    >>> lost.drives[0].upper, lost.limb_count  # N
    (0.0, 3)
    """
    known = {*self.__dataclass_fields__, "gravity"}
    for name in changes:
        if name not in known:
            raise UnknownName("field", name, known)
    refuse_other_side(changes, self.side)
    gravity = changes.pop("gravity", None)
    if gravity is not None:
        chain = changes.get("chain", self.chain)
        model, described = chain.model.copy(), chain.description
        model.gravity.linear = as_finite("gravity", gravity, (3,))
        root = replace(described.root, gravity=tuple(model.gravity.linear.tolist()))
        changes["chain"] = type(chain)(model, replace(described, root=root))
    return replace(self, **changes)


def mirrored(self: ChainDevice) -> ChainDevice:
    """The mirror image in the x-z plane, for the other shoulder.

    Chain, arm, drives, springs, routes, and stiffness of shoulder, links, harness and cuff go with it; all names
    stay. In the same clinical angles the coordinates of drives and springs, efforts and |F_s| are the same, and
    F_s has the other y. Mirrored twice it is the same device.

    Returns
    -------
    ChainDevice

    Raises
    ------
    InvalidInput
        If the chain has a joint whose mirror image is not known; see :meth:`ClosedChain.mirrored`.

    Examples
    --------
    >>> from exo_pin.device import ChainDevice
    >>> device = ChainDevice.from_chain(ep.load("prototype").chain)
    >>> right = device.mirrored()
    >>> right.side, (1e3 * right.arm.centre_of_mass).round(1)  # mm; of the left one at y = 22.7
    ('right', array([  -2.6,  -22.7, -189.7]))
    """
    return replace(
        self,
        chain=self.chain.mirrored(),
        drives=tuple(drive.mirrored() for drive in self.drives),
        springs=tuple(spring.mirrored() for spring in self.springs),
        arm=None if self.arm is None else self.arm.mirrored(),
        side=other_side(self.side),
        shoulder=self.shoulder.mirrored(),
        interfaces=self.interfaces.mirrored(),
        soft_links=tuple(soft.mirrored() for soft in self.soft_links),
    )


def stiffened(self: ChainDevice, parts: str, more: float) -> ChainDevice | None:
    """The device with some parts so many times as stiff.

    Parameters
    ----------
    parts : {"guides", "links"}
        Which.
    more : float
        Factor.

    Returns
    -------
    ChainDevice or None
        None if all of them are rigid.

    Examples
    --------
    >>> print(ep.load("four-cables").device.as_chain().stiffened("guides", 2.0))
    None
    """
    if parts == "links":
        springs = (replace(own.spring, stiffness=more * own.spring.stiffness) for own in self.soft_links)
        links = tuple(replace(own, spring=spring) for own, spring in zip(self.soft_links, springs, strict=True))
        return self.replace(soft_links=links) if links else None
    if all(limb.guide is None for limb in self.guided_slides):
        return None
    limbs = (replace(limb, guide=limb.guide and limb.guide.times(more)) for limb in self.guided_slides)
    return self.replace(guided_slides=tuple(limbs))
