"""What options of commands are and state, as stored."""

import contextlib
import io
from dataclasses import fields
from types import SimpleNamespace
from unittest import mock

import pytest
from answers import changes, each_of
from asked_in_turn import in_a_folder, in_turn
from command_line import options_of
from cyclopts.validators import Number
from places import URDF

import exo_pin as ep
from exo_pin.cli import COMMANDS, main
from exo_pin.cli.options import Worn
from exo_pin.cli.options.criteria_options import Judged
from exo_pin.cli.search_commands import Start
from exo_pin.core.errors import MissingExtra

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


class Telling:
    """In place of a scene: what it is asked."""

    messages, url = ("A message.", "It holds"), "http://here"

    def __init__(self):
        self.told = []

    def __call__(self, exo, **looks):
        self.told.append(["Scene", exo.name, looks])
        return self

    def __getattr__(self, name):
        def asked(*given, **more):
            self.told.append([name, *given, *more.items()])
            return {"show": SimpleNamespace(verdict="It holds."), "record": self, "serve": self.url}.get(name)

        return asked


#: Options of ``view``.
LINES = [
    "--scale 40 --limbs muscles --open --port 7777", "--no-human --to 50,10,5 --seconds 0.1",
    "--to 50,10,5 --seconds 0.01 --plot a.html", "--plot a.html", "--plot a.PNG --size 640x480@1.5", "--plot a.png",
    "--person 1.75,75,male", "--person 1.75,75,male --mannequin", "--person 1.75,75,male --no-human", "--scale -1",
]  # fmt: skip


@in_a_folder
def view():
    """What is drawn, moved, opened and written by options; of a person without the extra, too."""

    def ended(_):
        raise KeyboardInterrupt

    def missing(extra):
        raise MissingExtra(extra, "a package")

    def said(line):
        scene, out = Telling(), io.StringIO()
        with contextlib.ExitStack() as stack:
            stack.enter_context(contextlib.redirect_stdout(out))
            stack.enter_context(contextlib.redirect_stderr(out))
            for place, other in (
                ("view_command.Scene", scene), ("view_command.find_browser", scene.find_browser),
                ("view_command.webbrowser.open", scene.open), ("view_command.threading.Event.wait", ended),
                ("options.Worn.muscles", lambda _: "muscles"), ("view_command.require_extra", extra),
            ):  # fmt: skip
                stack.enter_context(mock.patch(f"exo_pin.cli.{place}", other))
            code = main(["view", "four-cables", "--flexion", "30", *line.split()])
        return code, out.getvalue().split("\n"), scene.told

    extra = str
    found = {line: said(line) for line in LINES}
    extra = missing
    return found, said(LINES[6])


def defaults():
    """Names of all options of all commands, with what they are if left out and within which numbers they lie."""

    def told(option):
        own = option.field_info.default
        bounds = [f"{each.gte} to {each.lte}" for each in option.parameter.validator if isinstance(each, Number)]
        left_out = [] if own is option.field_info.empty or option.required else [str(own)]
        return " ".join([*option.names, str(option.parameter.metavar), *bounds, *left_out])

    return {name: [told(option) for option in options_of(name)] for name in COMMANDS}


def start():
    """Designs that a search starts from: one with other limits, new ones, and what has no meaning."""
    someone, nobody = Worn(person="1.75,75,male"), Worn()

    def told(begun, design, side=None, worn=someone):
        device = begun.load(design, side, worn, "mine").device
        return (
            device.name,
            device.side,
            device.arm.centre_of_mass,
            device.dimensions(),
            [each.actuator for each in device.limbs[:1]],
        )

    return in_turn(
        limits=lambda: told(Start(pull=90.0, travel=150.0), "four-cables", "right", nobody),
        preset=lambda: told(Start(), None, None, nobody)[:2],
        family=lambda: told(Start(family="linear", pull=90.0, push=40.0, travel=110.0), None, "right"),
        muscles=lambda: told(Start(family="pneumatic muscle", supply=3.5, force_law="chou-hannaford"), None)[4:],
        no_law=lambda: told(Start(family="pneumatic muscle", supply=3.5), None)[4:],
        limbs=lambda: told(Start(limbs=3), None)[3:],
        other=lambda: told(Start(device="four-cables"), None, "right")[:2],
        alone=lambda: told(Start(limbs=3), None, worn=nobody),
        supply=lambda: told(Start(supply=3.0), "four-cables"),
        law=lambda: told(Start(force_law="none"), None),
        both=lambda: told(Start(limbs=3, force_law="none", device="prototype"), "four-cables"),
    )


ASKED = {each.__name__: each for each in (criteria, socket, view, defaults, start)}


@each_of(ASKED, {"socket"})
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
