"""Mass of a device: a wrist's by its geometry, any other's by its file."""

from __future__ import annotations

from typing import Any

from ...design.holding_frame import device_mass, mass_text
from ...device.wrist_device import as_device


def mass_of(design: Any) -> float:
    """Estimate of frame, cuff and drives of a wrist (:mod:`exo_pin.design.holding_frame`), else of all links, kg."""
    device = as_device(design)
    record = device.accelerate("workspace")
    return device_mass(record) if record is not None else float(device.links_mass + _on_arm(device))


def mass_words(design: Any) -> str:
    """What a design moves besides the arm, and what it weighs."""
    device = as_device(design)
    record = device.accelerate("workspace")
    own = f"Links that move otherwise: {device.links_mass:.2f} kg." if record is None else mass_text(record)
    return f"Moving mass besides the arm: {_on_arm(device):.2f} kg. {own}"


def _on_arm(device: Any) -> float:
    arm = device.arm
    return 0.0 if arm is None or arm.person is None else float(arm.mass - arm.person.mass)
