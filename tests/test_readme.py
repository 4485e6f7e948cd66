"""What README.md and the pages of the site show is what the code prints."""

import contextlib
import io
import re
import runpy
import shlex
import shutil
from pathlib import Path

import numpy as np
import pinocchio
import pytest
import ten_questions
from places import PAGES, REPOSITORY, SCRIPTS, URDF
from places import page as site_page

import exo_pin as ep
from exo_pin.cli import main
from exo_pin.core.files.toml_tables import UNITS
from exo_pin.core.tables import aligned
from exo_pin.design.io.mechanism_reading import _KEYS
from exo_pin.thesis.all_rows import printed_index, summary

#: Pages whose code blocks have no test of their own.
OTHERS = (
    "compiling", "devices", "elastic", "limits", "many_machines", "movement", "muscles", "recordings", "start",
    "uncertainty", "view", "wearer", "workspace",
)  # fmt: skip


#: An output that a page shows.
OUTPUT = r"<!-- output: \w+ -->\n```\w*\n(.*?)\n```"


README = (REPOSITORY / "README.md").read_text(encoding="utf-8")


def block(mark):
    """The fenced block under a comment."""
    found = re.search(rf"<!-- {re.escape(mark)} -->\n```\w*\n(.*?)\n```", README, re.DOTALL)
    assert found, f"README.md has no block {mark}"
    return found[1]


def numbers_aside(text):
    """The text line by line without its numbers and the width of its gaps, and the numbers."""
    pattern = r"-?\d+\.?\d*(?:e[+-]?\d+)?"
    return re.sub(r"[ \t]+", " ", re.sub(pattern, "#", text)), [float(n) for n in re.findall(pattern, text)]


def assert_same(shown, printed):
    words, values = numbers_aside(shown)
    expected_words, expected = numbers_aside(printed)
    assert words == expected_words
    # The last digit shown may round the other way on another processor.
    assert values == pytest.approx(expected, abs=0.011)


def test_first_command(capsys):
    command = block("command: ask").split("&&")[1]
    assert main(shlex.split(command)[1:]) == 0
    assert_same(block("output: ask"), capsys.readouterr().out.rstrip())


def test_code_and_its_output():
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(block("code: quickstart"), {})
    assert_same(block("output: quickstart"), printed.getvalue().rstrip())


def run_code_of(page, monkeypatch, folder, names=None):
    """The names that the Python blocks of a page leave behind, with those that it begins with."""
    text = site_page(page)
    monkeypatch.chdir(folder)
    names = {} if names is None else names
    for code in re.findall(r"```python\n(.*?)```", text, re.DOTALL):
        exec(code, names)
    return names


def test_example_of_a_design_is_what_the_page_says(monkeypatch, capsys, tmp_path):
    page = site_page("own_design")
    (tmp_path / "mine.toml").write_text(re.search(r"<!-- file: mine.toml -->\n```toml\n(.*?)```", page, re.DOTALL)[1])
    run_code_of("own_design", monkeypatch, tmp_path)
    shown = re.search(r"<!-- output: flexion -->\n```text\n(.*?)\n```", page, re.DOTALL)[1]
    assert_same(shown, capsys.readouterr().out.rstrip())


def test_every_key_of_a_design_is_on_its_page(monkeypatch):
    monkeypatch.syspath_prepend(SCRIPTS)
    keys = runpy.run_path(str(SCRIPTS / "reference_pages.py"))["design_keys"]()
    words = set(re.findall(r"[a-zA-Z_0-9]+", keys))
    for record, keys in _KEYS.items():
        for key in keys:
            units = [""] if isinstance(key.kind, type) or key.kind in ("text", "law") else UNITS[key.kind]
            assert words >= {key.name + unit for unit in units}, f"{record.__name__}: {key.name}"


def test_code_on_dynamics_runs(monkeypatch, capsys):
    names = run_code_of("dynamics", monkeypatch, Path(__file__).parents[1])
    assert "undetermined" in capsys.readouterr().out
    assert np.isfinite(names["motion"].a).all()


def test_code_on_other_programs_runs(monkeypatch, capsys, tmp_path):
    names = run_code_of("hand_off", monkeypatch, tmp_path)
    assert "18 coordinates, 18 rows of loops" in capsys.readouterr().out
    assert np.isfinite(names["motion"].a).all()
    again = ep.ClosedChain.from_mjcf(tmp_path / "prototype.xml")
    assert len(again.closures) == 3


def test_the_page_on_the_two_forces_shows_what_is_printed(monkeypatch, capsys, tmp_path):
    pytest.importorskip("myo_sim", reason="needs the extra person")
    page = site_page("which_number")
    shown = dict(re.findall(r"<!-- output: (\w+) -->\n```text\n(.*?)\n```", page, re.DOTALL))
    command = re.search(r"```bash\n(exo-pin .*?)\n```", page)[1]
    assert main(shlex.split(command)[1:]) == 0
    assert_same(shown["first"], capsys.readouterr().out.rstrip())
    run_code_of("which_number", monkeypatch, tmp_path)
    assert_same(shown["relief"], capsys.readouterr().out.rstrip())


@pytest.mark.full
def test_the_page_on_reports_shows_what_is_printed(monkeypatch, capsys, tmp_path):
    run_code_of("report", monkeypatch, tmp_path)
    assert_same(re.search(OUTPUT, site_page("report"), re.DOTALL)[1], capsys.readouterr().out.rstrip())
    assert (tmp_path / "report.html").is_file()


@pytest.mark.parametrize(
    "each",
    [
        pytest.param(each, marks=pytest.mark.full if " reaction " in each.command else pytest.mark.long)
        for each in ten_questions.QUESTIONS
    ],
    ids=lambda each: each.question,
)
def test_ten_questions_are_answered_as_their_page_says(each):
    page = site_page("clinicians")
    part = page[page.index(f"## {each.question}\n") :].partition("\n## ")[0]
    assert f"```bash\n{each.command}\n```" in part
    assert_same(re.search(OUTPUT, part, re.DOTALL)[1], ten_questions.answer_of(each))
    assert " ".join(each.reading.split()) in " ".join(part.split())


def test_code_on_trajectories_runs(monkeypatch, capsys, tmp_path):
    names = run_code_of("trajectories", monkeypatch, tmp_path)
    assert "[45.  0.  0.] [0.31415927 0.         0.        ]" in capsys.readouterr().out
    assert len(names["answer"].movement.times) == 151


def test_code_on_calibration_runs(monkeypatch, capsys, tmp_path):
    names = run_code_of("calibration", monkeypatch, tmp_path)
    page = site_page("calibration")
    shown = re.search(r"<!-- output: calibration -->\n```\n(.*?)\n```", page, re.DOTALL)[1]
    assert_same(shown, capsys.readouterr().out.rstrip())
    assert np.isfinite(names["found"].covariance).all()


def test_code_on_closed_chains_runs(monkeypatch, capsys, tmp_path):
    names = run_code_of("robot_with_loops", monkeypatch, tmp_path)
    chain, q = names["chain"], names["q"]
    assert "redundant rows       1: pin (1)" in capsys.readouterr().out
    # The plane's own view: virtual work of the weights along the one motion is that of the holding torque.
    free = chain.mobility(q)
    assert free.degrees_of_freedom == 1
    step = 1e-6
    heights = []
    for turn in (-step, step):
        moved = q.copy()
        moved[chain.configuration_slice("crank_hinge")] += turn
        moved = chain.close(moved, hold=["crank_hinge"])
        heights.append(names["pin"].computePotentialEnergy(chain.model, chain.model.createData(), moved))
    torque = (heights[1] - heights[0]) / (2 * step)
    assert names["rest"].effort("crank_hinge")[0] == pytest.approx(torque, rel=1e-6)
    assert np.abs(names["plain"] - chain.forward_dynamics(q).a).max() < 1e-9
    np.testing.assert_allclose(names["state"].qacc, names["plain"], rtol=2e-3, atol=1e-3 * np.abs(names["plain"]).max())
    assert np.ptp(names["run"].energy) < 1e-8
    # The target is beyond the end of the rocker, 0.2 m about (0.3, 0, 0): the pin and the target share what is missing.
    with pytest.raises(ep.LoopNotClosed) as caught:
        chain.inverse_kinematics("coupler_end", names["point"], q, part="position")
    ends = [chain.placement(caught.value.q, end).translation for end in ("rocker_end", "coupler_end")]
    gaps = [np.linalg.norm(ends[1] - each) for each in (ends[0], names["point"].translation)]
    assert gaps == pytest.approx([0.5 * (0.2 - np.hypot(0.1, 0.15))] * 2, rel=1e-3)
    # What the page says of drift, the sign of λ and Pinocchio's readers.
    assert 0.07 < np.abs(chain.residual(names["loose"])).max() < 0.09
    assert max(np.abs(chain.residual(each)).max() for each in names["kept"].q) < 2e-12
    assert np.abs(names["weight"] - np.cross(names["lever"], names["pin_force"]))[1] < 1e-12
    assert (len(names["own"]), len(names["lost"])) == (1, 0)


def test_code_on_the_plant_runs(monkeypatch, capsys, tmp_path):
    (tmp_path / "urdf").symlink_to(URDF)
    names = run_code_of("plant", monkeypatch, tmp_path)
    assert "polytropic_exponent = 1" in capsys.readouterr().out
    assert names["run"].status == names["fallen"].status == "completed"
    falls = ep.shoulder_angles(names["fallen"].rotations, degrees=True)[:, 1]
    assert falls[0] > 40.0 > 20.0 > falls[-1]


@pytest.mark.parametrize("page", ["equilibrium", "frames", "positioning", "singularity"])
def test_code_of_short_pages_prints_what_they_show(monkeypatch, capsys, tmp_path, page):
    run_code_of(page, monkeypatch, tmp_path)
    assert_same("\n".join(re.findall(OUTPUT, site_page(page), re.DOTALL)), capsys.readouterr().out.rstrip())


def test_torques_of_the_delta_are_those_of_virtual_work(monkeypatch, capsys, tmp_path):
    names = run_code_of("robot_torques", monkeypatch, tmp_path)
    shown = "\n".join(re.findall(OUTPUT, site_page("robot_torques"), re.DOTALL))
    assert_same(shown, capsys.readouterr().out.rstrip())
    chain, q, heights = names["chain"], names["q"], []
    for step in (-1e-5, 1e-5):
        moved = q.copy()
        for motor in names["motors"]:
            moved[chain.configuration_slice(motor)] += step
        moved = chain.close(moved, hold=names["motors"])
        heights.append(energy(chain, moved))
    total = sum(names["rest"].effort(motor)[0] for motor in names["motors"])
    assert total == pytest.approx((heights[1] - heights[0]) / 2e-5, rel=1e-6)
    # Pinocchio's constrained dynamics answer the torques of the moving platform with its acceleration.
    torques = {motor: names["moving"].effort(motor)[0] for motor in names["motors"]}
    back = chain.forward_dynamics(names["q_now"], names["v"], torques)
    np.testing.assert_allclose(back.a, names["a"], atol=1e-9)


def energy(chain, q):
    """Potential energy of a chain, J."""
    return pinocchio.computePotentialEnergy(chain.model, chain.model.createData(), q)


@pytest.mark.full
def test_every_command_of_the_common_questions_answers(monkeypatch, capsys, tmp_path):
    monkeypatch.chdir(tmp_path)
    shutil.copytree(REPOSITORY / "examples", tmp_path / "examples")
    commands = re.findall(r"`exo-pin ([^`]*)` \|", site_page("questions"))
    assert len(commands) >= 15
    for command in commands:
        assert main(shlex.split(command)) == 0, command
        assert capsys.readouterr().out, command


def test_every_page_with_code_is_run():
    own = {
        "calibration",
        "contributing",
        "control",
        "dynamics",
        "equilibrium",
        "frames",
        "hand_off",
        "own_design",
        "which_number",
    }
    own |= {
        "any_device",
        "live",
        "report",
        "plant",
        "positioning",
        "robot_torques",
        "robot_with_loops",
        "service",
        "singularity",
        "trajectories",
    }
    assert {name for name in PAGES if "```python\n" in site_page(name)} == own | set(OTHERS)


@pytest.mark.full
def test_figures_of_the_concepts_are_drawn(tmp_path):
    script = runpy.run_path(str(SCRIPTS / "draw_concepts.py"))
    script["draw"](tmp_path)
    for name in script["FIGURES"]:
        assert (tmp_path / f"concept_{name}.png").stat().st_size > 20_000
        assert f"concept_{name}.png" in site_page({"elasticity": "elastic"}.get(name, name))


@pytest.mark.full
@pytest.mark.parametrize("page", OTHERS)
def test_code_of_other_pages_runs(monkeypatch, capsys, tmp_path, page):
    for folder in ("examples", "urdf"):
        shutil.copytree(REPOSITORY / folder, tmp_path / folder)
    design = re.search(r"<!-- file: mine.toml -->\n```toml\n(.*?)```", site_page("own_design"), re.DOTALL)
    (tmp_path / "mine.toml").write_text(design[1])
    times = np.linspace(0.0, 1.0, 41)
    lines = [f"{t!r},{30 + 20 * t**2 * (3 - 2 * t)!r},40,0" for t in times.tolist()]
    (tmp_path / "reach.csv").write_text("\n".join(["time_s,flexion_deg,abduction_deg,internal_rotation_deg", *lines]))
    four_bar = site_page("robot_with_loops")
    names = {}
    exec(re.search(r"```python\n(FOUR_BAR.*?)```", four_bar, re.DOTALL)[1], names)
    ep.ClosedChain.from_mjcf(names["FOUR_BAR"].replace("crank_hinge", "motor").replace("four_bar", "four-bar")).to_urdf(
        tmp_path
    )
    run_code_of(page, monkeypatch, tmp_path)
    printed = capsys.readouterr().out
    for shown in re.findall(OUTPUT, site_page(page), re.DOTALL):
        assert shown in printed


@pytest.mark.full
def test_code_and_figures_on_control(monkeypatch, capsys, tmp_path):
    names = run_code_of("control", monkeypatch, tmp_path)
    model = names["tracking"]
    assert capsys.readouterr().out.startswith(model.verdict)
    assert (tmp_path / "run.csv").stat().st_size > 100_000
    page = site_page("machine_in_motion")
    found = re.search(r"\| `held-abduction` \| pi \|(.*)\n\| \| model \|(.*)\n", page)
    for row, tracking in zip(found.groups(), (ep.experiment("held-abduction").run(), model), strict=True):
        shown = [float(value) for value in re.findall(r"\d+\.?\d*", row)]
        keys = ("rms_error_deg", "rms_error_reachable_deg", "peak_F_s_N", "air_energy_J")
        computed = [tracking.summary()[key] for key in keys]
        assert shown == pytest.approx(computed, abs=0.5, rel=0.02)


def test_counts_of_the_thesis_are_not_stale(ledger_rows):
    shown = re.search(OUTPUT, site_page("thesis"), re.DOTALL)[1]
    assert shown == "\n".join(line.rstrip() for line in aligned(summary(printed_index(), ledger_rows), words=1))


def test_the_page_of_any_device_prints_what_it_shows(monkeypatch, capsys):
    run_code_of("any_device", monkeypatch, REPOSITORY)
    shown = re.findall(r"```text\n(.*?)```", site_page("any_device"), re.DOTALL)
    assert_same("".join(shown).rstrip(), capsys.readouterr().out.rstrip())
