"""Closing loops, side by side with toolbox-parallel-robots in one run.

::

    python benchmarks/closing.py                    # builds the peer's environment in a temporary folder
    python benchmarks/closing.py --environment DIR  # builds it there, or uses what is there

The peer needs pin 3.7 and modules casadi and pinocchio.casadi, which PyPI lacks; empty ones stand in for them, so its
SciPy and proximal solvers are measured, the ones that run without. Both sides get the same URDF, the same 6D closures
and the same starts, every coordinate up to 0.1 rad off, and close with all joints free. Every start is solved several
times and the fastest counts (SciPy's is solved once); the table has medians over the starts. What the peer prints at
every step goes to memory, and its time is in.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import textwrap
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

REQUIREMENTS = (
    "pin==3.7.0",
    "cmeel-urdfdom<5",
    "cmeel-tinyxml2<11",
    "toolbox-parallel-robots==1.2.0",
    "numpy<2.4",
    "scipy",
    "qpsolvers",
    "osqp",
)
STARTS, REPEATS, OFF = 40, 5, 0.1
#: A residual above this is an open loop.
OPEN = 1e-6

# Runs in the peer's environment: problems as JSON on standard input, answers as JSON on standard output.
WORKER = """
import io, json, sys, time, types, contextlib
import numpy as np
import pinocchio as pin
for name in ("casadi", "pinocchio.casadi"):
    sys.modules[name] = types.ModuleType(name)
pin.casadi = sys.modules["pinocchio.casadi"]
from toolbox_parallel_robots.mounting import closedLoopMountProximal, closedLoopMountScipy

def residual(model, data, constraints, q):
    pin.forwardKinematics(model, data, q)
    worst = 0.0
    for c in constraints:
        gap = (data.oMi[c.joint1_id] * c.joint1_placement).actInv(data.oMi[c.joint2_id] * c.joint2_placement)
        worst = max(worst, np.abs(gap.translation).max(), np.abs(pin.log3(gap.rotation)).max())
    return worst if np.isfinite(worst) else 1e300

answers = []
for problem in json.load(sys.stdin):
    model = pin.buildModelFromXML(problem["urdf"])
    data = model.createData()
    constraints = []
    for joint_a, place_a, joint_b, place_b in problem["closures"]:
        ends = [pin.SE3(np.array(p)) for p in (place_a, place_b)]
        constraints.append(pin.RigidConstraintModel(pin.ContactType.CONTACT_6D, model, model.getJointId(joint_a),
            ends[0], model.getJointId(joint_b), ends[1], pin.ReferenceFrame.LOCAL))
    datas = [c.createData() for c in constraints]
    for name, solve in (("proximal", closedLoopMountProximal), ("scipy", closedLoopMountScipy)):
        times, residuals = [], []
        for start in problem["starts"]:
            q0, best = np.array(start), np.inf
            for _ in range(problem["repeats"] if name == "proximal" else 1):
                with contextlib.redirect_stdout(io.StringIO()):
                    begun = time.perf_counter()
                    try:
                        q = solve(model, data, constraints, datas, q_prec=q0.copy())
                    except Exception:
                        q = q0 * np.nan
                    best = min(best, time.perf_counter() - begun)
            times.append(best)
            residuals.append(float(residual(model, data, constraints, q)))
        answers.append({"robot": problem["name"], "solver": name, "times": times, "residuals": residuals})
print(json.dumps(answers))
"""


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
    chain = ClosedChain.from_urdf(urdf, Closures("five_bar", closures=(Closure("tip", "rigid", "tip", "end"),)))
    q = np.append(named.q, named.q[0] + named.q[1] - named.q[2] - named.q[3])
    return "five-bar", urdf, chain, chain.close(q)


def delta_of_rods():
    """The delta with every joint in the tree and two rigid closures."""
    from mechanisms import delta

    named = delta("rigid")
    return "delta", named.urdf, named.chain(), named.q


def problem(name, urdf, chain, q):
    """What the worker needs."""
    rng = np.random.default_rng(0)
    starts = [(q + rng.uniform(-OFF, OFF, len(q))).tolist() for _ in range(STARTS)]
    closures = [
        [
            chain.model.names[constraint.joint1_id],
            constraint.joint1_placement.homogeneous.tolist(),
            chain.model.names[constraint.joint2_id],
            constraint.joint2_placement.homogeneous.tolist(),
        ]
        for constraint in chain.constraint_models
    ]
    return {"name": name, "urdf": urdf, "closures": closures, "starts": starts, "repeats": REPEATS}


def ours(name, chain, starts):
    """Close every start."""
    from exo_pin.errors import LoopNotClosed

    times, residuals, steps = [], [], []
    chain.close(np.array(starts[0]))  # compiles
    for start in starts:
        q0, best = np.array(start), np.inf
        for _ in range(REPEATS):
            begun = time.perf_counter()
            try:
                q = chain.close(q0)
            except LoopNotClosed as error:
                q = error.q
            best = min(best, time.perf_counter() - begun)
        times.append(best)
        residuals.append(float(np.abs(chain.residual(q)).max()))
        steps.append(chain._close(q0, np.zeros(0, dtype=int), 1e-12, 60)[1])
    return {"robot": name, "solver": "exo_pin", "times": times, "residuals": residuals, "steps": steps}


def environment(folder):
    """Python of the peer's environment, made if it is not there."""
    python = Path(folder) / "bin" / "python"
    if not python.exists():
        print(f"building the peer's environment in {folder}", file=sys.stderr)
        subprocess.run([sys.executable, "-m", "venv", folder], check=True)
    ready = subprocess.run([python, "-c", "import toolbox_parallel_robots_ready"], capture_output=True, check=False)
    if ready.returncode != 0:
        subprocess.run([python, "-m", "pip", "install", "--quiet", *REQUIREMENTS], check=True)
        where = subprocess.run(
            [python, "-c", "import sysconfig; print(sysconfig.get_paths()['purelib'])"],
            capture_output=True,
            text=True,
            check=True,
        ).stdout.strip()
        (Path(where) / "toolbox_parallel_robots_ready.py").write_text("")
    return python


def run(folder):
    """Measure both sides and print the table."""
    python = environment(folder)
    robots = [five_bar_with_tip(), delta_of_rods()]
    problems = [problem(*robot) for robot in robots]
    single = os.environ | dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
    done = subprocess.run(
        [python, "-c", textwrap.dedent(WORKER)],
        input=json.dumps(problems),
        capture_output=True,
        text=True,
        env=single,
        check=False,
    )
    if done.returncode != 0:
        sys.exit(f"the peer failed:\n{done.stderr}")
    answers = json.loads(done.stdout.strip().splitlines()[-1])
    answers += [ours(name, chain, given["starts"]) for (name, _, chain, _), given in zip(robots, problems, strict=True)]
    print(f"{'robot':10}{'solver':22}{'median':>10}{'closed':>10}{'residual':>12}{'ratio':>9}")
    for name, *_ in robots:
        mine = next(item for item in answers if item["robot"] == name and item["solver"] == "exo_pin")
        for item in answers:
            if item["robot"] != name:
                continue
            residuals = np.array(item["residuals"])
            closed = residuals < OPEN
            median = float(np.median(item["times"]))
            label = item["solver"] if item is mine else f"toolbox {item['solver']}"
            worst = f"{residuals[closed].max():.1e}" if closed.any() else "none"
            ratio = median / float(np.median(mine["times"]))
            count = f"{int(closed.sum())}/{len(closed)}"
            print(f"{name:10}{label:22}{median * 1e3:>7.3f} ms{count:>9}{worst:>12}{ratio:>8.1f}x")
            if item is not mine:
                lost = int((closed & ~(np.array(mine["residuals"]) < OPEN)).sum())
                if lost:
                    print(f"          {lost} starts that toolbox {item['solver']} closes are not closed by exo_pin")
        print(f"          exo_pin: {np.mean(mine['steps']):.1f} steps on average, {max(mine['steps'])} at most")


def main():
    """Parse and run."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--environment", metavar="DIR", help="folder of the peer's environment, kept")
    options = parser.parse_args()
    if options.environment is not None:
        run(options.environment)
        return
    with tempfile.TemporaryDirectory() as folder:
        run(str(Path(folder) / "peer"))


if __name__ == "__main__":
    main()
