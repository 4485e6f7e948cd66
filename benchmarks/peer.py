"""toolbox-parallel-robots in an environment of its own, and the robots that both sides are measured on.

It needs pin 3.7 and modules casadi and pinocchio.casadi, which PyPI lacks; empty ones stand in for them, so that those
of its functions are measured that run without.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

os.environ.setdefault("EXO_PIN_COMPILE", "compiled")

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "oracles"))

__all__ = ["delta_of_rods", "five_bar_with_tip", "in_turns", "main", "problem"]

REQUIREMENTS = (
    "pin==3.7.0",
    "cmeel-urdfdom<5",
    "cmeel-tinyxml2<11",
    "toolbox-parallel-robots==1.2.0",
    "numpy<2.4",
    "scipy",
    "qpsolvers",
    "osqp",
    "proxsuite==0.8.0",
)
#: What is imported to see whether an environment is ready; the first is written last.
_READY = "import toolbox_parallel_robots_ready, qpsolvers, proxsuite"

#: Start of a worker, which runs in the peer's environment with problems as JSON on standard input: imports, and how a
#: problem becomes a model with constraints. What the peer prints, from Python or from C++, goes nowhere;
#: ``take_turns`` writes the worker's answers, a line for every line that it gets.
START = """
import json, os, sys, time, types
answers_to = os.fdopen(os.dup(1), "w")
os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
import numpy as np
import pinocchio as pin
for name in ("casadi", "pinocchio.casadi"):
    sys.modules[name] = types.ModuleType(name)
pin.casadi = sys.modules["pinocchio.casadi"]

def robot(problem):
    model = pin.buildModelFromXML(problem["urdf"])
    constraints = []
    for joint_a, place_a, joint_b, place_b in problem["closures"]:
        ends = [pin.SE3(np.array(p)) for p in (place_a, place_b)]
        constraints.append(pin.RigidConstraintModel(pin.ContactType.CONTACT_6D, model, model.getJointId(joint_a),
            ends[0], model.getJointId(joint_b), ends[1], pin.ReferenceFrame.LOCAL))
    return model, constraints

def take_turns(turn):
    for _ in sys.stdin:
        answers_to.write(json.dumps(turn()) + "\\n")
        answers_to.flush()

problems = json.loads(sys.stdin.readline())
"""

#: Turns that the two sides take one after the other; a time is the median over them.
TURNS = 7


def five_bar_with_tip():
    """The five-bar with a hinge at its tip, so that its loop closes by a rigid closure, as the peer's examples do."""
    from mechanisms import five_bar

    from exo_pin.chain import ClosedChain, Closure, Closures

    named = five_bar()
    extra = (
        '<link name="end"><inertial><mass value="0.1"/>'
        '<inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        '<joint name="end_hinge" type="revolute"><parent link="right_forearm"/><child link="end"/>'
        '<origin xyz="0.275 0 0"/><axis xyz="0 0 1"/>'
        '<limit effort="0" velocity="100" lower="-6.3" upper="6.3"/></joint>'
    )
    urdf = named.urdf.replace("</robot>", f"{extra}</robot>")
    closures = Closures("five_bar", closures=(Closure("tip", "rigid", "tip", "end"),), roles=named.closures.roles)
    chain = ClosedChain.from_urdf(urdf, closures)
    q = named.q
    return "five-bar", urdf, chain, chain.close([*q, q[0] + q[1] - q[2] - q[3]])


def delta_of_rods():
    """The delta with every joint in the tree and two rigid closures."""
    from spatial_mechanisms import delta

    named = delta("rigid")
    return "delta", named.urdf, named.chain(), named.q


def problem(name, urdf, chain, **more):
    """What a worker needs to build a robot, with more beside it."""
    closures = [
        [
            chain.model.names[constraint.joint1_id],
            constraint.joint1_placement.homogeneous.tolist(),
            chain.model.names[constraint.joint2_id],
            constraint.joint2_placement.homogeneous.tolist(),
        ]
        for constraint in chain.constraint_models
    ]
    return {"name": name, "urdf": urdf, "closures": closures, **more}


def environment(folder):
    """Python of the peer's environment, made if it is not there."""
    python = Path(folder) / "bin" / "python"
    if not python.exists():
        print(f"building the peer's environment in {folder}", file=sys.stderr)
        subprocess.run([sys.executable, "-m", "venv", folder], check=True)
    if subprocess.run([python, "-c", _READY], capture_output=True, check=False).returncode != 0:
        subprocess.run([python, "-m", "pip", "install", "--quiet", *REQUIREMENTS], check=True)
        where = subprocess.run(
            [python, "-c", "import sysconfig; print(sysconfig.get_paths()['purelib'])"],
            capture_output=True,
            text=True,
            check=True,
        ).stdout.strip()
        (Path(where) / "toolbox_parallel_robots_ready.py").write_text("")
    return python


class Peer:
    """A worker, source text that follows :data:`START`, in the peer's environment, on one thread."""

    def __init__(self, folder, worker, problems):
        single = os.environ | dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
        command = [environment(folder), "-c", START + worker]
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, text=True, env=single)
        self._say(json.dumps(problems))

    def turn(self):
        """Answers to all problems."""
        self._say("turn")
        line = self._process.stdout.readline()
        if not line:
            sys.exit(f"the peer failed:\n{self._process.communicate()[1]}")
        return json.loads(line)

    def close(self):
        """End the worker."""
        self._process.communicate()

    def _say(self, line):
        with suppress(BrokenPipeError):
            print(line, file=self._process.stdin, flush=True)


def in_turns(folder, worker, problems, own):
    """Answers of the peer and of ``own()``, which take turns; the times of an answer are medians over the turns."""
    other = Peer(folder, worker, problems)
    turns = [other.turn() + own() for _ in range(TURNS + 1)]
    other.close()
    # The first turn compiles and fills caches.
    answers = turns[-1]
    for k, answer in enumerate(answers):
        answer["time"] = statistics.median(statistics.median(turn[k]["times"]) for turn in turns[1:])
    return answers


def main(description: str, run: Callable[[str], None]) -> None:
    """Run a benchmark in the environment that the command line names, or in a temporary one."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--environment", metavar="DIR", help="folder of the peer's environment, kept")
    options = parser.parse_args()
    if options.environment is not None:
        run(options.environment)
        return
    with tempfile.TemporaryDirectory() as folder:
        run(str(Path(folder) / "peer"))
