"""Which tolerance a file gets, by what its digits explain: each answer of the measurement, and none."""

from dataclasses import replace

import numpy as np
import pytest
from mechanisms import five_bar

from exo_pin import FileFormatError
from exo_pin.chain import ClosedChain
from exo_pin.chain.formats import digits
from exo_pin.chain.kinematics.structural_rank import Agreement

pytestmark = pytest.mark.usefixtures("plain")

#: Half a unit of four decimals.
WORDS, ROUNDED = ("0.1234", "2"), 5e-5


def chosen(monkeypatch, worst, measured, closes=True, words=WORDS):
    """Tolerance and reason of a five-bar, given what is found of it."""
    named = five_bar()
    chain = named.chain()

    def closed(state):
        # Loops close within the tolerance of the digits, and without it if that is said.
        return named.q if closes or state.tolerance else None

    def refused(*given):
        raise AssertionError("a file without rounded numbers is not measured")

    monkeypatch.setattr(digits, "_closed", closed if words == WORDS else refused)
    monkeypatch.setattr(digits, "agreeing_rows", lambda state, q: worst)
    monkeypatch.setattr(digits, "_measured", lambda *given: measured if worst != (0, 0.0) else refused())
    found = digits.with_digits(chain.model, chain.description, words, lambda redrawn: None)
    assert replace(found, tolerance=0.0, rounding=0.0, left_out=()) == chain.description
    # What makes no difference to the loops counts in ranks, by what was measured of it.
    is_read_as_known = closes and worst is not None and not found.left_out and words == WORDS
    explained = (measured.tolerance if measured else 0.0) or ROUNDED
    is_unclear = closes and measured is None and worst != (0, 0.0)
    in_ranks = is_read_as_known or is_unclear or (closes and measured and not measured.rows)
    assert found.rounding == (explained if in_ranks else 0.0)
    return found.tolerance, tuple(text.partition(" (no effect: ")[0] for text in found.left_out)


AGREES = "digits: places are known to 5e-05 m and rad, and of the loops' rows 2 agree with others to 3e-06"


@pytest.mark.parametrize(
    ("worst", "measured", "tolerance"),
    [
        # The worst chain has as many rows that agree: the tolerance is that of the digits.
        ((2, 1e-5), Agreement(2, 3e-6, 1e-6), 5e-5), ((2, 1e-5), Agreement(2, 3e-6, 0.0), 5e-5),
        # It has others, or does not say: the smaller tolerance, and never a larger one.
        ((1, 1e-5), Agreement(2, 3e-6, 1e-6), 1e-6), (None, Agreement(2, 3e-6, 1e-6), 1e-6),
        ((1, 1e-5), Agreement(2, 3e-6, 0.0), 5e-5), ((1, 1e-5), Agreement(2, 3e-6, 2e-4), 5e-5),
    ],
)  # fmt: skip
def test_rows_that_agree_by_the_digits(worst, measured, tolerance, monkeypatch):
    for closes in (True, False):
        assert chosen(monkeypatch, worst, measured, closes) == (tolerance, (AGREES,))


@pytest.mark.parametrize(
    ("worst", "measured", "tolerance"),
    [((0, 0.0), None, 5e-5), ((1, 1e-5), Agreement(0, 0.0, 2e-6), 2e-6), (None, Agreement(0, 0.0, 0.0), 5e-5)],
)
def test_loops_that_close_within_the_digits_alone(worst, measured, tolerance, monkeypatch):
    said = "digits: places are known to 5e-05 m and rad, and the loops close no better"
    assert chosen(monkeypatch, worst, measured, False) == (tolerance, (said,))
    # Loops that close anyhow need none.
    assert chosen(monkeypatch, worst, measured, True) == (0.0, ())


def test_what_is_not_clear_is_read_as_it_stands_and_counts_in_ranks(monkeypatch):
    said = "digits: places are known to 5e-05 m and rad, which leaves open whether rows of the loops agree"
    for worst in (None, (1, 1e-5)):
        assert chosen(monkeypatch, worst, None) == (0.0, (f"{said}: read as they stand",))
        # Loops that close no better have the tolerance of the digits.
        assert chosen(monkeypatch, worst, None, False) == (5e-5, (said,))


def test_files_without_rounded_numbers_are_not_measured(monkeypatch):
    assert chosen(monkeypatch, (0, 0.0), None, words=("0.5", "2")) == (0.0, ())


def test_a_stated_tolerance_stays_and_chains_without_loops_need_none(monkeypatch):
    monkeypatch.setattr(digits, "_closed", lambda state: pytest.fail("not asked"))
    chain = five_bar().chain()
    for stated in (replace(chain.description, tolerance=1e-7), replace(chain.description, closures=())):
        assert digits.with_digits(chain.model, stated, WORDS, lambda redrawn: None) is stated


def test_digits_are_measured_on_geometries_that_make_the_same_chain(monkeypatch):
    """Of 16 others each is another one; where one is no chain, or has other rows or freedoms, nothing is known."""
    monkeypatch.setattr(digits, "measured_agreement", lambda state, others, q, tolerance: (len(others), tolerance))
    chain, seeds = five_bar().chain(), []

    def again(seed):
        seeds.append(seed)
        return chain.model, chain.description

    assert digits._measured(chain._state, five_bar().q, again, 1e-5) == (16, 1e-5)
    assert len(set(seeds)) == len(seeds) == 16

    def refused(seed):
        if seed == 7:
            raise FileFormatError("no robot")
        return again(seed)

    less = replace(chain.description, closures=())
    fewer = chain.locked(["left_crank_hinge"], five_bar().q)
    for other in (
        refused, lambda seed: (chain.model, less if seed == 7 else chain.description),
        lambda seed: (fewer.model, fewer.description) if seed == 7 else again(seed),
    ):  # fmt: skip
        assert digits._measured(chain._state, five_bar().q, other, 1e-5) is None


def test_a_file_is_closed_from_where_it_is_drawn():
    named = five_bar()
    chain = named.chain()
    q = digits._closed(chain._state)
    assert np.abs(chain.residual(q)).max() < 1e-12
    closure = chain.closures[0]
    # No closed configuration: the end is farther away than the bars reach.
    far = replace(closure, placement_b=replace(closure.placement_b, translation=(9.0, 0.0, 0.0)))
    apart = ClosedChain(chain.model, replace(chain.description, closures=(far,)))
    assert digits._closed(apart._state) is None
