"""What stands in each figure, beside a stored description: words, axes, curves, areas and colours.

``PYTHONPATH=tests/oracles python tests/view/plots/test_drawn_figures.py`` stores it again; look at the pictures first.
"""

import re
from pathlib import Path

import matplotlib

matplotlib.use("agg")

import numpy as np
import pytest
from matplotlib import colors
from places import URDF

import exo_pin as ep
from exo_pin.muscle import PressureStep, dynamic_model, muscle_model, simulate
from exo_pin.view import plots

pytestmark = pytest.mark.usefixtures("plain")
STORED = Path(__file__).with_name("drawn_figures.txt")
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[-+]?\d+)?")


def summary(values):
    """Size, ends, least, greatest and mean of numbers that are known."""
    flat = np.asarray(np.ma.filled(np.ma.masked_invalid(np.asarray(values, dtype=float)), np.nan)).ravel()
    known = flat[np.isfinite(flat)]
    if not known.size:
        return f"{flat.size}: none"
    numbers = (known[0], known[-1], known.min(), known.max(), known.mean())
    return f"{flat.size}, {known.size}: " + " ".join(f"{value + 0.0:.4g}" for value in numbers)


def look(artist):
    colour = artist.get_facecolor() if hasattr(artist, "get_facecolor") else artist.get_color()
    colour = np.atleast_2d(colors.to_rgba_array(colour))[:1]
    return f"{colors.to_hex(colour[0]) if len(colour) else 'none'} {artist.get_alpha()} {artist.get_zorder()}"


def described(figure):
    lines = [f"figure {figure.get_size_inches()} {[text.get_text() for text in figure.texts]}"]
    for ax in figure.axes:
        grown = [each for child in (ax, *ax.child_axes) for each in (child.get_xlabel(), child.get_ylabel())]
        lines.append(f"axes {ax.get_title()!r} {ax.get_title('left')!r} {grown} {ax.get_xscale()} {ax.get_yscale()}")
        lines.append(
            f" limits {ax.get_xlim()[0]:.4g} {ax.get_xlim()[1]:.4g} {ax.get_ylim()[0]:.4g} {ax.get_ylim()[1]:.4g}"
        )
        lines += [f" text {text.get_text()!r} {look(text)}" for text in ax.texts]
        if ax.get_legend() is not None:
            lines.append(f" legend {[text.get_text() for text in ax.get_legend().get_texts()]}")
        for line in ax.get_lines():
            own = f"{line.get_linestyle()} {line.get_linewidth():.3g} {line.get_marker()} {look(line)}"
            lines.append(f" line {own} x {summary(line.get_xdata())} y {summary(line.get_ydata())}")
        for part in ax.collections:
            points = np.concatenate([path.vertices for path in part.get_paths()] or [np.empty((0, 2))])
            array = "" if part.get_array() is None else f" of {summary(part.get_array())} in {part.get_clim()}"
            name = type(part).__name__
            lines.append(f" {name} {look(part)} {len(points)}: {summary(part.get_offsets())}; {summary(points)}{array}")
        for patch in ax.patches:
            places = patch.get_patch_transform().transform(patch.get_path().vertices)
            lines.append(f" {type(patch).__name__} {look(patch)} {summary(places)}")
    return "\n".join(lines)


def worn():
    return ep.load("four-cables-worn")


def raised(exo):
    return exo.reaction(exo.pose(np.linspace(0.0, 90.0, 10), 30))


def sure():
    exo = ep.load("four-linear-actuators-worn")
    certain = {"A_mm": 0, "B_mm": 0, "pose_deg": 0}
    return exo.uncertainty(exo.pose(60, 30), uncertainties=certain | {"offset_mm": 0}), exo.total_uncertainty(
        exo.pose(60, 30), uncertainties=certain | {"offset_mm": 5}, draws=12
    )


def space(name="prototype"):
    exo = ep.load(name)
    return exo, exo.workspace(30.0)


def responses():
    law, times = dynamic_model("tang-3-31"), np.linspace(0.0, 0.4, 41)
    made = simulate(law, 2.0, PressureStep(2e5, 3e5, 0.05, 0.1), times, outside="mark")
    return plots.plot_responses({"a step": made})


CASES = {
    "curves": lambda: raised(worn()).plot(np.linspace(0.0, 90.0, 10), "flexion, °"),
    "one pose": lambda: worn().reaction(worn().pose(60, 30)).plot(),
    "not held": lambda: ep.load("prototype").reaction(ep.load("prototype").pose([10, 30, 60], 30)).plot(),
    "one quantity at a time": lambda: sure()[0].plot(),
    "all at once": lambda: sure()[1].plot(),
    "force map": lambda: plots.shoulder_force_map(ep.load("prototype"), step=15.0).figure,
    "determinant": lambda: plots.determinant_map(ep.load("prototype"), step=10.0).figure,
    "slices": lambda: plots.workspace_slices(space()[1]),
    "ball": lambda: plots.rotation_ball(space()[1]),
    "rates": lambda: plots.rate_slices(*space()),
    "drawing": lambda: plots.design_drawing(worn(), worn().pose([0, 60], 0)),
    "postures": lambda: plots.posture_drawing(worn(), worn().pose([0, 60], 0), ["rest", "raised"]),
    "postures of a chain": lambda: plots.posture_drawing(
        ep.load(URDF / "serial-y-x-z.urdf"), ep.load(URDF / "serial-y-x-z.urdf").pose([0, 60], 10), ["rest", "raised"]
    ),
    "force law": lambda: plots.plot_force_map(muscle_model("best")),
    "responses": responses,
}


def stored():
    return dict(part.split("\n", 1) for part in STORED.read_text(encoding="utf-8").split("\n== ")[1:])


@pytest.mark.parametrize("name", CASES)
def test_a_figure_holds_what_is_stored(name):
    ours, theirs = described(CASES[name]()).strip(), stored()[name].strip()
    assert NUMBER.split(ours) == NUMBER.split(theirs)
    numbers = [np.array(NUMBER.findall(text), dtype=float) for text in (ours, theirs)]
    np.testing.assert_allclose(*numbers, rtol=2e-3, atol=1e-9)


if __name__ == "__main__":
    texts = "".join(f"\n== {name}\n{described(make()).strip()}\n" for name, make in CASES.items())
    STORED.write_text(texts, encoding="utf-8")
