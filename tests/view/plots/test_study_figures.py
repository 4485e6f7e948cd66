"""Figures that compare designs: each bar, mark and word is a number of the table, the best design on top."""

import matplotlib

matplotlib.use("agg")

import numpy as np
import pytest
from words_apart import assert_words_are_apart

import exo_pin as ep
from exo_pin.study import StudyTable
from exo_pin.view.plots.answer_plots import quantity_words, unit_words
from exo_pin.view.plots.study_plots import column_words, comparison_figure, ranking_figure

NAN = np.nan
ROWS = [
    {"design": "weak", "can_hold": 0.0, "holdable": 0.0, "common_peak_F_s_N": NAN, "peak_F_s_N": NAN},
    {"design": "good", "can_hold": 0.5, "holdable": 0.9, "common_peak_F_s_N": 120.0, "peak_F_s_N": 150.0},
    {"design": "best", "can_hold": 0.9, "holdable": 0.9, "common_peak_F_s_N": 60.0, "peak_F_s_N": 70.0},
    {"design": "half", "can_hold": 0.4, "holdable": 0.4, "common_peak_F_s_N": NAN, "peak_F_s_N": 90.0},
    {"design": "free", "can_hold": 0.0, "holdable": 0.0, "common_peak_F_s_N": 30.0, "peak_F_s_N": NAN},
]
CONTACT = {
    "weak": (NAN, 200.0),
    "good": (90.0, 210.0),
    "best": (50.0, 205.0),
    "half": (NAN, NAN),
    "free": (80.0, 199.0),
}


def words(ax):
    """Texts behind the ends of bars, by row: the place and the text."""
    return {round(text.xy[1]): (text.xy[0], text.get_text()) for text in ax.texts}


def bars(ax):
    """Left end and length of the bars by row, in the order in which they were drawn."""
    found = {}
    for bar in ax.patches:
        found.setdefault(round(bar.get_y() + bar.get_height() / 2.0), []).append((bar.get_x(), bar.get_width()))
    return found


@pytest.mark.parametrize("joint", [False, True])
def test_a_ranking_shows_what_ranks(joint):
    rows = [dict(row) for row in ROWS]
    if joint:
        for row in rows:
            row["contact_N"], row["contact_without_N"] = CONTACT[row["design"]]
    table = StudyTable(rows, ["Five designs", "in one pose"])
    figure = ranking_figure(table)
    order = [rows[k] for k in table.ranking]
    *first, held, force = figure.axes
    left = figure.axes[0]
    labels = [text.get_text() for text in left.get_yticklabels()]
    assert [label.split(" ", 1)[1] for label in labels] == [row["design"] for row in order]
    ranks = table.ranks
    assert [label.split(" ")[0] for label in labels] == [
        f"{ranks[k]}{'=' if ranks.count(ranks[k]) > 1 else '.'}" for k in table.ranking
    ]
    low, high = left.get_ylim()
    assert low > high  # the best on top
    for k, row in enumerate(order):
        known, far, peak = row["can_hold"], row["holdable"], row["common_peak_F_s_N"]
        np.testing.assert_allclose(bars(held)[k], [(0.0, 100.0 * known), (100.0 * known, 100.0 * (far - known))])
        assert words(held)[k] == (pytest.approx(100.0 * far), f"{100.0 * far:.1f} %" if far else "none")
        shown = np.nan_to_num(peak)
        np.testing.assert_allclose(bars(force)[k], [(0.0, shown if far else 0.0), (0.0, 0.0 if far else shown)])
        text = {"weak": "holds no pose", "half": "no pose in common", "free": "30.0 N, its wearer makes the rest"}
        assert words(force)[k] == (shown, text.get(row["design"], f"{peak:.1f} N"))
    assert held.get_xlim() == (0.0, 122.0)
    assert held.get_xticks().tolist() == [0.0, 25.0, 50.0, 75.0, 100.0]
    assert force.get_xlim() == (0.0, pytest.approx(1.22 * 120.0))
    assert "% of the poses (more is better)" in held.get_xlabel()
    assert force.get_xlabel().endswith("N" if joint else "(less is better)")
    assert held.get_title() == ("poses that are held" if joint else "first: poses that are held")
    assert force.get_title().startswith("force without muscles" if joint else "between equals")
    assert [text.get_text() for text in held.get_legend().get_texts()] == [
        "known to be held",
        "if unknown limits allow it",
    ]
    assert "Five designs" in figure.get_suptitle()
    assert "in one pose" in figure.get_suptitle()
    assert len(first) == joint
    if joint:
        for k, row in enumerate(order):
            value, bare = CONTACT[row["design"]]
            np.testing.assert_allclose(bars(first[0])[k], [(0.0, np.nan_to_num(value))])
            assert words(first[0])[k] == (np.nan_to_num(value), f"{value:.0f} N" if np.isfinite(value) else "not known")
            (marks,) = first[0].get_lines()
            np.testing.assert_array_equal(marks.get_xydata()[k], [bare, k])
        assert first[0].get_xlim() == (0.0, pytest.approx(1.22 * 210.0))
        assert first[0].get_legend().get_texts()[0].get_text() == "without the device"
    assert_words_are_apart(figure)


def test_where_all_limits_are_known_there_is_one_sort_of_bar():
    row = {"can_hold": 0.0, "holdable": 0.0, "common_peak_F_s_N": NAN, "peak_F_s_N": NAN}
    held, force = ranking_figure(StudyTable([{"design": name} | row for name in "ab"])).axes
    assert held.get_legend() is None
    assert force.get_xlim() == (0.0, 1.22)
    assert [len(own) for own in bars(held).values()] == [1, 1]


DETAILED = {
    "holdable": [0.5, 1.0, 0.0], "can_hold": [0.5, 1.0, 0.0], "held_after_failure": [0.25, NAN, 0.0],
    "clear": [0.75, 1.0, 0.5], "singular": [0.0, 0.1, 0.2], "not_evaluated": [0.25, 0.0, 0.0],
    "median_F_s_N": [40.0, 30.0, NAN], "peak_F_s_N": [90.0, 400.0, NAN], "common_peak_F_s_N": [90.0, 60.0, NAN],
    "contact_N": [100.0, 80.0, NAN], "peak_contact_N": [150.0, 120.0, NAN], "contact_without_N": [300.0, 290.0, 310.0],
    "change_by_10_mm_N": [5.0, 150.0, NAN], "change_on_cuff_N": [2.0, 1.0, NAN], "follows_10_mm": [1.0, 0.5, 0.0],
    "effort_share": [0.2, 0.6, NAN], "effort_N": [200.0, NAN, NAN], "effort_Nm": [NAN, 12.0, NAN],
    "stroke_mm": [120.0, NAN, NAN], "stroke_deg": [NAN, 80.0, NAN],
    "mass_on_arm_kg": [0.5, 0.7, NAN], "mass_of_links_kg": [1.5, NAN, NAN],
}  # fmt: skip


def test_a_detailed_comparison_has_six_figures_of_each_device():
    names = ["a", "b", "c"]
    rows = [{"design": name} | {key: values[k] for key, values in DETAILED.items()} for k, name in enumerate(names)]
    table = StudyTable(rows, ["Three devices"])
    figure = comparison_figure(table)
    order = np.array(table.ranking)
    own = {key: np.array(values)[order] for key, values in DETAILED.items()}
    poses, force, contact, off, drives, masses = figure.axes
    at = np.arange(3)

    def line(ax, marker):
        return next(line.get_xydata() for line in ax.get_lines() if line.get_marker() == marker)

    lengths = {}
    for bar in poses.patches:
        lengths.setdefault(round(bar.get_y() + bar.get_height() / 2.0, 2), []).append((bar.get_x(), bar.get_width()))
    for k in at:
        np.testing.assert_allclose(
            lengths[round(k - 0.18, 2)],
            [(0.0, 100 * own["holdable"][k]), (100 * own["holdable"][k], 100 * own["not_evaluated"][k])],
        )
        np.testing.assert_allclose(
            lengths[round(k + 0.18, 2)], [(0.0, np.nan_to_num(100 * own["held_after_failure"][k]))]
        )
    np.testing.assert_allclose(line(poses, "D"), np.stack([100 * own["clear"], at], axis=1))
    np.testing.assert_allclose(line(poses, "x"), np.stack([100 * own["singular"], at], axis=1))
    for ax, median, peak in ((force, "median_F_s_N", "peak_F_s_N"), (contact, "contact_N", "peak_contact_N")):
        np.testing.assert_allclose(line(ax, "o"), np.stack([own[median], at], axis=1))
        ends = [segment[:, 0] for segment in ax.collections[0].get_segments() if len(segment)]
        known = np.isfinite(own[median])
        both = np.stack([own[median], own[peak]], axis=1)
        np.testing.assert_allclose(ends, both[known])
        (said,) = ax.texts
        assert (said.get_text(), said.xy) == ("holds none, or not known", (0.0, float(np.flatnonzero(~known)[0])))
    # A peak far beyond the medians leaves the picture.
    assert force.get_xlim()[1] == pytest.approx(8.0 * 40.0)
    assert contact.get_xlim()[1] > 310.0
    np.testing.assert_allclose(line(contact, "s"), np.stack([own["contact_without_N"], at], axis=1))
    assert off.get_xlim()[1] == 100.0
    np.testing.assert_allclose(
        [own[0] for own in bars(off).values()], [(0.0, v) for v in np.nan_to_num(own["change_by_10_mm_N"])]
    )
    np.testing.assert_allclose(line(off, "D"), np.stack([own["change_on_cuff_N"], at], axis=1))
    (said,) = off.texts
    assert (said.get_text(), said.xy[1]) == (
        "cannot follow: rigid",
        float(np.flatnonzero(own["follows_10_mm"] == 0.0)[0]),
    )
    told = {"a": (20.0, "200 N, 120 mm"), "b": (60.0, "12 N m, 80°"), "c": (0.0, "no drives")}
    for k in at:
        name = names[order[k]]
        assert words(drives)[k] == (pytest.approx(told[name][0]), told[name][1])
        np.testing.assert_allclose(bars(drives)[k], [(0.0, told[name][0])])
        arm, links = np.nan_to_num([own["mass_on_arm_kg"][k], own["mass_of_links_kg"][k]])
        np.testing.assert_allclose(bars(masses)[k], [(0.0, arm), (arm, links)])
        assert words(masses).get(k, (0.0, ""))[1] == {"a": "", "b": "+ ?", "c": "not known"}[name]
    assert drives.get_xlim() == (0.0, 170.0)
    assert drives.get_xticks().tolist() == [0.0, 25.0, 50.0, 75.0, 100.0]
    assert all(ax.get_xlim()[0] == 0.0 for ax in figure.axes)
    assert poses.get_ylim()[0] > poses.get_ylim()[1]
    assert [text.get_text().split(" ", 1)[1] for text in poses.get_yticklabels()] == [names[k] for k in order]
    legends = [
        [text.get_text() for text in ax.get_legend().get_texts()] if ax.get_legend() else [] for ax in figure.axes
    ]
    assert [len(each) for each in legends] == [5, 0, 1, 2, 0, 2]
    assert figure.get_suptitle() == "Three devices"
    known = StudyTable([{**row, "not_evaluated": 0.0} for row in rows])
    assert len(comparison_figure(known).axes[0].get_legend().get_texts()) == 4


@pytest.mark.parametrize(
    ("name", "want"),
    [
        ("cuff_height_mm", "cuff height, mm"), ("r_A_mm", "r_A, mm"), ("alpha_A[2]_deg", "alpha_A[2], °"),
        ("A[1].x_mm", "A[1] x, mm"), ("payload_kg", "payload, kg"), ("shares", "shares"), ("some_share", "some share"),
        ("holdable", "share of the poses held, as far as limits are known"),
    ],
)  # fmt: skip
def test_columns_in_words(name, want):
    assert column_words(name) == want


def test_a_study_over_two_parameters_and_over_none():
    rows = [
        {"r_A_mm": r, "h_B_mm": h, "peak_F_s_N": 10.0 * r + h if h < 3 else NAN}
        for h in (3.0, 1.0, 2.0)
        for r in (2.0, 1.0)
    ]
    (ax,) = StudyTable(rows).plot().axes
    curves = [line for line in ax.get_lines() if line.get_marker() == "o"]
    assert [line.get_label() for line in curves] == ["h_B, mm: 1", "h_B, mm: 2", "h_B, mm: 3"]
    np.testing.assert_array_equal(curves[0].get_xydata(), [[1.0, 11.0], [2.0, 21.0]])
    (crosses,) = [line for line in ax.get_lines() if line.get_marker() == "x"]
    assert sorted(crosses.get_xdata()) == [1.0, 2.0]
    assert len(ax.get_yticks())
    same = StudyTable([{"r_A_mm": 1.0, "peak_F_s_N": value} for value in (3.0, NAN, 5.0)])
    (ax,) = same.plot().axes
    assert [text.get_text() for text in ax.get_yticklabels()] == ["1", "2", "3"]
    assert [(text.get_text(), text.xy[1]) for text in ax.texts] == [("no pose is held", 1.0)]
    assert ax.get_ylabel() == "design, row of the table"
    low, high = ax.get_ylim()
    assert (low, high) == (2.6, -0.6)
    ranked = StudyTable([{"design": row["design"], "rank": 1} | row for row in ROWS])
    assert ranked.plot("peak_F_s_N").axes[0].get_xlabel().endswith("N (less is better)")
    assert ranked.plot("can_hold").axes[0].get_xlabel().endswith("(more is better)")


def test_one_thing_uncertain_at_a_time_is_a_bar_each():
    exo = ep.load("four-cables")
    sure = exo.uncertainty(exo.pose(60, 30))
    (ax,) = sure.plot().axes
    shown = bars(ax)
    finite = [end for effect in sure.effects for end in (effect.least, effect.greatest) if np.isfinite(end)]
    edge = max([*finite, sure.magnitude]) + 0.15 * np.ptp([*finite, sure.magnitude])
    for k, effect in enumerate(sure.effects):
        most = min(effect.greatest, edge)
        np.testing.assert_allclose(shown[k], [(effect.least, most - effect.least)])
    assert [text.xy[1] for text in ax.texts] == [
        k for k, effect in enumerate(sure.effects) if np.isinf(effect.greatest)
    ]
    labels = [text.get_text() for text in ax.get_yticklabels()]
    assert labels == [
        f"{quantity_words(effect.name)} ±{effect.size:g}{unit_words(effect.name)}" for effect in sure.effects
    ]
    assert ax.get_ylim()[0] > ax.get_ylim()[1]
    assert any(line.get_xdata()[0] == sure.magnitude for line in ax.get_lines())
    assert ax.get_xlim()[0] < min(finite) < edge < ax.get_xlim()[1] + 0.2 * np.ptp(finite)
    title = " ".join(ax.figure.get_suptitle().split())
    assert title.startswith("four-cables, flexion 60°, abduction 30°")
    assert f"|F_s| {sure.magnitude:.1f} N" in title
    assert ("orange" in title) == (not all(effect.holds for effect in sure.effects))
    assert len({bar.get_facecolor() for bar in ax.patches}) == len({effect.holds for effect in sure.effects})
    assert_words_are_apart(ax.figure)


@pytest.mark.parametrize(
    ("name", "want"),
    [
        ("A[2]_mm", "joint A of limb 2 mm"), ("A_mm", "A mm"), ("offset_mm", "centre of the device mm"),
        ("centre_of_mass_mm", "centre of mass mm"), ("pose_deg", "pose°"), ("tone_percent", "tone %"),
        ("guides_percent", "stiffness of guides %"),
    ],
)  # fmt: skip
def test_quantities_in_words(name, want):
    assert quantity_words(name) + unit_words(name) == want


def test_everything_uncertain_at_once_is_its_draws_and_what_explains_them():
    exo = ep.load("four-linear-actuators-worn")
    spread = exo.total_uncertainty(exo.pose(60, 30), draws=24, seed=3)
    above, below = spread.plot().axes
    low, middle, high = spread.quantiles["F_s_N"]
    counts = [bar.get_height() for bar in above.patches if bar.get_height() != 1.0 or bar.get_width() < high - low]
    assert sum(bar.get_height() for bar in above.patches[:24]) == np.isfinite(spread.shoulder_forces).sum() > 0
    assert counts
    assert f"{low:.0f} to {high:.0f} N in nine of ten, median {middle:.0f}" in above.get_title()
    assert any(line.get_xdata()[0] == spread.magnitude for line in above.get_lines())
    span = above.patches[-1]
    np.testing.assert_allclose([span.get_x(), span.get_x() + span.get_width()], [low, high])
    named = [each for each in spread.explained if np.nan_to_num(each.of_F_s) >= 0.01]
    np.testing.assert_allclose([own[0] for own in bars(below).values()], [(0.0, 100.0 * each.of_F_s) for each in named])
    assert [text.get_text() for text in below.get_yticklabels()] == [
        f"{quantity_words(each.name)} ±{each.size:g}{unit_words(each.name)}" for each in named
    ]
    assert below.get_ylim()[0] > below.get_ylim()[1]
    assert above.get_xlabel() == "|F_s|, N"
    assert above.get_yticks().size == 0
    assert spread.title in " ".join(above.figure.get_suptitle().split())
