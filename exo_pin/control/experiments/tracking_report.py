"""What is said of a tracking, before it and after: what happened and why, and the verdict.

Before a run it can be said whether the drives can hold its poses, and whether lengths alone tell them: a controller of
lengths does not see the arm. Where the weakest rate is small, an error of a length turns the arm far; where another
pose has the same lengths, the arm may settle there, with every length right (:mod:`exo_pin.device.accuracy`). A sensor
of the arm's orientation sees both.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ...core.results import Known
from ...core.validation import FloatArray
from ...device.accuracy.pose_accuracy import pose_accuracy
from ...device.wrist_device import as_device
from ...load_case import Case
from ...load_case.case import beyond_motion
from ...reaction import Assumptions, solve
from ...reaction.holding.verdict import angle_words
from ..controllers.planning import HELD, planner_of
from ..plant.drives import DirectDrive
from ..plant.equations.drive_kernels import free_contraction
from ..plant.plant import Plant

if TYPE_CHECKING:
    from .experiment import Experiment
    from .tracking import Tracking

#: Poses of a reference that are looked at.
_SAMPLES = 25


def default_controller(mechanism: Any) -> str:
    """The controller of a design for which none is named.

    "model" of a redundant design, whose lengths do not say what each limb has to pull, unless the design states that
    it measures no more than lengths; "pi" else, as in the thesis.
    """
    measures = _measures(mechanism)
    sees = not measures or "arm" in measures
    return "model" if (mechanism.limb_count > 3 or not as_device(mechanism).has_limbs) and sees else "pi"


def foreseen(experiment: Experiment) -> tuple[str, ...]:
    """Sentences on a run before it is made; of a controller that is a function only on what the drives can hold."""
    mechanism, side = experiment.mechanism, experiment.mechanism.side
    measures = _measures(mechanism)
    end = experiment.reference.duration if experiment.duration is None else experiment.duration
    poses = experiment.reference(np.linspace(0.0, end, _SAMPLES)).orientation
    found = []
    lacking = ~holdable(experiment.plant, poses)
    if lacking.any():
        share, words = 100.0 * lacking.mean(), angle_words(poses[int(lacking.argmax())], side)
        found.append(
            f"the drives cannot hold {share:.0f} % of the wanted poses at rest, the first at {words}: the arm will "
            "not follow there"
        )
    if experiment.controller == "pi":
        seen = pose_accuracy(as_device(mechanism), poses)
        doubtful = seen.is_doubtful
        if doubtful.any():
            worst = int(np.where(doubtful, seen.rate, np.inf).argmin())
            found.append(
                f"lengths alone do not place the arm in {100.0 * doubtful.mean():.0f} % of the wanted poses; at "
                f"{angle_words(poses[worst], side)}, {seen.sensitivity(worst)}. A sensor of the arm's orientation "
                "does: --controller model"
            )
    elif experiment.controller == "model" and not mechanism.limbs_are_massless:
        idle = as_device(mechanism).as_chain().structure.held
        if idle:
            found.append(
                f"the device can move while the arm rests ({idle} freedom{'s' * (idle > 1)}); the controller leaves "
                "that alone, so that weight and drives move it"
            )
    if experiment.controller == "model" and measures and "arm" not in measures:
        found.append(
            "the controller reads a sensor of the arm's orientation, which the design does not state (measures)"
        )
    return tuple(found)


def _measures(device: Any) -> Any:
    """What a wrist states that it measures; nothing of other devices."""
    record = as_device(device).accelerate("plant")
    return None if record is None else record.measures


def lengths_in(plant: Plant, poses: Rotation) -> FloatArray:
    """Coordinates of the drives in poses, shape (N, n), m or rad."""
    plans = planner_of(plant)
    return np.array([plans.lengths(pose) for pose in poses]).reshape(len(poses), plant.count)


def holdable(plant: Plant, poses: Rotation) -> NDArray[np.bool_]:
    """Shape (N,): whether the drives can hold a pose at rest, within the strokes of motor drives."""
    held = planner_of(plant).missing(poses) <= HELD
    for drive, length in zip(plant.drives, lengths_in(plant, poses).T, strict=True):
        if drive.is_motor:
            held &= drive.spans(length)
    return np.asarray(held)


#: Turn between poses that count as the same, rad.
SAME_POSE = np.radians(0.1)
#: |cos β| below which the angles lock.
_LOCKED = 1e-6


def continuous_angles(angles: FloatArray, locked_sum: float) -> FloatArray:
    """Angles of samples of a movement, each near those of the sample before.

    Parameters
    ----------
    angles : ndarray
        Shape (N, 3), rad: α, β, γ of each sample.
    locked_sum : float
        1 if α + γ is what is determined at β = 90° (and α - γ at -90°), -1 if it is α - γ.

    Returns
    -------
    ndarray
        Shape (N, 3), rad; the first sample as it is.
    """
    found = np.array(angles)
    for k in range(1, len(found)):
        before, (first, middle, last) = found[k - 1], found[k]
        if abs(np.cos(middle)) < _LOCKED:
            side = locked_sum * np.sign(np.sin(middle))
            first, last = before[0], last + side * (first - before[0])
        triples = np.array([[first, middle, last], [first + np.pi, np.pi - middle, last + np.pi]])
        triples -= 2.0 * np.pi * np.round((triples - before) / (2.0 * np.pi))
        found[k] = triples[np.abs(triples - before).sum(axis=1).argmin()]
    return found


#: Names of the clinical angles.
ANGLES = ("flexion", "abduction", "internal rotation")
#: A contraction is at its end when it is within this of the greatest one.
_NEAR_END = 0.01
#: How far beyond an end a motor is out of stroke, m or rad: its stops give way by more.
_BEYOND_END = 1e-9
#: Shares of time below which something is not worth a sentence.
_SELDOM = 0.02
#: The same of slackness of muscles, which hang loose in many poses.
_HALF = 0.5
#: Angle by which the rest pose must be off to be named, degrees.
_OFF = 2.0
#: Largest error of lengths that counts as right, m, and of angles of drives, degrees.
_RIGHT, _RIGHT_TURN = 3e-3, 0.5
#: Movement in the last part of a run that counts as standing still, degrees a second, and the smoothing, s.
_STILL, _WINDOW = 2.0, 0.25
_BAR = 1e5
#: Gauge pressure from which on a muscle counts as filled, Pa.
_FILLED = 0.5e5


def drive_kinds(plant: Plant) -> list[str]:
    """What each drive moves: a "limb", whose tension shortens it, or a joint that it lets "slide" or "turn"."""
    units = as_device(plant.mechanism).drive_units
    return [
        "turn" if unit == "N m" else "slide" if getattr(drive, "of_joint", False) else "limb"
        for drive, (_, unit) in zip(plant.drives, units, strict=False)
    ]


def greatest_ratios(tracking: Tracking) -> np.ndarray:
    """Contraction ratio of the shortest limb, shape (n,).

    A muscle is there where it pulls with nothing at the supply's pressure, a motor drive at the end of its stroke.
    """
    plant = tracking.run.plant
    shortest = plant.contractions.ratios(np.array([drive.shortest for drive in plant.drives]))
    if plant.supply is not None:
        bar = plant.supply.pressure / _BAR
        for i in np.flatnonzero(~plant.motors):
            shortest[i] = free_contraction(plant.tables.law, int(i), bar)[0]
    return shortest


def findings(tracking: Tracking) -> tuple[str, ...]:
    """Sentences, in the order of time."""
    return tuple(text for part in _PARTS for text in part(tracking))


def _rest(tracking: Tracking) -> list[str]:
    """The start is not the wanted one."""
    off = np.degrees(tracking.error[0])
    if off < _OFF:
        return []
    angles = ", ".join(f"{angle:.1f}" for angle in tracking.angles(convention="thesis")[0])
    short = " and ".join(
        f"{_name(tracking, i)} would have to be {-100.0 * value:.0f} % longer than nominal"
        for i, (value, kind) in enumerate(
            zip(tracking.wanted_ratios[0], drive_kinds(tracking.run.plant), strict=True), 1
        )
        if value < 0.0 and kind == "limb"
    )
    why = f": {short} there" if short and (tracking.ratios[0] < 0.0).any() else ""
    return [f"at rest the arm hangs {off:.1f}° from the wanted start, at θ = ({angles})°{why}"]


def _elsewhere(tracking: Tracking) -> list[str]:
    """The device turns the arm about fewer than three axes, and the reference needs more."""
    away = (tracking.attained * tracking.wanted.inv()).magnitude()
    worst = int(away.argmax())
    if away[worst] < SAME_POSE:
        return []
    return [
        f"the device does not have the wanted poses: the nearest that it has are up to {np.degrees(away[worst]):.1f}° "
        f"away, at {tracking.times[worst]:.2f} s"
    ]


def _stretched(tracking: Tracking) -> list[str]:
    text = "the reference needs {} longer than its nominal length for {:.0f} % of the time, and it cannot be stretched"
    limbs = np.array(drive_kinds(tracking.run.plant)) == "limb"
    return _often(tracking, (tracking.wanted_ratios < 0.0) & limbs, _SELDOM, text)


def _beyond(tracking: Tracking) -> list[str]:
    texts, plant = [], tracking.run.plant
    own = zip(tracking.wanted_ratios.T, greatest_ratios(tracking), drive_kinds(plant), plant.drives, strict=True)
    for i, (wanted, limit, kind, drive) in enumerate(own, 1):
        # A drive without ends has none to be beyond.
        ends = not drive.is_motor or bool(np.isfinite(drive.longest) and np.isfinite(drive.shortest))
        beyond = np.flatnonzero(ends & ((wanted > limit) | ((kind != "limb") & (wanted < 0.0))))
        needs = f"to contract by more than the {100.0 * limit:.0f} % that it can"
        needs = needs if kind == "limb" else "beyond the end of its range"
        if beyond.size:
            first = int(beyond[0])
            angle, name = _main(tracking, first, wanted=True)
            when = f"for {100.0 * beyond.size / len(wanted):.0f} % of the time, first at {tracking.times[first]:.2f} s"
            if beyond.size == len(wanted) - first:
                when = f"from {tracking.times[first]:.2f} s on"
            texts.append(f"the reference needs {_name(tracking, i)} {needs} {when} ({name} {angle:.0f}° wanted)")
    return texts


def _ends(tracking: Tracking) -> list[str]:
    """When limbs first are as short as their drives can make them."""
    limits, texts, run = greatest_ratios(tracking), [], tracking.run
    for i, drive in enumerate(run.plant.drives):
        if drive.is_motor:
            # A joint may begin at an end of its range.
            short = run.drive_positions[:, i] < drive.shortest - _BEYOND_END
            if getattr(drive, "of_joint", False):
                short |= run.drive_positions[:, i] > drive.longest + _BEYOND_END
        else:
            short = (tracking.ratios[:, i] >= limits[i] - _NEAR_END) & (run.pressures[:, i] >= _FILLED)
        if short.any():
            first = int(short.argmax())
            angle, name = _main(tracking, first)
            texts.append(
                f"{_name(tracking, i + 1)} runs out of stroke at {tracking.times[first]:.2f} s, at {name} {angle:.0f}°"
            )
    return texts


def _stall(tracking: Tracking) -> list[str]:
    """The main angle stands still before the reference does."""
    main = tracking.angles()[:, tracking.main_angle]
    wanted = tracking.angles(wanted=True)[:, tracking.main_angle]
    if len(main) < 2:
        return []
    step = float(np.median(np.diff(tracking.times)))
    width = max(int(_WINDOW / step), 1)
    if len(main) <= 2 * width or abs(wanted[-1] - main[-1]) < _OFF:
        return []
    speed = np.abs(main[width:] - main[:-width]) / (width * step)
    moving = np.flatnonzero(speed > _STILL)
    last = int(moving[-1]) + width if moving.size else 0
    if last >= len(main) - width:
        return []
    angle, name = _main(tracking, last)
    return [f"{name} stands still from {tracking.times[last]:.2f} s on, at {angle:.0f}°"]


def _slack(tracking: Tracking) -> list[str]:
    cables = np.array([drive.word == "cable" for drive in tracking.run.plant.drives], dtype=bool)
    text, slack = "{} is slack for {:.0f} % of the time", tracking.run.slack
    worth = cables | (slack.mean(axis=0) > _HALF)
    return _often(tracking, slack & worth, _SELDOM, text)


def _force_limits(tracking: Tracking) -> list[str]:
    texts = []
    for i, (drive, force) in enumerate(zip(tracking.run.plant.drives, tracking.run.motor_forces.T, strict=True)):
        most = getattr(drive, "force_limit", 0.0)
        low, high = (drive.lower, drive.upper) if isinstance(drive, DirectDrive) else (-most, most)
        reached = drive.is_motor & (((force >= high) & (high > 0.0)) | ((force <= low) & (low < 0.0)))
        if reached.any():
            who = _name(tracking, i + 1)
            who = who if drive.word == "motor" else f"the motor of {who}"
            what = "limit" if drive.word == "motor" else "force limit"
            texts.append(f"{who} is at its {what} for {100.0 * reached.mean():.1f} % of the time")
    return texts


def _alike(tracking: Tracking) -> list[str]:
    """The lengths are right and the pose is not."""
    run, own = tracking.run, tracking.attained[-1:]
    off = float(np.degrees((own * run.rotations[-1:].inv()).magnitude()[0]))
    wrong, turns = np.abs(run.lengths[-1] - lengths_in(run.plant, own)[0]), np.array(drive_kinds(run.plant)) == "turn"
    if off < _OFF or not wrong.size or (wrong > np.where(turns, np.radians(_RIGHT_TURN), _RIGHT)).any():
        return []
    along, about = wrong[~turns], np.degrees(wrong[turns])
    within = f"{1e3 * along.max():.1f} mm" if along.size else f"{about.max():.1f}°"
    within += f" and {about.max():.1f}°" if along.size and about.size else ""
    what = "the drives end" if about.size else "the lengths end"
    seen = pose_accuracy(as_device(tracking.experiment.mechanism), own)
    return [
        f"{what} within {within} of those wanted and the arm {off:.1f}° off: "
        f"{seen.sensitivity()}; a sensor of the arm's orientation tells"
    ]


def _faults(tracking: Tracking) -> list[str]:
    """What the shoulder gets after faults, beside the run without them; those of one kind and time together."""
    alike: dict[tuple[str, float], list[int]] = {}
    for fault in tracking.experiment.faults:
        alike.setdefault((fault.kind, fault.start), []).append(fault.limb + 1)
    texts = []
    for (kind, start), limbs in alike.items():
        if (tracking.times >= start).any():
            every = len(limbs) == tracking.run.plant.count > 1
            who = "all drives" if every else ", ".join(_name(tracking, limb) for limb in limbs)
            texts.append(f"{who}: {kind} from {start:g} s on; {_worst(tracking, partial(np.less_equal, start))}")
    return texts


def _worst(tracking: Tracking, when: Callable[[FloatArray], FloatArray]) -> str:
    """Greatest |F_s| and error in some of the time, beside those of the run without faults."""
    found = []
    for each in (tracking, tracking.without_faults):
        if each is not None and (at := when(each.times)).any():
            force = np.linalg.norm(each.shoulder_force[at], axis=1).max()
            found.append((f"{force:.0f} N", f"{np.degrees(each.error[at].max()):.0f}°"))
    force, off = found[0]
    beside = f" (without it {found[1][0]} and {found[1][1]})" if len(found) > 1 else ""
    return f"with the estimates as they are |F_s| reaches {force} and the arm is up to {off} off{beside}"


def _beyond_motion(tracking: Tracking) -> list[str]:
    """The arm leaves what a shoulder can do."""
    beyond = beyond_motion(tracking.run.rotations.as_matrix(), tracking.experiment.mechanism.side)
    if not beyond.any():
        return []
    first = tracking.times[int(beyond.argmax())]
    return [f"the arm is beyond a shoulder's range of motion from {first:.2f} s on: nothing of a joint stops it here"]


def _sensor(tracking: Tracking) -> list[str]:
    imu = tracking.experiment.imu
    if imu is None or not imu.lost:
        return []
    lost = ", ".join(f"{start:g} to {end:g} s" for start, end in imu.lost)

    def unread(times: FloatArray) -> FloatArray:
        # A reading that is due now was taken before the delay.
        return np.array([imu.is_lost(t - imu.delay) for t in times], dtype=bool)

    worst = _worst(tracking, unread) if unread(tracking.times).any() else "no sample of the run is then"
    return [f"the inertial sensor is lost from {lost}; {worst}"]


def _often(tracking: Tracking, happens: np.ndarray, least: float, text: str) -> list[str]:
    """A sentence for each limb to which something happens, (N, n), for more than a share of the time."""
    shares = happens.mean(axis=0).tolist()
    return [text.format(_name(tracking, i), 100.0 * share) for i, share in enumerate(shares, 1) if share > least]


def _main(tracking: Tracking, index: int, wanted: bool = False) -> tuple[float, str]:
    return float(tracking.angles(wanted)[index, tracking.main_angle]), ANGLES[tracking.main_angle]


def _name(tracking: Tracking, number: int) -> str:
    """What the drive of a limb is called: "muscle 1"."""
    return f"{tracking.run.plant.drives[number - 1].word} {number}"


_PARTS = (
    _rest, _elsewhere, _stretched, _beyond, _ends, _stall, _slack, _force_limits, _alike, _faults, _beyond_motion,
    _sensor,
)  # fmt: skip


def verdict_of(tracking: Tracking) -> str:
    """See :attr:`.Tracking.verdict`."""
    numbers, name = tracking.summary(), ANGLES[tracking.main_angle]
    if tracking.run.status != "completed":
        end = f"the run {tracking.run.status}"
    else:
        # Rounded, and added to zero: no minus before a zero.
        reached, wanted = (round(numbers[key]) + 0 for key in ("end_deg", "wanted_end_deg"))
        end = f"{name} ends at {reached}° of {wanted}°, the arm {numbers['end_error_deg']:.1f}° off"
    force = f"|F_s| up to {numbers['peak_F_s_N']:.0f} N"
    text = f"{tracking.experiment.title}: {end} ({numbers['rms_error_deg']:.1f}° rms); {force}."
    touching = as_device(tracking.experiment.mechanism).gaps(tracking.run.rotations.as_matrix()).words
    return f"{text} {touching}".rstrip()


#: Step of the differences, degrees: the effect of 1° is the derivative's.
_STEP = 0.1


def known_of(tracking: Tracking) -> tuple[Known, ...]:
    """The mounting of the sensor, and what 1° of it about each axis does to the last pose and its |F_s| at rest."""
    mechanism, last = tracking.experiment.mechanism, tracking.run.rotations[-1]
    steps = _STEP * np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)])
    turns = Rotation.from_rotvec(steps, degrees=True)
    answer = solve(as_device(mechanism), Case(turns * last), Assumptions(limits="none"))
    size, ahead, behind = answer.magnitude[0], answer.magnitude[1:4], answer.magnitude[4:]
    share = 100.0 * float(np.linalg.norm(ahead - behind)) / (2.0 * _STEP) / max(float(size), 1e-300)
    if not np.isfinite(share):
        return ()
    return (Known("mounting of the arm's sensor", 1.0, "deg", {"pose_deg": 1.0, "F_s_percent": share}, shows=False),)
