"""Planted mistakes in calibrations, and in files of designs and robots: each is refused or named, its cause first.

::

    python benchmarks/planted_designs.py               # both tables; counts in docs/evidence/hard_to_break.md
    python benchmarks/planted_designs.py calibration   # one of them

Each mistake is planted in genuine data that are made from a seed, and goes through every door that takes them: Python
and the command line. The first suggestion is the text of the first warning, else of the error, else the sentence of
the verdict that speaks against the answer. Genuine data go through the same doors; a warning or doubt there is a false
alarm.
"""

import argparse
import contextlib
import io
import re
import sys
import tempfile
import warnings
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests" / "oracles"))

from measured_devices import measured, near, poses  # noqa: E402

import exo_pin as ep  # noqa: E402
from exo_pin.cli import main as command  # noqa: E402
from exo_pin.control import MeasuredRun, write_run  # noqa: E402

NOISE = 3e-4
JOINTS, CENTRE = ("base_points", "platform_points"), ("base_offset", "cuff_offset")


def asked(question):
    """First suggestion of a call, empty where it has nothing to say."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        try:
            answer = question()
        except (ep.ExoPinError, ValueError) as error:
            return str(told[0].message if told else error)
    return str(told[0].message) if told else doubt(str(answer))


def doubt(text):
    """The sentence of a verdict that speaks against the answer; else what it took as known."""
    found = re.search(r"Not a good fit\. .*", text)
    return found[0] if found else text.partition("\n")[0] if text.startswith("Taken as known") else ""


def typed(*arguments):
    """First suggestion of a command in this process."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        command([str(each) for each in arguments])
    said = [line for line in err.getvalue().splitlines() if "compiling, once" not in line]
    return " ".join(said) if said else doubt(out.getvalue()) or flaw(out.getvalue())


def flaw(text):
    """The first finding of a check that fails."""
    found = [line.strip() for line in text.splitlines() if line.strip().startswith("fail")]
    return found[0] if found else ""


def calibration_doors(folder, seen, lengths, exo, options):
    """First suggestions of Python and of the command line."""
    tolerances = dict.fromkeys(options.get("unknowns", JOINTS), 0.01) if options.pop("workshop", False) else None
    noise = options.get("length_noise", NOISE)
    own = asked(lambda: ep.calibrate(seen, lengths, exo, **{"length_noise": noise} | options, tolerances=tolerances))
    path = folder / "run.csv"
    try:
        write_run(MeasuredRun(seen, lengths), path)
    except ep.ExoPinError as error:
        return own, str(error)
    more = [] if tolerances is None else [text for name in tolerances for text in ("--tolerance", f"{name}=10")]
    names = ",".join(options.get("unknowns", JOINTS))
    return own, typed("calibrate", "prototype", path, "--unknowns", names, "--length-noise", 1e3 * noise, *more)


def planted_calibrations(seed=0):
    """Name, what the first suggestion has to say, and the data with the mistake."""
    rng = np.random.default_rng(seed)
    exo = ep.load("prototype")
    device = near(exo, rng, joints=0.003)
    angles = rng.uniform([0.0, -4.0, -20.0], [85.0, 85.0, 85.0], (40, 3))
    arm = ep.shoulder_rotation(*angles.T, degrees=True)
    seen, lengths = measured(device, arm, rng, NOISE)
    limb = np.array([False, True, False])

    def changed(rows, limb, value):
        found = lengths.copy()
        found[rows, limb] = value(found[rows, limb])
        return found

    workshop = {"workshop": True}
    flip = np.array([-1.0, 1.0, -1.0, 1.0])
    theta = np.radians(angles * [-1.0, 1.0, -1.0])
    slack = np.maximum(lengths[:, 1], np.quantile(lengths[:, 1], 0.4))
    tilted = Rotation.from_rotvec(np.radians([3.0, 0.0, 2.0]))
    clinical = [np.radians(angles), angles[:, [1, 0, 2]]]
    yield "all lengths in millimetres", "millimetres", (seen, 1e3 * lengths, {})
    yield "all lengths in centimetres", "centimetres", (seen, 1e2 * lengths, {})
    yield "all lengths in inches", "inches", (seen, lengths / 0.0254, {})
    yield "one limb in centimetres", "limb 2.*centimetres", (seen, np.where(limb, 1e2, 1.0) * lengths, {})
    yield "one limb in millimetres", "limb 2.*millimetres", (seen, np.where(limb, 1e3, 1.0) * lengths, {})
    yield "two columns swapped", "column 2 is limb 1", (seen, lengths[:, [1, 0, 2]], workshop)
    yield "three columns in another order", "column 3 is limb 2", (seen, lengths[:, [2, 0, 1]], workshop)
    yield "matrices transposed", "inverted", (seen.inv(), lengths, workshop)
    yield "the other side of the body", "other side", (Rotation.from_quat(seen.as_quat() * flip), lengths, workshop)
    first = Rotation.from_quat(seen.as_quat()[:, [3, 0, 1, 2]])
    yield "quaternions with w first", "w first", (first, lengths, workshop)
    small = ep.shoulder_rotation(*clinical[0].T, degrees=True)
    yield "angles in radians under degrees", "radians", (small, lengths, workshop)
    other = ep.shoulder_rotation(*clinical[1].T, degrees=True)
    yield "flexion and abduction swapped", "flexion and abduction are swapped", (other, lengths, workshop)
    read = ep.thesis_rotation(theta[:, 1], theta[:, 0], theta[:, 2])
    yield "angles read in another order", "Y-X-Z .* were read as X-Y-Z", (read, lengths, workshop)
    yield "one limb without its end fitting", "limb 2 by .*length_offsets", (seen, lengths - 0.12 * limb, {})
    yield "all limbs without end fittings", "length_offsets", (seen, lengths - 0.126, {})
    yield "one length mistyped by 100 mm", "pose 7, limb 2", (seen, changed(7, 1, lambda x: x + 0.1), {})
    yield "a slack muscle", "limb 2.*slack", (seen, np.where(limb, slack[:, None], lengths), {})
    yield "lengths a row late", "a row late", (seen[1:], lengths[:-1], workshop)
    off = measured(device._replace(torso=tilted), arm, rng, NOISE)
    yield "torso sensor 3.6° off", "Taken as known.*deg of the torso mounting", (*off, {})
    yield "scale of the encoders 2 % off", "Taken as known.*% of the length scale", (seen, lengths / 1.02, {})


def genuine_calibrations(seed=1):
    """Data without a mistake."""
    for number in range(8):
        rng = np.random.default_rng([seed, number])
        exo = ep.load("prototype")
        arm = poses(rng, 40)
        more = {} if number < 4 else {"unknowns": (*JOINTS, "length_offsets")} if number < 6 else {"unknowns": CENTRE}
        moved = {"joints": 0.003} if number < 6 else {"joints": 0.0, "rings": (0.006, 0.006)}
        device = near(exo, rng, **moved, offsets=0.05 if 4 <= number < 6 else 0.0)
        yield f"genuine {number}", (*measured(device, arm, rng, NOISE), more)


def design_doors(folder, files):
    """First suggestions of Python and of the command line on files by name, the first of which is loaded."""
    for old in folder.iterdir():
        old.unlink()
    for name, text in files.items():
        (folder / name).write_text(text)
    path = folder / next(iter(files))
    return asked(lambda: loaded(path)), typed("check", path)


def loaded(path):
    """What a user does first with a file."""
    exo = ep.load(path)
    if exo.has_arm:
        exo.reaction(exo.pose(30))
    return flaw(str(exo.check()))


def robot(name, **replaced):
    """The files of a shipped robot, with texts replaced in that of each ending."""
    texts = {path.name: path.read_text() for path in sorted((ROOT / "urdf").glob(f"{name}.*"))}
    texts = dict(sorted(texts.items(), key=lambda item: not item[0].endswith(".urdf")))
    for ending, (pattern, new) in replaced.items():
        own = next(each for each in texts if each.endswith(ending.replace("_", ".")))
        texts[own], count = re.subn(pattern, new, texts[own], count=0 if callable(new) else 1, flags=re.DOTALL)
        assert count, (name, pattern)
    return texts


def planted_designs():
    """Name, what the first suggestion has to say, and the files with the mistake."""
    text = ep.design.preset_file("prototype")

    def design(pattern, new):
        found, count = re.subn(pattern, new, text, count=1)
        assert count, pattern
        return {"mine.toml": found}

    def decimals(match):
        return f'{match[1]}="' + " ".join(f"{float(x):.3f}" for x in match[2].split()) + '"'

    yield "a length in metres under millimetres", "metres", points(1e-3)
    yield "a length in millimetres under metres", "millimetres", points(1e3, "m")
    yield "a key mistyped", "base_radius", design("base_radius_mm", "base_radus_mm")
    yield "a key without its unit", "base_radius_m", design("base_radius_mm", "base_radius")
    yield "a mass in grams under kilograms", "grams", design("mass_g =", "mass_kg =")
    yield "angles in degrees under radians", "degrees", design("base_angles_deg", "base_angles_rad")
    yield (
        "a stroke in percent for a ratio",
        "percent",
        design(r"shortest_ratio = [\d.]+", "shortest_ratio = 75.0"),
    )
    yield "a pressure in pascals under bar", "bar", design(r"supply_bar = [\d.]+", "supply_bar = 400000.0")
    yield "a limb too few", "limb", {"mine.toml": text[: text.rindex("[[limbs]]")]}
    yield "inertia in g mm² under kg m²", "g mm", design("origin_g_mm2", "origin_kg_m2")
    yield "a robot with three decimals", "decimals", robot("prototype", urdf=(r'(xyz|rpy)="([^"]*)"', decimals))
    yield (
        "a joint's name mistyped in the closures",
        "there are|did you mean|unknown",
        robot("serial-y-x-z", closures_toml=("flexion", "flexoin")),
    )
    yield (
        "an axis of length zero",
        "axis",
        robot("serial-y-x-z", urdf=(r'(type="revolute".*?axis xyz=")[^"]*', r"\g<1>0 0 0")),
    )
    yield "an inertia that no body has", "no body has", robot("serial-y-x-z", urdf=(r'izz="[^"]*"', 'izz="9.0"'))
    spring = '[[springs]]\nname = "s"\njoint = "flexion"\nlaw = "constant"\nmoment_N_m = 5.0\n'
    beside = {"serial-y-x-z.device.toml": f'schema = 1\nname = "serial-y-x-z"\n{spring}'}
    yield "the old sign of a spring on a joint", "opposite sign", robot("serial-y-x-z") | beside


def points(factor, unit="mm"):
    """A design by points whose numbers are of another unit than their keys."""
    geometry = ep.load("prototype").geometry
    rows = [np.round(factor * (1e3 if unit == "mm" else 1.0) * each, 6).tolist()
            for each in (geometry.base_points, geometry.platform_points)]  # fmt: skip
    keys = f"[geometry.points]\nbase_{unit} = {rows[0]}\nplatform_{unit} = {rows[1]}\n"
    return {"mine.toml": f'schema = 1\nname = "mine"\n{keys}'}


def genuine_designs():
    """Files without a mistake."""
    for name in ("prototype", "four-cables", "three-linear-actuators"):
        yield name, {"mine.toml": ep.design.preset_file(name)}
    for name in ("serial-y-x-z", "spring-support", "prototype", "3rps-passive-ball"):
        yield name, robot(name)


def report(title, planted, genuine, doors):
    """Print a table, and return how many causes came first, and false alarms."""
    first, rows, alarms = 0, [], []
    with tempfile.TemporaryDirectory() as folder:
        for name, expected, data in planted:
            said = doors(Path(folder), data)
            named = [bool(re.search(expected, text, re.DOTALL)) for text in said]
            first += all(named)
            rows.append((name, *("yes" if ok else "other words" if text else "NO WORD"
                                 for ok, text in zip(named, said, strict=True)), said[0]))  # fmt: skip
        for name, data in genuine:
            alarms += [(name, text) for text in doors(Path(folder), data) if text and "Taken as known" not in text]
    print(f"\n## {title}\n")
    print("| planted | Python | command line | first words in Python |")
    print("| --- | --- | --- | --- |")
    for *cells, words in rows:
        short = re.sub(r"(/\S*/)", "", " ".join(words.split()))
        print(f"| {' | '.join(cells)} | {short[:150] + ('...' if len(short) > 150 else '')} |".replace("|F_s|", "F_s"))
    print(f"\nThe planted cause comes first at both doors in {first} of {len(rows)}. False alarms: {alarms or 'none'}.")
    return first, len(rows), len(alarms)


def main():
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("part", nargs="?", choices=["calibration", "designs"])
    part, found = parser.parse_args().part, []
    if part != "designs":
        exo = ep.load("prototype")

        def calibrated(folder, data):
            seen, lengths, options = data
            return calibration_doors(folder, seen, lengths, exo, dict(options))

        found.append(report("Calibration", planted_calibrations(), genuine_calibrations(), calibrated))
    if part != "calibration":
        found.append(report("Designs and robots", planted_designs(), genuine_designs(), design_doors))
    first, count, alarms = np.sum(found, axis=0)
    print(f"\nIn all {first} of {count}, {alarms} false alarms.")


if __name__ == "__main__":
    main()
