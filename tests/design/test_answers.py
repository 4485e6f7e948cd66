"""Answers of actuators, parameters and files of designs, as they are stored."""

from dataclasses import replace

import numpy as np
from answers import changes, each_of
from asked_in_turn import folder, in_turn, printed, words_and_numbers

import exo_pin as ep
from exo_pin.design import Limb, LimbBody, LimbGuide, Stroke, Tackle


def seen(record):
    """A record with the numbers that follow from it."""
    more = ("effort_range", "length_range", "mass", "pulls_only", "speed_limit", "power_limit", "play", "resolution")
    lacking = record.missing_limits() if isinstance(record, ep.Actuator) else None
    return str(record), {name: str(getattr(record, name)) for name in more if hasattr(record, name)}, lacking


def actuators():
    """Actuators, tackles, strokes, halves and guides of limbs, and what is none."""

    def tackle(**changes):
        return Tackle(**{"ratio": 3.0, "muscle_length": 0.4, "force_law": "best", "supply_pressure": 4e5, **changes})

    def actuator(family="cable", **given):
        return seen(ep.Actuator(family, **given))

    muscle = {"force_law": "best", "supply_pressure": 4e5}
    cases = {
        "cable": lambda: actuator(pull_limit=200, least_tension=3.0, play=0.001, resolution=0.0),
        "of unknown pull": lambda: actuator(),
        "muscle": lambda: actuator("pneumatic muscle", **muscle),
        "linear": lambda: actuator("linear", pull_limit=300.0, push_limit=200.0, travel_limit=0.2),
        "of unknown push": lambda: actuator("linear", speed_limit=0.1, power_limit=30.0),
        "tackled": lambda: actuator(tackle=tackle(count=2.0)),
        "pushing cable": lambda: actuator(push_limit=3.0),
        "zero push": lambda: actuator(push_limit=0.0, pull_limit=0.0),
        "family": lambda: actuator("hydraulic"),
        "slack linear": lambda: actuator("linear", least_tension=3.0),
        "least above": lambda: actuator(pull_limit=3.0, least_tension=3.1),
        "least as greatest": lambda: actuator(pull_limit=3.0, least_tension=3.0),
        "law alone": lambda: actuator("pneumatic muscle", force_law="best"),
        "supply alone": lambda: actuator("pneumatic muscle", supply_pressure=4e5),
        "law of a cable": lambda: actuator(**muscle),
        "tackle of a muscle": lambda: actuator("pneumatic muscle", tackle=tackle()),
        "no tackle": lambda: actuator(tackle=3),
        "bar": lambda: actuator("pneumatic muscle", force_law="best", supply_pressure=4.0),
        "least supply": lambda: actuator("pneumatic muscle", force_law="best", supply_pressure=100.0),
        "too much": lambda: actuator("pneumatic muscle", force_law="best", supply_pressure=1.1e7),
        "no law": lambda: actuator("pneumatic muscle", force_law="", supply_pressure=4e5),
        "no speed": lambda: actuator(speed_limit=0.0),
        "no travel": lambda: actuator(travel_limit=-1.0),
        "negative play": lambda: actuator(play=-1.0),
        "ratio": lambda: tackle(ratio=0.9),
        "ratio of one": lambda: tackle(ratio=1),
        "half a muscle": lambda: tackle(count=1.5),
        "no muscle": lambda: tackle(count=0),
        "true": lambda: tackle(count=True),
        "supply of a tackle": lambda: tackle(supply_pressure=5.0),
        "stroke": lambda: seen(Stroke(0.3, 0.7, 1.1, 0.05)),
        "percent": lambda: Stroke(0.3, 70, 110),
        "ten": lambda: Stroke(0.3, 0.7, 10.0).longest,
        "falling": lambda: Stroke(0.3, 1.1, 0.7),
        "fitting": lambda: Stroke(0.3, 0.7, 1.1, -0.01),
        "rod": lambda: LimbBody.rod(0.2, 0.4, 0.01),
        "thin": lambda: LimbBody(0.2, 0.1, 1e-4, 3e-4),
        "no mass": lambda: LimbBody(0.0, 0.1, 1e-4, 1e-4),
        "tube": lambda: LimbGuide.tube(0.01, 0.008, 2e11, 8e10).times(2.0),
        "solid": lambda: LimbGuide.tube(0.01, 0.0, 2e11, 8e10),
        "closed tube": lambda: LimbGuide.tube(0.01, 0.01, 2e11, 8e10),
        "joints": lambda: LimbGuide(65.0, 50.0, 300.0, 200.0, 40.0, 30.0),
        "no joint": lambda: LimbGuide(65.0, 50.0, -np.inf),
        "limb": lambda: seen(Limb("SPS", LimbBody.rod(0.2, 0.4, 0.1), LimbBody.rod(0.1, 0.3, 0.2)).without_spin()),
        "spinning": lambda: seen(Limb("UPU", LimbBody.rod(0.2, 0.4, 0.1)).without_spin()),
        "turned": lambda: Limb(joint_straight=(1.0, 2.0, -2.0)).mirrored().joint_straight,
        "driven": lambda: seen(
            Limb(
                actuator=ep.Actuator("cable", 9.0, speed_limit=0.2, power_limit=3.0, play=0.1),
                stroke=Stroke(0.3, 0.7, 1.1),
            )
        ),
        "known": lambda: (Limb(stroke=Stroke(0.3, 0.7, 1.1, 0.1)).missing_limits(True), Limb().missing_limits(False)),
        "kind": lambda: Limb("RRR"),
        "no stroke": lambda: Limb(stroke=3),
        "joint limit": lambda: Limb(joint_limit=0.0),
    }
    return in_turn(cases)


def parameters():
    """Designs with other values of their parameters, in whatever units, of limbs and of all."""
    circles, points = ep.load("prototype").device, ep.load("four-cables").device
    pressed = ep.load("four-linear-actuators").device
    bare = circles.replace(
        limbs=[replace(each, stroke=replace(each.stroke, end_fitting=None)) for each in circles.limbs]
    )

    def changed(device, side="left", **values):
        own = device if side == "left" else device.mirrored()
        found = own.with_dimensions(**values)
        before, after = own.dimensions(), found.dimensions()
        limbs = [
            (str(a.actuator), a.effort_range, a.length_range)
            for a, b in zip(found.limbs, own.limbs, strict=True)
            if a != b
        ]
        return {name: [before.get(name), each] for name, each in after.items() if abs(before[name] - each) > 1e-9} | {
            "limbs": limbs,
            "points": (found.geometry.base_points, found.geometry.platform_points),
            "sources": sorted(key for key, text in found.sources.items() if text != own.sources[key]),
            "no longer estimated": sorted({*own.estimated} - {*found.estimated}),
        }

    def asked(device, values, at=None):
        found = device.with_values(dict(zip(device.parameters(values), values.values(), strict=True)), at)
        return [found.arm and (found.arm.mass, found.arm.centre_of_mass), found.gravity, found.summary]

    person = ep.Wearer(1.62, 58.0, "female")
    of_circles = ("scale", "cuff_height_mm", "alpha[2]", "alpha_A[1]_deg", "r_B_mm", "nominal_length", "end_fitting[1]")
    of_joints = ("A[2].elevation", "A.azimuth_deg", "B.drop", "B[3].radius_mm", "cuff_height")
    return in_turn(
        {
            "of circles": circles.dimensions,
            "of points": points.dimensions,
            "radius": lambda: changed(circles, r_A_mm=150.0, h_B=0.21),
            "angles": lambda: changed(circles, **{"alpha[2]_deg": 70.0, "alpha_B[3]": 2.2}),
            "cuff height": lambda: (
                changed(circles, cuff_height_mm=190.0),
                changed(points, cuff_height=0.26)["points"],
            ),
            "scale": lambda: (changed(circles, scale=1.1), changed(pressed, scale=0.9)["limbs"]),
            "scale of a tackle": lambda: [
                (own.actuator.travel_limit, own.actuator.tackle.muscle_length, own.effort_range)
                for own in ep.load("four-muscle-cables").device.with_dimensions(scale=1.1).limbs
            ],
            "scale without fitting": lambda: changed(bare, scale=1.1)["limbs"],
            "joint": lambda: changed(
                points, **{"A[2].radius_mm": 260.0, "B[1].drop_m": 0.3, "A[3].elevation_deg": 10.0}
            ),
            "joint on the right": lambda: changed(points, "right", **{"A[2].azimuth_deg": 80.0, "B[4].radius": 0.09}),
            "every joint": lambda: changed(points, **{"B.drop": 0.27, "B[2].drop": 0.25}),
            "muscle": lambda: changed(circles, **{"nominal_length[1]_mm": 160.0, "end_fitting[2]_mm": 140.0}),
            "cable": lambda: changed(
                points, **{"nominal_length_mm": 600.0, "pull_limit[2]_N": 90.0, "least_tension": 2.0}
            )["limbs"],
            "rod": lambda: changed(pressed, **{"nominal_length[3]": 0.7, "travel_limit": 0.15, "push_limit": 50.0})[
                "limbs"
            ],
            "short rod": lambda: changed(pressed, nominal_length=0.09),
            "no actuator": lambda: changed(circles.replace(limbs=[Limb()] * 3), nominal_length=0.2),
            "no limits": lambda: changed(circles.replace(limbs=[Limb()] * 3), **{"pull_limit[2]": 9.0}),
            "no stroke": lambda: changed(circles.replace(limbs=[Limb()] * 3), **{"end_fitting[1]": 0.1}),
            "circle and joint": lambda: changed(circles, **{"r_A": 0.15, "A[1].radius": 0.2}),
            "no circle": lambda: changed(points, r_A=0.15),
            "fifth limb": lambda: changed(points, **{"A[5].radius": 0.2}),
            "zeroth limb": lambda: changed(points, **{"A[0].radius": 0.2}),
            "negative": lambda: changed(circles, scale=-1.0),
            "unknown": lambda: changed(points, **{"C[1].radius": 0.2}),
            "no unit": lambda: changed(points, **{"A[1].radius_N": 0.2}),
            "kind": lambda: asked(circles, {"limb_kind": "SPS"}),
            "lean": lambda: asked(circles, {"lean_forward": 0.1, "lean_left": 0.2}),
            "person": lambda: asked(points, {"person": person, "payload": 1.5}, [0.0, 0.0, -0.5]),
            "no payload": lambda: asked(points, {"payload": 0.0}, [0.0, 0.0, -0.5]),
            "payload": lambda: asked(points, {"payload": 1.0}),
            "values": lambda: [circles.value_of(own) for own in circles.parameters(of_circles)],
            "values of joints": lambda: [points.value_of(own) for own in points.parameters(of_joints)],
            "no value": lambda: [circles.value_of(own) for own in circles.parameters(["pull_limit"])],
            "records": lambda: [str(own) for own in circles.parameters(["arm", "limbs", "gravity_m_s2", "payload_kg"])],
        }
    )


def files():
    """Design files as they are written, what is wrong with others, and the parts for a workshop."""

    def read(change):
        text = ep.design.preset_file("prototype")
        for was, now in change:
            assert was in text, was
            text = text.replace(was, now, 1)
        (place / "own.toml").write_text(text, encoding="utf-8")
        found = ep.load("own.toml")
        return repr(found), found.mechanism.limbs[0].stroke, found.arm.mass, found.geometry.base_points[0]

    def written(exo):
        exo.save("written.toml")
        return words_and_numbers((place / "written.toml").read_text(encoding="utf-8"))

    limbs = [
        Limb(
            "SPS",
            LimbBody.rod(0.2, 0.4, 0.01),
            None,
            Stroke(0.3, 0.7, 1.1),
            0.4,
            (0, 0, 1.0),
            LimbGuide(65.0, 50.0, 9.0),
        )
    ]
    rich = (
        ep.load("prototype")
        .mirrored()
        .replace(
            limbs=limbs * 3,
            shoulder=ep.Shoulder(stiffness=np.diag([1e4, 2e4, 3e4])),
            estimated=["arm"],
            measures="arm",
            interfaces=ep.Interfaces(
                ep.Interface.of(1e4, 10.0), ep.Interface(np.diag([1e4] * 3 + [9.0] * 3), (0, 0, -0.2)), 0.01
            ),
            arm=ep.Arm.of_wearer(ep.Wearer(1.62, 58.0, "female", elbow_flexion=0.3, payload=0.5))
            + ep.Arm(0.5, [0, 0, -0.2], device=True),
        )
    )
    exo = ep.load("four-cables").worn_by(ep.Wearer(1.62, 58.0, "female"))
    with folder() as place:
        found = in_turn(
            {
                "as it is": lambda: read([]),
                "rich": lambda: written(rich),
                "points": lambda: written(ep.load("four-cables")),
                "changed arm": lambda: written(exo.replace(arm=replace(exo.arm.person, mass=3.3))),
                "schema": lambda: read([("schema = 1", "schema = 3")]),
                "unit": lambda: read([("mass_g", "mass_lb")]),
                "kilograms": lambda: read([("mass_g", "mass_kg")]),
                "no name": lambda: read([("name", "nome")]),
                # By name, so that one more changes no answer.
                "presets": lambda: {
                    name: (repr(ep.load(name)), ep.load(name).mechanism.title) for name in ep.presets()
                },
                "published": lambda: sorted(ep.design.published()),
                "no preset": lambda: ep.design.preset("none"),
                "no file": lambda: ep.design.preset_file("none"),
            }
        )
    return found | {"parts": {name: printed("parts", name) for name in ("four-cables", "four-linear-actuators")}}


ASKED = {
    "actuators": actuators,
    "parameters": parameters,
    "files": files,
}

#: Those that take longer than 0.15 s.
LONGER = {"files"}


@each_of(ASKED, LONGER)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
