"""Answers of design files with every key, and of values of parameters as text, as they are stored."""

# ruff: noqa: E501 - a question stands on one line

import numpy as np
import pytest
from answers import changes, each_of
from asked_in_turn import folder, in_turn

import exo_pin as ep
from exo_pin.study import sweep

PARTS = {
    "head": 'schema = 1\nname = "own"\n',
    "geometry": (
        "[geometry.points]\nbase_mm = [[100, 200, 50], [-120, 180, 100], [30, 210, -100]]\n"
        "platform_mm = [[80, 20, -200], [-50, 70, -220], [10, -90, -190]]\n"
    ),
    "arm": "[arm]\nmass_kg = 3.3\ncentre_of_mass_mm = [10, 20, -300]\n",
    "limbs": '[[limbs]]\nkind = "SPS"\n' * 3,
}
CIRCLES = "[geometry.circles]\nbase_radius_mm = 136\nplatform_radius_m = 0.12\nbase_height_mm = 78\nplatform_height_mm = 200\n"
ANGLES = "base_angles_deg = [31, 60, 120]\n"
INERTIA = "[[0.2, -0.01, 0.0], [-0.01, 0.2, 0.0], [0.0, 0.0, 0.05]]"
CUFF = "[interfaces.cuff]\nstiffness_N_mm = [[5, 0, 0], [0, 6, 0], [0, 0, 7]]\nrotational_stiffness_N_m_rad = [[1, 0, 0], [0, 2, 0], [0, 0, 3]]\n"


def limbs(more="", kind="UPU"):
    return f'[[limbs]]\nkind = "{kind}"\n{more}\n' * 3


def designs():
    """Designs that hold every key of a file, in other units, and files that are wrong."""

    def of(*names, more="", **parts):
        (place / "own.toml").write_text("\n".join([*(PARTS | parts).values(), more]), encoding="utf-8")
        (place / "law.toml").write_text("no law", encoding="utf-8")
        found = ep.load("own.toml").mechanism
        shown = {"limb": str(found.limbs[0]), "sources": dict(found.sources), "estimated": found.estimated}
        return [shown[name] if name in shown else getattr(found, name) for name in names] or str(found.name)

    def stroke(text):
        return of("limb", limbs=limbs(f"stroke = {{ {text} }}"))

    def actuator(text):
        return of("limb", limbs=limbs(f"actuator = {{ {text} }}"))

    def arm(text):
        found = of("arm", arm=f"[arm]\n{text}")[0]
        return [
            found.mass,
            found.centre_of_mass,
            found.inertia,
            found.device,
            found.body_mass,
            str(found.wearer),
            len(found.parts),
            [part.body_mass for part in found.parts],
        ]

    def geometry(text):
        found = of("geometry", geometry=text)[0]
        return [found.base_points, found.platform_points, found.base_axis, found.platform_axis, found.neutral]

    size = "wearer = { height_mm = 1620, mass_kg = 58, sex = 'female' }"
    points, muscle = PARTS["geometry"], 'family = "pneumatic muscle", supply_bar = 4, force_law = '
    head = 'title = "T"\nside = "right"\ngravity_m_s2 = [0, 0.5, -9.7]\nsource = "S"\nestimated = ["arm"]\nmeasures = ["arm"]\n'
    with folder() as place:
        return in_turn(
            {
                "plain": lambda: of("name", "title", "side", "gravity", "limb", "interfaces", "shoulder"),
                "head": lambda: of(
                    "title", "side", "gravity", "sources", "estimated", "measures", head=PARTS["head"] + head
                ),
                "circles": lambda: geometry(CIRCLES + ANGLES),
                "other angles": lambda: geometry(CIRCLES + ANGLES + "platform_angles_rad = [0.5, 1.0, 2.0]\n"),
                "no angles": lambda: geometry(CIRCLES),
                "neutral": lambda: geometry("[geometry]\nneutral_quaternion_xyzw = [0.6, 0, 0, 0.8]\n" + points),
                "neutral circles": lambda: geometry(
                    "[geometry]\nneutral_quaternion_xyzw = [0, 0.6, 0, 0.8]\n" + CIRCLES + ANGLES
                ),
                "long quaternion": lambda: geometry(
                    "[geometry]\nneutral_quaternion_xyzw = [0.6, 0, 0, 0.9]\n" + points
                ),
                "short quaternion": lambda: geometry(
                    "[geometry]\nneutral_quaternion_xyzw = [0.6, 0, 0, 0.7]\n" + points
                ),
                "axes": lambda: geometry(points + "base_axis = [0, 2, 0]\nplatform_axis = [0, 0.1, 1]\n"),
                "both": lambda: geometry(points + CIRCLES + ANGLES),
                "more of circles": lambda: geometry(CIRCLES + ANGLES + "tilt_deg = 3\n"),
                "more of points": lambda: geometry(points + "tilt_deg = 3\n"),
                "neither": lambda: geometry("[geometry]\n"),
                "metres": lambda: geometry(
                    points.replace("00", "").replace("0,", ",").replace("50", "5")
                    if False
                    else "[geometry.points]\nbase_mm = [[0.1, 0.2, 0.1], [-0.1, 0.2, 0.1], [0.03, 0.2, -0.1]]\n"
                    "platform_mm = [[0.1, 0.02, -0.2], [-0.05, 0.1, -0.2], [0.01, -0.1, -0.2]]\n"
                ),
                "whole arm": lambda: arm(
                    f"mass_g = 3300\ncentre_of_mass_m = [0.01, 0, -0.3]\ninertia_about_centre_kg_m2 = {INERTIA}\n"
                ),
                "about O": lambda: arm(
                    f"mass_kg = 1\ncentre_of_mass_m = [0.01, 0, -0.1]\ndevice = true\ninertia_about_origin_kg_m2 = {INERTIA}\n"
                    'products_of_inertia = "integrals"\n'
                ),
                "centre, integrals": lambda: arm(
                    f"mass_kg = 1\ncentre_of_mass_m = [0.01, 0, -0.1]\ninertia_about_centre_kg_m2 = {INERTIA}\n"
                    'products_of_inertia = "integrals"\nbody_mass_kg = 70\n'
                ),
                "two inertias": lambda: arm(
                    f"mass_kg = 1\ncentre_of_mass_m = [0, 0, -0.1]\ninertia_about_centre_kg_m2 = {INERTIA}\n"
                    f"inertia_about_origin_kg_m2 = {INERTIA}\n"
                ),
                "signs of none": lambda: arm(
                    'mass_kg = 1\ncentre_of_mass_m = [0, 0, -0.1]\nproducts_of_inertia = "tensor"\n'
                ),
                "wearer": lambda: arm(size),
                "wearer and mass": lambda: arm(f"{size}\nbody_mass_kg = 59\n"),
                "wearer of that mass": lambda: arm(f"{size}\nbody_mass_kg = 58\n"),
                "weighed wearer": lambda: arm(f"{size}\nmass_kg = 3\ncentre_of_mass_m = [0, 0, -0.3]\n"),
                "parts": lambda: arm(
                    f'body_mass_kg = 58\n[[arm.parts]]\nsource = "B"\n{size}\n[[arm.parts]]\nmass_kg = 0.5\ndevice = true\n'
                    "centre_of_mass_m = [0, 0, -0.2]\n"
                ),
                "parts of a device": lambda: arm(
                    "body_mass_kg = 58\n[[arm.parts]]\nmass_kg = 0.5\ndevice = true\ncentre_of_mass_m = [0, 0, -0.2]\n"
                ),
                "more of an arm": lambda: arm("mass_kg = 1\ncentre_of_mass_m = [0, 0, -0.2]\ncolour = 3\n"),
                "more of a wearer": lambda: arm(f"{size}\ncolour = 3\n"),
                "more of parts": lambda: arm(f"colour = 3\n[[arm.parts]]\n{size}\n"),
                "no mass": lambda: arm("centre_of_mass_m = [0, 0, -0.2]\n"),
                "shoulder": lambda: of("shoulder", more="[shoulder]\nabduction_centre_deg = 80\n"),
                "stiff shoulder": lambda: of(
                    "shoulder",
                    more="[shoulder]\nhalf_diagonal_deg = 80\nstiffness_N_mm = [[10, 0, 0], [0, 10, 0], [0, 0, 20]]\n",
                ),
                "cuff": lambda: of("interfaces", more="[interfaces]\ncuff_area_cm2 = 90\n" + CUFF),
                "cuff elsewhere": lambda: of(
                    "interfaces",
                    more=CUFF + 'at_mm = [0, 0, -200]\nsource = "S"\ncoupling_N = [[0, 9, 0], [0, 0, 0], [0, 0, 0]]\n',
                ),
                "harness": lambda: of("interfaces", more=CUFF.replace("cuff", "harness")),
                "more of interfaces": lambda: of(more="[interfaces]\ncolour = 3\n"),
                "more of a cuff": lambda: of(more=CUFF + "colour = 3\n"),
                "wide cuff": lambda: of("interfaces", more="[interfaces]\ncuff_area_m2 = 0.2\n"),
                "stroke": lambda: stroke("nominal_mm = 300, shortest_ratio = 0.7, longest_ratio = 1.1"),
                "lengths": lambda: stroke("shortest_mm = 300, longest_m = 0.4"),
                "one length": lambda: stroke("shortest_mm = 300"),
                "other length": lambda: stroke("longest_mm = 300"),
                "falling lengths": lambda: stroke("shortest_mm = 400, longest_mm = 300"),
                "same lengths": lambda: stroke("shortest_mm = 300, longest_mm = 300"),
                "lengths and more": lambda: stroke("shortest_mm = 300, longest_mm = 400, end_fitting_mm = 3"),
                "cable": lambda: actuator(
                    'family = "cable", pull_limit_kN = 0.2, play_mm = 1, resolution_m = 0, power_limit_W = 3'
                ),
                "fast cable": lambda: actuator(
                    'family = "cable", speed_limit_mm_s = 90, power_limit_W = 30, least_tension_N = 2'
                ),
                "travel": lambda: actuator('family = "linear", push_limit_N = 90, travel_limit_mm = 80'),
                "muscle": lambda: actuator(muscle + '"best"'),
                "law beside": lambda: actuator(muscle + '"law.toml"'),
                "law above": lambda: actuator(muscle + '"../law.toml"'),
                "law elsewhere": lambda: actuator(muscle + '"/law.toml"'),
                "no law": lambda: actuator(muscle + '"worst"'),
                "tackle": lambda: actuator(
                    'family = "cable", tackle = { ratio = 3, muscle_mm = 400, force_law = "best", supply_bar = 4 }'
                ),
                "no family": lambda: actuator('family = "rope"'),
                "limb": lambda: of(
                    "limb",
                    limbs=limbs(
                        "joint_half_diagonal_deg = 80\njoint_straight = [0, 0, 1]\nguide = { bending_rigidity_N_m2 = 65, "
                        "torsional_rigidity_N_m2 = 50, joint_stiffness_N_mm = 3, joint_twist_stiffness_N_m_rad = 20, "
                        "largest_bending_moment_N_m = 4, largest_torque_N_m = 3 }\nbase_body = { mass_g = 200, centre_mm = 90, "
                        "transverse_inertia_kg_m2 = 1e-4, axial_inertia_kg_m2 = 1e-5 }"
                    ),
                ),
                "no kind": lambda: of(limbs=limbs(kind="RRR")),
                "two limbs": lambda: of(limbs='[[limbs]]\nkind = "SPS"\n' * 2),
                "sources": lambda: of("sources", more='[sources]\n"limbs[0]" = "a book"\n'),
                "twice": lambda: of(
                    "sources", head=PARTS["head"] + 'source = "S"\n', more='[sources]\nmechanism = "a book"\n'
                ),
                "no side": lambda: of(head=PARTS["head"] + 'side = "up"\n'),
                "no geometry": lambda: of(geometry=""),
                "more": lambda: of(more="[more]\n"),
            }
        )


def texts():
    """Values of parameters as text, in units, and what is none."""
    exo = ep.load("four-cables")
    muscles = ep.load("prototype")

    def asked(own=exo, **vary):
        found = sweep(own, vary, own.pose([20.0, 50.0], 20.0))
        return str(found)

    return in_turn(
        {
            "range": lambda: asked(**{"A[1].radius_mm": "240:250:3"}),
            "list": lambda: asked(lean_left_deg="0,5", cuff_height_mm=[270, 280.0]),
            "one": lambda: asked(muscles, r_A_mm="140"),
            "kinds": lambda: asked(muscles, limb_kind="UPU,SPS"),
            "degrees": lambda: asked(muscles, **{"alpha[2]": "60,70"}),
            "negative degrees": lambda: asked(muscles, **{"alpha_A[2]": [-6.3, 7.0]}),
            "a turn": lambda: asked(muscles, **{"alpha_A[2]": f"{2.0 * np.pi}"}),
            "radians": lambda: asked(muscles, **{"alpha[2]": [1.0, 1.1]}),
            "person": lambda: asked(person=[ep.Wearer(1.6, 60, "female"), ep.Wearer(1.9, 90, "male")]),
            "person as text": lambda: asked(person="1.6"),
            "text": lambda: asked(cuff_height_mm="high"),
            "no count": lambda: asked(cuff_height_mm="250:260"),
            "half a count": lambda: asked(cuff_height_mm="250:260:1.5"),
            "many": lambda: asked(cuff_height_mm="250:260:10001"),
            "infinite": lambda: asked(cuff_height_mm="inf"),
            "empty": lambda: asked(cuff_height_mm=""),
            "none": lambda: asked(cuff_height_mm=[]),
            "number": lambda: asked(cuff_height_mm=3.0),
            "limb": lambda: asked(**{"cuff_height[2]": "3"}),
            "unit": lambda: asked(cuff_height_deg="3"),
        }
    )


ASKED = {"designs": designs, "texts": texts}


@pytest.mark.full
@each_of(ASKED)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
