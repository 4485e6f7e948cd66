"""How many of the robots that packages of PyPI and repositories bring are read, and why the others are not.

::

    python -m venv world
    world/bin/pip install dm_control gymnasium-robotics myosuite robosuite mujoco playground
    world/bin/pip install pybullet drake example-robot-data
    python benchmarks/reading_robots.py world
    git clone https://github.com/osrf/gazebo_models gazebo/gazebo_models
    git clone https://github.com/gazebosim/gz-sim gazebo/gz-sim
    python benchmarks/reading_robots.py gazebo

Counted are the MJCF files that MuJoCo compiles and that move, the URDF files that Pinocchio loads, and the SDF files
with a joint that include no other file, each file once.
A robot that is refused is read again with what the error asks to name in ``leave_out``. What is read of MJCF is
compared with MuJoCo's mass matrix, bias and passive forces by the reader; of URDF with Pinocchio's mass matrix and bias
here, to 1e-9. The tables are those of docs/evidence/robots_read.md.
"""

import argparse
import os
import re
import warnings
from collections import Counter, defaultdict
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin

from exo_pin.chain import ClosedChain
from exo_pin.chain.formats.leaving_out import LEAVE_OUT
from exo_pin.core.errors import ExoPinError

#: Files of one program that makes robots at random.
RANDOM, MADE = "random_urdfs", "made at random"
#: Around what is generated in the page, of a format.
MARKS = ("<!-- {} from benchmarks/reading_robots.py -->", "<!-- end -->")


def files(folder, endings, begins):
    """Files with one of the endings and a text in their first lines, each once."""
    seen = set()
    for path in sorted(path for ending in endings for path in folder.rglob(f"*{ending}")):
        real = os.path.realpath(path)
        if real in seen or begins not in path.read_text(errors="replace")[:4000]:
            continue
        seen.add(real)
        yield path


def package(path, folder):
    """The package that a file belongs to."""
    parts = path.relative_to(folder).parts
    if RANDOM in parts:
        return f"pybullet_data, {MADE}"
    known = [part for part in parts if part.replace("-", "_") == "example_robot_data"]
    if known:
        return "example-robot-data"
    return parts[parts.index("site-packages") + 1] if "site-packages" in parts else parts[0]


def read(load, path):
    """The chain or None, what was named, and the reason."""
    names = []
    while True:
        try:
            return load(path, leave_out=names), names, ""
        except ExoPinError as error:
            asked = re.search(r'leave_out=\["(\w+)"\]', str(error))
            if asked and asked.group(1) not in names:
                names.append(asked.group(1))
                continue
            reason = re.sub(r"^line \d+: ", "", str(error).split(f"{path}: ", 1)[-1])
            return None, names, reason[:100]


def moves(path):
    """Whether MuJoCo compiles a file and it moves."""
    try:
        return mujoco.MjModel.from_xml_path(str(path)).nv > 0
    except (ValueError, RuntimeError, mujoco.FatalError, mujoco.UnexpectedError):
        return False


def is_whole(path):
    """Whether an SDF has joints, and none of its parts in other files."""
    text = re.sub("<!--.*?-->", "", path.read_text(errors="replace"), flags=re.DOTALL)
    return "<joint" in text and "<include" not in text


def plain_model(path):
    """Pinocchio's own model, None if it does not load the file."""
    try:
        return pin.buildModelFromUrdf(str(path))
    except (ValueError, RuntimeError):
        return None


def is_same(chain, plain):
    """Whether mass matrix and bias are Pinocchio's at a random state."""
    if chain.model.nv != plain.nv or list(chain.model.names) != list(plain.names):
        return False
    if not plain.nv:
        return True
    rng = np.random.default_rng(0)
    q = pin.integrate(plain, pin.neutral(plain), rng.uniform(-1.0, 1.0, plain.nv))
    v = rng.normal(size=plain.nv)
    pairs = []
    for model in (chain.model, plain):
        data = model.createData()
        M = np.triu(np.reshape(pin.crba(model, data, q), (model.nv, model.nv)))
        pairs.append((M, pin.nonLinearEffects(model, data, q, v)))
    size = max(np.abs(pairs[1][0]).max(), np.abs(pairs[1][1]).max())
    return all(np.abs(one - other).max() <= 1e-9 * size for one, other in zip(*pairs, strict=True))


def survey(folder, endings, begins, counts_as, load, same=None):
    """Tables in Markdown: counts by package, what was named, and what was refused with the reason."""
    table, refused, named = defaultdict(Counter), [], Counter()
    for path in files(folder, endings, begins):
        plain = counts_as(path)
        if not plain:
            continue
        chain, names, reason = read(load, path)
        own = package(path, folder)
        row = table[own]
        row["files"] += 1
        if chain is not None and same is not None and not same(chain, plain):
            chain, reason = None, "read as another robot"
        if chain is None:
            row["refused"] += 1
            refused.append((own, path.name, reason.replace("|", "/")))
            continue
        row["as it is" if not names else "one name" if len(names) == 1 else "more names"] += 1
        named.update(names)
    if not table:
        return ""
    columns = ("files", "as it is", "one name", "more names", "refused")
    total = sum(table.values(), Counter())
    rows = [(name, *(row[column] for column in columns)) for name, row in [*sorted(table.items()), ("all", total)]]
    share = f"{100.0 * _share(total):.1f} % are read with at most one name"
    made = table.get(f"pybullet_data, {MADE}")
    if made is not None:
        share += f", {100.0 * _share(total - made):.1f} % without those made at random"
    lines = [f"{share}.", "", *_markdown(("package", *columns), rows)]
    if named:
        whats = [(f"`{name}`", count, LEAVE_OUT[name]) for name, count in named.most_common()]
        lines += ["", *_markdown(("named", "files", "what is left out"), whats)]
    if refused:
        lines += ["", *_markdown(("package", "refused file", "why"), [(own, f"`{n}`", why) for own, n, why in refused])]
    return "\n".join(lines)


def _share(row):
    return (row["as it is"] + row["one name"]) / max(row["files"], 1)


def _markdown(head, rows):
    return [f"| {' | '.join(map(str, row))} |" for row in (head, ["---"] * len(head), *rows)]


def replaced(page, kind, text):
    """A page of the docs with what stands between the marks of a format replaced."""
    mark, end = MARKS[0].format(kind), MARKS[1]
    before, rest = page.split(mark)
    return f"{before}{mark}\n\n{text}\n\n{end}{rest.split(end, 1)[1]}"


def main():
    """Print the tables of the formats that are there, or write them into a page."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=Path, help="an environment with the packages")
    parser.add_argument("--page", type=Path, help="a page to write the tables into, docs/evidence/robots_read.md")
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    mujoco.set_mju_user_warning(lambda _: None)
    found = {
        "MJCF": survey(given.folder, (".xml", ".mjcf"), "<mujoco", moves, ClosedChain.from_mjcf),
        "URDF": survey(given.folder, (".urdf",), "<robot", plain_model, ClosedChain.from_urdf, is_same),
        "SDF": survey(given.folder, (".sdf", ".world"), "<sdf", is_whole, ClosedChain.from_sdf),
    }
    mark = f"<!-- measured: mujoco {mujoco.__version__}, pin {pin.__version__} -->"
    versions = {"MJCF": f" (MuJoCo {mujoco.__version__}, Pinocchio {pin.__version__}) {mark}"}
    for kind, tables in found.items():
        if tables:
            text = f"{kind}{versions.get(kind, '')}: {tables}"
            print(f"{text}\n")
            if given.page is not None:
                page = replaced(given.page.read_text(encoding="utf-8"), kind, text)
                given.page.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
