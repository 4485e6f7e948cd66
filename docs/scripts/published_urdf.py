"""Make the folder ``urdf``: the published wrists, the dummy's shoulder unit, and devices to compare with.

``python docs/scripts/published_urdf.py`` writes it again. A wheel has the folder within the package.
"""

from __future__ import annotations

from pathlib import Path

from published_devices import device_texts
from published_devices.dummy_shoulder import dummy_shoulder

import exo_pin as ep
from exo_pin.core.files import write_files
from exo_pin.design import preset, published
from exo_pin.device.files.device_writing import device_text
from exo_pin.wrist_chain import AssumedMasses, mechanism_urdf
from exo_pin.wrist_chain.wrist_urdf import closures_beside

#: Cables in place of limbs: a few grams, for simulators.
_CABLES = AssumedMasses(0.01, 0.01, base_half_radius=0.002, platform_half_radius=0.002, cross_mass=0.002)


def published_urdf() -> dict[str, str]:
    """The files, name to text."""
    assumed = AssumedMasses()
    prototype = preset("prototype")
    parts = {f"{name}-wrist": mechanism_urdf(preset(name), "wrist", assumed) for name in published()}
    parts["prototype"] = mechanism_urdf(prototype, "whole", assumed)
    parts["prototype-shoulder"] = mechanism_urdf(prototype, "shoulder")  # Table 5-4 gives all that it has
    parts["six-cables"] = mechanism_urdf(preset("six-cables"), "whole", _CABLES)
    parts["dummy-shoulder"] = dummy_shoulder(prototype.arm, assumed)
    texts: dict[str, str] = {}
    for stem, (xml, closures) in parts.items():
        texts[f"{stem}.urdf"] = xml
        texts[f"{stem}.closures.toml"] = closures_beside(closures, stem)
    for stem in ("prototype", "six-cables"):
        texts[f"{stem}.device.toml"] = device_text(ep.load(stem).chain_device, f"{stem}.urdf")
    return texts | device_texts()


if __name__ == "__main__":
    write_files(Path(__file__).parents[2] / "urdf", published_urdf())
