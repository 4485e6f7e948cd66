"""Examples of public classes that no ordinary question makes: errors, muscles, rare results."""

from dataclasses import fields

import numpy as np
from places import REPOSITORY

import exo_pin as ep
from exo_pin import FileFormatError, InvalidInput, muscle, report
from exo_pin.chain import JointProperties
from exo_pin.chain.dynamics.force_distribution import Bound, ForceDistribution
from exo_pin.chain.dynamics.nonsmooth.settling import Impacts
from exo_pin.chain.structure.description import Cable
from exo_pin.core import errors
from exo_pin.core.errors import FileNotWritten
from exo_pin.core.files.csv_tables import parse_csv
from exo_pin.core.files.toml_tables import parse_toml
from exo_pin.device.elastic.soft_equations import NotEvaluated, OutOfReach
from exo_pin.device.parts.lacking_data import LackingData
from exo_pin.muscle import ConstantFriction
from exo_pin.muscle.simulation.step_response import Phases
from exo_pin.numerics.bounded.box_descent import scratch
from exo_pin.numerics.smoothing.smoothing_splines import SplineBasis
from exo_pin.person.contact.activation import MuscleChoice
from exo_pin.person.contact.conic import ActiveSet, Block, ConicProgram, EffortProgram
from exo_pin.reaction import SPLITS
from exo_pin.reaction.batch.limit_kernels import CompiledLimits
from exo_pin.reaction.constraints.actuator_limits import pull_laws
from exo_pin.reaction.splits.limb_and_side_forces import Choice
from exo_pin.thesis.all_rows import printed_index
from exo_pin.thesis.chapter_4 import scenario_one_rows
from exo_pin.thesis.muscle_ledger import fit_rows
from exo_pin.view.page.live_server import Reader
from exo_pin.workspace import CRITERIA
from exo_pin.wrist.forces.affine_state import AffineState
from exo_pin.wrist.kinematics.solutions import Solutions


def frozen(values):
    array = np.array(values)
    array.setflags(write=False)
    return array


def error_examples():
    """Every error, with arrays that can be written and such that cannot."""
    q = np.arange(3.0)
    noted = InvalidInput("expected more, got 3")
    noted.add_note("a note")
    return [
        errors.ExoPinError("something"),
        errors.LoopNotClosed(frozen([1.0, 2.0]), 1e-3, 50),
        errors.BeyondLimits(q, ["hip", "knee"]),
        errors.UndeterminedMotion(q, 2, ["rod", "knee"]),
        errors.UndrivenMotion(q, frozen([0.0, -2.0]), ["knee"]),
        errors.InfeasibleForces(3.5, ["f_1 at most 2"]),
        errors.MasslessMotion(["knee"]),
        NotEvaluated(0.5, (LackingData("spring", "strut", 0.25, 0.285, 0.9),)),
        errors.SingularConfiguration(q, -q, 0.1),
        errors.MotionBlocked(["slider", "crank"]),
        errors.UnsupportedDynamics("dry friction", ["hip"], "take it out"),
        errors.NearSingularConfiguration(q, 1e-6, 1e-8),
        errors.SamplesFailed({3: errors.NearSingularConfiguration(q, 1e-6, 1e-8)}, 5, frozen([1.0])),
        errors.SimulationStopped(0.2, q, frozen([1.0]), "it folds"),
        noted,
        errors.UnknownName("preset", "protoype", ["prototype", "scenario"], where="a file"),
        errors.MissingData(["mass"], "weight", "mine"),
        errors.MissingExtra("plot", "matplotlib"),
        FileFormatError("not TOML", "mine.toml", "geometry.r_A"),
        FileNotWritten("mine.toml", OSError(28, "No space left on device")),
        errors.StorageUnusable("mysql://me:secret@host/db", "no answer"),
        errors.NonConvexBound("not convex"),
        errors.InfeasibleBounds([0, 2]),
        errors.NotAWrist("delta", "it has no ball joint"),
        errors.AbsentAttribute("geometry", "look elsewhere"),
        errors.ExoPinWarning("mind this"),
        errors.BranchChanged("the branch ends"),
        errors.CacheUnusable("the disk is full"),
        errors.NoisyMovement("the forces are made of noise"),
        errors.OutsideHumanRange("this pose cannot be reached"),
        errors.NoisyMovement("noise"),
        errors.SuspectMeasurements("the limbs are in another order"),
        errors.BrowserNotFound(["chromium"], "EXO_PIN_BROWSER"),
        errors.BrowserFailed("chromium", "no answer"),
        errors.SolverFailed("ProxQP", 1e-3, "in pose 3"),
        OutOfReach("path of loops", 1e-3, "in pose 3"),
        errors.OutsideRangeOfMotion("elevation of 200.0°, where the model goes from 0 to 180°", 2, (1, 0)),
        muscle.OutsideValidity("best", "pressure 9 bar above 4 bar", 2, (1, 0)),
        muscle.NotIdentifiable("too few", ("K_1", "K_2")),
    ]


def raise_example(index):
    """Raise one of the errors; here, because a process of a pool imports it by the name of its module."""
    raise error_examples()[index]


def muscle_examples():
    """Models, measurements and fits."""
    static = muscle.muscle_model("best")
    states = muscle.steady_states(valid_only=True)
    model = muscle.dynamic_model("tang-3-31")
    step = muscle.PressureStep(2e5, 3e5)
    times = np.linspace(0.0, 1.2, 31)
    response = muscle.simulate(model, 1.3, step, times, outside="mark")
    recording = muscle.Recording(times, response.contraction, step, 1.3)
    return [
        *(muscle.muscle_model(name) for name in muscle.muscle_models()),
        muscle.Muscle(model=static, end_fitting=0.05),
        muscle.table("3-1"),
        states,
        muscle.identify_static(states.contraction, states.pressure, states.force, 0.3, select="region"),
        muscle.FestoLaw(name="festo", reference_length=0.189, validity=static.validity, largest_strain=0.1667),
        muscle.ForceTable(
            name="sheet",
            reference_length=0.3,
            validity=muscle.Validity(strain=(0.0, 0.2), pressure=(1e5, 3e5)),
            strains=[0.0, 0.2],
            pressures=[1e5, 3e5],
            forces=[[20.0, 60.0], [0.0, 30.0]],
        ),
        muscle.read_measurements(REPOSITORY / "examples" / "muscle.csv", 0.3),
        model,
        ConstantFriction(),
        muscle.simulate(model, 1.3, step, np.linspace(0, 0.5, 20), outside="mark"),
        step,
        muscle.PressureTrace([0.0, 1.0, 2.0], [1e5, 2e5, 2e5]),
        recording,
        muscle.identify_dynamic([recording], model.static, start=[228.9342, -90.429, 6.87, -1.0, 0.802]),
        Phases(model, 1.3, step, 0.1, True, {}, np.linspace(0, 1, 3)),
        parse_toml("a = 1", "mine.toml"),
        parse_csv("a,b\n1,2\n", "mine.csv"),
        list(fit_rows())[:1],
        muscle.settling_against_lag(model, 1.3, 3e5, [1.0], record=1.0),
    ]


def rare_examples():
    """What is only made within compiled code, in rare cases, or with a browser."""
    exo = ep.load("prototype")
    poses = ep.shoulder_rotation([30, 40], [20, 20], [0, 10], degrees=True)
    modes = exo.forward_kinematics(exo.inverse_kinematics(poses).lengths)
    path = modes.follow(poses[0])
    soft = exo.replace(arm=ep.Arm.from_anthropometry(1.75, 75, "male"), shoulder=ep.Shoulder(stiffness=2e4))
    bound, laws = Bound("f_1", 1.0, frozen([1.0, 0.5]), 0.0, np.inf), pull_laws(exo.mechanism)
    limbs = ep.load("three-linear-actuators").chain
    return [
        limbs.assemblies(limbs.roles.actuated, limbs.close(limbs.neutral()), frame="arm", starts=3),
        Cable("rope", (("universe", (0.0, 0.0, 1.0)), ("arm", (0.0, 0.0, 0.0)))),
        JointProperties("knee", 2.0, (0.1,), (0.2,)),
        bound,
        ForceDistribution(frozen([[1.0, 0.0, 1.0], [0.0, 1.0, 0.0]]), (bound,), 1e-12),
        Impacts(0.1, 2),
        Choice(*[0.0] * len(Choice._fields)),
        *SPLITS.values(),
        *CRITERIA.values(),
        scratch(3),
        CompiledLimits(*np.zeros((2, 3)), *np.zeros((2, 3), bool), *np.ones((2, 3)), np.zeros(3, bool), laws),
        AffineState.of_closures(*np.zeros((4, 3, 6)), np.zeros(6)).following(
            1e4 * np.eye(3), np.full(3, 1e5), np.zeros(3)
        ),
        modes,
        path,
        scenario_one_rows(),
        printed_index()[0],
        printed_index()[0].entries[0],
        Reader(bytes),
        SplineBasis(np.arange(20.0)),
        soft.reaction(poses, split="elastic").source.poses.moved,
        Solutions(np.zeros((8, 3, 3)), np.zeros(8), np.zeros(8)),
    ]


def report_examples():
    """The record of a report with one of each of its rows, without asking the questions behind it."""
    rows = (
        report.Posture("hanging", 0.0, 0.0, 0.0, "yes", "", *[1.0] * 7),
        report.Task("feeding", "1990", 27, *[1.0] * 6),
        report.DriveNeed("limb 1", "linear", "N", *[1.0] * 14),
        report.PersonFit("large man", 1.87, 111.0, 90.0, 80.0),
        report.Hazard("shape", "clear", "edges"),
    )
    texts = {field.name: "" for field in fields(report.DesignReport) if field.type == "str"}
    tuples = dict(zip(("postures", "tasks", "drives", "fits", "hazards"), [(row,) for row in rows], strict=True))
    tuples |= {"assumed": (), "not_checked": (), "criteria_percent": {"stroke": 90.0}, "picture": b""}
    numbers = {field.name: 1.0 for field in fields(report.DesignReport) if field.name not in texts | tuples}
    return [report.DesignReport(**texts, **tuples, **numbers)]


def muscle_program_examples():
    """What choosing muscle forces is made of: answers of poses are kept, so that a query may choose nothing anew."""
    program = ConicProgram(np.eye(2), np.zeros(2))
    program.add("positive", np.eye(2), np.array([-1.0, 2.0]))
    one, flags = np.ones(2), np.zeros(2, dtype=bool)
    effort = EffortProgram(one, 2, np.eye(2), one, np.eye(2), one, -one, one, np.zeros((0, 2)), np.zeros(0))
    return [
        Block("zero", np.eye(2), one),
        program,
        program.solve(),
        effort,
        ActiveSet(flags, flags, flags, False),
        MuscleChoice(one, 0.0, 0.0, True),
    ]
