"""The ledger: verdicts drawn from numbers."""

import numpy as np
import pytest

from exo_pin.thesis import compare, ledger, ledger_table

ROWS = {(row.source, row.quantity): row for row in ledger()}


def find(source, quantity):
    return next(row for key, row in ROWS.items() if key[0].startswith(source) and key[1].startswith(quantity))


def test_rows_are_unique_and_hold_both_numbers():
    rows = ledger()
    assert len(ROWS) == len(rows)
    for row in rows:
        assert row.printed.shape == row.computed.shape
        assert np.isfinite(row.computed).all() or row.verdict == "not reproducible"
        assert row.verdict == "reproduced" or row.note


@pytest.mark.parametrize(
    ("source", "quantity", "verdict"),
    [
        ("Section 4.2.2", "l_i, positive", "reproduced"),
        ("Section 4.2.2", "l_i, negative", "reproduced"),
        ("Section 4.2.2", "θ_yA", "reproduced"),
        ("Section 4.2.2", "A_2", "misprint, corrected"),
        ("Section 4.2.2", "B_2", "misprint, corrected"),
        ("Section 4.2.2", "R_A3", "misprint, corrected"),
        ("Section 4.2.2", "orientation", "not reproducible"),
        ("Table 5-4", "distance", "reproduced"),
        ("Table 5-4", "principal", "misprint, corrected"),
        ("(D-32)", "f_i", "not reproducible"),
        ("(D-33)", "F_s0", "not reproducible"),
        ("(D-35)", "g_i", "not reproducible"),
        ("(D-36)", "F_s", "reproduced"),
        ("(D-8)", "a_C", "misprint, corrected"),
    ],
)
def test_verdicts(source, quantity, verdict):
    assert find(source, quantity).verdict == verdict


def test_appendix_d_computes_what_its_data_say():
    np.testing.assert_allclose(find("(D-32)", "f_i").computed, [-73.10, -25.23, -27.23], atol=0.005)
    row = find("(D-32), (D-33)", "sum of")
    assert row.printed[0] < row.computed[0]


def test_scenario_one_lengths():
    np.testing.assert_allclose(
        find("Section 4.2.2", "l_i, positive").computed, [159.5270, 41.6830, 108.7461], atol=1e-4
    )


def test_verdict_follows_the_numbers():
    assert compare("s", "q", "", 1.0, 1.04, 0.05).verdict == "reproduced"
    assert compare("s", "q", "", 1.0, 1.06, 0.05).verdict == "not reproducible"
    assert compare("s", "q", "", -1.0, 1.0, 0.05, mended=1.0).verdict == "misprint, corrected"
    assert compare("s", "q", "", -1.0, 1.0, 0.05, mended=2.0).verdict == "not reproducible"


def test_table_has_a_row_each():
    lines = ledger_table(ledger()).splitlines()
    assert len(lines) == len(ROWS) + 2
    assert len({line.replace("\\|", "").count("|") for line in lines}) == 1


def test_no_reading_of_the_example_gives_its_printed_tensions():
    """Euler orders, transposes, gravity axes, limb orders and signs of B_i, all together."""
    from itertools import permutations, product

    from scipy.spatial.transform import Rotation

    from exo_pin.design import preset

    mechanism = preset("appendix-d")
    printed = np.array([9.51, 25.6, 19.8])
    angles = {"x": 2 * np.pi / 7, "y": np.pi / 4, "z": -np.pi / 3}
    A, B, C = mechanism.geometry.base_points, mechanism.geometry.platform_points, mechanism.arm.centre_of_mass
    orders = ["".join(order) for order in permutations("xyz")]
    rotations = [Rotation.from_euler(o, [angles[c] for c in o]).as_matrix() for o in orders]
    rotations += [Rotation.from_euler(o.upper(), [angles[c] for c in o]).as_matrix() for o in orders]
    rotations += [R.T for R in rotations]
    nearest = np.inf
    for R, signs, order in product(rotations, product((1, -1), repeat=3), permutations(range(3))):
        b = (B * signs)[list(order)] @ R.T
        s = (b - A) / np.linalg.norm(b - A, axis=1, keepdims=True)
        arms = np.cross(b, s).T
        if abs(np.linalg.det(arms)) < 1e-9:
            continue
        for axis, sign in product(range(3), (1, -1)):
            moment = np.cross(R @ C, 19.62 * sign * np.eye(3)[axis])
            f = np.linalg.solve(arms, moment)
            # Whatever limb the print calls first, and whatever sign it gives to tension.
            for shown in permutations(printed):
                nearest = min(nearest, np.abs(np.abs(f) - shown).max())
    assert nearest > 0.5
    computed = find("(D-32)", "f_i").computed
    assert np.abs(np.sort(np.abs(computed)) - np.sort(printed)).max() > nearest - 1e-9
