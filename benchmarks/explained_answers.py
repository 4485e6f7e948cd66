"""What is known of a pose in all words (`exo-pin reaction --explain`), read back beside the fields it comes from."""

import re

import numpy as np
from first_answers import NUMBER, agrees

from exo_pin.person.bare_arm import bare_arm_share


def explained(report):
    """What is wrong with all that is known of a pose: its parts, each where it is due, and their numbers."""
    answer, device, wrong = report.answer, report.device, []
    lines = report.explained().split("\n")
    text = " ".join(report.explained().split())

    def due(words, is_due):
        if (" ".join(words.split()) in text) != bool(is_due):
            wrong.append(f"{words!r} {'missing' if is_due else 'too much'}")

    wrong += [f"too wide: {line}" for line in lines if len(line) > 100]
    due(answer.verdict, True)
    due(str(report.remedy), report.remedy is not None)
    for caution in answer.cautions:
        due(f"Caution: {caution}", not caution.startswith(("Not ", "Posture: ")))
        due(caution, True)
    due("With the wearer's own muscles (least effort)", report.contact is not None)
    due("Force of the shoulder on the arm", answer.has_answer)
    if not answer.has_answer:
        return wrong
    head = re.search(rf"Force of the shoulder on the arm: {NUMBER} N(?:, {NUMBER} % of body weight)?", text)
    share, part = answer.percent_body_weight, "limbs" if device.has_limbs else "drives"
    if abs(float(head[1]) - answer.magnitude) > 0.006 * answer.magnitude + 1e-6 or bool(head[2]) != (share is not None):
        wrong.append(f"{head[0]}: {answer.magnitude}, {share}")
    if head[2] and abs(float(head[2]) - share) > 0.006 * share + 1e-6:
        wrong.append(f"{head[0]}: {share}")
    ways = re.search(
        rf"\({NUMBER} N (forward|backward), {NUMBER} N to the (left|right), {NUMBER} N (up|down); ass", text
    )
    for k, (word, sign) in enumerate(zip(ways.groups()[::2], ways.groups()[1::2], strict=True)):
        said, value = float(word) * (1.0 if sign in ("forward", "left", "up") else -1.0), answer.shoulder_force[k]
        if abs(said - value) > max(0.006 * abs(value), 0.05):
            wrong.append(f"{ways[0]}: {answer.shoulder_force}")
    due(f"criterion: {answer.criterion})", True)
    due(f"if the {part} could supply", not answer.held and device.holds_alone)
    due("with what is listed below from the wearer", not answer.held and not device.holds_alone)
    allowed = answer.range()
    due("All forces that these assumptions allow", allowed is not None and not allowed.is_single)
    due(
        "For comparison: at this elevation",
        report.contact is None and np.isfinite(bare_arm_share(answer.case.poses)[1]),
    )
    due("That is a relief of at most", report.reliefs and report.reliefs[0.0] > 0.0)
    due("The device relieves nothing here", report.reliefs and report.reliefs[0.0] <= 0.0)
    due("Tension is positive; a negative one is a push.", device.has_limbs)
    due("mm clear of the wearer", answer.clearance >= 0.0)
    if clear := re.search(rf"{NUMBER} mm clear of the wearer", text):
        wrong += [] if agrees(clear[1], 1e3 * float(answer.clearance)) else [f"{clear[0]}: {answer.clearance}"]
    due(str(report.accuracy), report.accuracy.is_doubtful)
    due(answer.certificate.statement, (answer.certificate.undetermined > 0).any())
    due("Peaks are higher", answer.cuff_text() and answer.cuff_pressure is not None)
    due("This pose is almost singular", answer.equilibrium_status == "near_singular")
    start = next(k for k, line in enumerate(lines) if re.search("length, mm|coordinate", line))
    return wrong + table(report, lines[start + 1 :])


def table(report, lines):
    """Position, range, effort and limits of each drive."""
    answer, wrong = report.answer, []
    poses, units = answer.source.poses, report.device.drive_units
    for i, (name, unit) in enumerate(units):
        limb, shown = report.device.has_limbs, re.split(r"  +", lines[i].strip())
        scale = 180.0 / np.pi if unit == "N m" else 1e3
        theirs = name.startswith("wearer")
        low, high = (float(end[0, i]) for end in (poses.limits.lower, poses.limits.upper))
        numbers = [([float(poses.lengths[0, i])], scale), (report.ranges[i], scale), ([answer.actuator_forces[i]], 1.0)]
        cells = shown[1:] if not theirs else ["", "", *shown[1:]]
        if shown[0] != (name.removeprefix("limb ") if limb else name) or len(cells) != 4:
            wrong.append(f"{lines[i]}: {name}")
            continue
        for cell, (values, factor) in zip(cells, [*numbers, ([low, high], 1.0)], strict=True):
            known = [float(value) for value in values if np.isfinite(value)]
            if theirs and not cell:
                continue
            if cell == "not asked":
                wrong += [f"{cell}: asked"] if poses.limits.asked else []
                continue
            words = re.findall(r"-?\d+(?:\.\d+)?", cell)
            ok = len(words) == len(known) and all(
                abs(float(word) - factor * value) <= max(0.5001, 0.006 * abs(factor * value)) and (
                    abs(factor * value) > 100.0 or len(values) > 1 or factor != 1.0
                    or abs(float(word) - value) <= max(0.0501, 0.006 * abs(value)))
                for word, value in zip(words, known, strict=True)
            )  # fmt: skip
            if not ok or (not known and cell not in ("not known", "no end")):
                wrong.append(f"{lines[i]}: {values}")
            if len(values) == 2 and len(known) == 1 and not cell.startswith("from" if np.isfinite(values[0]) else "?"):
                wrong.append(f"{lines[i]}: {values}")
    return wrong
