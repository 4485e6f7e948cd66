"""Contact force of a bare arm over the elevation, beside published values."""

from __future__ import annotations

import numpy as np

from ..core.conventions import shoulder_rotation
from ..core.tables import aligned
from .contact.contact_options import ContactOptions
from .wearer import Person

_ELEVATIONS = np.arange(10.0, 121.0, 10.0)
_PAYLOAD = 2.0
#: What was published, percent of body weight, straight arm without payload.
_PUBLISHED = (
    "Published, % of body weight, straight arm without payload:",
    "  Poppen and Walker 1978 (computed, Clin. Orthop. 135): 89 at 90° of abduction, shear largest (42) at 60°",
    "  Bergmann et al. 2011 (instrumented implants, J. Biomech. 44): means about 81 in abduction and 73 in flexion,",
    "  238 the largest; like models below 90°, and rising further above, where models fall",
)


def literature_table(person: Person, options: ContactOptions) -> str:
    """Contact force at 10 to 120° of abduction and flexion, without and with 2 kg.

    Parameters
    ----------
    person : Person
        The wearer; a payload of theirs is left out.
    options : ContactOptions
        Assumptions.

    Returns
    -------
    str
        Percent of body weight, with a dash where the muscles hold no such load.
    """
    columns, heads = [], ["elevation, °"]
    nothing = np.zeros_like(_ELEVATIONS)
    for name, flexion, abduction in (("abduction", nothing, _ELEVATIONS), ("flexion", _ELEVATIONS, nothing)):
        poses = shoulder_rotation(flexion, abduction, 0.0, side=person.side, degrees=True)
        for payload in (0.0, _PAYLOAD):
            result = person.with_changes(payload=payload).joint_contact(poses, options=options, outside="mark")
            columns.append(result.percent_body_weight)
            heads.append(f"{name}, {payload:g} kg" if payload else name)
            if not payload:
                columns.append(100.0 * result.shear / result.body_weight)
                heads.append("shear")
    rows = [
        [f"{value:.0f}" if np.isfinite(value) else "-" for value in row]
        for row in np.column_stack([_ELEVATIONS, *columns])
    ]
    table = aligned([heads, *rows])
    return "\n".join(["Contact force without a device, % of body weight", *table, "", *_PUBLISHED])
