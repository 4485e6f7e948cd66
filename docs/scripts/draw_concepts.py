"""Draw the figures of the concept pages, each from answers of the package.

    python docs/scripts/draw_concepts.py [FOLDER]

writes ``concept_*.png`` to ``docs/pictures``, or to a folder.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import pyplot as plt

import exo_pin as ep
from exo_pin.view.colours import BLACK, BLUE, GREEN, ORANGE, RED
from exo_pin.view.plots.plot_style import line, tidy

PICTURES = Path(__file__).resolve().parents[1] / "pictures"
GREY = "0.55"
#: Offsets of the device's centre, mm, and stiffnesses of a shoulder, N/m, of the figure on elasticity.
OFFSETS, STIFFNESSES = np.linspace(0.0, 20.0, 21), (5e3, 20e3, 80e3)


#: Where the label of an arrow stands from its head, points; from the left, and from the front.
SHIFTS = {
    "axis": ((-4, 7), (-4, 7)),
    "x_B": ((5, 2), (5, 2)),
    "y_B": ((5, 2), (3, 6)),
    "z_B": ((-14, 4), (5, 3)),
    "F_s": ((-10, -18), (-8, -18)),
    "weight": ((6, 0), (6, 0)),
}


def arrow(ax: Any, start: Any, vector: Any, colour: str, label: str = "", shift: tuple[float, float] = (6, 4)) -> None:
    """An arrow with a label at its head, shifted by points."""
    end = np.add(start, vector)
    ax.annotate("", end, start, arrowprops={"arrowstyle": "-|>", "color": colour, "lw": 2, "shrinkA": 0, "shrinkB": 0})
    ax.annotate(label, end, xytext=shift, textcoords="offset points", color=colour, fontsize=11)


def frames() -> Any:
    """The two frames, a limb with its direction, and the forces on the arm, from the left and from the front."""
    exo = ep.load("four-linear-actuators-worn")
    pose = exo.pose(flexion=50.0, abduction=25.0)
    answer = exo.reaction(pose)
    A = exo.geometry.base_points
    B = pose.apply(exo.geometry.platform_points.copy())
    elbow = pose.apply([0.0, 0.0, -0.29])
    weight = exo.mechanism.arm.mass * np.array(exo.mechanism.gravity)
    centre = pose.apply(np.array(exo.mechanism.arm.centre_of_mass))
    scale = 0.2 / 50.0  # m a newton
    figure, panels = plt.subplots(1, 2, figsize=(9.0, 5.0), layout="constrained")
    views = (("from the left: x forward, z up", 0, "x"), ("from the front: y to the wearer's left, z up", 1, "y"))
    for ax, (title, k, name) in zip(panels, views, strict=True):
        across = [k, 2]
        ax.plot(*np.array([np.zeros(3), elbow])[:, across].T, color="#e0b090", lw=20, solid_capstyle="round", zorder=0)
        for i, (a, b) in enumerate(zip(A, B, strict=True)):
            ax.plot(*np.array([a, b])[:, across].T, color=GREY, lw=1.5, zorder=1)
            ax.plot(*a[across], "s", color=GREY, markersize=5)
            ax.plot(*b[across], "o", color=GREY, markersize=4)
            if i == 0:
                ax.annotate("$A_1$", a[across], xytext=((-22, -4), (8, -3))[k], textcoords="offset points")
                ax.annotate("$B_1$", b[across], xytext=((5, -6), (7, -4))[k], textcoords="offset points")
                s = (b - a) / np.linalg.norm(b - a)
                arrow(ax, a[across], 0.15 * s[across], BLUE, "$s_1$", (7, 0))
        for axis, label in ((k, name), (2, "z")):
            arrow(ax, (0, 0), 0.25 * np.eye(3)[axis][across], BLACK, f"${label}_A$", SHIFTS["axis"][k])
            turned = pose.apply(np.eye(3)[axis])
            arrow(ax, (0, 0), 0.2 * turned[across], GREEN, f"${label}_B$", SHIFTS[f"{label}_B"][k])
        arrow(ax, (0, 0), scale * answer.shoulder_force[across], RED, "$F_s$", SHIFTS["F_s"][k])
        arrow(ax, centre[across], scale * weight[across], ORANGE, "weight", SHIFTS["weight"][k])
        ax.plot(0, 0, "o", color=BLACK, markersize=6)
        ax.set(title=title, xlabel=f"{name}, m", ylabel="z, m", aspect="equal", ylim=(-0.45, 0.6), xlim=(-0.5, 0.4))
        # As in the drawings of designs: who looks from the left has forward on their left.
        if k == 0:
            ax.invert_xaxis()
        tidy(ax)
    figure.suptitle(
        "four-linear-actuators-worn at flexion 50°, abduction 25°, internal rotation 0°\n"
        f"black: base frame {{O_A}}; green: arm frame {{O_B}}; forces on the arm, 0.1 m is {0.1 / scale:.0f} N",
        fontsize=11,
    )
    return figure


def equilibrium() -> Any:
    """What the moments determine, and what they leave: |F_s| over side forces, and over a tension that cancels."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(9.0, 4.0), layout="constrained")
    exo = ep.load("prototype")
    free, best = (exo.reaction(exo.pose(30, 30), split=split, limits="none") for split in ("spherical", "minimal"))
    shares = np.linspace(-0.5, 2.0, 51)
    force = [np.linalg.norm((1 - share) * free.shoulder_force + share * best.shoulder_force) for share in shares]
    left.plot(100 * shares, force, color=BLUE, lw=2)
    left.plot([0, 100], [free.magnitude, best.magnitude], "o", color=RED)
    left.annotate('"spherical": no side forces', (0, free.magnitude), xytext=(8, 4), textcoords="offset points")
    left.annotate('"minimal"', (100, best.magnitude), xytext=(12, -4), textcoords="offset points")
    tensions = ", ".join(f"{value:.0f}" for value in free.actuator_forces)
    left.set(
        title=f"prototype, flexion 30°, abduction 30°:\nf = ({tensions}) N for all side forces",
        xlabel="side forces, % of those that leave no shoulder force",
        ylabel="$|F_s|$, N",
        ylim=(-1, None),
    )
    cables = ep.load("four-cables")
    pose = cables.pose(60, 30)
    held = cables.reaction(pose)
    J = cables.jacobian(pose)
    null = np.linalg.svd(J.T)[2][-1]
    null = null / null[np.argmax(np.abs(null))]
    high = np.array([limb.actuator.pull_limit for limb in cables.limbs])
    bounds = np.sort([-held.actuator_forces / null, (high - held.actuator_forces) / null], axis=0)
    ends = bounds[0].max(), bounds[1].min()
    directions = cables.inverse_kinematics(pose).directions
    for span, style in ((np.linspace(ends[0] - 60, ends[1] + 60, 61), ":"), (np.linspace(*ends, 61), "-")):
        f = held.actuator_forces + np.outer(span, null)
        change = (f - held.actuator_forces) @ directions
        right.plot(span, np.linalg.norm(held.shoulder_force + change, axis=1), style, color=BLUE, lw=2)
    right.axvspan(*ends, color="0.92", zorder=0)
    right.plot(0, held.magnitude, "o", color=RED)
    right.annotate("least squares", (0, held.magnitude), xytext=(10, -2), textcoords="offset points")
    right.set(
        title="four-cables, flexion 60°, abduction 30°:\ntensions added that make no moment",
        xlabel="added to one cable, N (grey: tensions of 0 to 400 N)",
        ylabel="$|F_s|$, N",
        ylim=(0, None),
    )
    for ax in (left, right):
        tidy(ax)
    return figure


def singularity() -> Any:
    """|det X| and |F_s| of the prototype along abduction."""
    exo = ep.load("prototype")
    abduction = np.linspace(-3.0, 30.0, 331)
    poses = exo.pose(abduction=abduction)
    determinant = exo.singularity(poses).determinant
    answer = exo.reaction_map(poses, limits="none")
    figure, (top, bottom) = plt.subplots(2, 1, figsize=(7.5, 5.0), sharex=True, layout="constrained")
    top.plot(abduction, determinant, color=BLUE, lw=2)
    top.axhline(0.0, color=GREY, lw=0.8)
    top.set(ylabel="det X", title="prototype at flexion 0°, internal rotation 0°, without the limits of its muscles")
    bottom.semilogy(abduction, np.linalg.norm(answer.shoulder_force, axis=1), color=RED, lw=2)
    bottom.set(xlabel="abduction, °", ylabel="$|F_s|$, N")
    at = np.interp(0.0, determinant * np.sign(determinant[-1] - determinant[0]), abduction)
    for ax in (top, bottom):
        ax.axvline(at, color=BLACK, lw=1, ls="--")
        tidy(ax)
    top.annotate(f"singular at {at:.1f}°", (at, top.get_ylim()[1]), xytext=(8, -14), textcoords="offset points")
    return figure


def elasticity() -> Any:
    """|F_s| of the prototype with guides over an offset of the device, for shoulders of three stiffnesses."""
    exo = ep.load("prototype").worn_by(ep.Arm.from_anthropometry(1.75, 75, "male"))
    limbs = [ep.Limb(guide=ep.LimbGuide(bending_rigidity=65.0, torsional_rigidity=50.0))] * 3
    pose = exo.pose(60, 30)
    figure, ax = plt.subplots(figsize=(7.5, 4.2), layout="constrained")
    for k, stiffness in enumerate(STIFFNESSES):
        device = exo.replace(limbs=limbs, shoulder=ep.Shoulder(stiffness=stiffness))
        force = [
            device.reaction(pose, split="elastic", limits="none", centre_offset=[0.0, 0.0, 1e-3 * up]).magnitude
            for up in OFFSETS
        ]
        ax.plot(OFFSETS, force, **line(k), lw=2, label=f"guides, shoulder of {stiffness / 1e3:.0f} kN/m")
    plain = [exo.reaction(pose, limits="none", centre_offset=[0.0, 0.0, 1e-3 * up]).magnitude for up in OFFSETS]
    ax.plot(OFFSETS, plain, color=BLACK, lw=2, ls=(0, (2, 2)), label="no side forces (bare muscles)")
    ax.set(
        title="prototype at flexion 60°, abduction 30°, internal rotation 0°",
        xlabel="centre of the device above that of the shoulder, mm",
        ylabel="$|F_s|$, N",
        ylim=(0, None),
    )
    ax.legend(frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))
    tidy(ax)
    return figure


FIGURES = {"frames": frames, "equilibrium": equilibrium, "singularity": singularity, "elasticity": elasticity}


def draw(folder: Path) -> None:
    """Write all figures."""
    for name, make in FIGURES.items():
        figure = make()
        figure.savefig(folder / f"concept_{name}.png", dpi=200)
        plt.close(figure)


if __name__ == "__main__":
    draw(Path(sys.argv[1]) if len(sys.argv) > 1 else PICTURES)
