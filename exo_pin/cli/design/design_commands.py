"""``exo-pin presets``, ``check`` and ``export``: list, print, check and write designs."""

from __future__ import annotations

import argparse
from pathlib import Path

from ...core.files import write_text
from ...design import preset, preset_file, presets
from ...exo.model_methods import EXPORTS
from ...wrist_chain import write_published_urdf
from .. import deliver
from ..options.option_values import refuse
from ..options.query_options import design


def run_presets(options: argparse.Namespace) -> int:
    """Answer ``exo-pin presets`` and return its exit status."""
    if options.name is None:
        refuse(options, "a list of names is no design", "out")
        width = max(len(name) for name in presets())
        print("\n".join(f"{name:{width}}  {preset(name).title}" for name in presets()))
        return 0
    text = preset_file(options.name)
    deliver(options, text.rstrip("\n"), save=lambda path: write_text(path, text))
    return 0


def run_check(options: argparse.Namespace) -> int:
    """Answer ``exo-pin check`` and return its exit status."""
    report = design(options).check()
    deliver(options, report, json=report.to_json)
    return 0 if report.passed else 1


def run_export(options: argparse.Namespace) -> int:
    """Answer ``exo-pin export`` and return its exit status."""
    if options.folder is not None:
        refuse(options, "--published writes URDF to a folder", "out")
        print("\n".join(map(str, write_published_urdf(options.folder))))
        return 0
    exo = design(options)
    path = options.out or Path(f"{exo.name}.urdf")
    print("\n".join([*map(str, exo.export(path, options.part)), EXPORTS[path.suffix.lower()]]))
    return 0
