"""Answers about the joint of a person who wears a device, as they are stored."""

import numpy as np
import pytest
from answers import changes, each_of
from asked_in_turn import in_turn, printed
from places import URDF

pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")

import exo_pin as ep
from exo_pin import control

MAN = ep.Person(1.755, 85, "male", elbow_flexion=0.4)
LOAD = ep.Load([2.0, -1.0, -6.0], [0.1, 0.0, -0.2], [0.0, 0.01, -0.3])
MOTION = ep.Motion([0.3, -0.9, 0.2], [1.0, -2.0, 0.5])


def loaded(name):
    exo = ep.load(URDF / f"{name}.urdf" if (URDF / f"{name}.urdf").exists() else name)
    return exo.worn_by(MAN)


def told(contact):
    """Of a joint force what is not of the muscles alone."""
    names = ("status", "held", "caution", "device_wrench", "device_forces", "assumptions", "cautions")
    found = {name: getattr(contact, name) for name in names}
    return found | {
        "force": contact.force,
        "relief": contact.relief_percent,
        "bare": contact.without_device and contact.without_device.magnitude,
    }


def joints():
    """Joint forces with devices of every kind, whoever chooses what the device does."""
    cables, hinges, support = (loaded(name) for name in ("four-cables", "serial-y-x-z", "spring-support"))
    chain = ep.ShoulderExo.from_device(cables.chain_device)
    pose, poses = cables.pose(50, 20, 5), cables.pose([20, 70], [15, 30], 5)
    given = cables.reaction(pose).actuator_forces
    way = ep.device.Route.over(("universe", (0.0, 0.0, -0.5)), ("arm", (0.0, 0.0, -0.2)))
    down = ep.device.Spring("down", ep.device.ConstantForce(20.0), route=way)
    bow = ep.device.Spring("bow", ep.device.TableLaw((5.0, 6.0), (1.0, 2.0)), "flexion")

    def asked(exo, poses, forces=None, **more):
        return told(exo.joint_contact(poses, MAN, forces, **more))

    return in_turn(
        {
            "of themselves": lambda: asked(cables, poses, motion=MOTION, load=LOAD),
            "half": lambda: asked(cables, pose, 0.5, load=LOAD),
            "given": lambda: asked(cables, pose, given * 1.1, centre_offset=[0.003, 0.0, 0.004]),
            "too much": lambda: asked(cables, poses, given * [1.0, -1.0, 1.0, 1.0]),
            "least effort": lambda: asked(cables, pose, "least_effort"),
            "least contact": lambda: asked(cables, pose, "least_contact", limits=(0.0, 60.0)),
            "with sides": lambda: asked(cables, pose, "least_effort", constraint_bounds=(-5.0, 8.0)),
            "a reaction": lambda: asked(cables, poses, cables.reaction(poses, limits=(0.0, 30.0))),
            "of a chain": lambda: asked(chain, pose, given),
            "least of a chain": lambda: asked(chain, pose, "least_effort"),
            "chain displaced": lambda: asked(chain, pose, given, centre_offset=[0.003, 0.0, 0.004]),
            "sides of a chain": lambda: asked(chain, pose, "least_effort", constraint_bounds=5.0),
            "hinges": lambda: asked(hinges, pose, load=LOAD),
            "efforts of hinges": lambda: asked(hinges, poses, [1.0, 6.0, 5.0]),
            "a share of hinges": lambda: asked(hinges, pose, 0.4),
            "support": lambda: asked(support, poses),
            "share of a support": lambda: asked(support, pose, 0.4),
            "support, moving": lambda: asked(support, pose, motion=MOTION, load=LOAD),
            "two choices": lambda: asked(cables, pose, cables.reaction(pose), centre_offset=[0.0, 0.0, 0.01]),
            "other poses": lambda: asked(cables, poses, cables.reaction(pose)),
            "no choice": lambda: asked(cables, pose, "least_pain"),
            "fewer": lambda: asked(cables, pose, [1.0, 2.0]),
            "nobody": lambda: cables.joint_contact(pose, ep.Wearer(1.7, 70, "male")),
            "lacking": lambda: asked(hinges.replace(springs=[bow]), pose),
            "lacking, given": lambda: asked(hinges.replace(springs=[bow]), pose, [1.0, 6.0, 5.0]),
            "pulled down": lambda: str(support.replace(springs=[down]).joint_contact(pose, MAN)),
        }
    )


def without_drive():
    """Three hinges of which the last has no drive, and is beyond its end in one of two poses."""
    hinges = loaded("serial-y-x-z")
    drives = [drive for drive in hinges.device.drives if drive.joint != "internal_rotation"]
    return told(hinges.replace(drives=drives).joint_contact(hinges.pose(50, 20, [5, -45]), MAN))


def spread():
    """How far forces and joint forces spread, and the load of runs."""
    cables, hinges = loaded("four-cables"), loaded("serial-y-x-z")
    pose = cables.pose(50, 20, 5)
    cuff = ep.Interface.of([3.7e3, 3.15e3, 2.25e3], 12.0, at=(0.0, 0.0, -0.2))
    pad = control.Padding(damping_time=0.01, mass=0.2, radius=0.05, source="a test")
    few = {"offset_mm": 5.0, "tone_percent": 20.0}

    def spread_of(exo, person, **more):
        found = exo.total_uncertainty(pose, person, draws=8, **more)
        return str(found).splitlines()[:4]

    def run(exo, duration, **more):
        found = exo.joint_contact_of_run(exo.track("flexion", duration=duration), MAN, **more)
        return found.status, found.magnitude, found.assumptions["device"]

    def dropped(exo, **more):
        plant = ep.Plant(exo, **more)
        fall = plant.simulate(lambda t, seen: np.zeros(plant.count), 0.05)
        found = exo.joint_contact_of_run(fall, MAN, rate=20.0)
        return found.status, found.magnitude, found.caution

    return in_turn(
        {
            "stated": lambda: spread_of(cables, MAN, uncertainties=few, load=LOAD, seed=2),
            "nobody": lambda: spread_of(cables, None, uncertainties={"offset_mm": 5.0}),
            "no tone": lambda: spread_of(cables, MAN, uncertainties={"tone_percent": -1.0}),
            "no name": lambda: spread_of(cables, None, uncertainties={"weather": 1.0}),
            "run": lambda: run(cables, 0.4, rate=8.0),
            "run of hinges": lambda: run(hinges, 0.05),
            "run with a joint that nothing drives": lambda: dropped(loaded("3rps-passive-ball")),
            "run in a soft cuff": lambda: dropped(hinges.replace(interfaces=ep.Interfaces(cuff=cuff)), cuff=pad),
            "no rate": lambda: cables.joint_contact_of_run(None, MAN, rate=0.0),
        }
    )


def pages():
    """First answers and all that is known with a person's own muscles."""
    man = ("--person", "1.755,85,male", "--payload", "0.5", "--elbow-flexion", "30")
    cases = {
        "hinges": ("serial-y-x-z", "60", "20", "5"),
        "supports": ("spring-support", "60", "0", "0", "--explain"),
        "cables": ("four-cables", "70", "15", "0", "--hand-force", "0,0,-12"),
        "explained": ("four-linear-actuators", "60", "30", "0", "--explain"),
        "not held": ("four-cables", "70", "15", "0", "--limits", "0,10"),
    }
    found = {}
    for name, (design, flexion, abduction, inward, *more) in cases.items():
        design = str(URDF / f"{design}.urdf") if (URDF / f"{design}.urdf").exists() else design
        angles = ("--flexion", flexion, "--abduction", abduction, "--internal-rotation", inward)
        found[name] = printed("reaction", design, *angles, *man, *more)
    return found


ASKED = {"joints": joints, "without_drive": without_drive, "spread": spread, "pages": pages}


@pytest.mark.full
@each_of(ASKED)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
