"""What planning the tensions of a redundant cable shoulder gains: four and six cables, stated geometry.

Run it to write docs/pictures/tension_planning.png:  python notebooks/tension_planning.py

The shoulder: cables from a ring of 160 mm radius in the sagittal plane through the shoulder centre to a cuff of 80 mm
radius, 200 mm below it on the upper arm; hole angles below, on a 15° pattern, the best of 4,000 drawn for how much of
the box of daily activities they hold with every cable between 5 and 300 N. The arm of a man of 1.75 m and 75 kg, at
rest. Collisions of cables with the body are not looked at.

Three ways to choose among tensions that balance the same arm:

    middle    nearest to the middle of the limits, as cable robots like it for stiffness
    least     least sum of squares of tension
    planned   least force on the shoulder joint

The thesis's Figure 2-5 shows a gain of about 25 % for a geometry and a starting choice that are not printed.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import lsq_linear

from picture_options import picture_options

import exo_pin as ep

LOWER, UPPER = 5.0, 300.0
HOLES = {
    4: ([15, 60, 135, 210], [90, 330, 45, 300]),
    6: ([15, 30, 60, 150, 225, 315], [30, 120, 330, 225, 165, 240]),
}


def cable_shoulder(count):
    base, cuff = (np.radians(angles) for angles in HOLES[count])
    geometry = ep.WristGeometry.from_circles(r_A=0.16, r_B=0.08, h_A=0.0, h_B=0.2, alpha_A=base, alpha_B=cuff)
    person = ep.Arm.from_anthropometry(1.75, 75, "male")
    return ep.ShoulderExo(geometry, person, limbs=(ep.Limb("SPS"),) * count, name=f"{count} cables")


def middle_force(exo, poses):
    """|F_s| with tensions as near to the middle of the limits as balance lets them be."""
    state, J = exo.inverse_kinematics(poses), exo.jacobian(poses)
    weight = exo.arm.mass * exo.mechanism.gravity
    moment = np.cross(poses.as_matrix() @ exo.arm.centre_of_mass, weight)
    force = np.full(len(J), np.nan)
    heavy = 1e6  # balance counts this much more than nearness, and is checked
    for k in range(len(J)):
        n = J.shape[1]
        rows = np.vstack([heavy * J[k].T, np.eye(n)])
        target = np.concatenate([heavy * moment[k], np.full(n, (LOWER + UPPER) / 2)])
        f = lsq_linear(rows, target, (LOWER, UPPER), method="bvls", tol=1e-14).x
        if np.abs(J[k].T @ f - moment[k]).max() < 1e-4:
            force[k] = np.linalg.norm(f @ state.directions[k] - weight)
    return force


def forces(exo, poses):
    """|F_s| by each of the three ways, NaN where the pose cannot be held, and the fraction held."""
    limits = {"limits": (LOWER, UPPER)}
    planned = exo.reaction(poses, split="minimal", **limits)
    least = exo.reaction(poses, **limits).magnitude
    found = {"middle": middle_force(exo, poses), "least": least, "planned": planned.magnitude}
    return {way: np.where(planned.held, force, np.nan) for way, force in found.items()}, planned.held.mean()


def reach(samples):
    s = np.linspace(0, 1, samples)
    blend = 10 * s**3 - 15 * s**4 + 6 * s**5
    return s, ep.shoulder_rotation(10 + 80 * blend, 20 + 30 * blend, 20 * blend, degrees=True)


def study(step=10.0):
    """Medians over the box, and the gain of planning over each other choice, pose by pose."""
    rows = []
    for count in HOLES:
        poses = ep.adl_box(step)
        flat = poses.as_matrix().reshape(-1, 3, 3)
        by_way, held = forces(cable_shoulder(count), type(poses).from_matrix(flat))
        gains = {way: 1 - by_way["planned"] / by_way[way] for way in ("middle", "least")}
        rows.append(
            {
                "cables": count,
                "held": held,
                **{f"median_{way}_N": np.nanmedian(values) for way, values in by_way.items()},
                **{f"gain_over_{way}": np.nanmedian(values) for way, values in gains.items()},
                **{f"p90_gain_over_{way}": np.nanpercentile(values, 90) for way, values in gains.items()},
            }
        )
        # Planning never loses; the middle balances to 1e-4 N m only, hence the slack.
        assert all(np.nanmin(values) > -1e-6 for values in gains.values())
    return rows


def draw(path, rows, samples=101):
    import matplotlib

    matplotlib.use("agg")
    import matplotlib.pyplot as plt

    from exo_pin.view.colours import BLUE, GREEN, ORANGE
    from exo_pin.view.plots.plot_style import tidy

    style = {
        "middle": (ORANGE, ":", "middle of the limits"),
        "least": (BLUE, "--", "least tension"),
        "planned": (GREEN, "-", "planned: least shoulder force"),
    }
    figure, axes = plt.subplots(1, 2, figsize=(9, 4.2), sharey=True, layout="constrained")
    for ax, row in zip(axes, rows, strict=True):
        s, poses = reach(samples)
        by_way, _ = forces(cable_shoulder(row["cables"]), poses)
        for way, (color, line, label) in style.items():
            ax.plot(100 * s, by_way[way], color=color, linestyle=line, linewidth=2, label=label)
        ax.set(
            xlabel="time, % of the movement",
            title=f"{row['cables']} cables. Over daily activities the planned force is (median)\n"
            f"{100 * row['gain_over_least']:.0f} % less than with least tension, "
            f"{100 * row['gain_over_middle']:.0f} % less than in the middle",
        )
        ax.title.set_fontsize(9.5)
        tidy(ax)
    axes[0].set(ylabel="|F_s|, N", ylim=(0, None))
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False)
    figure.suptitle("From flexion 10°, abduction 20° to flexion 90°, abduction 50°, internal rotation 20°", fontsize=11)
    figure.savefig(path, dpi=200)
    plt.close(figure)


if __name__ == "__main__":
    asked = picture_options(__doc__, "tension_planning.png")
    table = study(60.0 if asked.coarse else 10.0)
    for row in table:
        print({key: round(float(value), 3) for key, value in row.items()})
    draw(asked.out, table, 11 if asked.coarse else 101)
