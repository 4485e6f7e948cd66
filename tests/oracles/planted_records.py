"""Mistakes planted in genuine records: what the file says is not what it holds.

A mistake takes a folder and a seed, and returns the file, the side, what else is said about it, and a word that a
message must have which names the cause.
"""

import contextlib
import io
import re
import warnings
from unittest import mock

import numpy as np
from foreign_records import (
    CLINICAL,
    MATRIX,
    C,
    awinda_file,
    dot_file,
    isb_values,
    lines,
    movement,
    mvnx,
    opensense,
    opensim_head,
    rajagopal,
    sensors,
    table,
    wxyz,
)  # fmt: skip
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import control
from exo_pin.cli import main
from exo_pin.workspace import task_reach

QUATERNION = ("time_s", "qx", "qy", "qz", "qw")
THESIS = ("time_s", "theta_x_deg", "theta_y_deg", "theta_z_deg")
ISB = ("time_s", "plane_of_elevation_deg", "elevation_deg", "axial_rotation_deg")
#: Whether every mistake is planted in drawn raises, also in those that stay in the range of a shoulder with it.
DRAWN = False
#: Raises in which the mistake leaves the range of a shoulder; others are movements of an arm, too.
SIDEWAYS, OVERHEAD = (15, 95, -5), (150, 10, 0)


def side_of(seed):
    return ("left", "right")[seed % 2]


def truth_of(seed, target=None):
    return movement(seed, side_of(seed), None if DRAWN else target)


def as_quaternions(folder, truth, poses):
    return lines(folder / "q.csv", [], QUATERNION, table(truth, poses.as_quat()))


def as_matrices(folder, truth, poses):
    return lines(folder / "m.csv", [], ("time_s", *MATRIX), table(truth, poses.as_matrix().reshape(-1, 9)))


def in_radians(names):
    return [name.replace("_deg", "_rad") for name in names]


def w_first(folder, seed):
    truth = truth_of(seed)
    return lines(folder / "q.csv", [], QUATERNION, table(truth, wxyz(truth.poses))), {}, 'reading="w-first"'


def w_last(folder, seed, writer=opensense):
    """Sensors, or segments, whose four numbers stand in another order than the format has."""
    truth = truth_of(seed)
    with mock.patch("foreign_records.wxyz", Rotation.as_quat):
        return *writer(folder, truth), 'reading="w-last"'


def segments_w_last(folder, seed):
    return w_last(folder, seed, mvnx)


def radians_as_degrees(folder, seed):
    truth = truth_of(seed)
    return (
        lines(folder / "a.csv", [], ("time_s", *CLINICAL), table(truth, np.radians(truth.angles))),
        {},
        'reading="radians"',
    )


def isb_radians_as_degrees(folder, seed):
    truth = truth_of(seed)
    return lines(folder / "a.csv", [], ISB, table(truth, np.radians(isb_values(truth)))), {}, 'reading="radians"'


def degrees_as_radians(folder, seed):
    truth = truth_of(seed)
    return (
        lines(folder / "a.csv", [], ("time_s", *in_radians(CLINICAL)), table(truth, truth.angles)),
        {},
        'reading="degrees"',
    )


def thesis_degrees_as_radians(folder, seed):
    truth = truth_of(seed)
    values = truth.poses.as_euler("XYZ", degrees=True)
    return lines(folder / "a.csv", [], in_radians(THESIS), table(truth, values)), {}, 'reading="degrees"'


def inverse_quaternions(folder, seed):
    truth = truth_of(seed, (85, 15, 0))
    return as_quaternions(folder, truth, truth.poses.inv()), {}, 'reading="inverse"'


def transposed(folder, seed):
    truth = truth_of(seed, (95, 40, 10))
    return as_matrices(folder, truth, truth.poses.inv()), {}, 'reading="inverse"'


def frames_in_t(folder, seed):
    truth = truth_of(seed)
    rows = [[k, *map(float, row)] for k, row in enumerate(truth.angles)]
    return lines(folder / "a.csv", [], ("t", *CLINICAL), rows), {}, "rate=..."


def frames_in_seconds(folder, seed):
    truth = truth_of(seed)
    rows = [[k, *map(float, row)] for k, row in enumerate(truth.poses.as_quat())]
    return lines(folder / "a.csv", [], QUATERNION, rows), {}, "rate=..."


def milliseconds_as_seconds(folder, seed):
    truth = truth_of(seed)
    return (
        lines(folder / "a.csv", [], ("time_s", *CLINICAL), table(truth, truth.angles, 1e3 * truth.t)),
        {},
        "milliseconds",
    )


def seconds_as_milliseconds(folder, seed):
    truth = truth_of(seed)
    return lines(folder / "a.csv", [], ("time_ms", *CLINICAL), table(truth, truth.angles)), {}, 'reading="seconds"'


def other_side(folder, seed):
    truth = truth_of(seed, SIDEWAYS)
    mirror = Rotation.from_quat(truth.poses.as_quat() * [-1, 1, -1, 1])
    return as_quaternions(folder, truth, mirror), {}, 'reading="other-side"'


def other_side_thesis(folder, seed):
    truth = truth_of(seed, SIDEWAYS)
    mirror = Rotation.from_quat(truth.poses.as_quat() * [-1, 1, -1, 1]).as_euler("XYZ", degrees=True)
    return lines(folder / "a.csv", [], THESIS, table(truth, mirror)), {}, 'reading="other-side"'


def y_up(folder, seed):
    truth = truth_of(seed, OVERHEAD)
    return as_quaternions(folder, truth, C * truth.poses * C.inv()), {}, 'reading="y-up"'


def y_up_matrices(folder, seed):
    truth = truth_of(seed, (130, 30, 10))
    return as_matrices(folder, truth, C * truth.poses * C.inv()), {}, 'reading="y-up"'


def t_pose(folder, seed):
    truth = truth_of(seed)
    turn = Rotation.from_euler("x", 90 if truth.side == "right" else -90, degrees=True)
    return as_quaternions(folder, truth, truth.poses * turn), {}, 'reading="t-pose"'


def minus_flexion(folder, seed):
    truth = truth_of(seed, (85, 15, 10))
    return (
        lines(folder / "a.csv", [], ("time_s", *CLINICAL), table(truth, truth.angles * [-1, 1, 1])),
        {},
        "minus-flexion",
    )


def minus_abduction(folder, seed):
    truth = truth_of(seed, SIDEWAYS)
    return (
        lines(folder / "a.csv", [], ("time_s", *CLINICAL), table(truth, truth.angles * [1, -1, 1])),
        {},
        "minus-abduction",
    )


def minus_elevation(folder, seed):
    truth = truth_of(seed, (85, 15, 10))
    return lines(folder / "a.csv", [], ISB, table(truth, isb_values(truth) * [1, -1, 1])), {}, "minus-elevation"


def other_order(folder, seed):
    truth = truth_of(seed, (95, 10, 5))
    values = truth.poses.as_euler("XYZ", degrees=True)
    return lines(folder / "a.csv", [], ("time_s", *CLINICAL), table(truth, values)), {}, "other-order"


def mot_without_degrees(folder, seed):
    truth = truth_of(seed)
    return *rajagopal(folder, truth, "no"), 'reading="degrees"'


def mot_of_radians(folder, seed):
    truth = truth_of(seed)
    path, options = rajagopal(folder, truth)
    rows = [line.split("\t") for line in path.read_text().splitlines()]
    start = next(k for k, row in enumerate(rows) if row[0] == "time") + 1
    body = [[row[0], *(repr(float(np.radians(float(cell)))) for cell in row[1:])] for row in rows[start:]]
    path.write_text("\n".join("\t".join(row) for row in [*rows[:start], *body]) + "\n")
    return path, options, 'reading="radians"'


def turned_trunk(folder, seed):
    truth = truth_of(seed, (95, 30, 5))
    path, options = opensense(folder, truth)
    return path, {**options, "forward": "-z"}, 'reading="turned-trunk"'


def no_rest(folder, seed):
    truth = truth_of(seed)
    late = np.flatnonzero(truth.t > 1.2)
    truth = truth._replace(t=truth.t[late], angles=truth.angles[late], elbow=truth.elbow[late])
    return *opensense(folder, truth), "still=..."


def no_trunk(folder, seed):
    truth = truth_of(seed)
    return dot_file(folder / "arm.csv", sensors(truth)["arm"], truth.t), {"forward": "z"}, "--sensor trunk=NAME"


def no_forward(folder, seed):
    return opensense(folder, truth_of(seed))[0], {}, "--forward z"


def packets_without_rate(folder, seed):
    truth = truth_of(seed)
    path = awinda_file(folder / "arm.txt", sensors(truth)["arm"])
    path.write_text("\n".join(path.read_text().splitlines()[3:]) + "\n")
    return path, {"forward": "z"}, "--rate HZ"


def other_arm(folder, seed):
    truth = truth_of(seed)
    path, options = rajagopal(folder, truth)
    other = {"left": "right", "right": "left"}[truth.side]
    path.write_text(path.read_text().replace(f"_{truth.side[0]}\t", f"_{other[0]}\t"))
    return path, options, f'side="{other}"'


def against_the_scapula(folder, seed):
    truth = truth_of(seed)
    rows = table(truth, isb_values(truth))
    head = opensim_head(len(rows), 4)
    return lines(folder / "a.mot", head, ("time", "plane_elv", "shoulder_elv", "axial_rot"), rows, "\t"), {}, "scapula"


#: Mistakes with the seeds of their movements; an even seed is a left arm.
MISTAKES = (
    (w_first, (0, 1, 2)), (w_last, (1, 4)), (segments_w_last, (2, 3)),
    (radians_as_degrees, (0, 1)), (isb_radians_as_degrees, (2,)),
    (degrees_as_radians, (0, 1)), (thesis_degrees_as_radians, (3,)), (inverse_quaternions, (0, 1)),
    (transposed, (2, 3)),
    (frames_in_t, (0, 1)), (frames_in_seconds, (2,)), (milliseconds_as_seconds, (3,)), (seconds_as_milliseconds, (4,)),
    (other_side, (0, 1)), (other_side_thesis, (2,)), (y_up, (0, 1)), (y_up_matrices, (2,)), (t_pose, (4, 5)),
    (minus_flexion, (0,)), (minus_abduction, (1,)), (minus_elevation, (2,)), (other_order, (0,)),
    (mot_without_degrees, (1,)), (mot_of_radians, (2,)), (turned_trunk, (0, 1)), (no_rest, (2,)), (no_trunk, (3,)),
    (no_forward, (4,)), (packets_without_rate, (5,)), (other_arm, (1,)), (against_the_scapula, (0,)),
)  # fmt: skip


def answer(call):
    """What a door says of a record: the message of its error, or its cautions and warnings."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always", ep.SuspectMeasurements)
        try:
            said = call()
        except ep.InvalidInput as error:
            return str(error)
    return "\n".join([*said, *(str(each.message) for each in told if each.category is ep.SuspectMeasurements)])


def command(*words):
    """What a command prints, on both streams."""
    out = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(out):
        main([str(word) for word in words])
    return [out.getvalue()]


def option_words(options):
    """Reading options as words of a command."""
    words = []
    for name, value in options.items():
        if name == "sensors":
            words += [f"--sensor={role}={given}" for role, given in value.items()]
        else:
            words.append(f"--{name}={value}")
    return words


DESIGN = "four-linear-actuators"


def doors(path, side, options):
    """Every door that takes a record, by name; each returns texts."""
    exo, reading = ep.load(DESIGN, side=side), ep.RecordingOptions(**options)
    words = (f"--side={side}", *option_words(options))
    study = ("--static", "--vary=cuff_height_mm=200", "--trajectory", path)

    def read():
        return ep.read_movement(path, side, reading=reading)

    def tasks():
        task_reach(exo.device, {"task": read() if options else path}, ())
        return read().cautions if options else ()

    return {
        "read_movement": lambda: read().cautions,
        "follow": lambda: exo.follow(read(), static=True).cautions,
        "track": lambda: control.reference_of(path, side, reading).cautions,
        "task_reach": tasks,
        "exo-pin record": lambda: command("record", path, *words),
        "exo-pin reaction": lambda: command("reaction", DESIGN, "--static", "--trajectory", path, *words),
        "exo-pin tasks": lambda: command("tasks", DESIGN, "--no-ranges", f"--movement=a={path}", *words),
        "exo-pin sweep": lambda: command("sweep", DESIGN, *study, *words),
    }


def is_named(text, word):
    """Whether a message names the cause, and no other reading before it."""
    text = " ".join(text.split())
    first = re.findall(r'reading="[\w-]+"', text)[:1]
    return word in text and (not word.startswith("reading=") or first == [word])
