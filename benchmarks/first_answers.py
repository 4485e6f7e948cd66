"""First answers of drawn cases, read back: their size, their words, and each number beside the field it is made from.

::

    python benchmarks/first_answers.py [--cases N]

A case is a device on either side (wrists of 3 to 9 drawn limbs, designs of the package, robots from files), with or
without a person and their muscles, elbow straight or bent, in a drawn pose. What is read back is computed here anew
from public fields of the answer.
"""

import argparse
import re
import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.exo.pose_report import report_on_pose
from exo_pin.person.bare_arm import bare_arm_share

URDF = Path(__file__).parents[1] / "urdf"
FILES = (
    "serial-y-x-z.urdf", "spring-support.urdf", "spherical-3rrr.urdf", "3rps-passive-ball.urdf", "nesm.urdf",
    "prototype.urdf", "prototype-shoulder.urdf", "six-cables.urdf",
)  # fmt: skip
WIDTH, LINES = 120, 10
#: Words that are explained nowhere in the answer.
TERMS = re.compile(r"F_s|\(g|[a-z]_[a-z]|\bnan\b|\binf\b|\bNone\b|certificate|self-stress|wrench|undetermined")
NUMBER = r"(-?\d+(?:\.\d+)?)"
WAYS = {
    "out of the socket": (0, 1), "into the socket": (0, -1), "up": (1, 1), "down": (1, -1),
    "forward": (2, 1), "backward": (2, -1),
}  # fmt: skip
BODY = {
    "forward": (0, 1), "backward": (0, -1), "to the left": (1, 1), "to the right": (1, -1),
    "up": (2, 1), "down": (2, -1),
}  # fmt: skip


def drawn_device(rng):
    """A device of any kind, on a wearer or on nobody."""
    kind = rng.choice(["wrist", "preset", "file"], p=[0.6, 0.25, 0.15])
    if kind == "file":
        return ep.load(URDF / str(rng.choice(FILES)))
    if kind == "preset":
        return ep.load(str(rng.choice(ep.presets())))
    n = int(rng.integers(3, 10))
    base = rng.normal(size=(n, 3)) * 0.12 + [0.0, 0.1, 0.1]
    platform = rng.normal(size=(n, 3)) * 0.06 + [0.0, 0.0, -0.2]
    limbs = []
    for length in np.linalg.norm(base - platform, axis=1):
        family = str(rng.choice(["linear", "cable"]))
        most = float(rng.uniform(20.0, 800.0)) if rng.uniform() < 0.9 else None
        actuator = ep.Actuator(family, pull_limit=most, push_limit=most if family == "linear" else None)
        stroke = ep.Stroke(length, float(rng.uniform(0.3, 0.8)), float(rng.uniform(1.1, 1.8)), 0.0)
        known = rng.uniform() < 0.9
        limbs.append(ep.Limb(str(rng.choice(["UPU", "SPS"])), stroke=stroke if known else None, actuator=actuator))
    arm = ep.Arm.from_anthropometry(1.7, 70, "female") if rng.uniform() < 0.3 else ep.Arm(3.5, [0.0, 0.0, -0.3])
    return ep.ShoulderExo(ep.WristGeometry(base, platform), arm=arm, limbs=limbs)


def drawn_case(seed):
    """A report on one pose of a drawn device."""
    rng = np.random.default_rng([20261129, seed])
    exo = drawn_device(rng)
    if rng.uniform() < 0.4:
        exo = exo.mirrored()
    person = None
    if rng.uniform() < 0.5:
        person = ep.Person(
            float(rng.uniform(1.5, 2.0)), float(rng.uniform(45.0, 140.0)), str(rng.choice(["male", "female"])),
            strength=float(rng.choice([0.0, 0.02, 0.5, 1.0, 1.0, 1.0])), payload=float(rng.choice([0.0, 0.0, 2.0])),
            side=exo.side, elbow_flexion=float(rng.choice([0.0, 0.0, 0.8, 1.6])),
        )  # fmt: skip
    if person is not None or exo.device.arm is None:
        exo = exo.worn_by(person or ep.Wearer(1.8, 80.0, "male"))
    angles = rng.uniform([-20.0, -10.0, -30.0], [110.0, 100.0, 60.0]) * (rng.uniform(size=3) < 0.7)
    limits = str(rng.choice(["design", "design", "design", "none"]))
    answer = exo.reaction(exo.pose(*angles), limits=limits)
    return report_on_pose(exo, answer, person, angles=angles)


def agrees(word, value, factor=1.0):
    """Whether a printed number is a value to its digits."""
    digits = len(word.partition(".")[2])
    return abs(float(word) - factor * value) <= 0.5001 * 10.0**-digits


def directions(text, vector, ways):
    """What is wrong with a force that is named along axes: numbers, ways, or a large part that is left out."""
    wrong, parts = [], vector.copy()
    for word, way in re.findall(rf"{NUMBER} ([a-z ]+?)(?: \(\w+\))?(?:,|;|$)", text):
        axis, sign = ways[way]
        if not agrees(word, sign * vector[axis]):
            wrong.append(f"{word} {way}: {vector[axis]}")
        parts[axis] = 0.0
    return wrong + ([f"left out: {parts}"] if np.abs(parts).max() > 0.1 * np.linalg.norm(vector) + 1e-9 else [])


def labelled(lines):
    """Lines behind their labels, those without one under the label above; the reason has none."""
    found, label = {}, "reason"
    for line in lines:
        if line[:1] != " ":
            label = line[:17].strip()
        found.setdefault(label, []).append(line[17:])
    return found


def read_back(report):
    """What is wrong with the text of a report: a list of sentences, empty for nothing."""
    text, answer, units = str(report), report.answer, report.device.drive_units
    names = [name for name, _ in units] or [f"limb {i + 1}" for i in range(len(answer.actuator_forces))]
    head, *lines = text.split("\n")
    limbs = [line for line in lines if re.match(r" \S", line)]
    parts = labelled([line for line in lines if line not in limbs])
    wrong = [f"too wide: {line}" for line in (head, *lines) if len(line) > WIDTH]
    if len(lines) + 1 - len(limbs) > LINES:
        wrong.append(f"{len(lines) + 1 - len(limbs)} lines")
    others = re.sub("|".join(map(re.escape, (*names, report.device.name))), "", text)
    wrong += [f"term {found[0]!r}" for found in TERMS.finditer(others)]
    wrong += ["cut short in another way"] if "[...]" in text else []
    if not lines[-1].endswith("More: --explain"):
        wrong.append("no way to more")
    wrong += verdict(report, head, parts.get("reason", []))
    wrong += asked_of(report, head)
    wrong += beside(report, parts)
    wrong += joint(report, parts)
    if answer.has_answer:
        wrong += alone(report, parts["Without muscles"])
        wrong += drives(report, limbs, names)
    return wrong


def verdict(report, head, reason):
    """The first words beside what the answer says of the pose."""
    answer = report.answer
    says = head.partition(".")[0]
    if says == "YES, it holds":
        return [] if answer.can_hold else ["YES, and it cannot"]
    left = report.left_to_wearer
    if answer.has_answer and left and not left[1] and not report.device.drives and not says.startswith("IT SUPPORTS"):
        return [f"{says}: it leaves {left} to the wearer"]
    if says in ("NO, it cannot hold", "PROBABLY NOT"):
        return [] if not answer.held and reason else ["NO, and it can, or no reason"]
    if says == "IT SUPPORTS, and the wearer holds":
        size = np.linalg.norm(report.device.moment_of_wearer(answer.actuator_forces[None])[0])
        found = re.search(rf"{NUMBER} N m", reason[0])
        return [] if not found or agrees(found[1], size) or size < 5e-3 else [f"{found[1]} N m left: {size}"]
    if says == "IT WOULD HOLD, but not as it is worn":
        through = answer.clearance < 0.0 or answer.source.poses.gaps.beside
        return [] if answer.held and through else ["touches nothing"]
    if says == "NO WAY TO IT":
        rest = answer.source.poses.mechanism
        turns = Rotation.from_rotvec(np.linspace(0.0, 1.0, 200)[:, None] * answer.case.poses.as_rotvec())
        signs = np.sign(ep.ShoulderExo.from_device(rest).singularity(turns).determinant)
        return [] if (signs[:-1] * signs[1:] < 0).any() else ["no singular pose on the way"]
    if says.startswith("NOT KNOWN") or says == "YES, if estimates are right":
        return [] if answer.unknown else ["known, and said not to be"]
    return [f"verdict {says!r}"]


def asked_of(report, head):
    """Pose and wearer in the first line."""
    if head.endswith("…"):
        return []
    side, wearer, wrong = report.device.side, report.wearer, []
    names = ("flexion", "abduction", "internal rotation")
    angles = [re.search(rf"(?:^|  |, ){name} {NUMBER}°", head) for name in names]
    said = ep.shoulder_rotation(*(float(found[1]) if found else 0.0 for found in angles), side=side, degrees=True)
    if (said * report.answer.case.poses.inv()).magnitude() > np.radians(0.15):
        wrong.append(f"pose of {head}")
    if ("arm hanging" in head) == any(angles):
        wrong.append(f"hanging: {head}")
    if not head.endswith(f"{side} arm"):
        wrong.append(f"side of {head}")
    man = re.search(rf"(wo)?man, {NUMBER} m, {NUMBER} kg(?:, {NUMBER} kg in the hand)?(?:, elbow {NUMBER}°)?, ", head)
    if bool(man) != (wearer is not None):
        return [*wrong, f"wearer of {head}"]
    if man:
        facts = (wearer.height, wearer.mass, wearer.payload, np.degrees(wearer.elbow_flexion))
        told = [float(word or 0.0) for word in man.groups()[1:]]
        if (man[1] is None) != (wearer.sex == "male") or (
            np.abs(np.subtract(told, facts)) > [1e-3, 0.06, 0.01, 0.51]
        ).any():
            wrong.append(f"wearer of {head}: {facts}")
    return wrong


def beside(report, parts):
    """How near a singular pose is, what would help, how the device sits, what to mind, and what is assumed."""
    answer, wrong, reason = report.answer, [], " ".join(parts.get("reason", []))
    near, away = re.match("Almost singular", reason), re.search(rf"singular pose is {NUMBER}(e-\d+)?° away", reason)
    if bool(near) != (answer.equilibrium_status == "near_singular"):
        wrong.append(f"near singular: {answer.equilibrium_status}")
    if near and "…" not in reason and bool(away) != bool(np.isfinite(report.singular_distance)):
        wrong.append(f"distance {report.singular_distance}: {reason}")
    if away and abs(float(away[1] + (away[2] or "")) - report.singular_distance) > 0.051 * report.singular_distance:
        wrong.append(f"{away[0]}: {report.singular_distance}")
    if report.remedy is not None and answer.has_answer and not answer.unknown:
        nearest = report.remedy.nearest
        found = "No pose within 60° can be held" if nearest is None else nearest.sentence(report.device.side)
        if found.split(". ")[0][:60].rstrip(".") not in reason:
            wrong.append(f"no remedy: {found}")
    elif "No pose within" in reason or "nearest pose" in reason.lower():
        wrong.append(f"remedy: {reason}")
    text = parts["Device"][0]
    clear, pull = re.search(rf"{NUMBER} mm clear", text), re.search(rf"pulls {NUMBER} N(?: to the (\w+))?", text)
    press, gap = re.search(rf", presses {NUMBER} kPa", text), float(answer.clearance)
    if not text.startswith(report.device.name[:30]):
        wrong.append(f"name: {text}")
    if bool(clear) != (np.isfinite(gap) and gap >= 0.0) or (clear and not agrees(clear[1], 1e3 * gap)):
        wrong.append(f"clear by {gap}: {text}")
    force = float(answer.cuff_pull)
    if bool(pull) != (answer.is_worn and np.isfinite(force)):
        wrong.append(f"cuff {force}: {text}")
    if pull:
        way = None if abs(force) < 0.05 else "hand" if force > 0.0 else "shoulder"
        if not agrees(pull[1], abs(force)) or pull[2] != way:
            wrong.append(f"cuff {force}: {text}")
        if bool(press) != (answer.cuff_pressure is not None) or (
            press and not agrees(press[1], 1e-3 * float(answer.cuff_pressure))
        ):
            wrong.append(f"pressure {answer.cuff_pressure}: {text}")
    if ("Placed" in parts) != (answer.has_answer and bool(report.accuracy.is_doubtful)):
        wrong.append(f"placed: {parts.get('Placed')}")
    first = [text for text in answer.cautions if not text.startswith(("Not ", "Posture: "))]
    first = [text for text in answer.cautions if text.startswith("Posture: ")] or first
    told = " ".join(parts.get("Mind", []))
    others = [text for text in answer.cautions if text.startswith("Not checked")]
    if bool(told) != bool(first or others) or (
        first and not told.startswith(re.split(r" ?\(", first[0])[0][:70].rstrip())
    ):
        wrong.append(f"mind {told!r}: {answer.cautions}")
    text = parts["Assumed"][0].removesuffix("More: --explain").strip()
    massless = report.device.has_limbs and report.device.limbs_are_massless
    if text.startswith("massless limbs") != massless or not text.endswith("."):
        wrong.append(f"assumed: {text}")
    chosen = not answer.criterion.startswith("none needed")
    if chosen and answer.criterion[:25] not in text and "…" not in text:
        wrong.append(f"criterion {answer.criterion}: {text}")
    low, high = bare_arm_share(answer.case.poses)
    text = " ".join(parts.get("In the joint", []))
    share = re.search(rf"(?:{NUMBER} to |about ){NUMBER} % of body weight without a device", text)
    if bool(share) != (report.contact is None and answer.has_answer and np.isfinite(low)):
        wrong.append(f"bare arm: {low}: {text}")
    if share and not (agrees(share[2], high) and agrees(share[1] or share[2], low)):
        wrong.append(f"{share[0]}: {low}, {high}")
    return wrong


def joint(report, parts):
    """Forces in the joint, and reliefs."""
    contact, wrong = report.contact, []
    if contact is None:
        return ["relief without a person"] if "Relief" in parts else []
    text, bare = " ".join(parts["In the joint"]), contact.without_device
    for pattern, found in (
        (rf"{NUMBER} N with the (?:device|closest)", contact), (rf"{NUMBER} N without", bare),
    ):  # fmt: skip
        said = re.search(pattern, text)
        if found.has_result != bool(said) and contact.has_muscles:
            wrong.append(f"{pattern} in {text!r}: {found.status}")
        if said and not agrees(said[1], float(found.magnitude)):
            wrong.append(f"{said[0]}: {found.magnitude}")
    relief = contact.relief_percent
    if ("Relief" in parts) != bool(np.isfinite(relief)):
        wrong.append(f"relief {relief}: {parts.get('Relief')}")
    if "Relief" in parts:
        text = parts["Relief"][0]
        said = re.match(rf"at most {NUMBER} %|none here: the joint carries {NUMBER} % more", text)
        values = [(said[1] or said[2], abs(float(relief)))]
        if kept := re.search(r"tension kept (.*?) \((.*?)\);", text):
            values += [
                (word, float(each.relief_percent))
                for word, each in zip(kept.groups(), report.kept.values(), strict=True)
            ]
        for word, value in values:
            number = re.match(NUMBER, word)
            if bool(number) != bool(np.isfinite(value)) or (number and not agrees(number[1], value)):
                wrong.append(f"relief {word}: {value}")
    return wrong


def alone(report, lines):
    """What arm and device press on the head: size, share, directions and range."""
    answer, wrong = report.answer, []
    push, size = -answer.shoulder_force, float(answer.magnitude)
    said = re.match(rf"{NUMBER} N(?:, {NUMBER} % of body weight,)? on the head(?:, of arm and device)?: (.*)", lines[0])
    if not agrees(said[1], size) or (said[2] and not agrees(said[2], float(answer.percent_body_weight))):
        wrong.append(f"{lines[0]}: {size}")
    if report.socket is None:
        wrong += directions(said[3], push, BODY)
    else:
        wrong += directions(said[3], report.socket @ push, WAYS)
        body = re.search(r"along the body (.*?)(?:; statics|$)", lines[1])[1]
        wrong += directions(body, push, BODY)
    allowed, span = answer.range(), re.search(rf"allows {NUMBER} (?:to {NUMBER} N|N or more)", " ".join(lines))
    if span and not (
        agrees(span[1], float(allowed.least)) and (not span[2] or agrees(span[2], float(allowed.greatest)))
    ):
        wrong.append(f"{span[0]}: {allowed}")
    if bool(span) != (allowed is not None and not allowed.is_single):
        wrong.append(f"range {allowed}: {lines}")
    return wrong


def _is_done(does, force):
    """Whether a force is what the words say: pulls or pushes with so much, slack, or an effort."""
    if does[3]:
        return abs(force) < 0.0501
    if does[1]:
        return agrees(does[2], abs(force)) and (does[1] == "pulls") == (force > 0.0)
    return agrees(does[4], force)


def drives(report, limbs, names):
    """A line a drive: what it does, its share of its limit, and its length."""
    answer, wrong = report.answer, []
    force, bounds, units = answer.actuator_forces, answer.source.poses.limits, report.device.drive_units
    own = [i for i, name in enumerate(names) if not name.startswith("wearer")]
    if len(limbs) != len(own):
        return [f"{len(limbs)} lines of {len(own)} drives"]
    for i, line in zip(own, limbs, strict=True):
        does = re.match(rf" {re.escape(names[i])} +(?:(pulls|pushes) {NUMBER} N|(slack)|{NUMBER} N)", line)
        if not does or not _is_done(does, force[i]):
            wrong.append(f"{line}: {force[i]}")
        limit = float(bounds.upper[0, i] if force[i] > 0.0 else -bounds.lower[0, i]) if bounds.asked else np.nan
        share = re.search(rf"{NUMBER} % of its limit", line)
        if share and limit > 0.0 and not agrees(share[1], 100.0 * abs(force[i]) / limit):
            wrong.append(f"{line}: limit {limit}")
        if bool(share) != bool(bounds.asked and (0.0 < limit < np.inf or (limit == 0.0 and agrees("0.0", force[i])))):
            wrong.append(f"{line}: limit {limit}")
        if ("limit not known" in line) != bool(bounds.asked and not np.isfinite(limit)):
            wrong.append(f"{line}: limit {limit}")
        unable = re.search("cannot (pull|push|act)", line)
        if bool(unable) != bool(bounds.asked and limit == 0.0 and not share):
            wrong.append(f"{line}: limit {limit}")
        if unable and unable[1] != ("act" if not report.device.has_limbs else "pull" if force[i] > 0.0 else "push"):
            wrong.append(f"{line}: {force[i]}")
        if ("limits not asked" in line) == bounds.asked:
            wrong.append(f"{line}: asked {bounds.asked}")
        place = re.search(
            rf"{NUMBER}( mm|°)(?: of {NUMBER} to {NUMBER}|, at least {NUMBER}|, at most {NUMBER})?$", line
        )
        scale = 1e3 if place[2] == " mm" else 180.0 / np.pi
        if (place[2] == " mm") != (units[i][1] != "N m" if units else True):
            wrong.append(f"unit of {line}")
        ends = scale * report.ranges[i]
        for word, end in ((place[3] or place[5], ends[0]), (place[4] or place[6], ends[1])):
            if bool(word) != bool(np.isfinite(end)) or (word and not agrees(word, end)):
                wrong.append(f"{line}: {ends}")
        if not agrees(place[1], scale * float(answer.source.poses.lengths[0, i])):
            wrong.append(f"{line}: at {answer.source.poses.lengths[0, i]}")
    return wrong


def main(count):
    """Print what was drawn, the verdicts, the largest answers and what is wrong."""
    heads, sizes, seconds, wrong = Counter(), [], [], {}
    for seed in range(count):
        report = drawn_case(seed)
        start = time.process_time()
        text = str(report).split("\n")
        seconds.append(time.process_time() - start)
        found = read_back(report)
        heads[text[0].partition(".")[0]] += 1
        own = sum(not line.startswith("  ") and line.startswith(" ") for line in text)
        sizes.append((len(text) - own, max(map(len, text))))
        if found:
            wrong[seed] = found
    lines, widths = np.array(sizes).T
    print(
        f"{count} first answers: at most {lines.max()} lines beside the limbs (median {np.median(lines):.0f}), ", end=""
    )
    print(f"at most {widths.max()} characters a line; {1e3 * np.median(seconds):.1f} ms of CPU to write one")
    for head, cases in heads.most_common():
        print(f"{cases:5d}  {head}")
    print(f"{len(wrong)} are wrong")
    for seed, texts in wrong.items():
        print(seed, *texts, sep="\n    ")
    return len(wrong)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--cases", type=int, default=500, help="number of cases (default 500)")
    sys.exit(int(main(parser.parse_args().cases) > 0))
