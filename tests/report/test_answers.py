"""Answers of design reports of all kinds: their fields and their words, as stored."""

import re
from dataclasses import fields, replace
from pathlib import Path
from unittest import mock

import fpdf
import matplotlib as mpl
import numpy as np
import pytest
from answers import changes, each_of
from asked_in_turn import in_a_folder, refused
from places import URDF

import exo_pin as ep
from exo_pin.report.hazards import hazards_of

MAN = ep.Wearer(1.755, 85, "male", elbow_flexion=0.6, payload=0.5)


def load(name):
    return ep.load(URDF / f"{name}.urdf" if (URDF / f"{name}.urdf").exists() else name)


def told(report):
    """Fields and words, but for versions, hashes and the picture."""
    left_out = ("picture", "design_hash", "file_hash")
    words = str(report).rsplit("\n\n", 1)[0]
    return words, {each.name: getattr(report, each.name) for each in fields(report) if each.name not in left_out}


@in_a_folder
def pages():
    """What a browser shows, but for the picture and the last line."""
    path = Path("report.html")
    woman = ep.Wearer(1.6, 55, "female", elbow_flexion=0.9, payload=1.3)
    load("four-cables").report(woman, 45.0, URDF / "prototype.urdf").save(path)
    text = re.sub(r"base64,[A-Za-z0-9+/=]+", "", path.read_text(encoding="utf-8"))
    return re.sub(r"exo_pin [\d.]+.*", "", text)


@in_a_folder
def laid_out():
    """Where on the pages every text and picture begins, in what size and face, and how wide and high it is."""
    found = []

    def noted(name):
        method = getattr(fpdf.FPDF, name)

        def call(self, *places, **more):
            sizes = [each for each in (*places, *more.values()) if type(each) in (int, float)]
            looks = f"{self.font_style} {more.get('align', '')} {[*map(round, self.fill_color.colors255)]}"
            here = [name, [self.page, self.get_x(), self.get_y(), self.font_size_pt, *sizes], looks]
            found.extend([here] * (here not in found))
            return method(self, *places, **more)

        return call

    exo = load("four-linear-actuators-worn").worn_by(MAN)
    names = ("add_page", "cell", "image", "multi_cell")
    # Pictures are of pixels, whatever the user's own are.
    pixels = mpl.rc_context({"savefig.format": "svg"})
    with pixels, mock.patch.multiple(fpdf.FPDF, **{name: noted(name) for name in names}):
        report = exo.report(ep.Wearer(1.6, 55, "female"), 45.0)
        report.save("report.pdf")
        text, size = Path("report.pdf").read_text("latin-1"), np.frombuffer(report.picture[16:24], ">u4")
        written = [*found, [*size], re.findall(r"/(?:Title|Creator) [^\d\n]*", text)]
        # In no size of print it has room.
        replace(report, assumed=("No friction. " * 200,) * 40).save("long.pdf")
    # Drives that do not move the arm, and of which no use is known.
    unused = tuple(replace(each, used_from=np.nan, used_to=np.nan) for each in report.drives)
    other = replace(report, weakest_rate=0.0, drives=unused)
    changed = [line for line in str(other).splitlines() if line not in str(report).splitlines()]
    changed += [each.computed for each in hazards_of(other) if each not in report.hazards]
    return written, sorted({size for _, (_, _, _, size, *_), _ in found}), changed


def refusals():
    exo = load("four-cables")
    return refused(
        lambda: exo.report(arm_speed=0.0),
        lambda: exo.replace(arm=None).report(),
        lambda: exo.report("a man"),
    )


def of_a_person():
    pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")
    return told(load("four-linear-actuators-worn").report(MAN, 40.0, URDF / "prototype.urdf"))


def of_a_support():
    pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")
    return told(load("spring-support").mirrored().report(ep.Wearer(1.6, 55, "female")))


ASKED = {
    "of_a_person": of_a_person,
    "of_a_support": of_a_support,
    "of_nobody": lambda: told(load("prototype").report()),
    "of_hinges": lambda: told(load("serial-y-x-z").replace(arm=ep.Arm(3.1, [0.0, 0.01, -0.2])).report()),
    "of_singular_poses": lambda: told(load("scenario-one").worn_by(MAN).report()),
    "of_unknown_limits": lambda: told(load("appendix-d").report()),
    "refusals": refusals,
    "pages": pages,
    "laid_out": laid_out,
}


@pytest.mark.full
@each_of(ASKED)
def test_an_answer_is_as_stored(name):
    if name in ("pages", "laid_out"):
        pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")
    assert not changes(__file__, name, ASKED[name])
