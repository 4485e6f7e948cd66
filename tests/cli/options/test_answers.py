"""Criteria that options of commands state, with units and persons, as stored."""

from dataclasses import fields

import pytest
from answers import changes, each_of
from asked_in_turn import in_turn
from places import URDF

import exo_pin as ep
from exo_pin.cli.options.criteria_options import Judged

ALL = Judged(
    criteria="forces, stroke", fits=("1.6,55,female",), elbow_range="10,95", gap=7.0, obstacle=("chair",),
    shoulder_force=90.0, least_tension=3.0, least_moment=0.4, cuff_pull=80.0, cuff_slip=9.0, above_elbow=25.0,
    without_limb=0.0, rate=0.7, no_twins=True, least_margin=0.11, stroke_rule="not all short",
)  # fmt: skip


def criteria():
    """Criteria of a design of lengths, of one of hinges, and of one without a wearer."""
    made = {
        "worn": (ALL, ep.load("four-cables").worn_by(ep.Wearer(1.75, 75, "male", clothing=0.004))),
        "hinges": (ALL, ep.load(URDF / "serial-y-x-z.urdf")),
        "alone": (Judged(fits=("1.6,55,female",)), ep.load("prototype")),
        "left out": (Judged(), ep.load("four-cables").worn_by(ep.Wearer(1.75, 75, "male"))),
    }
    found = {name: judged.of(exo) for name, (judged, exo) in made.items()}
    told = {name: {each.name: getattr(own, each.name) for each in fields(own)} for name, own in found.items()}
    wrong = {"elbow_range": "10", "pull_out": 60.0, "fits": ("tall",)}
    refused = in_turn({name: lambda name=name: Judged(**{name: wrong[name]}).of(made["alone"][1]) for name in wrong})
    return told, refused


def socket():
    """The socket of who wears the design, with what may pull out of it."""
    pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")
    found = Judged(pull_out=60.0).of(ep.load("four-cables").worn_by(ep.Wearer(1.75, 75, "male")))
    return found.largest_pull_out, found.socket


ASKED = {each.__name__: each for each in (criteria, socket)}


@each_of(ASKED, {"socket"})
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
