"""Answers of recordings in files, as they are stored."""

import functools
from pathlib import Path
from unittest import mock

import foreign_records as foreign
import numpy as np
import planted_records as planted
from answers import changes, each_of
from asked_in_turn import folder, in_turn

import exo_pin as ep
from exo_pin.load_case.recordings.reading import read_poses

HEAD = ",".join(foreign.CLINICAL)
#: Flexion, abduction and internal rotation of a dozen rows, degrees.
DOZEN = np.array([[3.0 * k, 0.2 * k * k, 5.0 - k] for k in range(12)])


def texts(**texts_of_files):
    """Write files into the current folder, by name."""
    for name, text in texts_of_files.items():
        with open(name.replace("__", "."), "w", encoding="utf-8") as file:
            file.write(text)


def read(path, side="left", **options):
    """Of a record, what was read and not how it was smoothed."""
    found = ep.read_movement(path, side, smoothing=None, reading=ep.RecordingOptions(**options))
    return {
        "times": found.times,
        "angles": ep.shoulder_angles(found.poses, side, degrees=True),
        "elbow": found.elbow_flexion,
        "cautions": found.cautions,
        "judged": found.judged_for,
    }


def formats(*sides):
    """Every format of other programs, of a movement with another seed each; the sides take turns."""
    found = {}
    with folder() as place:
        for seed, (name, writer) in enumerate(foreign.WRITERS.items()):
            side = sides[seed % 2]
            path, options = writer(place, foreign.movement(seed, side, noise=0.0, rate=25))

            def some(path=path, options=options, side=side):
                own = read(path, side, **options)
                own |= {key: own[key][::17] for key in ("times", "angles")}
                raw = read_poses(path, side, ep.RecordingOptions(**options))
                own |= {"what": [raw.format, raw.convention, len(raw.rows), raw.source.names[:9]]}
                return own | {"elbow": None if own["elbow"] is None else own["elbow"][::17]}

            found |= in_turn({name: some})
    return found


def timed(column, cells, name="a.csv", head="", count=12, reading="as-named", **options):
    """A record with one column of times, and what its times are read as."""
    rows = [f"{cell},{','.join(map(str, row))}" for cell, row in zip(cells, DOZEN.tolist()[:count], strict=True)]
    texts(**{name.replace(".", "__"): "\n".join([*([head] if head else []), f"{column},{HEAD}", *rows, ""])})
    found = ep.read_movement(name, smoothing=None, reading=ep.RecordingOptions(reading, **options))
    return {"times": found.times, "cautions": found.cautions, "speed": found.motion.angular_velocity[-1]}


def clocks():
    """Times as other programs write them."""
    k = np.arange(12)
    stamps = [f"2026-05-03T12:00:{each / 10:04.1f}Z" for each in k]
    cases = {
        "ms": ("time_ms", 700 + 50 * k, {}),
        "us": ("time_us", 50_000 * k, {}),
        "ns": ("time_ns", 50_000_000 * k, {}),
        "plain s": ("time", 3.0 + 0.25 * k, {}),
        "plain ms": ("t", 12 + 40 * k, {}),
        "just below 1": ("t", 0.99 * k, {}),
        "just 1": ("t", np.where(k > 5, k + 0.5, k), {}),
        "epoch s": ("timestamp", [f"{1.7e9 + 0.05 * each:.2f}" for each in k], {}),
        "epoch ms": ("timestamp", [f"{1.7e12 + 50 * each:.0f}" for each in k], {}),
        "epoch us": ("timestamp", [f"{1.7e15 + 5e4 * each:.0f}" for each in k], {}),
        "epoch of 1999": ("timestamp", [f"{9.4e8 + 0.05 * each:.2f}" for each in k], {}),
        "seconds since 1970 as such": ("time_s", [f"{1.7e9 + 0.05 * each:.2f}" for each in k], {}),
        "milliseconds since 1970 as s": ("time_s", [f"{1.7e12 + 50 * each:.0f}" for each in k], {}),
        "iso": ("timestamp", stamps, {}),
        "comma": ("t", [f'"12:00:{each // 10:02d},{each % 10}001234567"' for each in k], {}),
        "time of day": ("t", [f"9:00:{each:02d}" for each in k], {}),
        "with zone": ("t", [f"2026-05-03T12:00:{each / 10:04.1f}+02:00" for each in k], {}),
        "no date": ("t", [f"12:xx:{each}" for each in k], {}),
        "blank": ("time_s", ["0", "0.1", "", "0.3", "nan", *(0.1 * each for each in k[5:])], {}),
        "counted": ("t", k, {}),
        "counted from 7": ("timestamp", 7 + k, {}),
        "frames": ("Frame", 3 + k, {"rate": 40.0}),
        "frames without rate": ("Frame#", 3 + k, {}),
        "rate of a clock": ("time_s", 3 + 2 * k, {"rate": 40.0}),
        "packets": ("PacketCounter", (65_530 + k) % 65_536, {"rate": 30.0}),
        "samples": ("Sample", 2 * k, {"rate": 30.0}),
        "rate and no counter": ("other", k, {"rate": 20.0}),
        "no times": ("other", k, {}),
        "fine": ("SampleTimeFine", (2**32 - 200_000 + 50_000 * k) % 2**32, {}),
        "beyond all dates": ("timestamp", 15_000_000_000 + 50 * k, {}),
        "no fine": ("SampleTimeFine", [""] * 12, {}),
        "percent": ("time_percent", 100 * k / 11, {"duration": 2.5}),
        "percent without": ("percent", 100 * k / 11, {}),
        "falls": ("time_s", 0.1 * k[::-1], {}),
    }  # fmt: skip
    found = {}
    with folder():
        for name, (column, cells, options) in cases.items():
            found |= in_turn({name: lambda c=column, x=cells, o=options: timed(c, x, **o)})
        twice = [f"{x / 10},{x * 100}" for x in k]
        found |= in_turn(
            {
                "stated rate": lambda: timed("frame", 5 + k, head="// Update Rate: 50.0Hz"),
                "rate without counter": lambda: timed("other", k, head="Sample Rate:,40"),
                "no other clock": lambda: timed("frame", k, rate=20.0, reading="seconds"),
                "other clock": lambda: timed("theta_x_deg,time_ms", twice, reading="seconds"),
                "two": lambda: timed("time_s,time_ms", twice),
                "four": lambda: timed("time_s", 0.1 * k[:4], count=4),
                "three": lambda: timed("time_s", 0.1 * k[:3], count=3),
                "one known": lambda: timed("t", ["1", *[""] * 11]),
            }
        )
    return found


def sensors_said():
    """Where sensors are found, or not, and what is wrong with their numbers."""
    truth = foreign.movement(5, "left", noise=0.0, rate=25)

    def asked(names=("torso_imu", "humerus_{s}_imu", "radius_{s}_imu"), side="left", more=lambda text: text, **options):
        path, own = foreign.opensense(place, truth, names)
        path.write_text(more(path.read_text()))
        found = read(path, side, **{**own, **options})
        return {"middle": found["angles"][50], "elbow": found["elbow"][50], "cautions": found["cautions"]}

    def dot(sensors, rows=slice(10, 80), start=4_294_000_000, lost=(), blind=(), early=0, **options):
        parts = foreign.sensors(truth)
        trunk = foreign.dot_file(place / "trunk.csv", parts["trunk"][rows], truth.t[rows], start)
        text = trunk.read_text().splitlines()
        for row in lost:
            text[row] = ",".join([*text[row].split(",")[:2], *["nan"] * 4, "0,0,0,0"])
        if early:
            at = next(k for k, line in enumerate(text) if line[:1] == "1")
            text.insert(at, text[at].replace(str(start), str(start - early)))
        trunk.write_text("\n".join([*text, ""]))
        foreign.opensense(place, truth)
        arm = foreign.dot_file(place / "arm.csv", parts["arm"], truth.t, start)
        for path, row in ((path, row) for path in (trunk, arm) for row in blind):
            text = [line.split(",") for line in path.read_text().splitlines()]
            text[row][1] = ""
            path.write_text("\n".join([*map(",".join, text), ""]))
        return read(arm, sensors=sensors, forward="z", **options)

    def apdm(*lost):
        path, options = foreign.apdm(place, truth)
        rows = [line.split(",") for line in path.read_text().splitlines()]
        for row, column in lost:
            rows[-row][column] = "nan"
        path.write_text("\n".join(map(",".join, rows)) + "\n")
        return read(path, **options)["cautions"]

    def mvnx(change):
        path, _ = foreign.mvnx(place, truth)
        path.write_text(change(path.read_text()))
        return {key: own[::15] for key, own in read(path).items() if key in ("times", "angles", "elbow")}

    turned = {"forearm": "hand_imu", "trunk": "Back_imu", "arm": "biceps"}
    own = ("Back_imu", "biceps", "hand_imu")
    with folder() as place:
        return in_turn(
            {
                "words": lambda: asked(("sternum", "left_upper_arm", "left_lowerarm")),
                "other side": lambda: asked(("chest", "arm.r", "ulna_l")),
                "no side": lambda: asked(("t8", "Humerus", "FOREARM")),
                "unknown": lambda: asked(own),
                "named": lambda: asked(own, sensors=turned),
                "by other case": lambda: asked(own, sensors={key: name.upper() for key, name in turned.items()}),
                "misnamed": lambda: asked(own, sensors={**turned, "trunk": "Bck"}),
                "two arms": lambda: asked(("torso", "humerus_l_1", "arm_l_2")),
                "no forward": lambda: asked(forward=None),
                "wrong forward": lambda: asked(forward="u"),
                "up": lambda: asked(forward="x"),
                "down": lambda: asked(forward="-x"),
                "left": lambda: asked(forward="y", reading="as-named"),
                "back": lambda: asked(forward="-z"),
                "turned": lambda: asked(forward="-z", reading="turned-trunk"),
                "plus": lambda: asked(forward="+z"),
                "not still": lambda: asked(still=1.6),
                "longer still": lambda: asked(still=1.0),
                "short still": lambda: asked(still=0.01),
                "no cell": lambda: asked(more=lambda text: text.replace("1", "x", 40)),
                "blank cells": lambda: asked(
                    more=lambda text: text.replace(text.splitlines()[20].split("\t")[1], "nan")
                ),
                "long": lambda: asked(more=lambda text: text.replace("0.7", "0.8")),
                "dot": lambda: dot({"trunk": "trunk.csv"}),
                "dot after its clock": lambda: dot({"trunk": "trunk.csv"}, start=2**32 - 300_000),
                "dot without all times": lambda: dot({"trunk": "trunk.csv"}, start=2**32 - 300_000, blind=(50, 61)),
                "dot with a row long before": lambda: dot({"trunk": "trunk.csv"}, slice(80), early=2_200_000_000),
                "dot of one row": lambda: dot({"trunk": "trunk.csv"}, slice(20, 21)),
                "dot of two rows": lambda: dot({"trunk": "trunk.csv"}, slice(20, 22)),
                "dot with gaps": lambda: dot({"trunk": "trunk.csv"}, lost=(20, 21, 37)),
                "dot of several": lambda: dot({"trunk": "orientations.sto"}),
                "dot without": lambda: dot({}),
                "dot of none": lambda: dot({"trunk": "nowhere.csv"}),
                "dot in a reading": lambda: dot({"trunk": "trunk.csv"}, reading="w-last, inverse"),
                "apdm with gaps": lambda: apdm((20, 1), (25, 4), (31, 5), (36, 8), (40, 11)),
                "mvnx": lambda: mvnx(lambda text: text),
                "no normal frame": lambda: mvnx(lambda text: text.replace('"normal"', '"other"')),
                "fewer numbers": lambda: mvnx(lambda text: text.replace("<orientation>1 0 0 0 ", "<orientation>")),
                "no number": lambda: mvnx(lambda text: text.replace("1 0 0 0", "1 0 0 a")),
                "no time": lambda: mvnx(lambda text: text.replace('<frame time="240"', "<frame")),
                "entities": lambda: mvnx(lambda text: "<!DOCTYPE a>" + text),
                "no place": lambda: mvnx(lambda text: text.replace("http://www.xsens.com/mvn/mvnx", "else")),
            }
        )


def poses_said():
    """Poses that are no movement, of sensors, segments and angles."""
    truth = foreign.movement(5, "left", noise=0.0, rate=25)

    def asked(writer):
        path, options = writer(place, truth)
        found = read_poses(path, "left", ep.RecordingOptions(**options), movement=False)
        return found.times is None, found.poses[::20].as_rotvec(), found.convention, found.cautions

    with folder() as place:
        texts(a__csv="time_s,b\n0,1\n1,2\n")
        return in_turn({name: lambda name=name: asked(foreign.WRITERS[name]) for name in ("mvnx", "apdm", "isb")}) | (
            in_turn(columns=lambda: read_poses("a.csv", "left", movement=False))
        )


def columns_said():
    """Tables by their columns, maps of columns, gaps, and elbows."""
    t = [0.05 * k for k in range(12)]

    def table(names, values, name="a.csv", **options):
        rows = "\n".join(",".join(map(str, (s, *row))) for s, row in zip(t, values, strict=True))
        texts(**{name.replace(".", "__"): f"time_s,{names}\n{rows}\n"})
        return read(name, **options)

    def mapped(text, **options):
        texts(m__toml=text)
        return table("Bend,Out,In,Elbow", np.c_[DOZEN, 7 * DOZEN[:, 1]], columns="m.toml", **options)

    def mot(names, side, degrees="yes"):
        rows = np.c_[t, DOZEN * [1, 1.5, 2], 9 * DOZEN[:, 1]].tolist()
        rows = np.array(rows)[:, : 1 + len(names)] * [1.0, *[1.0 if degrees == "yes" else 0.02] * len(names)]
        path = foreign.lines(
            place / "a.mot", foreign.opensim_head(12, len(names)), ("time", *names), rows.tolist(), "\t"
        )
        path.write_text(path.read_text().replace("inDegrees=yes", f"inDegrees={degrees}"))
        return read("a.mot", side, reading="as-named")

    good = 'schema = 1\n[columns]\ntime_s = "time_s"\nflexion_deg = "Bend"\nabduction_deg = "-Out"\n'
    good += 'internal_rotation_deg = "In"\n'
    holes = DOZEN.astype(object)
    holes[2, 1], holes[7, 0], holes[8, 2] = "", "nan", "NA"
    quaternions = ep.shoulder_rotation(*DOZEN.T, degrees=True).as_quat()
    matrices = ep.shoulder_rotation(*DOZEN.T, degrees=True).as_matrix().reshape(12, 9)
    with folder() as place:
        return in_turn(
            {
                "rad": lambda: table(HEAD.replace("deg", "rad"), np.radians(DOZEN)),
                "parts by numbers": lambda: table(
                    ",".join(f"{body}_quat_q{k}" for body in ("left_arm", "chest") for k in range(4)),
                    np.c_[quaternions[:, [3, 0, 1, 2]], np.tile([0.6, 0.0, 0.0, 0.8], (12, 1))],
                    forward="x",
                    still=0.01,
                ),
                "elbow": lambda: table(HEAD + ",elbow_flexion_rad", np.c_[DOZEN, 0.1 * DOZEN[:, 0]]),
                "elbow without unit": lambda: table(HEAD + ",elbow_flexion", np.c_[DOZEN, DOZEN[:, 0]])["elbow"],
                "holes": lambda: table(HEAD, holes),
                "both": lambda: table(HEAD + ",qx,qy,qz,qw", np.c_[DOZEN, quaternions]),
                "none": lambda: table("a,b,c", DOZEN),
                "long": lambda: table("qx,qy,qz,qw", 1.0012 * quaternions),
                "less long": lambda: table("qx,qy,qz,qw", 1.0009 * quaternions)["angles"],
                "matrices": lambda: table(",".join(foreign.MATRIX), 1.003 * matrices)["angles"],
                "no matrices": lambda: table(",".join(foreign.MATRIX), 1.006 * matrices),
                "left-handed": lambda: table(",".join(foreign.MATRIX), -matrices),
                "one left-handed": lambda: table(
                    ",".join(foreign.MATRIX), np.where(np.arange(12)[:, None] == 4, -matrices, matrices)
                ),
                "matrices with a gap": lambda: table(
                    ",".join(foreign.MATRIX), np.where(np.arange(12)[:, None] == 4, np.nan, matrices)
                ),
                "map": lambda: mapped(good + 'elbow_flexion_deg = "Elbow"\n'),
                "map of no column": lambda: mapped(good.replace("In", "Inn")),
                "map of nothing": lambda: mapped("schema = 1\n[columns]\n"),
                "map of another schema": lambda: mapped(good.replace("= 1", "= 2")),
                "map with more": lambda: mapped(good + "[more]\n"),
                "rajagopal": lambda: mot(("arm_flex_r", "arm_add_r", "arm_rot_r", "elbow_flex_r"), "right"),
                "rajagopal left": lambda: mot(("arm_flex_l", "arm_add_l", "arm_rot_l"), "left"),
                "rajagopal of the other": lambda: mot(("arm_flex_r", "arm_add_r", "arm_rot_r"), "left"),
                "mobl": lambda: mot(("elv_angle", "shoulder_elv", "shoulder_rot", "elbow_flexion"), "right"),
                "mobl left": lambda: mot(("elv_angle_l", "shoulder_elv_l", "shoulder_rot_l"), "left", "no"),
                "thoracoscapular": lambda: mot(("plane_elv", "shoulder_elv", "axial_rot"), "right"),
                "arm26": lambda: mot(("r_shoulder_elev", "r_elbow_flex"), "right"),
                "arm26 left": lambda: mot(("r_shoulder_elev", "r_elbow_flex"), "left"),
                "options": lambda: ep.RecordingOptions(" w-first ,, as-named", sensors={"arm": "a"}, start=[1, 2, 3]),
                "no role": lambda: ep.RecordingOptions(sensors={"leg": "a"}),
                "no reading": lambda: ep.RecordingOptions("x-first"),
                "still": lambda: ep.RecordingOptions(still=0.0),
            }
        )


def broken():
    """Files of other programs with a line that is no orientation, without what they must have, or cut off."""
    head = "DataType=Quaternion\nendheader\ntime\ttorso\thumerus_l\n"
    files = {
        "a.sto": head + "0\t1,0,0,0\t1,0\n",
        "b.sto": head + "0\t1,0,0,0\t1,0,0,0\n0.1\t1,0,0,0\tnan\n0.2\t1,0,0,0\t1,0,0,0\n0.3\t1,0,0,0\t1,0,0,0\n",
        "a.mvnx": "<mvnx/>",
        "b.mvnx": "<mvnx",
        "c.mvnx": '<!DOCTYPE mvnx [<!ENTITY a "b">]><mvnx/>',
        "a.csv": f"time_s;{HEAD.replace(',', ';')}\n0;1,5;2,5;0\n1;1.5;2;0\n",
    }
    with folder():
        texts(**{name.replace(".", "__"): text for name, text in files.items()})
        return in_turn({name: lambda name=name: read(name) for name in files})


def mistakes(*seeds):
    """What is said of records with a mistake; their movements take turns."""
    found, slower = {}, functools.partial(foreign.movement, rate=30)
    for turn, (mistake, _) in enumerate(planted.MISTAKES):
        seed = seeds[turn % len(seeds)]
        side = planted.side_of(seed)
        with folder() as place, mock.patch("planted_records.movement", slower):
            path, options, _ = mistake(place, seed)

            def said(path=path, side=side, options=options):
                own = ep.RecordingOptions(**options)
                return ep.read_movement(path, side, smoothing=None, reading=own).cautions

            found |= in_turn({mistake.__name__: said})
    return found


def swept(fixed, over, low, high, side="left"):
    """Share of a record outside the range that goes evenly from one value of an angle to another, degrees."""
    own = np.tile(np.array(fixed, dtype=float), (101, 1))
    own[:, over] = np.linspace(low, high, 101)
    rows = np.c_[0.02 * np.arange(101), own].tolist()
    path = foreign.lines(Path("sweep.csv"), [], ("time_s", *foreign.CLINICAL), rows)
    return ep.read_movement(path, side, smoothing=None).cautions


def ranges(side):
    """Where the range of a shoulder ends: shares of records that pass its limits."""
    cases = {
        "inward": ((30, 5, 0), 2, 90, 130),
        "inward sideways": ((3, 80, 0), 2, 90, 130),
        "outward, hanging": ((12, 3, 0), 2, -85, -125),
        "outward, at 60 degrees": ((60, 3, 0), 2, -95, -145),
        "outward, horizontal": ((95, 3, 0), 2, -120, -160),
        "backward": ((0, 10, 5), 0, -40, -70),
        "across, in front": ((45, 0, 5), 1, -20, -75),
        "across, behind": ((5, 0, 5), 1, -25, -55),
        "in front of it": ((0, -48, 5), 0, 0, 60),
        "overhead": ((140, 20, 0), 2, -100, 100),
        "overhead sideways": ((10, 140, 0), 2, -30, 170),
        "round": ((20, 10, 0), 2, 100, 330),
        "up and over": ((0, 15, 0), 0, 60, 260),
    }
    with folder():
        return in_turn({name: lambda case=case: swept(*case, side) for name, case in cases.items()})


ASKED = {
    "formats": lambda: formats("left", "right"),
    "more_formats": lambda: formats("right", "left"),
    "clocks": clocks,
    "sensors": sensors_said,
    "columns": columns_said,
    "poses": poses_said,
    "broken": broken,
    "mistakes": lambda: mistakes(0, 1, 2, 3),
    "more_mistakes": lambda: mistakes(1, 2, 4, 5, 0),
    "ranges": lambda: ranges("left"),
    "ranges_right": lambda: ranges("right"),
}

#: Those that take longer than 0.15 s.
LONGER = {"more_formats", "more_mistakes", "ranges_right"}


@each_of(ASKED, LONGER)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
