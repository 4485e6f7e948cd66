"""The command line: words that are hostile, negative values, and the installed command."""

import subprocess
import sys
import warnings

import pytest
from command_line import run

import exo_pin as ep
from exo_pin.cli import main


@pytest.mark.parametrize("word", ["q" * 100_000, "--\x1b[2Jx"])
def test_wrong_words_are_cut_and_made_printable(capsys, word):
    for arguments in ([word], ["reaction", "prototype", "--split", word], ["reaction", "prototype", word]):
        assert main(arguments) == 2
        err = capsys.readouterr().err
        assert len(err) < 3000
        assert "\x1b" not in err


@pytest.mark.parametrize(
    "arguments",
    [
        ["reaction", "prototype", "--abduction", "-4", "--flexion", "-1e1"],
        ["reaction", "prototype", "--offset", "-5", "0", "-.3"],
        ["reaction", "prototype", "--compare", "minimal", "--limits=-10,20"],
        ["reaction", "prototype", "--limits=-300,500"],
    ],
)
def test_negative_values_need_no_equals_sign(capsys, arguments):
    assert run(capsys, *arguments)[0] == 0


def test_the_program_alone_has_warnings_of_one_line(capsys, monkeypatch):
    before = warnings.showwarning
    monkeypatch.setattr(warnings, "showwarning", before)
    assert main(["--version"]) == 0
    assert warnings.showwarning is before
    monkeypatch.setattr(sys, "argv", ["exo-pin", "--version"])
    assert main() == 0
    warnings.showwarning(UserWarning("two\n lines"), UserWarning, "file.py", 3)
    assert capsys.readouterr() == (f"{ep.__version__}\n" * 2, "exo-pin: two lines\n")


def test_the_installed_command():
    command = [sys.executable, "-m", "exo_pin.cli", "--version"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ep.__version__
