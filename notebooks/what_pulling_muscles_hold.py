"""How much of the box of daily activities muscles that only pull can hold: three, four, with and without an arm.

Run it to write docs/pictures/pull_only.png:  python notebooks/what_pulling_muscles_hold.py

The fourth muscle of the prototype was mounted and left unused; where, is not printed. The plates have holes every 10°,
so all 36 × 36 pairs of holes on the two circles are tried here. Collisions of the muscle with arm and body are not
looked at, and neither is what a muscle of a given length can reach.
"""

from __future__ import annotations

import numpy as np

from picture_options import picture_options

import exo_pin as ep

PERSON = ep.Arm.from_anthropometry(1.75, 75, "male")


def with_fourth(exo, base_deg, platform_deg):
    circles = exo.geometry.circles
    geometry = ep.WristGeometry.from_circles(
        circles.r_A,
        circles.r_B,
        circles.h_A,
        circles.h_B,
        np.append(circles.alpha_A, np.radians(base_deg)),
        np.append(circles.alpha_B, np.radians(platform_deg)),
    )
    return exo.replace(geometry=geometry, limbs=(*exo.limbs, ep.Limb("UPU")))


def held_by_pulls(exo, poses):
    """Whether limbs hold the arm that only pull, however hard."""
    bare = exo.replace(limbs=[ep.Limb()] * len(exo.limbs))
    return bare.reaction_map(poses, limits="pull", keep="status").held


def best_fourth(exo, step):
    """Fraction held for every pair of holes, and the best pair."""
    poses, holes = ep.adl_box(step), np.arange(0, 360, 10)
    held = np.array(
        [[held_by_pulls(with_fourth(exo, a, b), poses).mean() for b in holes] for a in holes]
    )
    row, column = np.unravel_index(held.argmax(), held.shape)
    return held, (int(holes[row]), int(holes[column]))


def study(step=2.0, search_step=10.0):
    """Fractions of the box, and the maps behind them (mean over axial rotation)."""
    alone = ep.load("prototype")
    worn = alone.worn_by(PERSON)
    _, holes = best_fourth(worn, search_step)
    designs = {
        "3 muscles, moving part alone": alone,
        "3 muscles, with a person's arm": worn,
        "4 muscles, moving part alone": with_fourth(alone, *holes),
        "4 muscles, with a person's arm": with_fourth(worn, *holes),
    }
    poses = ep.adl_box(step)
    maps = {name: held_by_pulls(exo, poses) for name, exo in designs.items()}
    fractions = {name: float(held.mean()) for name, held in maps.items()}
    values = list(fractions.values())
    assert values[2] > 10 * values[0]
    assert values[3] > 10 * values[1]
    return fractions, {name: held.mean(axis=-1) for name, held in maps.items()}


def draw(path, fractions, maps):
    import matplotlib

    matplotlib.use("agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(2, 2, figsize=(9, 7), sharex=True, sharey=True, layout="constrained")
    for ax, (name, held) in zip(axes.flat, maps.items(), strict=True):
        image = ax.imshow(
            100 * held[::-1].T, origin="lower", extent=(0, 110, -4, 96), aspect="auto", vmin=0, vmax=100, cmap="cividis"
        )
        ax.set_title(f"{name}: {100 * fractions[name]:.1f} %", fontsize=9)
    for ax in axes[1]:
        ax.set_xlabel("flexion, °")
    for ax in axes[:, 0]:
        ax.set_ylabel("abduction, °")
    figure.colorbar(image, ax=axes, label="internal rotations held, %", shrink=0.8)
    figure.suptitle("Prototype at rest, muscles that only pull; above each map: share of all poses held", fontsize=11)
    figure.savefig(path, dpi=200)
    plt.close(figure)


if __name__ == "__main__":
    asked = picture_options(__doc__, "pull_only.png")
    shares, pictures = study(20.0, 50.0) if asked.coarse else study()
    for design, share in shares.items():
        print(f"{design}: {100 * share:.1f} %")
    draw(asked.out, shares, pictures)
