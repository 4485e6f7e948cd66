"""Command ``exo-pin muscle identify``: from a CSV file of measurements to a parameter set."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ...core.errors import FileFormatError, InvalidInput
from ...core.files.csv_tables import read_csv
from ...core.files.toml_tables import naming_file
from ...core.validation import FloatArray, as_positive
from ...muscle.identification.dynamic_identification import DynamicIdentification, Recording, identify_dynamic
from ...muscle.identification.static_identification import StaticIdentification, identify_static
from ...muscle.io.dynamic_files import save_dynamic
from ...muscle.io.published import muscle_model
from ...muscle.io.static_files import load_parameters, save_parameters
from ...muscle.laws.dynamic import G
from ...muscle.laws.static import BAR, StaticModel
from ..options.option_values import numbers

_Identification = StaticIdentification | DynamicIdentification

_REST = ("contraction_mm", "pressure_bar", "force_N")
_RESPONSE = ("time_s", "contraction_mm", "pressure_bar")


def named_static(name: str) -> StaticModel:
    """Return the static model of a published name or of the path of a .toml file."""
    return load_parameters(name) if name.endswith(".toml") else muscle_model(name)


def read_columns(path: str, names: Sequence[str]) -> FloatArray:
    """Read numbers from a CSV file whose first line that is no comment (#) names the columns.

    Parameters
    ----------
    path : str
        The file.
    names : sequence of str
        Columns to read; others are left out.

    Returns
    -------
    ndarray
        Shape (n, len(names)).

    Raises
    ------
    FileFormatError
        If the file cannot be read, a column is missing, or a cell is no finite number; it names the line.
    """
    table = read_csv(path)
    if not table.rows:
        raise FileFormatError("expected at least one line of numbers below the header", path)
    return table.numbers(names)


def run_muscle_identify(args: argparse.Namespace) -> int:
    """Answer ``exo-pin muscle identify`` and return its exit status."""
    if (args.csv is None) == (not args.response):
        raise InvalidInput("expected either a CSV of measurements at rest or --response, got both or neither")
    if args.response:
        return _identify_dynamic(args)
    if args.length_mm is None:
        raise InvalidInput("expected --length-mm, the nominal length of the muscle")
    columns = read_columns(args.csv, _REST)
    found = identify_static(
        columns[:, 0] / 1e3,
        columns[:, 1] * BAR,
        columns[:, 2],
        nominal_length=args.length_mm / 1e3,
        select="all" if args.all else "region",
        name=args.name,
        source=f"identified from {Path(args.csv).name}",
    )
    intervals = found.intervals(args.level)
    used = len(found.residuals)
    total = used if found.region is None else len(found.region.selected)
    print(f"{used} of {total} measurements; rms {found.rms:.3f} N, leave-one-out {found.leave_one_out_rms:.3f} N")
    _print_coefficients(found, intervals)
    strain, pressure = found.model.validity.strain, found.model.validity.pressure
    print(
        f"valid from {100 * strain[0]:.1f} to {100 * strain[1]:.1f} % and {pressure[0] / BAR:.2f} to "
        f"{pressure[1] / BAR:.2f} bar"
    )
    if args.out:
        table = {
            "measurements": len(found.residuals),
            "rms_N": found.rms,
            "leave_one_out_rms_N": found.leave_one_out_rms,
            **_certainty(found, args.level),
            "covariance": [list(map(float, row)) for row in found.covariance],
        }
        save_parameters(found.model, args.out, identification=table)
        print(args.out)
    return 0


def _identify_dynamic(args: argparse.Namespace) -> int:
    recordings = []
    for path, weight in args.response:
        (newtons,) = numbers(weight, f"the weight behind {path} to be a number of N", 1)
        columns = read_columns(path, _RESPONSE)
        mass = as_positive(f"the weight behind {path}", newtons) / G
        with naming_file(path):
            recordings.append(Recording(columns[:, 0], columns[:, 1] / 1e3, columns[:, 2] * BAR, mass))
    names = ", ".join(Path(path).name for path, _ in args.response)
    static = named_static(args.static)
    found = identify_dynamic(recordings, static, name=args.name, source=f"identified from {names}")
    print(f"{found.samples} samples; rms about the simulation {1e3 * found.sigma:.3f} mm")
    intervals = found.intervals(args.level)
    _print_coefficients(found, intervals)
    if args.out:
        table = {"samples": found.samples, "sigma_m": found.sigma, **_certainty(found, args.level)}
        save_dynamic(found.model, args.out, identification=table)
        print(args.out)
    return 0


def _print_coefficients(found: _Identification, intervals: FloatArray) -> None:
    for text in found.cautions:
        print(f"Caution: {text}")
    for name, value, (low, high) in zip(found.names, found.coefficients, intervals, strict=True):
        print(f"{name:>4} {value:14.5g}  [{low:.5g}, {high:.5g}]")


def _certainty(found: _Identification, level: float) -> dict[str, Any]:
    """How well the coefficients are known, as a parameter set has it."""
    intervals = zip(found.names, found.intervals(level), strict=True)
    return {
        "level": level,
        "indistinct": list(found.indistinct),
        "intervals": {name: list(map(float, pair)) for name, pair in intervals},
    }
