"""The wearer's model beside published measurements: contact force, strength, lever arms (python benchmarks/wearer.py).

Every figure is in measured_wearer.csv with its source. Strength is the greatest moment about the axis of the plane with
all other moments about the joint balanced by the muscles themselves, and with these carried by the dynamometer. With
``--plot FILE`` the contact force over the elevation is drawn, bare and with 1.75 kg in the hand, beside measurements.
"""

import argparse
import csv
from pathlib import Path

import numpy as np
from scipy.optimize import linprog
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.person import MUSCLES
from exo_pin.person.limb.muscle_curves import muscle_state

MAN, WOMAN = ep.Person(1.755, 85.0, "male"), ep.Person(1.626, 67.0, "female")
AXIAL = {"infraspinatus": "INFSP", "teres minor": "TMIN", "subscapularis": "SUBSC"}
#: Of a left arm, degrees in front of the frontal plane: where the hand goes as the arm is raised.
PLANES = {"flexion": 90.0, "scapular": 35.0, "abduction": 0.0}
ELEVATIONS = np.arange(0.0, 121.0, 10.0)


def axis_of(plane):
    """Axis about which an arm is raised in a plane, base frame."""
    turn = np.radians(PLANES[plane])
    return np.array([np.cos(turn), -np.sin(turn), 0.0])


def raised(plane, angles):
    """Poses of the arm at elevations, degrees, in a plane."""
    return Rotation.from_rotvec(np.radians(np.atleast_1d(angles))[:, None] * axis_of(plane))


def levers(poses, axis, person=MAN):
    """Moments of the muscles per newton about an axis, shape (N, m), m, and the rest of their moments (N, 2, m)."""
    limb = person.limb_state(poses)
    others = np.linalg.svd(axis[None])[2][1:]
    return limb.moment @ axis, np.einsum("ki,nmi->nkm", others, limb.moment), limb


def strength(plane, angle, sense=1.0, person=MAN):
    """Greatest moment that raises (sense 1) or lowers the arm, N m: balanced by muscles, and in a dynamometer."""
    own, others, limb = levers(raised(plane, angle), axis_of(plane), person)
    active = muscle_state(person.muscle_table, limb.length, None, False).active[0]
    about, rest = sense * own[0] * active, others[0] * active
    found = linprog(-about, A_eq=rest, b_eq=np.zeros(2), bounds=[(0.0, 1.0)] * about.size, method="highs")
    return -found.fun, np.maximum(about, 0.0).sum()


def contact(plane, angles, load=0.0):
    """Contact force, percent of body weight."""
    person = MAN.with_changes(payload=load)
    return person.joint_contact(raised(plane, angles), outside="mark").percent_body_weight


def modelled(row):
    """What the model gives for a row: one value or two."""
    quantity, plane = row["quantity"], row["plane"]
    angle, load = float(row["angle_deg"] or 0.0), float(row["load_kg"])
    if quantity == "contact":
        return contact(plane, angle, load)
    if quantity == "contact peak":
        return [np.nanmax(contact(plane, ELEVATIONS))]
    if quantity == "lever peak":
        own = levers(raised("scapular", ELEVATIONS), axis_of("scapular"))[0]
        return [1e3 * own[:, MUSCLES.index("DELT2")].max()]
    raising = {"adduction": ("abduction", -1.0), "extension": ("flexion", -1.0)}
    if quantity == "strength ratio":
        first, second = plane.split(" to ")
        above, below = (strength(*_at(name, angle, raising)) for name in (first, second))
        return [a / b for a, b in zip(above, below, strict=True)]
    if quantity.startswith("share of"):
        person = WOMAN if "woman" in quantity else MAN
        weight = 9.81 * person.arm.mass * -person.arm.centre_of_mass[2]
        return [100.0 * weight / value for value in strength(plane, angle, person=person)[::-1]]
    if quantity == "women to men":
        both = (strength(plane, angle, person=person) for person in (WOMAN, MAN))
        return [a / b for a, b in zip(*both, strict=True)]
    if quantity == "axial lever peak":
        peaks = []
        for turn in np.radians(np.arange(-60.0, 61.0, 15.0)):
            poses = raised("scapular", ELEVATIONS) * Rotation.from_rotvec([0.0, 0.0, turn])
            about = np.einsum("nmi,ni->nm", MAN.limb_state(poses).moment, poses.as_matrix()[:, :, 2])
            peaks.append(1e3 * np.nanmax(np.abs(about[:, MUSCLES.index(AXIAL[plane])])))
        return [max(peaks)]
    return strength(*_at(plane, angle, raising))


def _at(name, angle, raising):
    plane, sense = raising.get(name, (name, 1.0))
    return plane, angle, sense


def measured():
    """Rows of measured_wearer.csv."""
    with (Path(__file__).parent / "measured_wearer.csv").open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def draw(path):
    """Contact force over the elevation beside what was measured."""
    import matplotlib.pyplot as plt

    figure, panels = plt.subplots(1, 2, figsize=(9.0, 3.6), sharey=True, layout="constrained")
    for ax, plane in zip(panels, ("flexion", "abduction"), strict=True):
        for load, colour in ((0.0, "#0072B2"), (1.75, "#D55E00")):
            ax.plot(ELEVATIONS, contact(plane, ELEVATIONS, load), color=colour, label=f"model, {load:g} kg in the hand")
        for row in measured():
            if (row["quantity"], row["plane"]) == ("contact", plane):
                low, high = float(row["low"]), float(row["high"])
                where, colour = (91.5, "#D55E00") if float(row["load_kg"]) else (88.5, "#0072B2")
                ax.plot(
                    [where, where], [low, high], color=colour, linewidth=5, alpha=0.3, label="measured in patients, 90°"
                )
                if row["middle"]:
                    ax.plot(where, float(row["middle"]), "o", color=colour)
        ax.set(xlabel=f"{plane}, °", title=plane, ylim=(0, 200))
    panels[0].set_ylabel("contact force, % of body weight")
    panels[0].legend(frameon=False)
    figure.savefig(path, dpi=110)


def main():
    """Print the table, and draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--plot", metavar="FILE")
    options = parser.parse_args()
    print("| what | measured | model | source |\n| --- | --- | --- | --- |")
    for row in measured():
        where = " ".join(text for text in (row["plane"], row["angle_deg"] and f"{row['angle_deg']}°") if text)
        load = f", {row['load_kg']} kg" if float(row["load_kg"]) else ""
        span = f"{row['low']} to {row['high']}" if row["low"] else ""
        known = " (".join(text for text in (row["middle"], span) if text) + (")" if row["middle"] and span else "")
        own = " to ".join(f"{value:.3g}" for value in sorted(modelled(row)))
        unit = f" {row['unit']}" if row["unit"] else ""
        print(f"| {row['quantity']}, {where}{load} | {known}{unit} | {own}{unit} | {row['source']} |")
    if options.plot:
        draw(options.plot)


if __name__ == "__main__":
    main()
