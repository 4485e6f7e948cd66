"""Command line of the muscles: ``exo-pin muscle force|pressure|identify|step``. Printing is allowed only here."""

# ruff: noqa: T201
from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import FileFormatError, InvalidInput
from ..validation import FloatArray
from .dynamic import G, DynamicModel
from .dynamic_files import dynamic_model, dynamic_models, load_dynamic, save_dynamic
from .files import load_parameters, save_parameters
from .identify import StaticIdentification, identify_static
from .identify_dynamic import Recording, identify_dynamic
from .pressure import PressureStep
from .published import muscle_model, muscle_models
from .simulate import simulate
from .static import BAR, StaticModel

__all__ = ["add_parser"]

_REST = ("contraction_mm", "pressure_bar", "force_N")
_RESPONSE = ("time_s", "contraction_mm", "pressure_bar")


def add_parser(subparsers: Any) -> argparse.ArgumentParser:
    """Register ``muscle`` with its four commands.

    Parameters
    ----------
    subparsers
        What ``ArgumentParser.add_subparsers`` returned. Each command sets ``handler``, a function of the parsed
        arguments that prints and returns an exit status; errors of exo_pin travel to the caller.

    Returns
    -------
    argparse.ArgumentParser
        The parser of ``muscle``.
    """
    parser: argparse.ArgumentParser = subparsers.add_parser("muscle", help="pneumatic muscles")
    commands = parser.add_subparsers(dest="muscle_command", required=True)
    _add_force(commands)
    _add_pressure(commands)
    _add_identify(commands)
    _add_step(commands)
    return parser


def _static_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--model", default="best", help=f"{', '.join(muscle_models())}, or the path of a .toml (default: best)"
    )
    parser.add_argument(
        "--length-mm", type=float, help="nominal length; scaled by equal strain (default: as measured)"
    )
    parser.add_argument(
        "--mark",
        action="store_true",
        help="mark answers outside the validity range with * instead of refusing them",
    )


def _static(args: argparse.Namespace) -> StaticModel:
    model = _named_static(args.model)
    return model if args.length_mm is None else model.scaled(args.length_mm / 1e3)


def _named_static(name: str) -> StaticModel:
    return load_parameters(name) if name.endswith(".toml") else muscle_model(name)


def _outside(args: argparse.Namespace) -> str:
    return "mark" if args.mark else "raise"


def _print_table(heads: Sequence[str], columns: Sequence[FloatArray], digits: Sequence[int]) -> None:
    cells = [
        [
            "none" if not np.isfinite(v) else f"{v:.{d}f}" + ("*" if masked else "")
            for v, masked in zip(np.ma.getdata(c), np.ma.getmaskarray(c), strict=True)
        ]
        for c, d in zip(columns, digits, strict=True)
    ]
    widths = [max(len(h), *(len(v) for v in column)) for h, column in zip(heads, cells, strict=True)]
    print("  ".join(h.rjust(w) for h, w in zip(heads, widths, strict=True)))
    for row in zip(*cells, strict=True):
        print("  ".join(v.rjust(w) for v, w in zip(row, widths, strict=True)))
    if any(np.ma.getmaskarray(c).any() for c in columns):
        print("* outside the validity range of the model")


def _add_force(commands: Any) -> None:
    parser = commands.add_parser("force", help="force at a contraction and a pressure, or a list of each")
    _static_arguments(parser)
    parser.add_argument("--contraction-mm", type=float, nargs="+", required=True)
    parser.add_argument("--pressure-bar", type=float, nargs="+", required=True)
    parser.set_defaults(handler=_force)


def _force(args: argparse.Namespace) -> int:
    model = _static(args)
    x, p = (a.ravel() for a in np.meshgrid(args.contraction_mm, args.pressure_bar, indexing="ij"))
    si = (x / 1e3, p * BAR)
    force = model.force(*si, outside=_outside(args))
    stiffness = model.stiffness(*si, outside=_outside(args))
    gain = model.pressure_gain(*si, outside=_outside(args))
    print(f"{model.name}, {model.length * 1e3:g} mm")
    heads = ("contraction_mm", "pressure_bar", "force_N", "stiffness_N_per_mm", "gain_N_per_bar")
    _print_table(heads, (x, p, force, stiffness / 1e3, gain * BAR), (2, 3, 2, 3, 2))
    return 0


def _add_pressure(commands: Any) -> None:
    parser = commands.add_parser("pressure", help="pressure that makes a muscle pull a force at a contraction")
    _static_arguments(parser)
    parser.add_argument("--force-N", type=float, nargs="+", required=True, dest="force_N")
    parser.add_argument("--contraction-mm", type=float, nargs="+", required=True)
    parser.set_defaults(handler=_pressure)


def _pressure(args: argparse.Namespace) -> int:
    model = _static(args)
    f, x = (a.ravel() for a in np.meshgrid(args.force_N, args.contraction_mm, indexing="ij"))
    pressure = model.pressure_for(f, x / 1e3, outside=_outside(args))
    print(f"{model.name}, {model.length * 1e3:g} mm")
    _print_table(("force_N", "contraction_mm", "pressure_bar"), (f, x, pressure / BAR), (2, 2, 3))
    return 0


def read_columns(path: str, names: Sequence[str]) -> FloatArray:
    """Read numbers from a CSV file whose first line that is no comment (#) names the columns.

    Parameters
    ----------
    path : str
        The file.
    names : sequence of str
        Columns that are wanted; others are passed over.

    Returns
    -------
    ndarray
        Shape (n, len(names)).

    Raises
    ------
    FileFormatError
        If the file cannot be read, a column is missing, or a cell is no finite number; it names the line.
    """
    try:
        lines = Path(path).read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise FileFormatError(f"cannot be read: {error}", path) from None
    body = [(n, line) for n, line in enumerate(lines, start=1) if line.strip() and not line.startswith("#")]
    table = csv.DictReader(line for _, line in body)
    missing = [c for c in names if c not in (table.fieldnames or ())]
    if missing:
        raise FileFormatError(f"expected the columns {', '.join(names)}; missing: {', '.join(missing)}", path)
    values = []
    for (number, _), row in zip(body[1:], table, strict=True):
        try:
            numbers = [float(row[c]) for c in names]
        except (TypeError, ValueError):
            numbers = [float("nan")]
        if not np.isfinite(numbers).all():
            cells = ", ".join(f"{c}={row[c]!r}" for c in names)
            raise FileFormatError(f"line {number}: expected finite numbers, got {cells}", path)
        values.append(numbers)
    if not values:
        raise FileFormatError("expected at least one line of numbers", path)
    return np.array(values)


def _add_identify(commands: Any) -> None:
    parser = commands.add_parser(
        "identify",
        help="fit a force law to measurements at rest, or friction and damping to responses; write a parameter set",
    )
    parser.add_argument("csv", nargs="?", help="measurements at rest: contraction_mm, pressure_bar, force_N")
    parser.add_argument("--length-mm", type=float, help="nominal length of the muscle, for measurements at rest")
    parser.add_argument(
        "--response",
        nargs=2,
        action="append",
        metavar=("CSV", "WEIGHT_N"),
        help="a response of a hung weight: time_s, contraction_mm, pressure_bar; may be given several times",
    )
    parser.add_argument(
        "--static",
        default="best",
        help=f"force law that responses are fitted with: {', '.join(muscle_models())}, or a .toml (default: best)",
    )
    parser.add_argument(
        "--all", action="store_true", help="fit every measurement instead of the region where the law holds"
    )
    parser.add_argument("--level", type=float, default=0.95, help="confidence of the intervals (default: 0.95)")
    parser.add_argument("--name", default="identified")
    parser.add_argument("--output", help="TOML file to write")
    parser.set_defaults(handler=_identify)


def _identify(args: argparse.Namespace) -> int:
    if (args.csv is None) == (args.response is None):
        raise InvalidInput("expected either a CSV of measurements at rest or --response, got both or neither")
    if args.response is not None:
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
    kept = len(found.residuals)
    total = kept if found.region is None else len(found.region.kept)
    print(f"{kept} of {total} measurements; rms {found.rms:.3f} N, leave-one-out {found.leave_one_out_rms:.3f} N")
    for name, value, (low, high) in zip(found.names, found.coefficients, intervals, strict=True):
        print(f"{name:>4} {value:14.5g}  [{low:.5g}, {high:.5g}]")
    if found.indistinct:
        print(f"cannot be told apart (compare forces): {', '.join(found.indistinct)}")
    strain, pressure = found.model.validity.strain, found.model.validity.pressure
    print(
        f"holds from {100 * strain[0]:.1f} to {100 * strain[1]:.1f} % and {pressure[0] / BAR:.2f} to "
        f"{pressure[1] / BAR:.2f} bar"
    )
    if args.output:
        save_parameters(found.model, args.output, identification=_identification_table(found, args.level))
        print(f"wrote {args.output}")
    return 0


def _identify_dynamic(args: argparse.Namespace) -> int:
    recordings = []
    for path, weight in args.response:
        try:
            mass = float(weight) / G
        except ValueError:
            raise InvalidInput(f"expected the weight behind {path} to be a number of N, got {weight!r}") from None
        columns = read_columns(path, _RESPONSE)
        recordings.append(Recording(columns[:, 0], columns[:, 1] / 1e3, columns[:, 2] * BAR, mass))
    names = ", ".join(Path(path).name for path, _ in args.response)
    static = _named_static(args.static)
    found = identify_dynamic(recordings, static, name=args.name, source=f"identified from {names}")
    print(f"{found.samples} samples; rms about the simulation {1e3 * found.sigma:.3f} mm")
    print(f"{100 * found.inside:.0f} % of them inside the model's range")
    intervals = found.intervals(args.level)
    for name, value, (low, high) in zip(found.names, found.coefficients, intervals, strict=True):
        print(f"{name:>4} {value:14.5g}  [{low:.5g}, {high:.5g}]")
    if found.indistinct:
        print(f"cannot be told apart (compare responses): {', '.join(found.indistinct)}")
    if args.output:
        table = {
            "samples": found.samples,
            "sigma_m": found.sigma,
            "level": args.level,
            "indistinct": list(found.indistinct),
            "intervals": {n: list(map(float, pair)) for n, pair in zip(found.names, intervals, strict=True)},
        }
        save_dynamic(found.model, args.output, identification=table)
        print(f"wrote {args.output}")
    return 0


def _identification_table(found: StaticIdentification, level: float) -> dict[str, Any]:
    return {
        "measurements": len(found.residuals),
        "rms_N": found.rms,
        "leave_one_out_rms_N": found.leave_one_out_rms,
        "level": level,
        "indistinct": list(found.indistinct),
        "intervals": {
            n: list(map(float, pair)) for n, pair in zip(found.names, found.intervals(level), strict=True)
        },
        "covariance": [list(map(float, row)) for row in found.covariance],
    }


def _add_step(commands: Any) -> None:
    parser = commands.add_parser("step", help="response of a hung mass to a step of pressure")
    parser.add_argument(
        "--model",
        default="tang-3-31",
        help=f"{', '.join(dynamic_models())}, or the path of a .toml (default: tang-3-31)",
    )
    load = parser.add_mutually_exclusive_group(required=True)
    load.add_argument("--mass-kg", type=float)
    load.add_argument("--weight-N", type=float, dest="weight_N")
    parser.add_argument("--from-bar", type=float, default=0.0)
    parser.add_argument("--to-bar", type=float, required=True)
    parser.add_argument("--lag-s", type=float, default=0.1, help="time constant of the filling (default: 0.1)")
    parser.add_argument("--duration-s", type=float, default=4.0)
    parser.add_argument("--mark", action="store_true", help="go on outside the model's range and say how much")
    parser.add_argument("--csv", help="write time_s, contraction_mm, velocity_mm_per_s, pressure_bar, inside")
    parser.set_defaults(handler=_step)


def _step(args: argparse.Namespace) -> int:
    model: DynamicModel = load_dynamic(args.model) if args.model.endswith(".toml") else dynamic_model(args.model)
    mass = args.mass_kg if args.mass_kg is not None else args.weight_N / G
    pressure = PressureStep(args.from_bar * BAR, args.to_bar * BAR, time_constant=args.lag_s)
    samples = max(2, round(args.duration_s / 1e-3) + 1)
    times = np.linspace(0.0, args.duration_s, samples)
    response = simulate(model, mass, pressure, times, outside=_outside(args))
    print(f"{model.name}, {mass:.3f} kg, {args.from_bar:g} to {args.to_bar:g} bar with a lag of {args.lag_s:g} s")
    print(f"contraction    {response.contraction[0] * 1e3:.2f} to {response.steady_state * 1e3:.2f} mm")
    print(f"at rest        {'yes' if response.at_rest else 'no'}")
    print(f"overshoot      {100 * response.overshoot:.1f} %")
    print(f"settling time  {response.settling_time():.3f} s (2 %)")
    print(f"inside range   {100 * response.inside.mean():.1f} % of the time")
    print(f"error          {response.error_estimate:.1e} m (integration)")
    if args.csv:
        _write_csv(args.csv, response)
        print(f"wrote {args.csv}")
    return 0


def _write_csv(path: str, response: Any) -> None:
    rows = zip(
        response.time,
        response.contraction * 1e3,
        response.velocity * 1e3,
        response.pressure / BAR,
        response.inside,
        strict=True,
    )
    # Beside its place first, so that a file is never half-written.
    temporary = Path(path + ".part")
    with temporary.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow(("time_s", "contraction_mm", "velocity_mm_per_s", "pressure_bar", "inside"))
        writer.writerows((f"{t:.6f}", f"{x:.6f}", f"{v:.6f}", f"{p:.6f}", int(i)) for t, x, v, p, i in rows)
    temporary.replace(path)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the muscle commands alone; the package's own command line hooks :func:`add_parser` instead."""
    parser = argparse.ArgumentParser(prog="exo-pin")
    add_parser(parser.add_subparsers(required=True))
    args = parser.parse_args(arguments)
    return int(args.handler(args))


if __name__ == "__main__":
    sys.exit(main())
