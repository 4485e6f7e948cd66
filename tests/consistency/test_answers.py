"""Answers of the consistency checks: of designs that pass, and of those that cannot work, as stored."""

import re

from answers import changes, each_of
from places import URDF

import exo_pin as ep
from exo_pin.consistency import Finding, Report, check, check_chain
from exo_pin.device import Brake, LinearSpring, Route, Spring, TableLaw


def load(name):
    return ep.load(URDF / f"{name}.urdf" if (URDF / f"{name}.urdf").exists() else name)


def told(report):
    """What is found, without the digits of rounding errors."""
    rounding = re.compile(r"\d\.\d+e[-+](0[7-9]|1\d)|\binf\b")
    return [(each.name, each.outcome, rounding.sub("(rounding)", each.detail)) for each in report.findings]


def kinds():
    names = (
        "prototype",
        "scenario-one",
        "appendix-d",
        "four-cables",
        "serial-y-x-z",
        "3rps-passive-ball",
        "six-cables",
    )
    return {name: told(load(name).check()) for name in (*names, "spring-support", "dummy-shoulder")} | {
        "preset": told(ep.load("prototype").check())
    }


def spoiled():
    """Wrists that are singular, folded or without mass, of limbs of few kinds, and a robot that is locked or open."""
    muscles, serial, cables = ep.load("prototype"), load("serial-y-x-z"), load("four-cables")
    joints = [drive.joint for drive in serial.device.drives]
    turned = {angle: ep.thesis_rotation(angle, 0, 0, degrees=True) for angle in (90.0, 60.0, 20.0)}
    neutral = {angle: muscles.geometry.replace(neutral=turn) for angle, turn in turned.items()}
    ways = [Route.over(("universe", at), ("arm", [0.02, 0.0, -0.2])) for at in ([0.3, 0, 0], [0, 0.3, 0])]
    springs = [Spring("top", TableLaw((0.1, 0.35), (1.0, 2.0)), route=ways[0]),
               Spring("cord", LinearSpring(40.0), route=ways[1]),
               Spring("far", TableLaw((2.0, 3.0), (1.0, 2.0)), route=ways[1])]  # fmt: skip
    designs = [
        *(muscles.replace(geometry=each) for each in neutral.values()),
        muscles.replace(arm=None),
        muscles.replace(arm=ep.Arm(2.0, [0.0, 0.0, -0.2])),
        muscles.replace(limbs=[ep.Limb("UPU"), ep.Limb("SPS"), ep.Limb("UPU")]),
        cables.replace(limbs=None),
        serial.replace(drives=()),
        serial.replace(drives=serial.device.drives[:1], brakes=[Brake("hold", joints[1])]),
        serial.replace(springs=springs),
        serial.replace(springs=springs[1:2]),
        serial.replace(springs=[Spring("hinge", TableLaw((-0.4, 0.9), (1.0, 2.0)), joint=name) for name in joints[:2]]),
    ]
    return [told(design.check()) for design in designs] + [
        told(check_chain(serial.chain)), told(check_chain(cables.chain, 1)), told(check(cables.device.as_chain())),
        str(Report("own", (Finding.of("loops", False, "open"), Finding.of("mobility", True, "fits")))),
        Report("own", (Finding("loops", "note", "open"),))._repr_html_(),
        Report("own", (Finding("loops", "note", "open"),)),
    ]  # fmt: skip


ASKED = {"kinds": kinds, "spoiled": spoiled}
LONGER = {"kinds", "spoiled"}


@each_of(ASKED, LONGER)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
