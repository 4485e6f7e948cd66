"""The wearer's model beside published measurements: contact force, strength, lever arms (python benchmarks/wearer.py).

Every figure is in measured_wearer.csv with its source. Strength is the greatest moment about the axis of the plane with
all other moments about the joint balanced by the muscles themselves, and with these carried by the dynamometer. Another
table has the part of each explanation of the difference with a load in the hand: one thing changed at a time. With
``--plot FILE`` the contact force over the elevation is drawn, bare and with 1.5 kg in the hand, beside measurements.
"""

import argparse
import csv
from pathlib import Path

import numpy as np
from scipy.optimize import linprog
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.person import MUSCLES
from exo_pin.person.limb.muscle_table import muscle_state

MAN, WOMAN = ep.Person(1.755, 85.0, "male"), ep.Person(1.626, 67.0, "female")
AXIAL = {"infraspinatus": "INFSP", "teres minor": "TMIN", "subscapularis": "SUBSC"}
#: Of a left arm, degrees in front of the frontal plane: where the hand goes as the arm is raised.
PLANES = {"flexion": 90.0, "scapular": 35.0, "abduction": 0.0}
ELEVATIONS = np.arange(0.0, 121.0, 10.0)
#: What the source of the loaded measurements leaves open, or what persons differ in: arguments of :func:`contact`.
CHANGES = {
    "straight arm, flexion 90°, 85 kg": {},
    "arm in the scapular plane": {"plane": "scapular"},
    "elbow bent 30°": {"elbow": 30.0},
    "scapular plane and elbow bent 30°": {"plane": "scapular", "elbow": 30.0},
    "raised to 75°": {"angle": 75.0},
    "arm turned 20° inwards": {"inwards": 20.0},
    "arm turned 20° outwards": {"inwards": -20.0},
    "body of 100 kg": {"mass": 100.0},
    "no condition on the socket": {"options": ep.ContactOptions(cone=None)},
    "socket 10° forward": {"options": ep.ContactOptions(socket_turn=np.radians(10.0))},
    "socket 10° backward": {"options": ep.ContactOptions(socket_turn=np.radians(-10.0))},
    "scapula moves by 80 %": {"scapular_motion": 0.8},
    "cubed activations": {"options": ep.ContactOptions(power=3)},
}


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
    """Greatest moment that raises (sense 1) or lowers the arm, or turns it outwards, elbow bent, N m.

    Balanced by muscles, and in a dynamometer.
    """
    if plane == "outward rotation":
        person = person.with_changes(elbow_flexion=np.radians(90.0))
    poses = raised("flexion" if plane == "outward rotation" else plane, angle)
    axis = poses.as_matrix()[0, :, 2] if plane == "outward rotation" else axis_of(plane)
    own, others, limb = levers(poses, axis, person)
    active = muscle_state(person.muscle_table, limb.length, None, False).active[0]
    about, rest = sense * own[0] * active, others[0] * active
    found = linprog(-about, A_eq=rest, b_eq=np.zeros(2), bounds=[(0.0, 1.0)] * about.size, method="highs")
    return -found.fun, np.maximum(about, 0.0).sum()


def contact(plane, angles, load=0.0, elbow=0.0, inwards=0.0, options=None, **person):
    """Contact force, percent of body weight; angles in degrees."""
    wearer = MAN.with_changes(payload=load, elbow_flexion=np.radians(elbow), **person)
    poses = raised(plane, angles) * Rotation.from_rotvec([0.0, 0.0, -np.radians(inwards)])
    return wearer.joint_contact(poses, options=options, outside="mark").percent_body_weight


def explained(change, loads=(0.0, 1.5, 2.0)):
    """Contact force with loads in the hand, raised forwards to 90° unless the change has it otherwise."""
    asked = {"plane": "flexion", "angle": 90.0, **change}
    plane, angle = asked.pop("plane"), asked.pop("angle")
    return [float(contact(plane, angle, load, **asked)[0]) for load in loads]


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

    colours = {0.0: "#0072B2", 1.5: "#D55E00", 2.0: "#CC79A7"}
    words = {0.0: "nothing in the hand", 1.5: "1.5 kg", 2.0: "2 kg"}
    figure, panels = plt.subplot_mosaic("01;22", figsize=(8.6, 8.2), layout="constrained")
    for ax, plane in zip(panels.values(), ("flexion", "abduction"), strict=False):
        for load in (0.0, 1.5):
            label = f"model, straight arm, {words[load]}"
            ax.plot(ELEVATIONS, contact(plane, ELEVATIONS, load), color=colours[load], linewidth=2.2, label=label)
        for row in measured():
            if (row["quantity"], row["plane"]) == ("contact", plane):
                load = float(row["load_kg"])
                where = 87.5 + 2.5 * list(colours).index(load)
                span, label = (
                    [float(row["low"]), float(row["high"])],
                    f"measured in patients, {words[load]}: range, middle",
                )
                style = {"color": colours[load], "linewidth": 5, "alpha": 0.35, "solid_capstyle": "butt"}
                ax.plot([where, where], span, **style)
                ax.plot(where, float(row["middle"]), "o", color=colours[load], markeredgecolor="white", label=label)
        ax.set(xlabel=f"{plane}, °", ylim=(0, 180))
        way = "forwards" if plane == "flexion" else "sideways"
        ax.set_title(f"Arm raised {way}, 1.755 m, 85 kg", loc="left", fontsize=11)
    panels["0"].set_ylabel("contact force, % of body weight")
    loaded = [explained(change, (1.5,))[0] for change in CHANGES.values()]
    places = np.arange(len(CHANGES))
    (pot,) = (row for row in measured() if row["load_kg"] == "1.5")
    panels["2"].axvspan(
        float(pot["low"]),
        float(pot["high"]),
        color="0.88",
        zorder=0,
        label="measured in 4 patients, 1.5 kg: range, mean (bars)",
    )
    panels["2"].axvline(float(pot["middle"]), color="0.4", linewidth=1.0, zorder=0)
    panels["2"].barh(places, loaded, height=0.7, color=["#D55E00", *["#E8A87C"] * (len(places) - 1)])
    panels["2"].bar_label(panels["2"].containers[0], fmt="%.0f", padding=3, fontsize=8.5)
    panels["2"].set_yticks(places, CHANGES, fontsize=8.5)
    panels["2"].tick_params(axis="y", length=0)
    panels["2"].invert_yaxis()
    panels["2"].set(xlabel="contact force, % of body weight", xlim=(0, 180))
    panels["2"].set_title("1.5 kg in the hand at 90°, one assumption changed at a time", loc="left")
    for ax in panels.values():
        ax.spines[["top", "right"]].set_visible(False)
    marks = {label: mark for ax in panels.values() for mark, label in zip(*ax.get_legend_handles_labels(), strict=True)}
    figure.legend(marks.values(), marks.keys(), loc="outside lower center", ncols=2, frameon=False, fontsize=9)
    figure.savefig(path, dpi=200)


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
    print("\n| 90°, % BW | no load | 1.5 kg | 2 kg |\n| --- | --- | --- | --- |")
    for name, change in CHANGES.items():
        print(f"| {name} | {' | '.join(f'{value:.0f}' for value in explained(change))} |")
    if options.plot:
        draw(options.plot)


if __name__ == "__main__":
    main()
