"""Packages of the extras: absent, broken, of another version, or interrupted while they are loaded."""

import re
import sys
import tomllib

import pytest
from places import REPOSITORY

from exo_pin.cli import main
from exo_pin.core import errors, optional_packages

LOADING = {
    "broken": ("raise ImportError('libEGL.so.1: cannot open')", "what is installed cannot be loaded: libEGL"),
    "confused": ("raise RuntimeError('invalid value of MUJOCO_GL')", "cannot be loaded: invalid value"),
    "needs": ("import a_package_that_nobody_has", "cannot be loaded: No module named 'a_package_that_nobody_has'"),
    "new": ("__version__ = '9.1.0rc1'", r"mujoco>=3\.10,<5 \(what is installed has version 9\.1\.0rc1\)"),
    "old": ("__version__ = '3.9.2'", "has version 3.9.2"),
}


@pytest.fixture
def mujoco(tmp_path, monkeypatch):
    """Put another module in the place of MuJoCo."""
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "mujoco", raising=False)

    def write(text):
        (tmp_path / "mujoco.py").write_text(text)

    yield write
    sys.modules.pop("mujoco", None)


@pytest.mark.parametrize("kind", LOADING)
def test_what_is_wrong_with_an_installed_package_is_said(mujoco, kind):
    text, message = LOADING[kind]
    mujoco(text)
    with pytest.raises(errors.MissingExtra, match=message) as found:
        optional_packages.optional("robots", "mujoco")
    assert found.value.problem
    assert ".[robots]" in str(found.value)


def test_an_absent_package_is_absent(monkeypatch):
    monkeypatch.setitem(sys.modules, "yaml", None)
    with pytest.raises(errors.MissingExtra, match="this needs PyYAML: in the folder") as found:
        optional_packages.require_extra("robots")
    assert (found.value.extra, found.value.problem) == ("robots", "")


STOPPED = "try:\n    raise KeyboardInterrupt\nfinally:\n    raise ImportError('init')\n"


@pytest.mark.parametrize("text", ["raise KeyboardInterrupt", STOPPED])
def test_ctrl_c_while_a_package_is_loaded_stays_one(mujoco, text):
    mujoco(text)
    with pytest.raises(KeyboardInterrupt):
        optional_packages.optional("robots", "mujoco")


def test_a_command_that_is_stopped_while_a_package_is_loaded_ends_as_stopped(mujoco, tmp_path, capsys):
    mujoco(STOPPED)
    robot = tmp_path / "robot.xml"
    robot.write_text("<mujoco/>")
    assert main(["check", str(robot)]) == 130
    assert "pip install" not in capsys.readouterr().err


def test_the_extras_have_these_packages_in_these_versions():
    extras = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    for extra, modules in optional_packages._MODULES.items():
        named = {re.split("[<>=]", line)[0].lower(): line for line in extras[extra]}
        for module in modules:
            line = named[optional_packages._NAMES.get(module, module).lower()]
            if (extra, module) in optional_packages._VERSIONS:
                least, end = optional_packages._VERSIONS[extra, module]
                assert line.endswith(f">={'.'.join(map(str, least))},<{end[0]}")
