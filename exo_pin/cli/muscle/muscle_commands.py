"""``exo-pin muscle force|pressure|identify|step``: pneumatic muscles."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...core.errors import InvalidInput
from ...core.files import write_figure, write_text
from ...core.files.csv_tables import csv_text
from ...core.validation import FloatArray
from ...muscle.io.dynamic_files import dynamic_model, dynamic_models, load_dynamic
from ...muscle.io.published import muscle_models
from ...muscle.laws.dynamic import DynamicModel, G
from ...muscle.laws.friction import ConstantFriction
from ...muscle.laws.static import BAR, StaticModel
from ...muscle.simulation.pressure import PressureStep
from ...muscle.simulation.response import StepResponse
from ...muscle.simulation.step_response import simulate
from ...view.plots.muscle_plots import plot_force_map, plot_responses
from .. import add_flag, add_number, aligned
from ..options.option_values import duration
from .muscle_identify_command import add_identify, named_static

__all__ = ["add_commands"]


def add_commands(commands: Any) -> None:
    """Register the commands of this module."""
    parser = commands.add_parser("muscle")
    own = parser.add_subparsers(required=True, metavar="COMMAND")
    _add_force(own)
    _add_pressure(own)
    add_identify(own)
    _add_step(own)


def _static_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--model",
        default="best",
        metavar="NAME|FILE",
        help=f"force law: {', '.join(muscle_models())}, or a .toml file (default: best)",
    )
    add_number(
        parser,
        "--length-mm",
        "MM",
        "nominal length of the muscle, mm; the law is scaled by equal strain (default: as measured)",
    )
    add_flag(parser, "--mark", "mark answers outside the validity range with * instead of refusing them")


def _add_several(parser: argparse.ArgumentParser, name: str, unit: str, text: str) -> None:
    """Add an option with one number or several."""
    parser.add_argument(name, type=float, nargs="+", required=True, metavar=unit, help=f"{text}; one or several")


def _static(args: argparse.Namespace) -> StaticModel:
    model = named_static(args.model)
    return model if args.length_mm is None else model.scaled(args.length_mm / 1e3)


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
    print("\n".join(aligned([heads, *zip(*cells, strict=True)])))
    if any(np.ma.getmaskarray(c).any() for c in columns):
        print("* outside the validity range of the model")


def _add_force(commands: Any) -> None:
    parser = commands.add_parser("force", help="force at a contraction and a pressure, or a list of each")
    _static_arguments(parser)
    _add_several(parser, "--contraction-mm", "MM", "contraction, mm")
    _add_several(parser, "--pressure-bar", "BAR", "gauge pressure, bar")
    parser.add_argument("--plot", metavar="FILE", help="write a picture of the whole force map (needs matplotlib)")
    parser.set_defaults(run=_force)


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
    if args.plot:
        write_figure(args.plot, plot_force_map(model))
        print(f"wrote {args.plot}")
    return 0


def _add_pressure(commands: Any) -> None:
    parser = commands.add_parser("pressure", help="pressure that makes a muscle pull a force at a contraction")
    _static_arguments(parser)
    _add_several(parser, "--force-N", "N", "pull, N")
    _add_several(parser, "--contraction-mm", "MM", "contraction, mm")
    parser.set_defaults(run=_pressure)


def _pressure(args: argparse.Namespace) -> int:
    model = _static(args)
    f, x = (a.ravel() for a in np.meshgrid(args.force_N, args.contraction_mm, indexing="ij"))
    pressure = model.pressure_for(f, x / 1e3, outside=_outside(args))
    print(f"{model.name}, {model.length * 1e3:g} mm")
    _print_table(("force_N", "contraction_mm", "pressure_bar"), (f, x, pressure / BAR), (2, 2, 3))
    return 0


def _add_step(commands: Any) -> None:
    parser = commands.add_parser("step", help="response of a hung mass to a step of pressure")
    parser.add_argument(
        "--model",
        default="tang-3-31",
        metavar="NAME|FILE",
        help=f"dynamic model: {', '.join(dynamic_models())}, or a .toml file (default: tang-3-31)",
    )
    load = parser.add_mutually_exclusive_group(required=True)
    add_number(load, "--mass-kg", "KG", "hung mass, kg")
    load.add_argument("--weight-N", type=float, dest="weight_N", metavar="N", help="weight of the hung mass, N")
    add_number(parser, "--from-bar", "BAR", "gauge pressure before the step, bar", 0.0)
    parser.add_argument("--to-bar", type=float, required=True, metavar="BAR", help="gauge pressure after it, bar")
    add_number(parser, "--lag-s", "S", "time constant of the filling, s", 0.1)
    add_number(parser, "--duration-s", "S", "how long to simulate, s", 4.0)
    add_flag(parser, "--mark", "go on outside the model's range and report the share of time")
    parser.add_argument(
        "--csv",
        metavar="FILE",
        help="write the columns time_s, contraction_mm, velocity_mm_per_s, pressure_bar, inside",
    )
    parser.add_argument(
        "--plot", metavar="FILE", help="write a picture beside the same muscle with a constant friction of 2.5 N"
    )
    parser.set_defaults(run=_step)


def _step(args: argparse.Namespace) -> int:
    model: DynamicModel = load_dynamic(args.model) if args.model.endswith(".toml") else dynamic_model(args.model)
    mass = args.mass_kg if args.mass_kg is not None else args.weight_N / G
    pressure = PressureStep(args.from_bar * BAR, args.to_bar * BAR, time_constant=args.lag_s)
    end = duration("--duration-s", args.duration_s)
    times = np.linspace(0.0, end, max(2, round(end / 1e-3) + 1))
    response = simulate(model, mass, pressure, times, outside=_outside(args))
    print(f"{model.name}, {mass:.3f} kg, {args.from_bar:g} to {args.to_bar:g} bar with a lag of {args.lag_s:g} s")
    for text in response.cautions:
        print(f"Caution: {text}")
    print(f"contraction    {response.contraction[0] * 1e3:.2f} to {response.steady_state * 1e3:.2f} mm")
    print(f"at rest        {'yes' if response.at_rest else 'no'}")
    print("\n".join(_step_facts(response)))
    print(f"error          {response.error_estimate:.1e} m (integration)")
    if args.csv:
        _write_csv(args.csv, response)
        print(f"wrote {args.csv}")
    if args.plot:
        constant = replace(model, name="constant friction of 2.5 N", friction=ConstantFriction())
        beside = simulate(constant, mass, pressure, times, outside="mark", estimate_error=False)
        write_figure(args.plot, plot_responses({model.name: response, constant.name: beside}))
        print(f"wrote {args.plot}")
    return 0


def _step_facts(response: StepResponse) -> list[str]:
    """Lines about overshoot and settling, which a mass that ends where it began does not have."""
    try:
        time = response.settling_time()
    except InvalidInput:
        return ["no step        the mass ends where it began"]
    settled = f"{time:.3f} s (2 %)" if np.isfinite(time) else "longer than the response (2 %)"
    return [f"overshoot      {100 * response.overshoot:.1f} %", f"settling time  {settled}"]


def _write_csv(path: str, response: Any) -> None:
    columns = ("time_s", "contraction_mm", "velocity_mm_per_s", "pressure_bar", "inside")
    values = (response.time, response.contraction * 1e3, response.velocity * 1e3, response.pressure / BAR)
    rows = zip(np.column_stack(values), response.inside, strict=True)
    cells = ([*(f"{value:.6f}" for value in row), str(int(inside))] for row, inside in rows)
    write_text(path, csv_text(columns, cells))
