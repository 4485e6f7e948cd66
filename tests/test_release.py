"""Version, changelog and citation agree, and the templates of issues and pull requests can be read."""

import importlib
import re
import tomllib

import pytest
from places import REPOSITORY, SCRIPTS

import exo_pin as ep

yaml = pytest.importorskip("yaml")

CHANGELOG = (REPOSITORY / "CHANGELOG.md").read_text(encoding="utf-8")
CITATION = yaml.safe_load((REPOSITORY / "CITATION.cff").read_text(encoding="utf-8"))


def test_version_and_date_agree():
    assert CITATION["version"] == ep.__version__
    released = dict(re.findall(r"^## \[(\d[^\]]*)\] - (\d{4}-\d{2}-\d{2})$", CHANGELOG, re.MULTILINE))
    # A version that has not been released has no date anywhere.
    assert str(CITATION.get("date-released")) == released.get(ep.__version__, "None")
    if ep.__version__ not in released:
        assert re.search(r"^## \[Unreleased\]$", CHANGELOG, re.MULTILINE)


def test_templates_of_issues_ask_for_something():
    forms = sorted((REPOSITORY / ".github" / "ISSUE_TEMPLATE").glob("[!c]*.yml"))
    assert len(forms) == 2
    for path in forms:
        form = yaml.safe_load(path.read_text(encoding="utf-8"))
        assert form["name"]
        assert any(field.get("validations", {}).get("required") for field in form["body"])


def test_the_template_of_pull_requests_names_pages_that_exist():
    text = (REPOSITORY / ".github" / "pull_request_template.md").read_text(encoding="utf-8")
    for path in re.findall(r"\((\w+/\w+\.md)\)", text):
        assert (REPOSITORY / path).exists()
    assert "CHANGELOG.md" in text


def test_the_hosted_check_runs_what_is_here():
    jobs = yaml.safe_load((REPOSITORY / ".github/workflows/check.yml").read_text(encoding="utf-8"))["jobs"]
    lines = [step["run"] for job in jobs.values() for step in job["steps"] if "run" in step]
    paths = {word for line in lines for word in line.split() if word.startswith((".ci/", "tests/"))}
    assert {".ci/run", ".ci/packages"} <= paths
    assert all((REPOSITORY / path).exists() for path in paths)


def test_the_release_check_finds_what_is_not_ready(monkeypatch):
    monkeypatch.syspath_prepend(SCRIPTS)
    check = importlib.import_module("release_check")
    log = "# Changelog\n\n## [Unreleased]\n\n## [0.2.0] - 2026-11-29\n- new\n"
    assert check.version_faults("0.2.0", log, "version: 0.2.0\n") == []
    assert len(check.version_faults("0.3.0", log.replace("\n\n## [0.2", "\n- x\n\n## [0.2"), "version: 0.2.0\n")) == 3
    page = "<!-- measured: mujoco 3.17.0, pin 4.1.0 -->"
    assert check.stale_tables(page, {"mujoco": "3.9.1", "pin": "4.1.0"}) == []
    assert check.stale_tables(page, {"mujoco": "3.17.1"}) == ["measured with mujoco 3.17.0, now 3.17.1"]


def test_the_recipe_for_conda_wants_what_the_package_wants():
    recipe = yaml.safe_load((REPOSITORY / ".ci" / "conda" / "recipe.yaml").read_text(encoding="utf-8"))
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    named = {"pinocchio": "pin", "meshcat-python": "meshcat"}
    wanted = dict(line.split() for line in recipe["requirements"]["run"])
    assert wanted.pop("python") == project["requires-python"]
    assert {named.get(name, name) + bounds for name, bounds in wanted.items()} == set(project["dependencies"])
    commands = [" = ".join(command) for command in project["scripts"].items()]
    assert recipe["build"]["python"]["entry_points"] == commands
    assert (recipe["context"]["version"], recipe["package"]["name"]) == (ep.__version__, project["name"])
    assert [(REPOSITORY / name).exists() for name in recipe["about"]["license_file"]] == [True, True]
