"""How far the elastic formula for small displacements is from the equilibrium at the displaced geometry.

Run it to write docs/elastic.png and print the percentages of docs/elastic.md:  python notebooks/elastic_difference.py

The prototype on the arm of a man of 1.75 m and 75 kg, at rest; 600 poses drawn from the box of daily activities on a
10° grid, those with |det X| > 0.05 (446); base and cuff off together in a direction drawn for each pose. Three sets of
stiffness: shoulder K_s 10, 20 and 30 kN/m, guides with GJ 20, 50 and 80 N m² and the EI = 1.3 GJ of a steel tube.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

import exo_pin as ep

SETS = ((1e4, 20.0), (2e4, 50.0), (3e4, 80.0))
SIZES = np.array([0.0, 2.5, 5.0, 10.0, 15.0, 18.0, 21.0, 25.0])
PERSON = ep.Arm.from_anthropometry(1.75, 75, "male")
DIRECTION = np.array([1.0, 1.0, 1.0]) / np.sqrt(3.0)
POSES = {"flexion 60°, abduction 30°": (60, 30, 0), "flexion 90°": (90, 0, 0), "abduction 100°": (0, 100, 0)}


def guided(stiffness: float, torsion: float) -> ep.ShoulderExo:
    """The worn prototype with guides and a shoulder of the given stiffness."""
    exo = ep.load("prototype").worn_by(PERSON)
    guide = ep.LimbGuide(1.3 * torsion, torsion)
    return exo.replace(limbs=(ep.Limb(guide=guide),) * 3, shoulder=ep.Shoulder(stiffness=stiffness))


def sample(exo: ep.ShoulderExo, rng: np.random.Generator) -> tuple[Rotation, np.ndarray]:
    """Poses away from the singular surface, and a direction for each."""
    box = ep.adl_box(10).as_quat().reshape(-1, 4)
    poses = Rotation.from_quat(box[rng.choice(len(box), 600, replace=False)])
    poses = poses[np.abs(exo.singularity(poses).determinant) > 0.05]
    directions = rng.normal(size=(len(poses), 3))
    return poses, directions / np.linalg.norm(directions, axis=1)[:, None]


def main() -> None:
    import matplotlib.pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    exo = guided(*SETS[1])
    fine = np.linspace(0.0, 25.0, 26)
    for colour, (name, angles) in zip(("tab:blue", "tab:orange", "tab:green"), POSES.items(), strict=True):
        pose = ep.shoulder_rotation(*angles, degrees=True)
        stack = Rotation.from_quat(np.tile(pose.as_quat(), (len(fine), 1)))
        found = exo.elastic_difference(stack, centre_offset=1e-3 * fine[:, None] * DIRECTION)
        left.plot(fine, found.finite.magnitude, color=colour, label=f"{name}, displaced geometry")
        left.plot(fine, found.linear.magnitude, "--", color=colour, label=f"{name}, linear formula")
    left.set(xlabel="offset of the device's centre along (1, 1, 1), mm", ylabel="shoulder force |F_s|, N")
    left.set_ylim(0.0, 1500.0)
    left.legend(fontsize=7, loc="upper left")
    left.set_title("K_s = 20 kN/m, GJ = 50 N m²", fontsize=10)
    for colour, (stiffness, torsion) in zip(("tab:green", "tab:blue", "tab:red"), SETS, strict=True):
        exo, rng = guided(stiffness, torsion), np.random.default_rng(1)
        poses, directions = sample(exo, rng)
        rows = []
        for size in SIZES:
            found = exo.elastic_difference(poses, centre_offset=1e-3 * size * directions)
            known = found.relative[np.isfinite(found.relative)]
            share = found.finite.has_answer.mean()
            rows.append([*np.quantile(known, [0.5, 0.9, 1.0]), share])
            print(
                f"K_s {stiffness / 1e3:.0f} kN/m, GJ {torsion:.0f} N m², {size:4.1f} mm: median {100 * rows[-1][0]:5.1f} %, "
                f"ninth decile {100 * rows[-1][1]:5.1f} %, largest {100 * rows[-1][2]:7.0f} %; answered {100 * share:.1f} % "
                f"of {len(poses)}"
            )
        middle, most = 100.0 * np.array(rows).T[:2]
        label = f"K_s {stiffness / 1e3:.0f} kN/m, GJ {torsion:.0f} N m²"
        right.plot(SIZES, middle, "o-", color=colour, ms=4, label=f"{label}")
        right.plot(SIZES, most, "o:", color=colour, ms=4, label="ninth decile" if colour == "tab:red" else None)
    right.set(xlabel="offset of the device's centre, mm", ylabel="error of the linear formula in F_s, %")
    right.set_ylim(0.0, 40.0)
    right.legend(fontsize=7, ncols=2, loc="upper left")
    right.set_title("poses of daily activities with |det X| > 0.05; lines: median", fontsize=10)
    figure.savefig(Path(__file__).parents[1] / "docs" / "elastic.png", dpi=120)


if __name__ == "__main__":
    main()
