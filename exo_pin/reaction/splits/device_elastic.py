"""Split "elastic" of a device that is not a wrist: its forces follow from the stiffness of what gives way."""

from __future__ import annotations

from ...core.validation import FloatArray
from ...design import Mechanism
from .pose_stack import PoseStack
from .spherical import Spherical
from .split import Chosen


class DeviceElastic(Spherical):
    """Efforts and displacements are those of :mod:`exo_pin.device.elastic.soft_equations`.

    Parameters
    ----------
    name : {"elastic", "elastic_locked"}
        The pose is held, or the drives' coordinates in it (:mod:`exo_pin.device.elastic.locked_equations`).
    """

    name = "elastic"
    assumption = "the stiffness of what gives way, at the displaced geometry"
    criterion = "efforts that balance themselves of least sum of squares"
    options = frozenset()
    determines_sides = True
    moves = True

    def __init__(self, name: str = "elastic") -> None:
        if name == "elastic_locked":
            self.name = name  # type: ignore[misc]
            self.assumption = f"{self.assumption} and with the drives locked"  # type: ignore[misc]
            self.chooses_tensions = False

    def assumed(self, mechanism: Mechanism) -> str:
        """The assumption in words."""
        return self.assumption

    def caption(self, mechanism: Mechanism) -> str:
        """The assumption in a few words."""
        return "determined by stiffness"

    def extras(self, poses: PoseStack, answer: Chosen) -> dict[str, FloatArray]:
        """Displacements of harness, cuff and shoulder, and the share of the load that has an equilibrium."""
        assert poses.placed is not None
        moved = poses.placed.moved
        assert moved is not None
        turned = {} if self.chooses_tensions else {"arm_orientation": moved.arm}
        return turned | {
            "interface_displacements": moved.interfaces,
            "load_share": moved.share,
            "centre_displacement": moved.centre,
        }
