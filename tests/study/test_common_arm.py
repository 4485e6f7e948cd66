"""Comparisons put one wearer, one payload and one side on all designs; ties are named, and no order decides."""

import itertools
import json

import numpy as np
import pytest
from places import URDF

import exo_pin as ep
from exo_pin import MissingData
from exo_pin.cli import main
from exo_pin.study import StudyTable

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


def test_the_first_design_s_wearer_wears_all(cables, six):
    table = cables.compare(six, POSES)
    man = cables.arm.wearer
    for row, exo in enumerate((cables.worn_by(cables.arm.person), six.worn_by(cables.arm.person))):
        answer = exo.reaction(POSES)
        assert table["peak_F_s_N"][row] == pytest.approx(answer.magnitude[answer.can_hold].max(), rel=1e-12)
        # On whoever wears it in its file it has another force.
    own = six.reaction(POSES)
    assert table["peak_F_s_N"][1] < 0.99 * own.magnitude[own.can_hold].max()
    assert f"{man.height:g} m, {man.mass:g} kg, elbow straight, payload 0 kg (the first design's)" in table.heading[0]
    assert str(table).startswith(table.heading[0][:60])
    # What a device itself moves stays its own: six cables have a heavier cuff.
    assert six.worn_by(cables.arm.person).arm.mass - cables.arm.mass == pytest.approx(0.219, abs=1e-3)


def test_payload_and_elbow_go_with_the_wearer(cables, six, capsys):
    loaded = six.worn_by(WOMAN)
    table = loaded.compare(cables, POSES)
    assert "woman of 1.6 m, 55 kg, elbow bent by 45°, payload 1.5 kg (the first design's)" in table.heading[0]
    asked = cables.compare(six, POSES, person=WOMAN)
    assert "payload 1.5 kg (as asked)" in asked.heading[0]
    expected = rows_of(asked)
    for name, figures in rows_of(table).items():
        assert figures == pytest.approx(expected[name], rel=1e-12)
    # A weight that a sweep put into the hand is a payload, too.
    more = cables.replace(arm=cables.arm + ep.Arm(2.0, [0.0, 0.0, -0.6], np.zeros((3, 3))))
    assert "payload 2 kg" in more.compare(six, POSES).heading[0]
    command = [
        "compare",
        "four-cables",
        "six-cables",
        "--step",
        "55",
        "--person",
        "1.6,55,female",
        "--no-muscles",
        "--json",
    ]
    assert main([*command, "--payload", "1.5", "--elbow-flexion", "45"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["heading"] == list(asked.heading)
    np.testing.assert_allclose(printed["columns"]["peak_F_s_N"], asked["peak_F_s_N"])


def test_who_wears_designs_that_name_nobody(cables):
    prototype, bare = ep.load("prototype"), ep.load("optimised-table-c-2")
    table = prototype.compare(cables, POSES)
    assert "(that of four-cables: no design before it has a person)" in table.heading[0]
    worn = prototype.worn_by(cables.arm.person).reaction(POSES, limits="none")
    free = prototype.compare(cables, POSES, limits="none")
    assert free["peak_F_s_N"][0] == pytest.approx(worn.magnitude.max(), rel=1e-12)
    nobody = prototype.compare(prototype.replace(name="other"), POSES)
    assert nobody.heading[0].startswith("Nobody wears these designs")
    with pytest.raises(MissingData, match=r"optimised-table-c-2.*person") as caught:
        prototype.compare(bare, POSES)
    assert "arm of a person" in str(caught.value)
    assert "1.6 m" in prototype.compare(bare, POSES, person=WOMAN).heading[0]


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


def test_robots_are_mirrored_too(cables):
    robot = ep.load(URDF / "spherical-3rrr.urdf")
    expected = rows_of(cables.compare(robot, POSES))
    table = cables.compare(robot.mirrored(), POSES)
    assert table.heading[0].endswith("spherical-3rrr: mirrored to the left shoulder.")
    turned = robot.mirrored().compare(cables, ep.adl_box(55.0, "right"), person=cables.arm.person)
    assert turned.heading[0].endswith("four-cables: mirrored to the right shoulder.")
    for found in (table, turned):
        for name, figures in rows_of(found).items():
            assert figures == pytest.approx(expected[name], rel=1e-5)


def test_of_passive_supports_the_lowest_peak_is_first():
    support = ep.load(URDF / "spring-support.urdf")
    moved = support.device.with_dimensions(**{"spring[strut,1].x_mm": 60.0}).replace(name="moved")
    designs = ep.ShoulderExo.from_device(moved), support
    peaks = [exo.reaction(POSES, limits="none").magnitude.max() for exo in designs]
    assert abs(peaks[0] - peaks[1]) > 0.1
    table = designs[0].compare(designs[1], POSES)
    assert table["common_peak_F_s_N"] == pytest.approx(peaks)
    best = int(np.argmin(peaks))
    assert table.ranks[best] == 1
    start = f"No design holds any of the poses alone. With the moments of the wearer {designs[best].name} has"
    assert table.verdict.startswith(start)


def test_a_design_that_holds_nothing_changes_no_other(cables, six):
    serial, prototype = ep.load(URDF / "serial-y-x-z.urdf"), ep.load("prototype")
    without = cables.compare(six, serial, POSES)
    table = cables.compare(prototype, six, serial, POSES)
    own = rows_of(table)
    assert np.isfinite(without["common_peak_F_s_N"]).all()
    assert np.isnan(own.pop("prototype")[0])
    assert own == rows_of(without)
    assert "but prototype, which holds none" in table.heading[1]
    assert "common_peak_F_s_N, peak_F_s_N, p95_F_s_N, median_F_s_N (it holds no pose)" in table["blank"][1]
    # Nor does a passive support, which holds none alone.
    support = ep.load(URDF / "spring-support.urdf")
    beside = rows_of(cables.compare(support, six, serial, POSES))
    assert np.isfinite(beside.pop("spring-support")[0])
    assert beside == rows_of(without)
    # Two that hold nothing have no figure in common, and no rank before each other.
    none = prototype.compare(prototype.replace(name="a"), POSES, person=WOMAN)
    assert none.ranks == (1, 1)
    assert none.verdict == "No design holds any of the poses."


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


def test_ranks_of_rows():
    rng = np.random.default_rng(11)

    def row(name, known, far, peak):
        return {"design": name, "can_hold": known, "holdable": far, "common_peak_F_s_N": peak, "peak_F_s_N": 2.0 * peak}

    rows = [
        row("best", 0.9, 0.9, 60.0),
        row("as good", 0.9, 0.9, 60.0 * (1.0 + 1e-9)),
        row("more force", 0.9, 0.9, 60.1),
        row("unknown limits", 0.5, 1.0, 20.0),
        row("known", 0.5, 0.5, 10.0),
        row("passive", 0.0, 0.0, 5.0),
        row("nothing", 0.0, 0.0, np.nan),
        row("nothing else", 0.0, 0.0, np.nan),
    ]
    for _ in range(20):
        order = rng.permutation(len(rows))
        table = StudyTable([rows[k] for k in order])
        ranks = dict(zip(table["design"].tolist(), table.ranks, strict=True))
        assert [ranks[each["design"]] for each in rows] == [1, 1, 3, 4, 5, 6, 7, 7]
        assert table.verdict.startswith(
            "Equal first: as good and best, which hold 90.0% of the poses, peak |F_s| 60.0 N"
        )
        assert table.verdict.endswith("more force is third: 90.0% of the poses, peak |F_s| 60.1 N.")
    assert "Equal designs share a rank" in str(table)
    # Poses held come before force, also where nothing is held in common.
    alone = StudyTable([row("a", 0.5, 0.5, np.nan), row("b", 0.6, 0.6, np.nan)])
    assert alone.ranks == (2, 1)


def test_the_picture_draws_what_ranks(cables, six):
    serial = ep.load(URDF / "serial-y-x-z.urdf")
    table = serial.compare(six, ep.load("prototype"), cables, poses=POSES, person=WOMAN)
    figure = table.plot()
    held, force = figure.axes
    best = list(table.ranking)
    assert best != list(range(4))
    assert held.yaxis_inverted()  # the first bar is on top
    np.testing.assert_allclose([bar.get_width() for bar in held.patches[:4]], 100.0 * table["can_hold"][best])
    peaks = np.nan_to_num(table["common_peak_F_s_N"][best])
    np.testing.assert_allclose([bar.get_width() for bar in force.patches[:4]], peaks)
    assert ("more is better" in held.get_xlabel(), "less is better" in force.get_xlabel()) == (True, True)
    assert "woman of 1.6 m" in figure.get_suptitle().replace("\n", " ")
    (axes,) = table.plot("median_F_s_N").axes
    np.testing.assert_allclose([bar.get_width() for bar in axes.patches], table["median_F_s_N"][best])
    assert [text.get_text()[3:] for text in axes.get_yticklabels()] == table["design"][best].tolist()
    assert "less is better" in axes.get_xlabel()


def assert_every_blank_has_a_reason(table):
    found = 0
    for row in range(table.row_count):
        given = table["blank"][row].replace("(", " ").replace(",", " ").split()
        for name in table:
            if table[name].dtype.kind == "f":
                assert (name in given) == np.isnan(table[name][row])
                found += name in given
    assert found > 0
    shown = " ".join(str(table).split())
    assert all(" ".join(each.split()) in shown for each in table["blank"])


def others():
    names = ("serial-y-x-z", "3rps-passive-ball", "spring-support")
    return [ep.load("prototype"), *(ep.load(URDF / f"{name}.urdf") for name in names)]


def test_every_blank_has_a_reason(cables, tmp_path):
    table = cables.compare(*others(), poses=cables.pose([30.0, 60.0, 80.0], 20.0))
    assert_every_blank_has_a_reason(table)
    assert "reach (a stroke" not in table["blank"][0]
    table.to_csv(tmp_path / "table.csv")
    assert "(it holds no pose)" in (tmp_path / "table.csv").read_text()


@pytest.mark.full
def test_every_blank_of_a_detailed_comparison_has_a_reason(cables):
    pytest.importorskip("myo_sim")
    poses = cables.pose([30.0, 60.0, 80.0], 20.0)
    table = cables.compare(*others(), poses=poses, detailed=True)
    assert_every_blank_has_a_reason(table)
    assert "held_and_clear, singular, median_margin, held_after_failure" in table["blank"][-1]
    assert "it has no drives" in table["blank"][-1]
    free = cables.compare(others()[0], poses=poses, detailed=True, limits="none")
    assert_every_blank_has_a_reason(free)
    assert "held_after_failure (the question gives no numbers" in free["blank"][0]
