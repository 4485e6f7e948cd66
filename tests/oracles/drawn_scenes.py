"""Every sort of scene and recording: what their stored descriptions are made from."""

import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
from drawn_figures import MAN, prototype, robot, sprung, worn
from mechanisms import four_bar, random_loop
from places import URDF
from spatial_mechanisms import delta

import exo_pin as ep
from exo_pin.chain import ClosedChain
from exo_pin.design import LimbGuide
from exo_pin.device import ConstantForce, Drive, LinearSpring, Route, Spring
from exo_pin.view import ChainScene, Scene

APART = ep.CentreOffset([0.004, -0.01, 0.012], [-0.006, 0.0, 0.015])


def shown(exo, *angles, view=None, **query):
    """A scene of a device in a pose, alone unless ``view`` says more."""
    scene = exo.view(**({"human": False} | (view or {})))
    scene.show(exo.pose(*angles), **query)
    return scene


def heavy():
    """A wrist whose links have mass: its forces come from its chain."""
    return ep.load(URDF / "prototype.urdf").worn_by(MAN)


def guided():
    """Limbs that carry side forces."""
    exo = prototype()
    tube = LimbGuide.tube(outer_radius=0.012, inner_radius=0.010, youngs_modulus=70e9, shear_modulus=26e9)
    limbs = [replace(limb, guide=tube) for limb in exo.limbs]
    return exo.replace(limbs=limbs, shoulder=ep.Shoulder(stiffness=2e4))


def cuffed():
    """A soft cuff."""
    return prototype().replace(interfaces=ep.Interfaces(cuff=ep.Interface.upper_arm_cuff(0.2), cuff_area=0.01))


def mixed():
    """Three cables and a linear actuator."""
    exo = ep.load("four-cables")
    return exo.replace(limbs=[*exo.limbs[:3], ep.load("four-linear-actuators").limbs[3]])


def roped(rest):
    """A robot with a strong spring along a route, of a length at rest in m, and one in a hinge."""
    way = Route.over(
        ("universe", (0.0, 0.1, 0.3)),
        ("universe", [0.0, 0.15, 0.2]),
        ("arm", (0.03, 0.04, -0.2)),
        ("arm", (0.0, 0.05, -0.25)),
    )
    springs = [
        Spring("rope", LinearSpring(1000.0, rest), route=way),
        Spring("wound", ConstantForce(3.0), joint="flexion"),
    ]
    return ep.load(URDF / "serial-y-x-z.urdf").replace(springs=springs).worn_by(MAN)


def cabled():
    way = Route.over(("universe", [0.05, 0.1, 0.25]), ("universe", [0.0, 0.15, 0.2]), ("arm", [0.03, 0.0, -0.2]))
    return robot("spring-support").replace(drives=[Drive("rope", route=way)])


def bare(name):
    """A robot without an arm's mass, or a wrist without."""
    return ep.load(name)


def with_visual():
    """A bar with a shape of its own among rods."""
    named = four_bar()
    tree = ET.fromstring(named.urdf)
    visual = ET.SubElement(next(link for link in tree.findall("link") if link.get("name") == "crank"), "visual")
    ET.SubElement(ET.SubElement(visual, "geometry"), "box", size="0.3 0.02 0.02")
    xml = ET.tostring(tree, encoding="unicode")
    return ChainScene(ClosedChain.from_urdf(xml, named.closures), xml, q=named.q)


def ajar():
    named = four_bar()
    return ChainScene(named.chain(), q=named.q + np.array([0.1, -0.2, 0.15]))


def looked_at():
    """From a place by hand, with points to drag."""
    scene = ChainScene(delta().chain(), labels=False)
    scene.camera(position=[2.0, 1.0, 0.5], field_of_view=40.0)
    scene.offer({"free": [0.1, 0.2, 0.3]}, hand=[0.0, 0.0, -0.6])
    return scene


def turned_back():
    """A pose that the device does not reach, then one that it does, and another design."""
    exo = robot("serial-y-x-z")
    scene = exo.view(human=False)
    scene.show(exo.pose(0, 110, 0))
    return scene


def exchanged():
    scene = shown(prototype(), 60, 30)
    scene.replace_exo(prototype().replace(geometry=prototype().geometry.replace(r_A=0.14)))
    return scene


def wide():
    """A device that is wider than what a page shows of a person."""
    exo = ep.load("prototype")
    return exo.replace(geometry=exo.geometry.replace(r_A=0.9))


def person(name, *angles, side="left", options=None, **query):
    wearer = ep.Person(1.75, 75, "male", elbow_flexion=20, degrees=True)
    exo = name if isinstance(name, ep.ShoulderExo) else ep.load(name, side=side)
    return shown(exo, *angles, view={"human": None, "person": wearer} | (options or {}), **query)


def film(exo, angles, **query):
    poses = exo.pose(*np.transpose(angles))
    return exo.view(human=False).record(poses, np.linspace(0.0, 1.0, len(angles)), **query)


def film_of_chain():
    scene = ChainScene(four_bar().chain())
    path = [scene.move({"crank_hinge": angle}) for angle in (1.5, 1.6, 1.7)]
    return scene.record(path, [0.0, 0.2, 0.4])


HUMAN = {"view": {"human": True}}
#: Scenes by name, as they are on a page.
SCENES = {
    "wrist": lambda: shown(prototype(), 60, 30, 10),
    "wrist_rest": lambda: Scene(prototype(), human=False),
    "wrist_singular": lambda: shown(prototype(), 0, 90),
    "wrist_near_singular": lambda: shown(prototype(), 6.3, 30.0, limits="none"),
    "wrist_cuff": lambda: shown(cuffed(), 60, 30),
    "wrist_muscles": lambda: shown(prototype(), 60, 30, view={"limbs": "muscles"}),
    "wrist_muscles_linear": lambda: shown(worn(), 20, 10, view={"limbs": "muscles"}),
    "wrist_minimal": lambda: shown(prototype(), 30, 40, split="minimal", constraint_bounds=(-80, 80), limits="none"),
    "wrist_offset": lambda: shown(prototype(), 60, 30, centre_offset=APART),
    "wrist_shifted": lambda: shown(worn(), 0, 0, centre_offset=[0.0, 0.0, 0.01]),
    "wrist_elastic": lambda: shown(guided(), 60, 30, split="elastic", centre_offset=APART),
    "wrist_scaled": lambda: shown(prototype(), 60, 30, view={"metres_per_newton": 0.01}),
    "wrist_no_arm": lambda: shown(bare("scenario-one"), 20, 0),
    "wrist_exchanged": exchanged,
    "wrist_heavy": lambda: shown(heavy(), 50, 30),
    "wrist_cables_heavy": lambda: shown(robot("six-cables"), 50, 30),
    "cables": lambda: shown(mixed(), 60, 30),
    "cables_right": lambda: shown(ep.load("four-cables", side="right"), 40, 50),
    "human": lambda: shown(worn(), 60, 20, **HUMAN),
    "human_right": lambda: shown(worn("right"), 30, 40, 20, **HUMAN),
    "human_robot": lambda: shown(robot("nesm"), 30, 20, **HUMAN),
    "serial": lambda: shown(robot("serial-y-x-z"), 40, 20, 10),
    "serial_not_reached": turned_back,
    "serial_offset": lambda: shown(robot("serial-y-x-z"), 30, 20, 5, centre_offset=APART, limits="none"),
    "serial_right": lambda: shown(ep.load(URDF / "serial-y-x-z.urdf", side="right").worn_by(MAN), 40, 20),
    "serial_alone": lambda: shown(ep.load(URDF / "serial-y-x-z.urdf"), 40, 20),
    "serial_roped": lambda: shown(roped(0.1), 30, 20),
    "serial_pushed": lambda: shown(roped(0.9), 30, 20),
    "serial_no_data": lambda: shown(sprung(), 10, 0),
    "spherical": lambda: shown(robot("spherical-3rrr"), 30, 20),
    "parallel": lambda: shown(robot("3rps-passive-ball"), 40, 20, 10),
    "parallel_offset": lambda: shown(robot("3rps-passive-ball"), 30, 20, 5, centre_offset=APART, limits="none"),
    "spring": lambda: shown(cabled(), 0, 70),
    "spring_offset": lambda: shown(cabled(), 30, 20, centre_offset=APART),
    "exoskeleton": lambda: shown(robot("nesm"), 50, 20),
    "exoskeleton_of_chain": lambda: shown(ep.ShoulderExo.from_device(robot("nesm").chain_device), 50, 20),
    "chain": lambda: ChainScene(four_bar().chain(), q=four_bar().q),
    "chain_open": ajar,
    "chain_visuals": with_visual,
    "chain_hinges": lambda: ChainScene(random_loop("revolute").chain(), q=random_loop("revolute").q),
    "chain_delta": lambda: ChainScene(delta().chain()),
    "chain_looked_at": looked_at,
    "chain_of_wrist": lambda: ChainScene(ep.load("three-linear-actuators").chain),
    "chain_robot": lambda: ep.load(URDF / "dummy-shoulder.urdf").view(),
}
#: Those of the wearer's bones and muscles, with the extra ``person``.
PERSONS = {
    "person": lambda: person("four-cables", 30, 40),
    "person_right": lambda: person("prototype", 60, 30, side="right"),
    "person_alone": lambda: person("four-cables", 20, 60, options={"device": False}),
    "person_alone_beyond": lambda: person(wide(), 20, 30, 150, options={"device": False}),
    "person_unseen": lambda: person("four-cables", 30, 40, options={"human": False}),
    "person_beyond": lambda: person("four-cables", 20, 30, 150),
    "person_robot": lambda: person(URDF / "spring-support.urdf", 50, 20),
}
#: Recordings by name.
FILMS = {
    "film": lambda: film(prototype(), [(0, 0), (30, 15), (60, 30)]),
    "film_singular": lambda: film(prototype(), [(angle, 30) for angle in range(0, 91, 6)], limits="none"),
    "film_muscles": lambda: Scene(prototype(), human=False, limbs="muscles").record(
        prototype().pose([0, 60], [10, 30]), [0.0, 1.0]),
    "film_robot": lambda: film(robot("nesm"), [(10, 20), (40, 20), (60, 20)]),
    "film_chain": film_of_chain,
}  # fmt: skip
