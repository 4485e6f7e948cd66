"""``exo-pin muscle force|pressure|identify|step``: pneumatic muscles."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ...core.errors import FileFormatError, InvalidInput
from ...core.files.csv_tables import read_csv
from ...core.files.toml_tables import naming_file
from ...core.tables import aligned
from ...core.validation import FloatArray, as_positive
from ...muscle.identification.dynamic_identification import DynamicIdentification, Recording, identify_dynamic
from ...muscle.identification.static_identification import StaticIdentification, identify_static
from ...muscle.io.model_files import (
    dynamic_model,
    load_dynamic,
    load_parameters,
    muscle_model,
    save_dynamic,
    save_parameters,
)
from ...muscle.laws.dynamic import DynamicModel, G
from ...muscle.laws.friction import ConstantFriction
from ...muscle.laws.static import BAR, StaticModel
from ...muscle.simulation.response import PressureStep, StepResponse
from ...muscle.simulation.step_response import simulate
from ...view.plots.muscle_plots import plot_force_map, plot_responses
from .. import deliver
from ..options.query_options import duration, numbers

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


def _static(args: argparse.Namespace) -> StaticModel:
    model = named_static(args.model)
    return model if args.length_mm is None else model.scaled(args.length_mm / 1e3)


def _outside(args: argparse.Namespace) -> str:
    return "mark" if args.mark else "raise"


def _deliver(
    args: argparse.Namespace, model: StaticModel, columns: dict[str, FloatArray], digits: Sequence[int]
) -> int:
    cells = [
        [
            "none" if not np.isfinite(v) else f"{v:.{d}f}" + ("*" if masked else "")
            for v, masked in zip(np.ma.getdata(c), np.ma.getmaskarray(c), strict=True)
        ]
        for c, d in zip(columns.values(), digits, strict=True)
    ]
    lines = [f"{model.name}, {model.length * 1e3:g} mm", *aligned([list(columns), *zip(*cells, strict=True)])]
    if any(np.ma.getmaskarray(c).any() for c in columns.values()):
        lines.append("* outside the validity range of the model")
    deliver(
        args,
        "\n".join(lines),
        columns=lambda: {name: np.ma.getdata(column) for name, column in columns.items()},
        figure=lambda: plot_force_map(model),
    )
    return 0


def run_muscle_force(args: argparse.Namespace) -> int:
    """Answer ``exo-pin muscle force`` and return its exit status."""
    model = _static(args)
    x, p = (a.ravel() for a in np.meshgrid(args.contraction_mm, args.pressure_bar, indexing="ij"))
    si = (x / 1e3, p * BAR)
    force = model.force(*si, outside=_outside(args))
    stiffness = model.stiffness(*si, outside=_outside(args))
    gain = model.pressure_gain(*si, outside=_outside(args))
    heads = ("contraction_mm", "pressure_bar", "force_N", "stiffness_N_per_mm", "gain_N_per_bar")
    return _deliver(
        args, model, dict(zip(heads, (x, p, force, stiffness / 1e3, gain * BAR), strict=True)), (2, 3, 2, 3, 2)
    )


def run_muscle_pressure(args: argparse.Namespace) -> int:
    """Answer ``exo-pin muscle pressure`` and return its exit status."""
    model = _static(args)
    f, x = (a.ravel() for a in np.meshgrid(args.force_N, args.contraction_mm, indexing="ij"))
    pressure = model.pressure_for(f, x / 1e3, outside=_outside(args))
    return _deliver(args, model, {"force_N": f, "contraction_mm": x, "pressure_bar": pressure / BAR}, (2, 2, 3))


def run_muscle_step(args: argparse.Namespace) -> int:
    """Answer ``exo-pin muscle step`` and return its exit status."""
    model: DynamicModel = load_dynamic(args.model) if args.model.endswith(".toml") else dynamic_model(args.model)
    mass = args.mass_kg if args.mass_kg is not None else args.weight_N / G
    pressure = PressureStep(args.from_bar * BAR, args.to_bar * BAR, time_constant=args.lag_s)
    end = duration("--duration-s", args.duration_s)
    times = np.linspace(0.0, end, max(2, round(end / 1e-3) + 1))
    response = simulate(model, mass, pressure, times, outside=_outside(args))
    lines = [f"{model.name}, {mass:.3f} kg, {args.from_bar:g} to {args.to_bar:g} bar with a lag of {args.lag_s:g} s"]
    lines += [f"Caution: {text}" for text in response.cautions]
    lines.append(f"contraction    {response.contraction[0] * 1e3:.2f} to {response.steady_state * 1e3:.2f} mm")
    lines.append(f"at rest        {'yes' if response.at_rest else 'no'}")
    lines += _step_facts(response)

    def figure() -> Any:
        constant = replace(model, name="constant friction of 2.5 N", friction=ConstantFriction())
        beside = simulate(constant, mass, pressure, times, outside="mark")
        return plot_responses({model.name: response, constant.name: beside})

    deliver(args, "\n".join(lines), columns=lambda: _columns(response), figure=figure)
    return 0


def _step_facts(response: StepResponse) -> list[str]:
    """Lines about overshoot and settling, which a mass that ends where it began does not have."""
    try:
        time = response.settling_time()
    except InvalidInput:
        return ["no step        the mass ends where it began"]
    settled = f"{time:.3f} s (2 %)" if np.isfinite(time) else "longer than the response (2 %)"
    return [f"overshoot      {100 * response.overshoot:.1f} %", f"settling time  {settled}"]


def _columns(response: StepResponse) -> dict[str, Any]:
    scaled = (response.time, response.contraction * 1e3, response.velocity * 1e3, response.pressure / BAR)
    names = ("time_s", "contraction_mm", "velocity_mm_per_s", "pressure_bar")
    columns = {name: np.round(values, 6) for name, values in zip(names, scaled, strict=True)}
    return columns | {"inside": response.inside.astype(int)}
