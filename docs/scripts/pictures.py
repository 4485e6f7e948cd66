"""The pictures of the pages: what draws each, so that it can be drawn again.

::

    python docs/scripts/pictures.py                    # all that take seconds, into docs/pictures
    python docs/scripts/pictures.py view person_map    # some
    python docs/scripts/pictures.py --to folder        # elsewhere

Those of :data:`OTHERS` come from a script of their own, which also prints numbers of their pages, and have to be named.
"""

from __future__ import annotations

import argparse
import contextlib
import shlex
import subprocess
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
from draw_concepts import FIGURES

import exo_pin as ep
from exo_pin import muscle
from exo_pin.cli import main as exo_pin
from exo_pin.view.plots import design_drawing, shoulder_force_map

FOLDER = Path(__file__).parents[1] / "pictures"
#: Pixels an inch of the drawings: a page shows 96.
DPI = 200
#: By the command line.
COMMANDS = {
    "control": "track --experiment held-abduction --controller model",
    "control_cables": "track --experiment four-cables-abduction",
    "overview": "reaction prototype --flexion 60 --abduction 30 --person 1.75,75,male",
    "person": "person prototype --person 1.75,75,male --limits none",
    "person_map": "person four-cables --map --step 10",
    "uncertainty_all": "uncertainty --flexion 60 --abduction 30 --person 1.755,85,male --all 400",
    "uncertainty": "uncertainty four-cables --flexion 60 --abduction 30 --uncertain offset_mm=20",
    "which_kind": "compare prototype optimised-table-c-2 three-linear-actuators four-linear-actuators-worn four-cables "
    "six-cables urdf/spherical-3rrr.urdf urdf/3rps-passive-ball.urdf urdf/serial-y-x-z.urdf urdf/nesm.urdf "
    "urdf/spring-support.urdf --person 1.755,85,male --step 20 --detailed",
    "day": "tasks four-linear-actuators-worn --person 1.755,85,male --day --step 5",
    "workspace_slices": "workspace four-cables --gap 12 --shoulder-force 120 --least-tension 5",
}
#: By the command line and a browser.
SCENES = {
    "view": "view --flexion 65 --abduction 20 --elbow-flexion 130 --person 1.755,85,male --mannequin --size 1120x760@2",
    "person_view": "view --flexion 60 --abduction 20 --person 1.755,85,male --elbow-flexion 90 --size 1120x760@2",
}
#: By scripts that also print the numbers of their pages: what to run from the repository, before the file to write.
OTHERS = {
    "app": "python docs/scripts/app_picture.py",
    "calibration": "python notebooks/calibration_poses.py --out",
    "energy": "python benchmarks/energy.py --out",
    "person_measured": "python benchmarks/wearer.py --plot",
    "pull_only": "python notebooks/what_pulling_muscles_hold.py --out",
    "tension_planning": "python notebooks/tension_planning.py --out",
}
#: What makes those of minutes coarse, in seconds; of the same size, for a test that their commands run.
COARSE = {
    "calibration": "--coarse",
    "energy": "--coarse",
    "person_map": "--step 50",
    "pull_only": "--coarse",
    "tension_planning": "--coarse",
    "workspace_slices": "--step 20",
}


def drawing(preset: str, *angles: tuple[float, float], elbow: Iterable[float] | None = None) -> Any:
    """A design on its wearer in poses of flexion and abduction, degrees, and with an elbow bent, degrees."""
    exo = ep.load(preset)
    flexion, abduction = np.transpose(angles)
    bends = None if elbow is None else np.radians(list(elbow))
    worn = exo if exo.arm.wearer is not None else exo.worn_by(ep.Wearer(1.75, "male", 75.0))
    return design_drawing(worn, exo.pose(flexion, abduction), bends)


def force_map() -> Any:
    """|F_s| of the four cables at rest."""
    return shoulder_force_map(ep.load("four-cables")).figure


def settling() -> Any:
    """Settling time of a hung mass over the lag of the pressure, beside the measured one."""
    from exo_pin.view.colours import BLACK, BLUE, GREY
    from exo_pin.view.plots.plot_style import new_figure, tidy

    law, mass, pressure = muscle.dynamic_model("tang-3-31"), 22.74 / 9.81, 4e5
    lags = np.array([0.0, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0])
    times = muscle.settling_against_lag(law, mass, pressure, lags)
    figure, ax = new_figure(7.2, 4.8)
    ax.plot(lags, times, "o-", color=BLUE, linewidth=2.0, label="within the model's range")
    outside = lags[np.isnan(times)]
    steps = [muscle.PressureStep(0.0, pressure, time_constant=lag) for lag in outside]
    runs = [muscle.simulate(law, mass, step, np.linspace(0.0, 8.0, 2001), outside="mark") for step in steps]
    hollow = {"color": GREY, "markerfacecolor": "none", "label": "leaves the model's range"}
    ax.plot(outside, [run.settling_time() for run in runs], "o", **hollow)
    ax.axhline(6.0, color=BLACK, linestyle="--", linewidth=1.2, label="measured, 6 s")
    title = "A mass of 2.32 kg at 4 bar, record of 8 s"
    ax.set(xlabel="lag of the pressure, s", ylabel="settling time (2 %), s", title=title, ylim=(0.0, 7.0))
    figure.legend(loc="outside lower center", ncols=3, frameon=False)
    tidy(ax)
    return figure


REST_AND_LIFTED = ((0.0, 0.0), (90.0, 0.0), (0.0, 80.0))
#: By a function of this script.
DRAWN: dict[str, Callable[[], Any]] = {
    **{f"concept_{name}": figure for name, figure in FIGURES.items()},
    "settling": settling,
    "workspace_drawing": lambda: drawing("four-cables", *REST_AND_LIFTED),
    "workspace_force": force_map,
    "workspace_linear": lambda: drawing("four-linear-actuators", *REST_AND_LIFTED),
    "workspace_muscles": lambda: drawing("four-muscle-cables", *REST_AND_LIFTED),
    "workspace_three_linear": lambda: drawing("three-linear-actuators", *REST_AND_LIFTED),
    "workspace_wearable": lambda: drawing(
        "four-linear-actuators-worn", (0.0, 20.0), (45.0, 20.0), (65.0, 20.0), elbow=(0, 90, 130)
    ),
    "workspace_worn": lambda: drawing("four-cables-worn", *REST_AND_LIFTED),
}


def draw(names: Iterable[str], folder: Path, coarse: bool = False) -> None:
    """Draw pictures by name into a folder."""
    for name in names:
        path, words = folder.resolve() / f"{name}.png", shlex.split(COARSE.get(name, "") if coarse else "")
        if name in DRAWN:
            DRAWN[name]().savefig(path, dpi=DPI)
        elif name in OTHERS:
            _, script, *rest = OTHERS[name].split()
            subprocess.run([sys.executable, script, *rest, str(path), *words], check=True, cwd=FOLDER.parents[1])
        else:
            with contextlib.chdir(FOLDER.parents[1]):  # files of commands are named from there
                if exo_pin([*shlex.split((COMMANDS | SCENES)[name]), *words, "--plot", str(path)]):
                    sys.exit(f"{name} was not drawn")


def main() -> None:
    """Draw what is named, or all that this script draws."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("names", nargs="*", help="pictures; all but those of scripts of their own if left out")
    parser.add_argument("--to", type=Path, default=FOLDER, help="folder")
    options = parser.parse_args()
    draw(options.names or [*COMMANDS, *DRAWN, *SCENES], options.to)


if __name__ == "__main__":
    main()
