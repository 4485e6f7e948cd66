"""Why a figure of a comparison is blank."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ..reaction.assumptions import Question
from .detailed_figures import is_passive

if TYPE_CHECKING:
    from ..exo.shoulder_exo import ShoulderExo

__all__: list[str] = []

_NO_DRIVES = "it has no drives"
_NONE_HELD = "it holds no pose"
_NO_WEARER = "the size of its wearer is not known"
#: Of columns that only some designs have.
_OF_SOME = {
    "one_side": "of three drives that hold the arm alone",
    "reach": "a stroke or an end fitting is not known",
    "least_margin": "no pose is reached",
    "mass_on_arm_kg": "its file does not say which mass on the arm is the device's",
    "mass_of_links_kg": "its file gives its limbs no mass",
    "effort_share": "no limit of a drive is known",
    "left_to_wearer": "of passive supports alone",
    "change_on_cuff_N": "of devices with a frame at the cuff alone",
}


def why_blank(exo: ShoulderExo, row: Mapping[str, Any], question: Question) -> str:
    """The columns of a row that have no number, with the reason, such as ``"relief (it holds no pose)"``."""
    reasons: dict[str, list[str]] = {}
    for name, value in row.items():
        if isinstance(value, (float, np.floating)) and np.isnan(value):
            reasons.setdefault(_reason(exo, row, question, name), []).append(name)
    return "; ".join(f"{', '.join(names)} ({reason})" for reason, names in reasons.items())


def _reason(exo: ShoulderExo, row: Mapping[str, Any], question: Question, name: str) -> str:
    passive, holds = is_passive(exo), row["holdable"] > 0.0
    if name == "left_to_wearer" and passive:
        return "no arm of a person hangs in it, or its weight has no moment"
    if name in ("held_and_clear", "held_after_failure", "singular", "median_margin") and passive:
        return _NO_DRIVES
    if name == "held_after_failure":
        return "the question gives no numbers for the limits of its drives"
    if name in ("clear", "held_and_clear"):
        return _NO_WEARER if exo.arm is None or exo.arm.wearer is None else "its parts have no shapes"
    if name.startswith(("effort_", "stroke_")):
        pair = {"effort_N": "effort_Nm", "effort_Nm": "effort_N", "stroke_mm": "stroke_deg", "stroke_deg": "stroke_mm"}
        if passive:
            return _NO_DRIVES
        if name in pair and not np.isnan(row[pair[name]]):
            return f"none of its drives {'slides' if name in ('effort_N', 'stroke_mm') else 'turns'}"
        if name.startswith("effort_") and not holds:
            return _NONE_HELD
        return _OF_SOME.get(name, "no pose is reached")
    if name in ("contact_N", "peak_contact_N", "contact_without_N", "relief"):
        if exo.arm is None or exo.arm.wearer is None:
            return _NO_WEARER
        return "its wearer's muscles hold none of its poses" if holds or passive else _NONE_HELD
    if name in ("follows_10_mm", "change_by_10_mm_N"):
        return "it follows none of the moved centres" if row.get("follows_10_mm") == 0.0 else "no pose is reached"
    if name == "common_peak_F_s_N" and (holds or passive):
        return "it and the other designs hold no pose in common"
    if name.endswith("F_s_N"):
        return _NONE_HELD if not passive else "it has no force in any pose"
    return _OF_SOME.get(name, "no pose is reached")
