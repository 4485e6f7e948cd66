"""Pages on muscles show the numbers of the commands."""

import re

import numpy as np
import pytest
from places import DOCS, REPOSITORY

from exo_pin.cli import main
from exo_pin.control import muscle_loop
from exo_pin.muscle import (
    PolynomialModel,
    identify_static,
    load_parameters,
    muscle_model,
    read_measurements,
)


@pytest.fixture
def run(capsys):
    def call(*words):
        assert main(["muscle", *map(str, words)]) == 0
        return capsys.readouterr().out

    return call


def test_the_tutorial_shows_the_numbers_of_the_command(run):
    page = (DOCS / "tutorials" / "muscles.md").read_text()
    command = re.search(r"exo-pin muscle (identify .*) --out law.toml", page)[1].split()
    out = run(*(str(REPOSITORY / word) if word.endswith(".csv") else word for word in command))
    assert out.splitlines()[0] in page
    assert out.splitlines()[1] in page
    assert f"rms {float(re.search('rms ([0-9.]+)', out)[1]):.3f} N" in page
    shown = re.search(r"off by ([0-9.]+) N \(rms\), ([0-9.]+) N where", page.split("```text")[1]).groups()
    assert [f"{float(value):.2f}" for value in re.findall(r"([0-9.]+) N", out.splitlines()[1])] == list(shown)


def test_the_page_on_muscle_data_shows_the_numbers_of_command_and_python(run, tmp_path):
    page = (DOCS / "howto" / "muscle_data.md").read_text()
    command = re.search(r"exo-pin muscle (identify examples/.*)", page)[1].split()
    out = run(*(str(REPOSITORY / word) if word.endswith(".csv") else word for word in command))
    data = read_measurements(REPOSITORY / "examples" / "muscle.csv", nominal_length=0.3)
    fit = identify_static(data.contraction, data.pressure, data.force, 0.3, diameter=0.006)
    gauge, ruler, _ = (each.effects["force_percent"] for each in fit.known)
    assert f"zero changes\nthe force by {gauge:.2g} % of the middle one" in page
    assert f"the contraction's zero by {ruler:.2g} %" in page
    assert f"{gauge:.2g} % of the force; 1 mm of the contraction's zero: {ruler:.2g} % of the force" in out
    assert f"rms {fit.rms:.3g} N, leave-one-out {fit.leave_one_out_rms:.3g} N" in out
    (tmp_path / "law.toml").write_text(re.search(r"```toml\n(.*?)```", page, re.DOTALL)[1])
    law = load_parameters(tmp_path / "law.toml")
    made = PolynomialModel.tondu_lopez(0.010, np.radians(25.0), 0.25, k=1.2, name="braid", validity=law.validity)
    assert law.force(0.03, 3e5) == pytest.approx(made.force(0.03, 3e5))
    shown = run("force", "--contraction-mm", 30, "--pressure-bar", 3, "--model", tmp_path / "law.toml")
    assert f"{law.force(0.03, 3e5):.2f}" in shown


def test_pictures(run, tmp_path):
    map_path, step_path = tmp_path / "map.png", tmp_path / "step.png"
    run("force", "--contraction-mm", 50, "--pressure-bar", 3, "--plot", map_path)
    run("step", "--weight-N", 22.74, "--from-bar", 2.6, "--to-bar", 3.6, "--duration-s", 1.5, "--plot", step_path)
    loop_path = tmp_path / "loop.png"
    out = run("loop", "--to-percent", 15, "--weight-N", 12.74, "--plot", loop_path)
    page = (DOCS / "howto" / "muscle_data.md").read_text()
    error, overshoot = (re.search(rf"{word} +(-?[0-9.]+) %", out)[1] for word in ("steady error", "overshoot"))
    assert f"the steady error is {error.lstrip('-')} % (it sticks beyond), the overshoot {overshoot} %" in page
    loop = muscle_loop(muscle_model("best", 0.25), 12.74 / 9.81, 0.15)
    assert (f"{100 * loop.steady_error:.2g}", f"{100 * loop.overshoot:.2g}") == (error, overshoot)
    for path in (map_path, step_path, loop_path):
        assert path.read_bytes().startswith(b"\x89PNG")
