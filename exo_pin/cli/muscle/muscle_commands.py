"""``exo-pin muscle force|pressure|identify|step``: pneumatic muscles."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...core.errors import InvalidInput
from ...core.tables import aligned
from ...core.validation import FloatArray
from ...muscle.io.dynamic_files import dynamic_model, load_dynamic
from ...muscle.laws.dynamic import DynamicModel, G
from ...muscle.laws.friction import ConstantFriction
from ...muscle.laws.static import BAR, StaticModel
from ...muscle.simulation.pressure import PressureStep
from ...muscle.simulation.response import StepResponse
from ...muscle.simulation.step_response import simulate
from ...view.plots.muscle_plots import plot_force_map, plot_responses
from .. import deliver
from ..options.option_values import duration
from .muscle_identify_command import named_static
from .muscle_identify_command import run_muscle_identify as run_muscle_identify


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
    lines += [*_step_facts(response), f"error          {response.error_estimate:.1e} m (integration)"]

    def figure() -> Any:
        constant = replace(model, name="constant friction of 2.5 N", friction=ConstantFriction())
        beside = simulate(constant, mass, pressure, times, outside="mark", estimate_error=False)
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
