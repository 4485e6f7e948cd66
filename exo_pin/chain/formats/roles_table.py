"""The table of roles in TOML files of chains and of devices."""

from __future__ import annotations

from ...core.files.toml_tables import TomlTable
from ..structure.roles import LimbRole, Roles


def read_roles(table: TomlTable) -> Roles:
    """The table ``[roles]``."""
    actuated = table.texts("actuated")
    names = (table.text(key, required=False) for key in ("shoulder", "arm", "reference_point", "cuff"))
    shoulder, arm, point, cuff = names
    limbs = []
    for limb in table.tables("limbs"):
        texts = [limb.text(key) for key in ("name", "kind", "slide", "platform_joint", "closure")]
        limb.finish()
        limbs.append(LimbRole(*texts))  # type: ignore[arg-type]
    table.finish()
    return Roles(actuated, shoulder, arm, point, tuple(limbs), cuff)
