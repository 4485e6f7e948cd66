"""What options of commands are and state, and what commands with odd values of them answer, as stored."""

import contextlib
import functools
import io
import shlex
from dataclasses import asdict, fields, is_dataclass
from types import SimpleNamespace
from unittest import mock

import pytest
from answers import changes, each_of
from asked_commands import MAN, POSE, QUICK, WOMAN, answered_in_turn
from asked_in_turn import in_a_folder, in_turn
from command_line import options_of
from cyclopts.validators import Number
from places import URDF

import exo_pin as ep
from exo_pin.cli import COMMANDS as ALL_COMMANDS
from exo_pin.cli import main
from exo_pin.cli.command import command, writes
from exo_pin.cli.options import Worn
from exo_pin.cli.options.criteria_options import Judged
from exo_pin.cli.search_commands import Start
from exo_pin.core.errors import MissingExtra

#: Options of what a pose has to meet.
ALL = (
    "--criteria forces,stroke --fits 1.6,55,female --elbow-range 10,95 --gap 7 --obstacle chair --obstacle wall:60 "
    "--shoulder-force 90 --least-tension 3 --least-moment 0.4 --cuff-pull 80 --cuff-slip 9 --above-elbow 25 "
    '--without-limb 0 --least-rate 0.7 --no-twins --least-margin 0.11 --stroke-rule "not all short"'
)


def judged_by(line):
    """Options of a line of words, as the command has them."""
    _, bound, _ = command("workspace").parse_args(shlex.split(line), print_error=False, exit_on_error=False)
    return next(each for each in bound.arguments.values() if isinstance(each, Judged))


def criteria():
    """Criteria of a design of lengths, of one of hinges, and of one without a wearer."""
    made = {
        "worn": (judged_by(ALL), ep.load("four-cables").worn_by(ep.Wearer(1.75, 75, "male", clothing=0.004))),
        "hinges": (judged_by(ALL), ep.load(URDF / "serial-y-x-z.urdf")),
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
    found = judged_by("--pull-out 60").of(ep.load("four-cables").worn_by(ep.Wearer(1.75, 75, "male")))
    return found.largest_pull_out, found.socket


#: Options of pages and services.
PAGES = [
    "app four-cables --person 1.6,45,female,300 --elbow-flexion 40 --clothing 4 --strength 30 --flexion 60",
    "app prototype --side right --payload 1.5 --port 7200 --open", "app",
    "serve --host 0.0.0.0 --port 1 --name a --name b --workers 2 --waiting 3 --seconds 4 --body 5 --memory 6 --live 7 "
    "--udp 8", "serve",
    "report urdf/prototype.urdf --arm-speed 12", "report four-cables --person 1.6,45,female",
]  # fmt: skip


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


def pages():
    """What pages and services are asked with by options: persons, ports, and the file of a design."""
    found = {}

    def told(*given):
        plain = [asdict(each) if is_dataclass(each) else getattr(each, "name", each) for each in given]
        found[line] += [each for each in plain if not callable(each)]
        raise KeyboardInterrupt if "report" not in line else ep.SolverFailed("report", 0.0, "none")

    with contextlib.ExitStack() as stack:
        for place, other in (
            ("cli.pages.app_command.serve_app", told), ("cli.pages.app_command.require_extra", str),
            ("cli.pages.serve_command.served", told), ("cli.pages.serve_command.require_extra", str),
            ("cli.pages.report_command.require_extra", str), ("ShoulderExo.report", told),
        ):  # fmt: skip
            stack.enter_context(mock.patch(f"exo_pin.{place}", other))
        stack.enter_context(contextlib.chdir(URDF.parent))
        stack.enter_context(mock.patch.dict("os.environ", EXO_PIN_TOKEN="a token of 24 characters"))
        for line in PAGES:
            found[line] = []
            found[line].append(main(line.split()))
    return found


def files_of_commands():
    """Options that a command gets for its files."""

    def told(*endings, **more):
        own = writes(*endings, **more)(lambda *, files: files).__kwdefaults__["files"]
        return {each.name: each.type.__metadata__[0].help for each in fields(own)}

    return told(".toml"), told(".csv", ".json", json=False, plot="all", also=(".html",))


def defaults():
    """Names of all options of all commands, with what they are if left out and within which numbers they lie."""

    def told(option):
        own = option.field_info.default
        bounds = [f"{each.gte} to {each.lte}" for each in option.parameter.validator if isinstance(each, Number)]
        left_out = [] if own is option.field_info.empty or option.required else [str(own)]
        return " ".join([*option.names, str(option.parameter.metavar), *bounds, *left_out])

    return {name: [told(option) for option in options_of(name)] for name in ALL_COMMANDS}


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


WORN = "four-linear-actuators-worn"
#: New designs: the search ends after its first designs.
NEW = f"{WOMAN} --budget 12 --run-length 12 --step 60 --refine --no-twins"

COMMANDS = {
    "judged": [
        f"workspace {WORN} --step 60 {MAN} --no-muscles --json {options}"
        for options in (
            "--criteria forces,shoulder_force,stroke --shoulder-force 66 --least-tension 3 --stroke-rule each",
            "--fits 1.6,55,female --fits 1.9,100,male --clothing 6",
            "--elbow-range 10,95",
            "--offset 6 -9 4",
            "--moving-centre",
            "--cuff-slip 12",
            "--obstacle ceiling:700",
        )
    ]
    + [
        "workspace urdf/nesm.urdf --step 60 --least-rate 0.5 --json",
        'workspace appendix-d --step 60 --stroke-rule "not all short" --json',
        "workspace four-cables --elbow-range 9",
    ],
    "fitted": [
        "muscle step --weight-N 10 --to-bar 3.6 --mark --duration-s 0.15 --out response.csv",
        "muscle identify --response response.csv 10 --name mine --out moving.toml",
        "muscle step --model moving.toml --mass-kg 1.2 --to-bar 3 --from-bar 0.5 --lag-s 0.15 --mark --duration-s 1",
        "muscle identify examples/muscle.csv --length-mm 300 --diameter-mm 21 --all --name still --out still.toml",
        "muscle force --model still.toml --contraction-mm 10 40 --pressure-bar 1 2.5 --mark",
        "muscle loop --model still.toml --to-percent 8 --mass-kg 0.8 --length-mm 280 --duration-s 1",
        "muscle pressure --force-N 40 --contraction-mm 12 --model still.toml --length-mm 260 --mark",
        "calibrate three-linear-actuators examples/measured.csv --unknowns length_offsets,torso_mounting "
        "--length-noise 0.4 --tolerance base_points=1.5 --tolerance length_scale=0.3 --tolerance arm_mounting=2",
    ],
    "driven": [
        f"track {options} --trajectory quick.csv --no-progress --json"
        for options in (
            "prototype --supply 5 --lost-imu 0.1,0.3 --controller pi",
            "prototype --fault stuck-shut,all,0.2",
            "four-cables --play 2 --controller pi",
            "four-cables --fault no-current,2,0.1 --side right",
            f"four-cables --lost-beyond 6 --lower-in 2 --controller model {WOMAN}",
        )
    ]
    + ["thesis --section 5.1.2 --reasons --json", "thesis --section 2 --all --out rows.csv"],
    "moving": [
        "reaction prototype --to 90,0,0 --poses 4 --require-hold",
        "reaction four-cables --to 40,20,5 --require-hold",
        "reaction prototype --flexion 30 --to 30,0,0 --poses 2 --split minimal --side-force-limit actuator",
        f"reaction {WORN} {POSE} {MAN} --muscles --strength 60 --table --offset 5 -3 8",
        f"reaction {WORN} {POSE} {WOMAN} --strength 0 --json",
        "reaction four-cables --trajectory quick.csv --sensor-noise 2",
        f"person {WORN} {MAN} --trajectory quick.csv --static --share 60 --json",
        f"person {WORN} {WOMAN} --map --step 60 --least effort --out map.csv",
        f"person four-linear-actuators-worn {MAN} {POSE} --moving-centre --side-force-limit 25 --json",
        "tasks four-cables --movement swing=quick.csv --step 30 --least-moment 1.5 --json",
        "tasks four-cables --movement swing=quick.csv --no-ranges --json",
        "mobility urdf/nesm.urdf --flexion 35",
        "tasks four-cables --day --no-ranges",
        f"forces urdf/serial-y-x-z.urdf {POSE} --side right",
        "forces urdf/prototype.urdf --external arm=3,0,-20,1,0,0.5 --external arm=0,4,0 "
        "--actuated limb_1_slide,limb_2_slide,limb_3_slide --joint limb_1_base --joint limb_2_base",
    ],
    "viewed": [
        "view prototype --no-human --scale 250 --flexion 35 --plot a.html",
        f"view four-cables --side right {POSE} --plot b.html",
        f"view prototype --limbs muscles {POSE} --plot d.html",
        "view urdf/dummy-shoulder.urdf --set shoulder_x=20deg --plot e.html",
        f"view {WORN} {WOMAN} --mannequin --plot f.html",
        "view urdf/dummy-shoulder.urdf --scale 9 --plot g.html",
        "view prototype --set shoulder_x=2deg --plot h.html",
        "track four-cables --trajectory quick.csv --no-progress --plot i.html",
        f"view urdf/nesm.urdf {POSE} --plot k.html",
    ],
    "starts": [
        f"optimise {options} {NEW}"
        for options in (
            "--limbs 3 --family 'pneumatic muscle' --force-law best --supply 3.5 --side right --out found.toml",
            "--limbs 4 --family linear --pull 300 --push 150 --travel 210 --device geometry --base-radius 130:240",
            "--family cable --arm-radius 60:120 --drop 90:250 --device prototype",
        )
    ]
    + [
        f"optimise four-cables --pull 250 --travel 300 {NEW} --objective index --objective peak_shoulder_force "
        "--out front.toml --json",
        f"optimise {WORN} --vary cuff_height_mm=60:110 --moving-centre --fixed-centre {NEW}",
    ],
}
COMMANDS |= {
    "odd": [
        f"reaction four-cables {WOMAN} --abduction 100 --to 90,130,5 --poses 3 --offset 5 0 -4 --out way.csv",
        f"reaction prototype {POSE} --compare spherical,minimal,spherical --side-force-limit 4 --limits none",
        "reaction four-cables --compare --offset 5 0 -4 --flexion 50 --json",
        f"uncertainty four-cables {POSE} --offset 5 0 -4 --split minimal --limits none --uncertain offset_mm=0 "
        "--uncertain mass_percent=5 --side right",
        "uncertainty four-cables --trajectory quick.csv --uncertain pose_deg=1 --uncertain offset_mm=0",
        f"uncertainty four-cables {POSE} --all 8 --offset 1 0 0",
        "uncertainty four-cables --all 8 --trajectory quick.csv",
        f"uncertainty four-cables {POSE} --all 8 --split minimal --limits none --uncertain A_mm=4",
        "mobility urdf/dummy-shoulder.urdf --set shoulder_x=200deg",
        "record quick.csv --out quick.mot", "record quick.csv --angles quaternions --side right --out turned.csv",
        f"track prototype {WOMAN} --trajectory quick.csv --no-progress --json",
        "track four-cables --trajectory flexion --start 1,2,3", "track --experiment abduction --side right",
        "track --experiment abduction --start 1,2,3", "forces urdf/nesm.urdf --flexion 30 --actuated flexion",
        "compare four-cables designs.csv --step 60 --limits none --split minimal --side right",
        "compare four-cables designs.csv --trajectory quick.csv --to 90,0,0",
        "sweep four-cables --vary scale=0.9,1 --trajectory quick.csv --limits none --split minimal --side right",
        f"person four-cables --map --range {WOMAN}", f"person four-cables --map {POSE}",
        "reaction four-cables --compare --flexion 20 --abduction 110 --out rows.csv", "person --bare --moving-centre",
        "person four-cables --abduction 100 --limits none --strength 70 --side right --out contact.csv",
        "person four-cables --trajectory quick.csv", "singularity prototype --abduction 110 --flexion 20 --side right",
        "check four-cables --side right --json",
    ],
}  # fmt: skip
DESIGNS = "design,name,scale\nfour-cables,small,0.8\nfour-cables,,1.1\n"
LINES_OF = {
    name: functools.partial(answered_in_turn, lines, quick_csv=QUICK, designs_csv=DESIGNS)
    for name, lines in COMMANDS.items()
}
ASKED = {each.__name__: each for each in (criteria, socket, view, pages, files_of_commands, defaults, start)} | LINES_OF


@each_of(ASKED, {"socket", *LINES_OF})
def test_an_answer_is_as_stored(name):
    if name == "starts":
        pytest.importorskip("optuna", reason="needs the extra optimise")
    if name in LINES_OF:
        pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")
    assert not changes(__file__, name, ASKED[name])
