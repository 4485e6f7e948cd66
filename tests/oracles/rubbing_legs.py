"""Three-legged robots with dry friction in all joints, as MJCF: on hinge-balls, universal joints or hinges."""

from __future__ import annotations

from itertools import product

import numpy as np

BALL = ("1 0 0", "0 1 0", "0 0 1")
#: What the legs stand on; what changes their length; whether all of them end in hinge-balls; friction, N and N m; and
#: a seed of the motion at the start, None at rest.
VARIANTS = [
    *product(("ball", "universal", "hinge"), ("slide", "knee"), (False, True), (0.02, 0.3), (None, 1)),
    ("hinge", "slide", True, 0.1, 2),
    ("ball", "slide", False, 1.0, 2),
]


def _hinges(kind: str, prefix: str) -> str:
    axes = {"ball": BALL, "universal": BALL[:2]}.get(kind, (kind,))
    return "".join(f'<joint name="{prefix}{k}" axis="{axis}"/>' for k, axis in enumerate(axes))


def three_legs(foot: str, middle: str, balls: bool, friction: float) -> str:
    """The platform is carried by the hinge-ball of the first leg, and by points or hinge-balls of the others."""
    legs, ends = "", ""
    for k, angle in enumerate(np.radians([90.0, 210.0, 330.0])):
        out = np.array([np.cos(angle), np.sin(angle), 0.0])
        along = -0.2 * out + [0.0, 0.0, 0.5]
        across = f"{-out[1]} {out[0]} 0"
        half, mass = 0.5 * along, '<inertial mass="0.4" pos="{} {} {}" diaginertia=".004 .004 .004"/>'
        moves = f'type="slide" axis="{along[0]} {along[1]} {along[2]}"' if middle == "slide" else f'axis="{across}"'
        if k == 0:
            sites = "".join(
                f'<site name="p{j}" pos="{0.2 * (np.cos(a) - out[0])} {0.2 * (np.sin(a) - out[1])} 0"/>'
                for j, a in enumerate(np.radians([90.0, 210.0, 330.0]))
            )
            centre = -0.2 * out
            platform = (
                f'<body name="platform" pos="{half[0]} {half[1]} {half[2]}">{_hinges("ball", "top0_")}'
                f'<inertial mass="2" pos="{centre[0]} {centre[1]} 0.05" diaginertia=".02 .02 .03"/>{sites}</body>'
            )
        else:
            end = f'<site name="end{k}"/>'
            hinges = _hinges("ball", f"top{k}_") + '<inertial mass=".05" pos="0 0 0" diaginertia="1e-4 1e-4 1e-4"/>'
            platform = f'<body pos="{half[0]} {half[1]} {half[2]}">{hinges if balls else ""}{end}</body>'
            kind = "weld" if balls else "connect"
            ends += f'<{kind} name="loop{k}" site1="end{k}" site2="p{k}"/>'
        feet = _hinges(across if foot == "hinge" else foot, f"foot{k}_")
        legs += (
            f'<body pos="{0.4 * out[0]} {0.4 * out[1]} 0">{feet}{mass.format(*(0.5 * half))}'
            f'<body pos="{half[0]} {half[1]} {half[2]}"><joint name="middle{k}" {moves}/>'
            f"{mass.format(*(0.5 * half))}{platform}</body></body>"
        )
    return (
        f'<mujoco><default><joint frictionloss="{friction}"/></default><worldbody>{legs}</worldbody>'
        f"<equality>{ends}</equality></mujoco>"
    )
