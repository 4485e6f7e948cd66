"""``exo-pin presets``, ``check`` and ``export``: list, print, check and write designs."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from ...core.files import write_text
from ...design import preset, preset_file, presets
from ...exo.model_methods import EXPORTS
from ...wrist_chain import PARTS, write_published_urdf
from .. import add_moved, add_outputs, deliver
from ..options.option_values import refuse
from ..options.query_options import add_design, add_person, design


def add_commands(commands: Any) -> None:
    """Register the commands of this module."""
    listing = commands.add_parser("presets")
    listing.add_argument("name", nargs="?", metavar="NAME", help="print the file of this design, to begin one's own")
    add_outputs(listing, ".toml")
    listing.set_defaults(run=_presets)

    check = commands.add_parser("check")
    add_design(check)
    add_outputs(check, ".json")
    check.set_defaults(run=_check)

    export = commands.add_parser("export")
    add_design(export)
    add_person(export)
    add_outputs(export, *EXPORTS)
    export.add_argument(
        "--part",
        choices=PARTS,
        default="whole",
        help="what to write: limbs and shoulder (whole), the limbs alone (wrist), the shoulder alone, or limbs and a "
        "free arm (floating) (default: whole)",
    )
    export.add_argument(
        "--published",
        dest="folder",
        type=Path,
        metavar="FOLDER",
        help="write all published designs as URDF to this folder instead, as in the folder urdf",
    )
    add_moved(export, format="the ending of --out FILE: .urdf, .xml (MJCF) or .sdf")
    export.set_defaults(run=_export)


def _presets(options: argparse.Namespace) -> int:
    if options.name is None:
        refuse(options, "a list of names is no design", "out")
        width = max(len(name) for name in presets())
        print("\n".join(f"{name:{width}}  {preset(name).title}" for name in presets()))
        return 0
    text = preset_file(options.name)
    deliver(options, text.rstrip("\n"), save=lambda path: write_text(path, text))
    return 0


def _check(options: argparse.Namespace) -> int:
    report = design(options).check()
    deliver(options, report, json=report.to_json)
    return 0 if report.passed else 1


def _export(options: argparse.Namespace) -> int:
    if options.folder is not None:
        refuse(options, "--published writes URDF to a folder", "out")
        print("\n".join(map(str, write_published_urdf(options.folder))))
        return 0
    exo = design(options)
    path = options.out or Path(f"{exo.name}.urdf")
    print("\n".join([*map(str, exo.export(path, options.part)), EXPORTS[path.suffix.lower()]]))
    return 0
