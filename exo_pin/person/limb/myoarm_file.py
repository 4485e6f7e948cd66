"""MyoArm as a model that can be edited and written to a file: of the installed package, or of a file of one's own."""

from __future__ import annotations

import os
import warnings
import xml.etree.ElementTree as ET
from os import PathLike
from pathlib import Path
from typing import Any

from ...chain.formats.mjcf.mjcf_compiling import mujoco_warnings
from ...core.errors import FileFormatError
from ...core.errors.base import echo
from ...core.optional_packages import optional

#: What shows in the compiled model of elements whose default class has no name in the package's own XML.
_NAMELESS = {"geom": ("contype", "conaffinity"), "tendon": ("width", "rgba")}


def person_spec(path: str | PathLike[str] | None, left: bool) -> Any:
    """A person's model, mujoco.MjSpec.

    Parameters
    ----------
    path : path-like or None
        An MJCF; None for MyoArm of the package ``myo_sim``: ``myoarm_r``, or both arms (``myoarms``) for a left one.
    left : bool
        Which arm is asked for.

    Raises
    ------
    MissingExtra
        If MuJoCo or the package is not installed.
    FileFormatError
        If the file cannot be read.
    """
    mujoco = optional("person", "mujoco")
    if path is None:
        return _of_package(mujoco, "myoarms" if left else "myoarm_r")
    try:
        with mujoco_warnings(mujoco, []):
            spec = mujoco.MjSpec.from_file(os.fsdecode(path))
    except (ValueError, OSError, TypeError) as error:
        raise FileFormatError(f"MuJoCo cannot read it: {echo(str(error))}", os.fsdecode(path)) from error
    # The new file may stand in another folder.
    folder = Path(os.fsdecode(path)).resolve().parent
    spec.meshdir, spec.texturedir = str(folder / spec.meshdir), str(folder / spec.texturedir)
    return spec


def _of_package(mujoco: Any, name: str) -> Any:
    """A model of ``myo_sim`` that can be written.

    The package joins its models with an empty prefix, which leaves default classes without a name, and both arms' with
    the same ones. They get a name, and elements what the compiled model has of such a class.
    """
    myo_sim = optional("person", "myo_sim")
    with mujoco_warnings(mujoco, []), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        made = myo_sim.load_spec(name)
        model = made.compile()
        root = ET.fromstring(made.to_xml())
        default = root.find("default")
        assert default is not None
        taken: set[str | None] = set()
        for nested in list(default):
            if nested.tag == "default" and "class" not in nested.attrib:
                if taken & (own := {each.get("class") for each in nested.iter("default")} - {None}):
                    default.remove(nested)
                    continue
                nested.set("class", "myo_sim")
                taken |= own
        spec = mujoco.MjSpec.from_string(ET.tostring(root, encoding="unicode"))
        spec.compile()
    for kind, attributes in _NAMELESS.items():
        for element in getattr(spec, f"{kind}s"):
            for attribute in attributes:
                setattr(element, attribute, getattr(model, f"{kind}_{attribute}")[element.id])
    return spec
