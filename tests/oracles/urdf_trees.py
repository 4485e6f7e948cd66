"""Random URDF trees with joints of every type."""

import numpy as np
from scipy.spatial.transform import Rotation

KINDS = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")


def text(values):
    return " ".join(repr(float(value)) for value in np.atleast_1d(values))


def inertial(rng):
    """A body of a random shape: principal moments as of three point masses on its axes."""
    mass, squares = rng.uniform(0.2, 3.0), rng.uniform(0.01, 0.1, 3) ** 2
    moments = mass * (squares.sum() - squares)
    R = Rotation.random(rng=rng).as_matrix()
    i = R @ np.diag(moments) @ R.T
    i = (i + i.T) / 2
    six = {"ixx": i[0, 0], "ixy": i[0, 1], "ixz": i[0, 2], "iyy": i[1, 1], "iyz": i[1, 2], "izz": i[2, 2]}
    entries = " ".join(f'{key}="{text(value)}"' for key, value in six.items())
    return (
        f'    <inertial>\n      <origin xyz="{text(rng.normal(size=3) * 0.1)}" rpy="{text(rng.normal(size=3))}"/>\n'
        f'      <mass value="{text(mass)}"/>\n      <inertia {entries}/>\n    </inertial>\n'
    )


def joint(rng, k, kind, parent):
    """A joint from link ``parent`` to link k + 1, with damping and friction where its type may have some."""
    axis = "0 0 1" if kind == "planar" else text(rng.normal(size=3) * rng.uniform(0.5, 2.0))
    lines = [
        f'  <joint name="j{k}" type="{kind}">',
        f'    <parent link="l{parent}"/>',
        f'    <child link="l{k + 1}"/>',
        f'    <origin xyz="{text(rng.normal(size=3) * 0.3)}" rpy="{text(rng.normal(size=3))}"/>',
        f'    <axis xyz="{axis}"/>',
    ]
    if kind in ("revolute", "prismatic", "continuous"):
        span = "" if kind == "continuous" else f'lower="{text(-rng.uniform(1, 3))}" upper="{text(rng.uniform(1, 3))}" '
        lines.append(f'    <limit {span}effort="{text(rng.uniform(1, 99))}" velocity="{text(rng.uniform(1, 9))}"/>')
        lines.append(f'    <dynamics damping="{text(rng.uniform(0, 2))}" friction="{text(rng.uniform(0, 1))}"/>')
    return "\n".join([*lines, "  </joint>\n"])


def random_tree(seed, count=7, kinds=KINDS):
    """A URDF of ``count`` joints, in which every kind comes at least once if there are enough of them."""
    rng = np.random.default_rng(seed)
    chosen = rng.permutation([*kinds, *rng.choice(kinds, size=max(0, count - len(kinds)))])[:count]
    parts = [f'<robot name="tree-{seed}">\n  <link name="l0"/>\n']
    for k, kind in enumerate(chosen):
        parts.append(f'  <link name="l{k + 1}">\n{inertial(rng)}  </link>\n')
        parts.append(joint(rng, k, str(kind), int(rng.integers(max(0, k - 2), k + 1))))
    return "".join([*parts, "</robot>\n"])
