"""The benchmarks are run by hand and go stale without a word: their imports, robots and rows, without the timing."""

import ast
import importlib
import importlib.util
import itertools
import re
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
from published_devices import rps_device, spherical_3rrr

FOLDER = Path(__file__).parents[1] / "benchmarks"
#: Peers that a benchmark compares with and that the extra "test" does not hold.
PEERS = {"pymoo", "toolbox_parallel_robots"}


def imports(path):
    """All (module, name or None) of a script, inside functions too."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from ((each.name, None) for each in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from ((node.module, each.name) for each in node.names)


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.py")), ids=lambda path: path.stem)
def test_what_a_benchmark_imports_exists(path, monkeypatch):
    oracles = FOLDER.parent / "tests" / "oracles"
    monkeypatch.setattr(sys, "path", [str(FOLDER), *(each for each in sys.path if each != str(oracles))])
    if '"tests" / "oracles"' in path.read_text() or "import peer" in path.read_text():
        sys.path.insert(0, str(oracles))
    found = list(imports(path))
    assert found
    for module, name in found:
        if module.split(".")[0] in PEERS and importlib.util.find_spec(module.split(".")[0]) is None:
            continue
        loaded = importlib.import_module(module)
        if name is not None and not hasattr(loaded, name):
            importlib.import_module(f"{module}.{name}")


def test_each_slow_test_is_there():
    slow = tomllib.loads((FOLDER.parent / "tests" / "slow_tests.toml").read_text(encoding="utf-8"))
    assert min(map(len, slow.values())) > 100
    for name in itertools.chain(*slow.values()):
        path, _, function = name.partition("::")
        assert function.partition("[")[0] in (FOLDER.parent / path).read_text(encoding="utf-8"), name


@pytest.fixture
def benchmark(monkeypatch):
    """Import a module of the benchmarks."""
    monkeypatch.setattr(sys, "path", [str(FOLDER), *sys.path])
    monkeypatch.setenv("EXO_PIN_COMPILE", "auto")
    return importlib.import_module


def test_the_survey_of_robots_counts_what_is_read(benchmark, tmp_path):
    survey = benchmark("reading_robots")
    body = '<worldbody><body><joint name="j"/><geom size="0.1"/></body></worldbody>'
    folder = tmp_path / "site-packages" / "robots"
    folder.mkdir(parents=True)
    (folder / "a.xml").write_text(f"<mujoco>{body}</mujoco>")
    (folder / "b.xml").write_text(f'<mujoco><option density="1"/>{body}</mujoco>')
    (folder / "c.xml").write_text("<mujoco/>")
    (folder / "d.xml").write_text(f'<mujoco model="\x01"><option density="1"/>{body}</mujoco>')
    text = survey.survey(tmp_path, (".xml",), "<mujoco", survey.moves, survey.ClosedChain.from_mjcf)
    assert text.startswith("66.7 % are read with at most one name.")
    assert "| robots | 3 | 1 | 1 | 0 | 1 |" in text
    assert "| `fluid` | 1 | forces of air and water |" in text
    assert "| robots | `d.xml` | not an MJCF: its XML is not well-formed" in text
    begin, end = survey.MARKS[0].format("SDF"), survey.MARKS[1]
    page = survey.replaced(f"a\n{begin}\nold\n{end}\nb\n", "SDF", text)
    assert page == f"a\n{begin}\n\n{text}\n\n{end}\nb\n"
    # So many of the world's files are read.
    shown = (Path(__file__).parents[1] / "docs" / "evidence" / "robots_read.md").read_text(encoding="utf-8")
    assert all(survey.MARKS[0].format(kind) in shown for kind in ("MJCF", "URDF", "SDF"))
    shares = [float(share) for share in re.findall(r": ([0-9.]+) % are read", shown)]
    assert shares[0] >= 95.0
    assert shares[1] >= 97.0
    assert shares[2] >= 92.0


def test_the_devices_files_have_what_the_searches_found(benchmark):
    """By the searches' own measures, beside designs drawn at random."""
    search = benchmark("device_search")
    margin, blocked, sides = search.eye_measure(*spherical_3rrr.axes(), search.box((9, 9, 9)))
    assert sides == spherical_3rrr.SIDES
    assert margin.min() > 0.15
    assert 1.0 - blocked.mean() == pytest.approx(0.72, abs=0.02)
    rng, coarse = np.random.default_rng(0), search.box((5, 5, 5))
    own = (blocked | (margin < 0.15)).mean()
    assert min(search.eye_cost(rng.uniform(-np.pi, np.pi, 6), coarse) for _ in range(30)) > own
    dimensions = np.array(
        [
            *np.radians([*rps_device.BASE_DIRECTION, rps_device.BASE_ANGLE]),
            *(rps_device.BASE_HEIGHT, rps_device.BASE_RADIUS),
            *(rps_device.PLATFORM_RADIUS, rps_device.PLATFORM_HEIGHT),
            np.radians(rps_device.PLATFORM_ANGLE - rps_device.BASE_ANGLE),
        ]
    )
    for one, other in zip(search.rps_design(dimensions)[1:], rps_device.joints(), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-15)
    directions = -search.box((5, 5, 1))[:, :, 2]
    low, high = search.RPS_BOUNDS.T
    others = [search.rps_cost(x, directions) for x in rng.uniform(low, high, (300, 8))]
    assert search.rps_cost(dimensions, directions) < 0.7 < min(others)
