"""Comparisons put one side on all designs, and no order decides."""

import itertools

import numpy as np
import pytest
from places import URDF

import exo_pin as ep
from exo_pin.cli import main

WOMAN = ep.Wearer(1.60, 55, "female", elbow_flexion=45, payload=1.5, degrees=True)
POSES = ep.adl_box(55.0)
FIGURES = ("common_peak_F_s_N", "peak_F_s_N", "median_F_s_N", "can_hold", "holdable", "least_margin")


def rows_of(table, names=FIGURES):
    """Figures by name of the design."""
    return {str(name): [float(table[each][row]) for each in names] for row, name in enumerate(table["design"])}


@pytest.fixture(scope="module")
def cables():
    return ep.load("four-cables")  # on a man of 75 kg


@pytest.fixture(scope="module")
def six():
    return ep.load("six-cables")  # on a man of 85 kg


def test_designs_for_the_other_side_are_mirrored(cables, six, capsys):
    right = cables.mirrored()
    table = right.compare(six, ep.adl_box(55.0, "right"), person=WOMAN)
    assert table.heading[0].endswith("six-cables: mirrored to the right shoulder.")
    expected = rows_of(cables.compare(six, POSES, person=WOMAN))
    for name, figures in rows_of(table).items():
        assert figures == pytest.approx(expected[name], rel=1e-6)
    # Who wears the right-sided design has a right arm, which is mirrored back where it has to be.
    lifted = cables.replace(arm=cables.arm + ep.Arm(1.0, [0.0, 0.1, -0.5], np.zeros((3, 3))))
    left = rows_of(lifted.compare(six, POSES))
    for name, figures in rows_of(lifted.mirrored().compare(six, ep.adl_box(55.0, "right"))).items():
        assert figures == pytest.approx(left[name], rel=1e-6)
    # The command mirrors all of them.
    assert main(["compare", "four-cables", "six-cables", "--side", "right", "--step", "55"]) == 0
    assert "mirrored" not in capsys.readouterr().out


def test_no_order_of_the_arguments_decides(cables, six):
    linear, support = ep.load("four-linear-actuators-worn"), ep.load(URDF / "spring-support.urdf")
    muscles = ep.load("prototype")
    designs = [cables, cables.replace(name="twin"), linear, muscles, muscles.replace(name="muscles"), support]
    found = []
    rng = np.random.default_rng(4)
    every = list(itertools.permutations(range(len(designs))))
    orders = [every[k] for k in rng.choice(len(every), 4, replace=False)] + [tuple(range(6)), tuple(range(6))[::-1]]
    for order in orders:
        first, *others = (designs[k] for k in order)
        table = first.compare(*others, POSES, person=WOMAN)
        ranked = [str(table["design"][row]) for row in table.ranking]
        assert table["rank"].tolist() == list(table.ranks)
        found.append((ranked, dict(zip(table["design"], table.ranks, strict=True)), table.verdict, table.heading[0]))
        bars = table.plot().axes[0].get_yticklabels()
        assert [text.get_text()[3:] for text in bars] == ranked
    assert all(each == found[0] for each in found)
    ranked, ranks, verdict, _ = found[0]
    assert ranked[-3:] == ["spring-support", "muscles", "prototype"]
    assert ranks["four-cables"] == ranks["twin"]
    assert (ranks["spring-support"], ranks["prototype"], ranks["muscles"]) == (4, 5, 5)
    assert "four-cables and twin, which hold" in verdict
    assert "Equal" in verdict


def others():
    names = ("serial-y-x-z", "3rps-passive-ball", "spring-support")
    return [ep.load("prototype"), *(ep.load(URDF / f"{name}.urdf") for name in names)]
