"""The first answer to a question about one pose: at most ten lines, and one a limb, each made from fields.

In this order: the verdict, the force in the joint with the device and without it, what the joint carries without
muscles, the limbs, how the device sits on the wearer, what to mind, and what was assumed. The rest is in
:meth:`.PoseReport.explained`.

**Directions.** The head of the humerus is pushed by arm, load and device with -F_s, where F_s is the force of the
shoulder on the arm. With a wearer's muscles the scapula is known, and -F_s is named along the axes of the socket; along
the axes of the body it is named always.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from ..core.tables import NOTES, aligned, newtons, screen_width
from ..core.validation import FloatArray
from ..reaction.holding.verdict import UNSOLVED, describe_axis
from ..wrist.singularities.measures import singularity

if TYPE_CHECKING:
    from .pose_report import PoseReport

#: Columns of a line where it is not known how wide the screen is, and of the words before the numbers.
_WIDTH, _LABEL = 120, 17
#: Columns of what is broken nowhere.
_UNBROKEN = 1_000_000
#: Most lines beside those of the limbs.
_MOST = 10
#: Parts of a force that are smaller than this share of it are left out.
_SMALL = 0.1
#: Ways along the axes of the socket and of the body; the last is that of a left shoulder and of a right one.
_SOCKET = (("out of the socket (distraction)", "into the socket"), ("up", "down"), ("forward", "backward"))
_BODY = (("forward", "backward"), ("to the left", "to the right"), ("up", "down"))
#: Elevation below which the arm hangs, cosine: what pulls the head down then is traction.
_HANGING = float(np.cos(np.radians(15.0)))
#: What the verdict says before the reason.
_HEADS = re.compile(r"^(The device (probably )?can(not)? hold this pose|It is not known whether [^:;]* pose)[:;.]? ?")
#: How much less EMG of the shoulder was measured on wearers of devices, who keep tension, percent; in words.
EMG_FALL = (9, 64)
MEASURED = (
    "Measured on healthy wearers, EMG of the shoulder fell by {} to {} %: 16 to 32 % overhead (16 persons, doi "
    "10.1177/10519815251329325), 33 to 43 % static (14, 10.1109/ACCESS.2020.3014285), up to 25 % with cables "
    "(10, Ding 2023), 9 to 24 % (Lauret 2025), up to 49.6 % (10, arXiv 2411.13770), up to 63.7 % in flexion (10, "
    "arXiv 2602.18212)."
).format(*EMG_FALL)
_MEASURED = "in studies EMG fell by {} to {} %".format(*EMG_FALL)
_MORE = "  More: --explain"


def first_answer(report: PoseReport, width: int | None = None) -> str:
    """The first answer, in lines of at most ``width`` columns (default: of the screen, at most 120)."""
    return "\n".join(_Lines(report, width or screen_width(_WIDTH)).all())


class AnswerParts(NamedTuple):
    """The first answer, for a page that lays it out itself.

    Attributes
    ----------
    verdict, reason : str
        The verdict in a word or two, and why.
    lines : tuple of (str, str)
        Label and text of all that follows, unbroken, but for the drives.
    drives : tuple of tuple of str
        Of each drive its name, what it does, the share of its limit, and its position.
    """

    verdict: str
    reason: str
    lines: tuple[tuple[str, str], ...]
    drives: tuple[tuple[str, str, str, str], ...]


def answer_in_parts(report: PoseReport, moving: bool = False) -> AnswerParts:
    """The first answer in parts; ``moving`` leaves out what takes longer than a picture of a moving arm lasts."""
    made = _Lines(report, _UNBROKEN)
    verdict, reason = made.judged()
    lines = [*made.joint(), *made.worn()]
    if not moving:
        lines = [*made.remedy(), *made.joint(), *made.relief()]
        lines += [*made.alone(), *made.placed()] if report.answer.has_answer else []
        lines += [*made.worn(), *made.minded(), made.assumed().removesuffix(_MORE)]
    pairs: list[tuple[str, str]] = []
    for line in lines:
        label, text = line[:_LABEL].strip(), line[_LABEL:]
        if pairs and not label:
            label, before = pairs.pop()
            text = f"{before}; {text}"
        pairs.append((label, text))
    return AnswerParts(verdict, reason, tuple(pairs), tuple(made.drives()) if report.answer.has_answer else ())


class _Lines:
    """The lines of one report."""

    def __init__(self, report: PoseReport, width: int) -> None:
        self.report, self.width, self.answer, self.contact = report, width, report.answer, report.contact
        self.device: Any = report.device
        #: Most lines of a text, and of the sentence on a better pose.
        self.most = self.most_of_better = 2

    def all(self) -> list[str]:
        """Every line, the verdict first; where they would be more than ten beside the limbs, texts get one each."""
        lines: list[str] = []
        for self.most, self.most_of_better in ((2, 2), (2, 1), (1, 1)):
            lines = self._every()
            if len(lines) - sum(line[:1] == " " and line[1:2] != " " for line in lines) <= _MOST:
                break
        return lines

    def _every(self) -> list[str]:
        lines = [*self._verdict(), *self.joint(), *self.relief()]
        if self.answer.has_answer:
            lines += [*self.alone(), *self._limbs(), *self.placed()]
        return [*lines, *self.worn(), *self.minded(), self.assumed()]

    def _labelled(self, label: str, text: str, most: int = 1) -> list[str]:
        """A text behind a label, in at most so many lines."""
        lines = textwrap.wrap(text, self.width - _LABEL, max_lines=most, placeholder=" …")
        return [f"{name:<{_LABEL}}{line}" for name, line in zip([label, *[""] * most], lines, strict=False)]

    def _verdict(self) -> list[str]:
        word, reason = self.judged()
        head = "   ".join([word, *(text for text in (self.report.pose_in_words, self._who()) if text)])
        lines = textwrap.wrap(head, self.width, max_lines=1, placeholder=" …")
        lines += self._labelled("", reason, self.most) if reason else []
        return [*lines, *self.remedy()]

    def remedy(self) -> list[str]:
        """The nearest pose that can be held, where this one cannot."""
        if self.report.remedy is not None and self.answer.has_answer and not self.answer.unknown:
            near = self.report.remedy.nearest
            found = "No pose within 60° can be held." if near is None else near.sentence(self.device.side)
            found = found if self.most_of_better > 1 else f"{found.rstrip('.').split('. ')[0]}."
            return self._labelled("", found, self.most_of_better)
        return []

    def judged(self) -> tuple[str, str]:
        """The verdict in a word or two, and the reason."""
        word, reason = self._judged()
        if self.answer.equilibrium_status == "near_singular":
            reason = f"Almost singular, so that forces change a lot near it{self._how_near()}. {reason}"
        return word, reason

    def _how_near(self) -> str:
        degrees = self.report.singular_distance
        return f": a singular pose is {degrees:.2g}° away" if np.isfinite(degrees) else ""

    def _judged(self) -> tuple[str, str]:
        answer, limits = self.answer, self.answer.limits
        reason = _HEADS.sub("", answer.verdict)
        if not reason.startswith(tuple(name for name, _ in self.device.drive_units if "_" in name)):
            reason = f"{reason[:1].upper()}{reason[1:]}"
        if str(answer.status) in UNSOLVED:
            return "NOT KNOWN.", reason
        if not answer.has_answer:
            return "NO, it cannot hold.", reason
        if not limits.can_hold and (left := self.report.left_to_wearer):
            moment, others = left
            size = float(np.linalg.norm(moment))
            text = f"{newtons(size)} N m about {describe_axis(moment)}" if size >= 5e-3 else "less than 0.01 N m"
            if not others and not self.device.drives:
                return "IT SUPPORTS, and the wearer holds.", f"It leaves the wearer's muscles {text}."
        if limits.violated:
            return ("PROBABLY NOT." if limits.unknown else "NO, it cannot hold."), reason
        if self._is_cut_off():
            cut = "very way from rest passes a singular pose."
            return "NO WAY TO IT.", f"It would hold here, but e{cut}" if limits.can_hold else f"E{cut}"
        if answer.source.poses.gaps.words:
            return "IT WOULD HOLD, but not as it is worn.", reason
        if limits.can_hold:
            return "YES, it holds.", reason
        if limits.estimated and not limits.missing:
            return "YES, if estimates are right.", reason
        return "NOT KNOWN whether it holds.", reason

    def _is_cut_off(self) -> bool:
        """Whether the singular surface of three limbs lies between the pose and rest."""
        record = self.device.accelerate("singularity")
        if record is None or record.limb_count != 3 or self.answer.source.poses.moved is not None:
            return False
        rest = singularity(record.geometry, Rotation.identity(), record.is_upu).determinant
        return bool(float(rest) * float(self.answer.determinant) < 0.0)

    def _who(self) -> str:
        wearer = self.report.wearer
        if wearer is None:
            return f"{self.device.side} arm"
        words = [f"{'man' if wearer.sex == 'male' else 'woman'}", f"{wearer.height:.4g} m", f"{wearer.mass:.4g} kg"]
        words += [f"{wearer.payload:.3g} kg in the hand"] if wearer.payload else []
        words += [f"elbow {np.degrees(wearer.elbow_flexion):.0f}°"] if wearer.elbow_flexion else []
        return ", ".join([*words, f"{self.device.side} arm"])

    def joint(self) -> list[str]:
        """Force in the joint with the wearer's own muscles."""
        contact = self.contact
        if contact is None or contact.without_device is None:
            return []
        bare = contact.without_device
        parts = []
        if contact.has_result:
            how = "with the device" if contact.held else "with the closest forces it can give"
            parts.append(f"{newtons(float(contact.magnitude))} N {how}")
        if contact.has_result and not contact.has_muscles:
            return self._labelled("In the joint", f"{parts[0]}: {without_muscles()}")
        if bare.has_result:
            parts.append(f"{newtons(float(bare.magnitude))} N without")
        rest = "at rest, " if contact.held and self.answer.case.motion is None else ""
        least = f" ({rest}least effort; people keep more tension)" if parts else ""
        text = f"{', '.join(parts)}{least}"
        lacking = {"with it": contact, "without the device": bare}
        texts = [f"{name} {why(each)}" for name, each in lacking.items() if not each.has_result]
        if len(texts) == len(lacking) and why(contact) == why(bare):
            texts = [why(contact)]
        # A pose with relief has both forces.
        return self._labelled("In the joint", "; ".join([*([text] if text else []), *texts]), self.most)

    def relief(self) -> list[str]:
        """How much the joint is relieved, at most and by those who keep tension."""
        reliefs = dict(self.report.reliefs)
        if not reliefs:
            return []
        most = reliefs.pop(0.0)
        if most <= 0.0:
            text = f"none here: the joint carries {newtons(-most)} % more than without the device"
        elif not reliefs:
            text = f"at most {newtons(most)} %; not known if muscles keep tension; {_MEASURED}"
        else:
            kept = [f"{newtons(value)} %" if np.isfinite(value) else "cannot be" for value in reliefs.values()]
            shares = [f"{100.0 * share:.0f} %" for share in reliefs]
            text = f"at most {newtons(most)} %; with {_pair(shares)} of muscle tension kept {_pair(kept)}; {_MEASURED}"
        return self._labelled("Relief", text)

    def alone(self) -> list[str]:
        """What the joint carries without muscles: -F_s, along the axes of the socket and of the body."""
        push, answer = -self.answer.shoulder_force, self.answer
        size = float(answer.magnitude)
        text = f"{newtons(size)} N"
        if answer.percent_body_weight is not None:
            text += f", {newtons(float(answer.percent_body_weight))} % of body weight,"
        text += " on the head"
        allowed = answer.range()
        span = ""
        if allowed is not None and not allowed.is_single:
            least, most = (float(end) for end in (allowed.least, allowed.greatest))
            span = f"; statics allows {newtons(least)} " + ("N or more" if np.isinf(most) else f"to {newtons(most)} N")
        body = along(push, np.eye(3), _BODY)
        socket = self.report.socket
        whose = "of arm and device"
        ways = body if socket is None else along(push, socket, _SOCKET)
        if socket is not None:
            whose += f"; along the body {body}"
            if self.report.elevation_cosine > _HANGING:
                # What pulls the head of a hanging arm down is a pull along the arm.
                ways = ways.replace(" down", " down (traction)")
        if len(text) + len(ways) + 2 > self.width - _LABEL:
            ways = ways.replace(" (distraction)", "")
        if len(whose) + len(span) > self.width - _LABEL:
            whose = whose.removeprefix("of arm and device; ")
        one = f"{text}, {whose}: {ways}"
        if socket is None and not span and len(one) <= self.width - _LABEL:
            lines = self._labelled("Without muscles", one)
        else:
            lines = [*self._labelled("Without muscles", f"{text}: {ways}"), *self._labelled("", f"{whose}{span}")]
        return lines if socket is not None else [*lines, *self._bare_arm()]

    def _bare_arm(self) -> list[str]:
        """What the joint of a bare arm carries, where the wearer's own muscles are not counted."""
        low, high = self.report.bare_arm_share
        if self.contact is not None:
            return []
        if np.isnan(low):
            return self._labelled("In the joint", "not known without --person, which counts the wearer's own muscles")
        share = f"{low:.0f} to {high:.0f} %" if round(low) != round(high) else f"about {high:.0f} %"
        text = f"{share} of body weight without a device, by the wearer's own muscles; --person counts them"
        return self._labelled("In the joint", text)

    def _limbs(self) -> list[str]:
        rows = self.drives()
        if not rows:
            return []
        return [line[: self.width] for line in aligned([tuple(f" {cell}" for cell in row) for row in rows], words=4)]

    def drives(self) -> list[tuple[str, str, str, str]]:
        """What each drive does, beside its limit and its stroke; nothing of moments that a wearer adds."""
        poses, units = self.answer.source.poses, self.device.drive_units
        bounds, percent, rows = poses.limits, self.report.percent_of_limits, []
        for i, force in enumerate(self.answer.actuator_forces.tolist()):
            name, unit = units[i][0], "" if self.device.has_limbs else units[i][1]
            if name.startswith("wearer"):
                continue
            does = f"{newtons(force)} {unit}" if unit else _pull(force)
            share = "limits not asked"
            if bounds.asked:
                share = _share(force, float(bounds.lower[0, i]), float(bounds.upper[0, i]), unit, percent[i])
            scale, mark = (180.0 / np.pi, "°") if unit == "N m" else (1e3, " mm")
            low, high = (scale * float(end) for end in self.report.ranges[i])
            rows.append(
                (name, does, share, f"{np.round(scale * poses.lengths[0, i]) + 0.0:.0f}{mark}{_ends(low, high)}")
            )
        return rows

    def placed(self) -> list[str]:
        """What an error of the drives does, where they alone do not place the arm."""
        seen = self.report.accuracy
        return self._labelled("Placed", f"{seen.sensitivity()}.", self.most) if seen.is_doubtful else []

    def worn(self) -> list[str]:
        """How the device sits on the wearer."""
        answer, texts = self.answer, []
        if answer.clearance >= 0.0 and np.isfinite(answer.clearance):
            texts.append(f"{1e3 * float(answer.clearance):.0f} mm clear all round")
        if answer.is_worn and np.isfinite(answer.cuff_pull):
            pull = float(answer.cuff_pull)
            way = "" if abs(pull) < 0.05 else f" to the {'shoulder' if pull < 0.0 else 'hand'}"
            texts.append(f"cuff pulls {newtons(abs(pull))} N{way}")
            if answer.cuff_pressure is not None:
                texts[-1] += f", presses {newtons(1e-3 * float(answer.cuff_pressure))} kPa"
        return self._labelled("Device", "; ".join([textwrap.shorten(self.device.name, 40, placeholder="…"), *texts]))

    def minded(self) -> list[str]:
        """What to mind and what was not checked, in one line."""
        told = self.answer.cautions
        own = [text for text in told if not text.startswith(NOTES)]
        posture, unchecked = ([text for text in told if text.startswith(note)] for note in ("Posture: ", "Not checked"))
        text = " ".join([*posture, *own, *unchecked])
        return self._labelled("Mind", plain(text)) if text else []

    def assumed(self) -> str:
        answer = self.answer
        split = answer.source.split.assumed(answer.source.poses.mechanism)
        if self.device.has_limbs and self.device.limbs_are_massless:
            split = f"massless {split}" if split.startswith("limbs") else f"massless limbs; {split}"
        texts = [split]
        if not answer.criterion.startswith("none needed"):
            texts.append(answer.criterion.removesuffix(", within the limits of the limbs"))
        text = textwrap.shorten(plain("; ".join(texts)), self.width - _LABEL - len(_MORE) - 1, placeholder=" …")
        return f"{'Assumed':<{_LABEL}}{text}.{_MORE}"


def along(force: FloatArray, axes: FloatArray, ways: tuple[tuple[str, str], ...]) -> str:
    """A force in words along axes, shape (3, 3), rows; parts below a tenth of it are left out.

    Parameters
    ----------
    force : ndarray
        Shape (3,), N.
    axes : ndarray
        Unit vectors.
    ways : tuple of (str, str)
        What each axis is called along it and against it.
    """
    parts = axes @ force
    shown = np.abs(parts) >= _SMALL * np.linalg.norm(force)
    words = [
        f"{newtons(abs(float(part)))} {way[int(part < 0.0)]}"
        for part, way, show in zip(parts, ways, shown, strict=True)
        if show and part
    ]
    return ", ".join(words) or "nothing"


def _pair(words: list[str]) -> str:
    """Words with all but the first in brackets: "80 % (47 %)"."""
    first, *others = words
    return first + "".join(f" ({word})" for word in others)


def plain(text: str) -> str:
    """A text without the symbols that are explained elsewhere."""
    return re.sub(r" ?\((g = 0|worn_by, --person|least_tension|\[roles\] cuff|constraint_bounds does)\)", "", text)


def relief_words(reliefs: Mapping[float, float]) -> str:
    """Reliefs of :attr:`PoseReport.reliefs` in sentences: at most, and of wearers who keep tension."""
    most, others = reliefs[0.0], {share: value for share, value in reliefs.items() if share}
    if most <= 0.0:
        return f"The device relieves nothing here: the joint carries {newtons(-most)} % more than without it."
    text = f"That is a relief of at most {newtons(most)} %: people keep more tension than the least effort."
    for share, value in others.items():
        who = f"muscles that keep {100.0 * share:.0f} % of their activation while the device carries the rest"
        if np.isfinite(value):
            text += f" With {who} it is {newtons(value)} %."
        else:
            text += f" There is no answer with {who}: device, strength and socket do not allow it."
    return text if others else f"{text} The device cannot carry a share of all moments, to leave them the rest."


def words_of_angles(angles: Sequence[float]) -> str:
    """Clinical angles, degrees, without those that are zero: "flexion 60°, abduction 30°"."""
    names = ("flexion", "abduction", "internal rotation")
    shown = [f"{name} {value:.4g}°" for name, value in zip(names, angles, strict=True) if abs(value) >= 0.05]
    return ", ".join(shown) or "arm hanging"


def _pull(force: float) -> str:
    """What a limb does: pulls where its force is a tension."""
    size = newtons(abs(force))
    return "slack" if size == "0" else f"{'pulls' if force > 0.0 else 'pushes'} {size} N"


def _share(force: float, low: float, high: float, unit: str, percent: float) -> str:
    """A force in percent of the limit on its side; ``unit`` is empty of a limb."""
    if np.isfinite(percent):
        return f"{newtons(percent)} % of its limit"
    limit = high if force > 0.0 else -low
    if not np.isfinite(limit):
        return "limit not known"
    if newtons(abs(force)) == "0":
        return "0 % of its limit"
    return "cannot act this way" if unit else f"cannot {'pull' if force > 0.0 else 'push'}"


def _ends(low: float, high: float) -> str:
    """Two ends of a range behind a value."""
    if not np.isfinite(low) and not np.isfinite(high):
        return ""
    if not np.isfinite(high):
        return f", at least {low:.0f}"
    return (
        f" of {np.round(low) + 0.0:.0f} to {np.round(high) + 0.0:.0f}" if np.isfinite(low) else f", at most {high:.0f}"
    )


def why(contact: Any) -> str:
    """Why a joint force is not known, as a clause."""
    from ..person.contact.result import NO_RESULT  # here: few answers need it

    text = NO_RESULT[str(contact.status)].rstrip(".")
    return f"not known: {text[:1].lower()}{text[1:]}"


def without_muscles() -> str:
    """What holds the joint of a wearer whose muscles have no force, as a clause."""
    from ..person.contact.result import WITHOUT_MUSCLES  # here: few answers need it

    return WITHOUT_MUSCLES
