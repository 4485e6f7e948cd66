"""``exo-pin muscle force|pressure|identify|step|loop``: pneumatic muscles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from cyclopts import Parameter

from ..core.errors import InvalidInput
from ..core.results import taken_as_known
from ..core.tables import aligned
from ..core.validation import FloatArray, as_positive
from ..muscle.identification.dynamic_identification import DynamicIdentification, Recording, identify_dynamic
from ..muscle.identification.static_identification import StaticIdentification, identify_static
from ..muscle.io.measurement_files import read_measurements, read_response
from ..muscle.io.model_files import (
    dynamic_model,
    dynamic_models,
    load_dynamic,
    load_parameters,
    muscle_model,
    muscle_models,
    save_dynamic,
    save_parameters,
)
from ..muscle.laws.dynamic import DynamicModel, G
from ..muscle.laws.static import BAR, StaticModel
from ..muscle.simulation.response import PressureStep, StepResponse
from ..muscle.simulation.step_response import simulate
from ..view.plots.muscle_plots import plot_force_map, plot_motion
from . import options
from .command import Files, writes

_Identification = StaticIdentification | DynamicIdentification

#: The dynamic model that a step is of unless said otherwise, and its static law, with which responses are fitted.
_DYNAMIC, _STATIC = "tang-3-31", "tang-3-25"
Several = Parameter(consume_multiple=True)


def _model(said: str, names: list[str]) -> Parameter:
    """An option that names a model or its file."""
    return options.called("NAME|FILE", help=f"{said}: {', '.join(names)}, or a .toml file.")


@options.group
@dataclass(frozen=True)
class Law:
    """A force law at rest.

    Attributes
    ----------
    length_mm : float, optional
        Nominal length of the muscle, mm; the law is scaled by equal strain (default: as measured).
    mark : bool
        Mark answers outside the validity range with * instead of raising an error.
    """

    model: Annotated[str, _model("Force law", muscle_models())] = "best"
    length_mm: options.Millimetres | None = None
    mark: bool = False

    @property
    def static(self) -> StaticModel:
        """The law, for a muscle of the length that is asked for."""
        model = named_static(self.model)
        return model if self.length_mm is None else model.scaled(self.length_mm / 1e3)


@options.group
@dataclass(frozen=True)
class Hung:
    """What hangs on the muscle.

    Attributes
    ----------
    mass_kg : float, optional
        Hung mass, kg.
    weight_N : float, optional
        Weight of the hung mass, N, instead of its mass.
    """

    mass_kg: options.Kilograms | None = None
    weight_N: Annotated[options.Newtons | None, Parameter(name="--weight-N")] = None

    @property
    def mass(self) -> float:
        """The hung mass, kg."""
        if (self.mass_kg is None) == (self.weight_N is None):
            raise InvalidInput("expected one of --mass-kg and --weight-N, got both or neither")
        return self.weight_N / G if self.weight_N is not None else float(self.mass_kg or 0.0)


def named_static(name: str) -> StaticModel:
    """Return the static model of a published name or of the path of a .toml file."""
    return load_parameters(name) if name.endswith(".toml") else muscle_model(name)


@writes(".toml", json=False)
def muscle_identify(
    csv: Annotated[str | None, options.called("FILE")] = None,
    /,
    *,
    length_mm: options.Millimetres | None = None,
    response: Annotated[tuple[tuple[str, str], ...], options.called("CSV WEIGHT_N")] = (),
    diameter_mm: options.Millimetres | None = None,
    static: Annotated[str, _model("Force law that responses are fitted with", muscle_models())] = _STATIC,
    all: bool = False,
    progress: options.Progress = False,
    name: Annotated[str, options.called("NAME")] = "identified",
    files: Files = Files(),
) -> None:
    """Fit a force law to measurements at rest, or friction and damping to responses, and write a parameter set.

    Parameters
    ----------
    csv : str, optional
        CSV file of measurements at rest. Its headers say the units: contraction_mm (percent), strain or length_mm;
        pressure_bar (kPa, MPa, psi; _abs if absolute); force_N (kgf, lbf) or mass_kg.
    length_mm : float, optional
        Nominal length of the muscle, mm, for measurements at rest.
    response : tuple of tuple, optional
        CSV file of the response of a hung weight, N, with a column of time (time_s, time_ms), contraction and pressure;
        may be repeated.
    diameter_mm : float, optional
        Diameter of the muscle at rest, mm, against which the pull is checked.
    all : bool
        Fit every measurement instead of the region where the law holds.
    name : str
        Name of the parameter set.

    Examples
    --------
    exo-pin muscle identify examples/muscle.csv --length-mm 300 --out mine.toml
    """
    if (csv is None) == (not response):
        raise InvalidInput("expected either a CSV of measurements at rest or --response, got both or neither")
    if csv is None:
        law = named_static(static)
        recordings = [_recording(path, weight, law) for path, weight in response]
        source = f"identified from {', '.join(Path(path).name for path, _ in response)}"
        found: Any = identify_dynamic(recordings, law, name=name, source=source, progress=progress)
        print(taken_as_known(found.known))
        print(f"{found.samples} samples; rms about the simulation {1e3 * found.sigma:.3f} mm")
        table: dict[str, Any] = {"samples": found.samples, "sigma_m": found.sigma}
    else:
        if length_mm is None:
            raise InvalidInput("expected --length-mm, the nominal length of the muscle")
        diameter = None if diameter_mm is None else as_positive("--diameter-mm", diameter_mm) / 1e3
        data = read_measurements(csv, as_positive("--length-mm", length_mm) / 1e3, diameter)
        found = identify_static(
            data.contraction,
            data.pressure,
            data.force,
            data.nominal_length,
            select="all" if all else "region",
            name=name,
            source=f"identified from {Path(csv).name}",
            diameter=diameter,
            written=data.written,
        )
        used = len(found.residuals)
        total = used if found.region is None else len(found.region.selected)
        print(taken_as_known(found.known))
        print(f"{used} of {total} measurements; rms {found.rms:.3f} N, leave-one-out {found.leave_one_out_rms:.3f} N")
        table = {"measurements": used, "rms_N": found.rms, "leave_one_out_rms_N": found.leave_one_out_rms}
    intervals = found.intervals()
    for text in found.cautions:
        print(f"Caution: {text}")
    for key, value, (low, high) in zip(found.names, found.coefficients, intervals, strict=True):
        print(f"{key:>4} {value:14.5g}  [{low:.5g}, {high:.5g}]")
    if csv is not None:
        strain, pressure = found.model.validity.strain, found.model.validity.pressure
        low, high = pressure[0] / BAR, pressure[1] / BAR
        if diameter_mm is None:
            least, most = (1e3 * diameter for diameter in found.diameters)
            print(
                f"pulls like a muscle of {least:.0f} to {most:.0f} mm diameter (--diameter-mm checks the force by it)"
            )
        print(f"valid from {100 * strain[0]:.1f} to {100 * strain[1]:.1f} % and {low:.2f} to {high:.2f} bar")
    if files.out:
        table |= {
            "level": 0.95,
            "indistinct": list(found.indistinct),
            "intervals": {key: list(map(float, pair)) for key, pair in zip(found.names, intervals, strict=True)},
        }
        if csv is None:
            save_dynamic(found.model, files.out, identification=table)
        else:
            table["covariance"] = [list(map(float, row)) for row in found.covariance]
            save_parameters(found.model, files.out, identification=table)
        print(files.out)


def _recording(path: str, weight: str, law: StaticModel) -> Recording:
    """The response of a hung weight."""
    (newtons,) = options.numbers(weight, f"the weight behind {path} to be a number of N", 1)
    return read_response(path, as_positive(f"the weight behind {path}", newtons) / G, law.length)


def _deliver(model: StaticModel, columns: dict[str, FloatArray], digits: Sequence[int], files: Files) -> None:
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
    files.deliver(
        "\n".join(lines),
        columns=lambda: columns,
        figure=lambda: plot_force_map(model),
    )


@writes(".csv", ".xlsx", ".npz", json=False, plot="the whole force map")
def muscle_force(
    *,
    contraction_mm: Annotated[list[options.Millimetres], Several],
    pressure_bar: Annotated[list[options.Bar], Several],
    law: Law = Law(),
    files: Files = Files(),
) -> None:
    """Compute the force of a muscle at a contraction and a pressure, or at a list of each.

    Parameters
    ----------
    contraction_mm : list of float
        Contraction, mm; one or several.
    pressure_bar : list of float
        Gauge pressure, bar; one or several.

    Examples
    --------
    exo-pin muscle force --contraction-mm 20 --pressure-bar 2 4
    """
    model, outside = law.static, _outside(law.mark)
    x, p = (a.ravel() for a in np.meshgrid(contraction_mm, pressure_bar, indexing="ij"))
    si = (x / 1e3, p * BAR)
    columns = {
        "contraction_mm": x,
        "pressure_bar": p,
        "force_N": model.force(*si, outside=outside),
        "stiffness_N_per_mm": model.stiffness(*si, outside=outside) / 1e3,
        "gain_N_per_bar": model.pressure_gain(*si, outside=outside) * BAR,
    }
    _deliver(model, columns, (2, 3, 2, 3, 2), files)


@writes(".csv", ".xlsx", ".npz", json=False)
def muscle_pressure(
    *,
    force_N: Annotated[list[options.Newtons], Several, Parameter(name="--force-N")],
    contraction_mm: Annotated[list[options.Millimetres], Several],
    law: Law = Law(),
    files: Files = Files(),
) -> None:
    """Compute the pressure that makes a muscle pull a force at a contraction.

    Parameters
    ----------
    force_N : list of float
        Pull, N; one or several.
    contraction_mm : list of float
        Contraction, mm; one or several.

    Examples
    --------
    exo-pin muscle pressure --force-N 30 --contraction-mm 20
    """
    model = law.static
    f, x = (a.ravel() for a in np.meshgrid(force_N, contraction_mm, indexing="ij"))
    pressure = model.pressure_for(f, x / 1e3, outside=_outside(law.mark))
    _deliver(model, {"force_N": f, "contraction_mm": x, "pressure_bar": pressure / BAR}, (2, 2, 3), files)


def _outside(mark: bool) -> str:
    return "mark" if mark else "raise"


@writes(".csv", ".xlsx", ".npz", json=False, plot="contraction and pressure over time")
def muscle_step(
    *,
    to_bar: options.Bar,
    hung: Hung = Hung(),
    from_bar: options.Bar = 0.0,
    lag_s: options.Seconds = 0.1,
    duration_s: options.Seconds = 4.0,
    model: Annotated[str, _model("Dynamic model", dynamic_models())] = _DYNAMIC,
    mark: bool = False,
    files: Files = Files(),
) -> None:
    """Compute the response of a hung mass to a step of pressure.

    Parameters
    ----------
    to_bar : float
        Gauge pressure after the step, bar.
    from_bar : float
        Gauge pressure before the step, bar.
    lag_s : float
        Time constant of the filling, s.
    duration_s : float
        How long to simulate, s.
    mark : bool
        Continue outside the model's range, and report for what share of the time.

    Examples
    --------
    exo-pin muscle step --weight-N 10 --to-bar 3.6 --mark --out response.csv
    """
    mass = hung.mass
    law: DynamicModel = load_dynamic(model) if model.endswith(".toml") else dynamic_model(model)
    pressure = PressureStep(from_bar * BAR, to_bar * BAR, time_constant=lag_s)
    end = options.duration("--duration-s", duration_s)
    times = np.linspace(0.0, end, max(2, round(end / 1e-3) + 1))
    response = simulate(law, mass, pressure, times, outside=_outside(mark))
    lines = [f"{law.name}, {mass:.3f} kg, {from_bar:g} to {to_bar:g} bar with a lag of {lag_s:g} s"]
    lines += [f"Caution: {text}" for text in response.cautions]
    lines.append(f"contraction    {response.contraction[0] * 1e3:.2f} to {response.steady_state * 1e3:.2f} mm")
    lines.append(f"at rest        {'yes' if response.at_rest else 'no'}")
    lines += _step_facts(response)

    columns = _columns(response)
    files.deliver("\n".join(lines), columns=lambda: columns, figure=lambda: plot_motion(columns))


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


@writes(".csv", ".xlsx", ".npz", json=False, plot="contraction, pressure and duty over time")
def muscle_loop(
    *,
    to_percent: options.Percent,
    hung: Hung = Hung(),
    length_mm: options.Millimetres = 250.0,
    duration_s: options.Seconds = 5.0,
    model: Annotated[str, _model("Force law", muscle_models())] = "best",
    files: Files = Files(),
) -> None:
    """Compute a step of one muscle under its PI controller, with a hung mass (Figure 5-10 of the thesis).

    Parameters
    ----------
    to_percent : float
        Wanted contraction, % of the nominal length.
    length_mm : float
        Nominal length of the muscle, mm.
    duration_s : float
        How long to simulate, s.

    Examples
    --------
    exo-pin muscle loop --to-percent 15 --weight-N 12.74
    """
    from ..control.controllers.thesis_controller import table_5_5_gains
    from ..control.experiments.muscle_loop import muscle_loop as simulated

    law = named_static(model).scaled(as_positive("--length-mm", length_mm) / 1e3)
    gains, mass = table_5_5_gains([law.length])[0], hung.mass
    run = simulated(law, mass, to_percent / 100.0, duration=options.duration("--duration-s", duration_s))
    settled = f"{run.settling_time:.2f} s (5 %)" if np.isfinite(run.settling_time) else "longer than the run (5 %)"
    lines = [
        f"{law.name}, {1e3 * law.length:g} mm, {mass:.3f} kg, K_c {gains.K_c:g} a percent, T_i {gains.T_i:g} s",
        *(f"Caution: {text}" for text in run.cautions),
        f"contraction    {1e3 * run.contraction[-1]:.2f} mm of {1e3 * run.wanted:.2f} mm",
        f"steady error   {100 * run.steady_error:.1f} %",
        f"overshoot      {100 * run.overshoot:.1f} %",
        f"settling time  {settled}",
    ]
    columns = {
        "time_s": run.time,
        "contraction_mm": 1e3 * run.contraction,
        "wanted_mm": np.full(len(run.time), 1e3 * run.wanted),
        "pressure_bar": run.pressure / BAR,
        "duty": run.duty,
        "inside": run.inside.astype(int),
    }
    files.deliver("\n".join(lines), columns=lambda: columns, figure=lambda: plot_motion(columns))
