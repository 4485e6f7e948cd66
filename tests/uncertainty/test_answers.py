"""Answers on how sure the force in the shoulder is, as stored: each quantity, the worst offset, all at once."""

import numpy as np
import pytest
from answers import changes, each_of
from asked_in_turn import in_turn, tried
from guided_limbs import guided
from places import URDF

import exo_pin as ep

MAN = ep.Wearer(1.755, 85.0, "male")
WORN = ep.load("four-linear-actuators-worn")
LOAD = ep.Load([3.0, -2.0, -14.0], at=[0.01, 0.02, -0.3], moment=[0.2, -0.1, 0.3], frame="arm")
CERTAIN = {"offset_mm": 0.0, "pose_deg": 0.0, "mass_percent": 0.0, "centre_of_mass_mm": 0.0}
NO_PLACES = {"A_mm": 0.0, "B_mm": 0.0}


def device(name, **options):
    return ep.load(URDF / f"{name}.urdf", **options).worn_by(MAN)


def told(found):
    """What is said of a force that is not certain, and its numbers."""
    worst = found.worst_offset
    return {
        "says": str(found).splitlines(),
        "columns": found.columns(),
        "known": [(each.name, each.size, each.unit, each.effects, each.shows) for each in found.known],
        "at": found.at,
        "cautions": found.cautions,
        "worst": worst and (worst.radius, worst.magnitude, worst.holds, worst.magnitudes),
        "document": found.as_dict(),
        "certain": found.places_certain,
    }


def asked_of_each():
    stated = {
        "A[1]_mm": 5.0,
        "A_mm": 3.0,
        "lean_deg": 4.0,
        "offset_mm": 8.0,
        "load_percent": 12.0,
        "B_mm": 0.0,
        "cuff_height_mm": 6.0,
    }
    poses = WORN.pose([20.0, 75.0, 50.0], [10.0, 40.0, 80.0], 15.0)
    return told(WORN.uncertainty(poses, load=LOAD, uncertainties=stated, centre_offset=[0.002, -0.001, 0.003]))


def guiding():
    return guided(ep.load("prototype").worn_by(MAN), stiffness=2e4 * np.eye(3))


def soft_guides():
    """Guided limbs on a cuff that gives way at 60 degrees of flexion."""
    return guiding().replace(interfaces=ep.Interfaces(cuff=ep.Interface.upper_arm_cuff(0.19)))


def asked_of_soft_parts():
    exo = guiding()
    serial = device("serial-y-x-z").replace(interfaces=ep.Interfaces(cuff=ep.Interface.upper_arm_cuff(0.19)))
    harness = serial.replace(interfaces=ep.Interfaces(harness=ep.Interface.of(2e4, 300.0, at=(-0.1, 0.0, 0.1))))
    springs = CERTAIN | {"springs_percent": 30.0}
    stated = {"offset_mm": 0.0, "guides_percent": 25.0, "B_mm": 0.0, "pose_deg": 0.0, "centre_of_mass_mm": 3.0}
    return in_turn(
        guides=lambda: told(exo.uncertainty(exo.pose(60, 30), split="elastic", uncertainties=stated)),
        cuff=lambda: told(serial.uncertainty(serial.pose(50, 30), split="elastic", uncertainties=springs)),
        harness=lambda: told(harness.uncertainty(serial.pose(50, 30), split="elastic", uncertainties=springs)),
    )


def asked_of_devices():
    support, serial, right = device("spring-support"), device("serial-y-x-z"), device("spring-support", side="right")
    soft = serial.replace(interfaces=ep.Interfaces(cuff=ep.Interface.upper_arm_cuff(0.19)))
    springs = CERTAIN | {"springs_percent": 0.0}
    two = {
        "limits": "none",
        "uncertainties": CERTAIN | {"spring[strut,1]_mm": 3.0, "spring_mm": 2.0, "mass_percent": 7.0},
    }
    return in_turn(
        support=lambda: told(support.uncertainty(support.pose(30, 45, 30), **two)),
        right=lambda: right.uncertainty(right.pose(30, 45, 30), **two).columns(),
        offset=lambda: told(
            support.uncertainty(
                support.pose(30, 45, 30), limits="none", uncertainties=CERTAIN | {"spring_mm": 0, "offset_mm": 6}
            )
        ),
        serial=lambda: told(serial.uncertainty(serial.pose(50, 30), uncertainties=CERTAIN | {"offset_mm": 4.0})),
        rigid=lambda: told(serial.uncertainty(serial.pose(50, 30), uncertainties=CERTAIN)),
        far=lambda: told(
            soft.uncertainty(soft.pose(50, 30), split="elastic", uncertainties=springs | {"offset_mm": 150.0})
        ),
    )


def asked_of_wrong_questions():
    pose, plain = WORN.pose(60, 30), ep.load("prototype")
    certain = CERTAIN | NO_PLACES
    flat = WORN.pose([60, 61], 30)

    def asked(**stated):
        return [effect.name for effect in WORN.uncertainty(pose, uncertainties=certain | stated).effects]

    return in_turn(
        percent=lambda: tried(lambda size: asked(mass_percent=size), 99.0, 100.0, -1.0),
        unknown=lambda: asked(mas_percent=3.0),
        no_load=lambda: asked(load_percent=3.0),
        certain_load=lambda: asked(load_percent=0.0, springs_percent=0.0),
        no_dimension=lambda: asked(**{"A[9]_mm": 1.0}),
        dimensions=lambda: asked(cuff_height_mm=2.0),
        both=lambda: asked(**{"A[1]_mm": 2.0, "A_mm": 1.0}),
        no_mapping=lambda: WORN.uncertainty(pose, uncertainties=3),
        no_arm=lambda: plain.replace(arm=None).uncertainty(plain.pose(60, 30)),
        too_far=lambda: asked(offset_mm=400.0),
        none=lambda: WORN.uncertainty(pose, uncertainties=certain | {"lean_deg": 0.0}).worst_offset,
        stack=lambda: WORN.uncertainty(flat, uncertainties=certain | {"mass_percent": 2.0}).at,
        no_answer=lambda: soft_guides().uncertainty(pose, split="elastic"),
        no_draws=lambda: soft_guides().total_uncertainty(pose, split="elastic", draws=8),
        peaks=lambda: [
            WORN.uncertainty(WORN.pose(*angles), uncertainties=certain | {"mass_percent": 2.0}).at
            for angles in (([150, 90], [0, 90]), ([170, 150], 0), ([[170, 90, 60]], [0, 90, 30]))
        ],
        singular=lambda: plain.uncertainty(plain.pose([0, 0], 90)),
        outside=lambda: WORN.uncertainty(WORN.pose(170, 0), uncertainties=certain).verdict,
    )


def spread(found):
    return (
        str(found).splitlines(),
        found.columns(),
        found.quantiles,
        found.shoulder_forces[:6],
        found.held.sum(),
        found.magnitude,
    )


def asked_of_all_at_once():
    right = ep.load("four-linear-actuators-worn", side="right")
    stated = {"A_mm": 1.5, "cuff_height_mm": 3.0, "lean_deg": 2.0}

    def total(exo, draws=14, **options):
        return spread(exo.total_uncertainty(exo.pose(60, 30), **{"draws": draws, "uncertainties": stated} | options))

    soft = device("serial-y-x-z").replace(interfaces=ep.Interfaces(cuff=ep.Interface.upper_arm_cuff(0.19)))
    guides = {"guides_percent": 25.0, "shoulder_stiffness_percent": 40.0, "mass_percent": 4.0}
    springs = {"split": "elastic", "uncertainties": CERTAIN | {"springs_percent": 30.0, "mass_percent": 4.0}}
    return in_turn(
        left=lambda: total(WORN, seed=3, load=LOAD),
        springs=lambda: total(soft, 8, **springs),
        guides=lambda: total(
            guiding().replace(shoulder=ep.Shoulder(stiffness=np.diag([2e4, 3e4, 1e4]))),
            8,
            split="elastic",
            uncertainties=CERTAIN | NO_PLACES | guides,
        ),
        right=lambda: total(right, seed=3)[3:],
        few=lambda: total(WORN, 7),
        seed=lambda: total(WORN, seed=-1),
        nothing=lambda: total(WORN, 8, uncertainties=CERTAIN | NO_PLACES),
        stack=lambda: WORN.total_uncertainty(WORN.pose([60, 50], 30)),
        wrong=lambda: total(WORN, uncertainties={"mas_percent": 3.0}),
        little_tone=lambda: total(WORN, 8, uncertainties=CERTAIN | NO_PLACES | {"tone_percent": 0.5})[0],
        tone=lambda: total(WORN, 8, uncertainties=CERTAIN | NO_PLACES | {"tone_percent": 20.0, "mass_percent": 4.0}),
    )


def asked_of_muscles():
    pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")
    person = ep.Person(1.755, 85, "male")
    stated = CERTAIN | NO_PLACES | {"offset_mm": 4.0, "mass_percent": 4.0}
    return spread(WORN.total_uncertainty(WORN.pose(60, 30), person, draws=8, uncertainties=stated))


ASKED = {
    "each": asked_of_each,
    "soft_parts": asked_of_soft_parts,
    "devices": asked_of_devices,
    "wrong_questions": asked_of_wrong_questions,
    "all_at_once": asked_of_all_at_once,
    "muscles": asked_of_muscles,
}
#: Those that take longer than 0.15 s.
LONGER = set(ASKED)


@each_of(ASKED, LONGER)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
