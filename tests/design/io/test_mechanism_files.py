"""Files of designs: they come back bit for bit, cite their sources, and say what is wrong."""

import tomllib

import pytest
from same_records import same

import exo_pin as ep
from exo_pin.design import (
    preset,
    presets,
    published,
)


def test_the_published_mechanisms():
    assert published() == ["appendix-d", "optimised-table-5-3", "optimised-table-c-2", "prototype", "scenario-one"]
    found = {"four-cables", "four-cables-worn", "four-linear-actuators", "four-muscle-cables", "three-linear-actuators"}
    found |= {"four-linear-actuators-worn", "six-cables"}
    assert not set(published()) & found
    assert set(presets()) == set(published()) | found
    assert preset("prototype").geometry.circles.r_A == pytest.approx(0.1363)
    assert preset("scenario-one").arm is None
    assert preset("optimised-table-c-2").arm is None
    assert preset("appendix-d").arm.mass == 2.0
    assert preset("appendix-d").arm.inertia is None


@pytest.mark.parametrize("name", presets())
@pytest.mark.parametrize("side", ["left", "right"])
def test_files_come_back_bit_for_bit(name, side, tmp_path):
    exo = ep.load(name, side)
    exo.save(tmp_path / "a.toml")
    back = ep.load(tmp_path / "a.toml")
    assert same(exo.mechanism, back.mechanism)
    back.save(tmp_path / "b.toml")
    assert (tmp_path / "a.toml").read_bytes() == (tmp_path / "b.toml").read_bytes()


def test_a_failed_write_leaves_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "a.toml"
    ep.load("prototype").save(path)
    before = path.read_bytes()
    monkeypatch.setattr("os.replace", lambda *_: (_ for _ in ()).throw(OSError("full")))
    with pytest.raises(ep.ExoPinError, match="full"):
        ep.load("appendix-d").save(path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_presets_cite_their_source():
    from importlib.resources import files

    for name in published():
        data = tomllib.loads((files("exo_pin.design") / "presets" / f"{name}.toml").read_text(encoding="utf-8"))
        assert "Tang" in data["source"]
        assert data["geometry"]["source"]
