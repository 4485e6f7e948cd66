"""The commands by which presets were found run as they are written in the files."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

import exo_pin as ep
from exo_pin.cli import main

FOUND = Path(ep.__file__).parent / "design" / "presets" / "found"


@pytest.mark.long
@pytest.mark.parametrize("name", [path.stem for path in sorted(FOUND.glob("*.toml"))])
def test_commands_run_and_their_first_designs_come_again(name, tmp_path, monkeypatch):
    """To the first designs alone: the whole search takes hours. The last file leads from itself to the same design."""
    for extra in ("cmaes", "optuna", "myo_sim"):
        pytest.importorskip(extra)
    monkeypatch.chdir(tmp_path)
    source = tomllib.loads((FOUND / f"{name}.toml").read_text(encoding="utf-8"))["source"]
    commands = source.removeprefix("found by: ").split("; then: ")
    for command in commands:
        words = command.removeprefix("exo-pin ").split()
        words[words.index("--budget") + 1] = "4"
        assert main(words) == 0, command
    assert words[-2:] == ["--out", f"{name}.toml"]
    last = ep.load(f"{name}.toml")
    again = last.mechanism.sources["mechanism"].removeprefix("found by: exo-pin ").split()
    assert main([*again, "--out", "again.toml"]) == 0
    for part in ("base_points", "platform_points"):
        np.testing.assert_array_equal(getattr(ep.load("again.toml").geometry, part), getattr(last.geometry, part))
    # Of the kind that was found.
    found = ep.load(name)
    assert [limb.actuator.family for limb in last.limbs] == [limb.actuator.family for limb in found.limbs]
