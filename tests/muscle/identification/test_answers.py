"""Answers of identified force laws, as they are stored: fits, regions, doubts about measurements, friction."""

from dataclasses import replace
from itertools import count
from time import monotonic
from unittest import mock

import numpy as np
from answers import changes, each_of
from asked_in_turn import in_turn, tried
from some_muscles import WIDE

from exo_pin.muscle import (
    Damping,
    DynamicModel,
    LoadDependentFriction,
    PressureStep,
    Recording,
    dynamic_model,
    find_region,
    identify_dynamic,
    identify_static,
    muscle_model,
    simulate,
    steady_states,
)

STATES = steady_states(valid_only=True)
ALL = steady_states()
#: Factors of the measured forces, as a scale of little care has them.
WORN = 1.0 + 0.01 * np.sin(np.arange(66.0) ** 1.3)


def states(force=None, *, among=STATES, **options):
    forces = among.force if force is None else among.force * force
    return identify_static(among.contraction, among.pressure, forces, 0.3, **options)


def slipped(count=25, **factors):
    """Factors of one everywhere but for some measurements, "n7" for the eighth."""
    found = np.ones(count)
    for name, factor in factors.items():
        found[int(name[1:])] = factor
    return found


def coarse():
    """States of a muscle that is hardly contracted, or stretched, in whole mm, 0.1 bar and 10 N."""
    x, p, f = plane(off=0.01)
    return -np.round(0.4 * x, 3), np.round(p, -4), np.round(f, -1)


def slipped_coarse(factor):
    """Which of these states are suspect, of which one has another force."""
    x, p, f = coarse()
    states = x, p, f * slipped(n7=factor)
    return identify_static(*states, 0.3, powers=((2, 1), (0, 1), (0, 0))).suspects


def slipped_little(factor):
    """Which of the states of nearly a plane are left out, of which one has another force."""
    x, p, f = plane(off=1e-3)
    return find_region(x, p, f * slipped(n12=factor), 0.3, powers=((1, 1), (0, 1), (0, 0))).outliers


def told(fit):
    return fit.names, fit.coefficients, fit.cautions, fit.diameters, fit.rounding, fit.region and fit.region.misfit


def asked_of_fits():
    return in_turn(
        fit=lambda: states(diameter=0.0065, name="mine", source="a rig"),
        region=lambda: states(WORN, among=ALL, select="region"),
        intervals=lambda: states(powers=((1, 1), (0, 1), (0, 0))).intervals(0.9),
        widest=lambda: (states(powers=((1, 1), (0, 1), (0, 0)), validity=WIDE).model.validity, states().intervals(1.0)),
        suspect=lambda: states(slipped(n7=1.4)).cautions,
        suspects=lambda: states(slipped(n7=0.6, n20=1.5)).cautions,
        outlier=lambda: told(states(slipped(66, n25=0.7, n41=1.25), among=ALL, select="region")),
        coarse=lambda: told(identify_static(*coarse(), 0.3, powers=((2, 1), (0, 1), (0, 0)), diameter=0.02)),
        five=lambda: (
            identify_static(
                *(each[[0, 3, 9, 16, 24]] for each in plane(4.0123456789, slip=1.02, length=0.3012345678)),
                0.3,
                powers=((0, 1), (1, 1), (0, 0)),
            ).suspects
        ),
        row_by_row=lambda: states(STATES.force[::-1] / STATES.force, diameter=0.0065).cautions,
        form=lambda: told(states(select="region", powers=((0, 1), (1, 0)))),
        coarse_slip=lambda: tried(slipped_coarse, 1.2660, 1.2679),
        dropped=lambda: told(identify_static(*dropped(900.0), 0.3, select="region")),
        squares=lambda: [each.effects for each in states(powers=((0, 2), (1, 1), (0, 0))).known],
        no_level=lambda: states().intervals(0.0),
        few=lambda: states(among=STATES.select(np.arange(25) < 6)),
        seven=lambda: states(among=STATES.select(np.arange(25) < 7)).suspects,
        few_of_region=lambda: told(states(among=STATES.select(np.arange(25) < 8), select="region")),
        least_of_region=lambda: [
            states(among=STATES.select(np.arange(25) < count), select="region").region for count in (8, 9)
        ],
        twice=lambda: states(powers=((1, 1), (0, 1), (1, 1))),
        no_powers=lambda: states(powers=()),
        select=lambda: states(select="some"),
        high_powers=lambda: told(states(powers=((4, 3), (0, 1)))),
    )


def dropped(slope):
    """States of a muscle that pulls less where it is hardly contracted, as no braid makes it."""
    count = np.arange(60.0)
    x, p = 0.0375 * (1.0 + np.sin(count**1.3)), 1e5 * (2.75 + 1.25 * np.sin(count**1.7))
    force = muscle_model("tang-optimised").unchecked_force(x, p) + 0.2 * np.sin(count**1.9)
    return x, p, force - np.where(x < 0.02, slope * (0.02 - x), 0.0)


def asked_of_regions():
    def region(force=1.0, among=ALL, **options):
        return find_region(among.contraction, among.pressure, among.force * force, 0.3, **options)

    return in_turn(
        all=region,
        strict=lambda: region(WORN, level=0.2),
        lax=lambda: region(WORN, level=1e-9),
        valid=lambda: region(among=STATES),
        slips=lambda: [
            region(slipped(66, **slip))
            for slip in ({"n40": 1.3}, {"n25": 0.7, "n41": 1.25}, {"n62": 1.4, "n41": 1.3}, {"n60": 1.06})
        ],
        little=lambda: [slipped_little(factor) for factor in (1.03, 1.06, 1.2)],
        no_line=lambda: region(slipped(66, n28=0.6)).margin,
        short=lambda: region(powers=((1, 1), (0, 1), (0, 0))),
        dropped=lambda: [find_region(*dropped(slope), 0.3).misfit for slope in (900.0, 790.0, 750.0)],
        level=lambda: region(level=1.0),
        few=lambda: region(among=STATES.select(np.arange(25) < 8)),
        nine=lambda: region(among=STATES.select(np.arange(25) < 9)),
        lengths=lambda: find_region(ALL.contraction, ALL.pressure[:-1], ALL.force, 0.3),
    )


def plane(top=4.0, end=0.28, area=6.0, tube=0.4, length=0.3, off=0.0, rows=5, slip=1.0):
    """States of a muscle of 20 mm whose pull is a plane: greatest pressure, bar, strain where it ends, and so on."""
    bar, strain = (grid.ravel() for grid in np.meshgrid(np.linspace(0.6, 1.0, rows) * top, np.linspace(0.0, 0.1, rows)))
    gain = area * np.pi / 4.0 * 0.02**2 * 1e5
    pull = bar * gain - bar * strain * (gain - tube * gain / top) / end - tube * gain
    noise = off * np.sin(np.arange(bar.size) ** 1.7) * pull.max()
    pull[-1] *= slip
    return length * strain, 1e5 * bar, pull + noise


def doubts(diameter=0.02, length=0.3, written=("mm", "bar", "N"), among=slice(None), **changed):
    x, p, f = (each[among] for each in plane(length=length, **changed))
    return identify_static(x, p, f, length, powers=((1, 1), (0, 1), (0, 0)), diameter=diameter, written=written).doubts


def asked_of_doubts():
    return {
        "top": tried(lambda v: doubts(top=v), 0.98, 1.02, 9.9),
        "end": tried(lambda v: doubts(end=v), 0.148, 0.152, 0.59, 0.61),
        "area": tried(lambda v: doubts(area=v), 0.975, 0.99, 2.45, 2.55, 15.8, 16.2, 60.0, 600.0),
        "tube": tried(lambda v: doubts(tube=v), -0.61, -0.59, 0.98, 1.02),
        "slender": tried(lambda v: doubts(None, area=v), 0.1, 30.0, 200.0),
        "long": tried(lambda v: doubts(None, length=v), 0.079, 0.081, 1.99, 2.01),
        "top_unit": tried(lambda v: doubts(None, top=v, area=0.018), 110.0, 137.0),
        "noisy_area": tried(lambda v: doubts(area=v, off=0.02), 16.87, 16.89),
        "noisy_tube": tried(lambda v: doubts(tube=v, off=0.01), -0.6814, -0.6801, 1.1117, 1.1131),
        "scatter": tried(lambda v: doubts(area=7.0, off=v, end=0.2), 0.09, 0.13),
        "written": tried(
            lambda v: doubts(area=60.0, written=v), ("cm", "psi", "lbf"), ("length in inch", "kPa absolute", "gf")
        ),
        "absolute": tried(lambda v: doubts(tube=v, written=("mm", "bar absolute", "N")), -0.65),
        "both": tried(lambda v: doubts(area=v, top=0.9), 40.0),
        "many": tried(lambda v: doubts(area=6.0, end=v, rows=22), 0.148, 0.3),
        "few": tried(lambda v: doubts(area=v, rows=2), 60.0),
        "five": tried(lambda v: doubts(area=v, among=[0, 3, 9, 16, 24]), 60.0),
    }


def changed(column, value, rows=1, nominal=0.3):
    """What is said of states of which the first rows of a column have another value."""
    states = [np.where(np.arange(25) < rows, value if k == column else own, own) for k, own in enumerate(plane())]
    return identify_static(*states, nominal, powers=((1, 1), (0, 1), (0, 0)), diameter=0.02).doubts


def asked_of_possible_states():
    most = plane()[2].max()
    return {
        "strain": tried(lambda value: changed(0, 0.3 * value), -0.0499, -0.05, -0.0501, 0.4, 0.4001),
        "bar": tried(lambda value: changed(1, 1e5 * value), 0.0, -0.001, 10.0, 10.001),
        "push": tried(lambda share: changed(2, -share * most), 0.049, 0.051),
        "rows": tried(lambda rows: changed(0, 100.0, rows), 2, 3),
        "falls": tried(lambda rows: changed(2, most - plane()[2], rows), 25),
        "nominal": tried(lambda size: changed(0, 0.0, 0, size), 3e-4, 3e-3, 0.03, 3.0, 30.0, 300.0),
    }


def recording(begins=None, noise=0.0, samples=31, mass=22.74 / 9.81, step=(2.6e5, 4.0e5, 0.05, 0.03), seconds=0.35):
    times, step = np.linspace(0.0, seconds, samples), PressureStep(*step)
    response = simulate(TRUE, mass, step, times, outside="mark").contraction.copy()
    start, seen = float(response[0]), response + noise * np.sin(np.arange(float(samples)) ** 1.7)
    seen[0] = seen[0] if begins is None else begins
    return Recording(times, seen, step, mass, start)


TRUE = DynamicModel(
    name="true",
    static=dynamic_model("tang-3-31").static,
    friction=LoadDependentFriction.from_bar(228.9, -90.4, 6.87),
    damping=Damping.from_bar(-4.0, 0.8),
)
VALUES = np.array([228.9, -90.4, 6.87, -4.0, 0.8])


#: At rest there a muscle pulls nothing, at the stop, nearly or just so much more or less than its weight as is doubted.
BEGINS = (0.12, 0.0, 0.07085, 0.07093, 0.02788, 0.02548)


def figures(values):
    """Numbers of a search as texts of three digits, of which the last may differ."""
    return [f"{value:.2e}" for value in np.ravel(values)]


def dynamic_questions():
    def found(*recordings, start=VALUES, sets=None, clock=monotonic, **options):
        # A clock that ticks with each set of responses that is simulated.
        clock = clock if sets is None else count().__next__
        options = options if sets is None else options | {"time_limit": sets}
        with mock.patch("exo_pin.muscle.identification.dynamic_identification.monotonic", clock):
            fit = identify_dynamic(recordings, TRUE.static, start=start, name="mine", source="a rig", **options)
        known = [(one.name, one.size, one.unit, figures(list(one.effects.values())), one.shows) for one in fit.known]
        sizes = [figures(part) for part in (fit.coefficients, np.diag(fit.covariance), fit.sigma, fit.intervals(0.9))]
        return sizes, fit.samples, fit.indistinct, fit.inside, fit.cautions, known, fit.model.source

    still, short = PressureStep(3.6e5, 3.6e5), np.linspace(0.0, 1.0, 12)
    pair = [
        recording(noise=1e-4, samples=8, mass=mass, step=(*step, 0.01, 0.01), seconds=0.09)
        for mass, step in ((1.3, (1.3e5, 4e5)), (3.5, (4e5, 1.8e5)))
    ]
    return {
        "two": lambda: found(*pair, sets=12),
        "guessed": lambda: found(*pair, start=None, sets=36),
        "drives": lambda: tried(
            lambda start: found(*pair, start=start, sets=12),
            (0, -100, 4.15, 1, 1),
            (0, 0, 4, 3, -1),
            (0, -90, 6, 0.4, 0.9),
        ),
        "doubted": lambda: found(
            *pair,
            *(recording(x, seconds=0.01, samples=2, mass=1.3) for x in BEGINS),
            start=[99.0, -40.0, 5.0, 0.9, 1.1],
            sets=12,
        ),
        "still": lambda: found(Recording(short, np.full(12, 0.059), still, 2.3)),
        "few": lambda: found(Recording([0.0, 1.0], [0.05, 0.05], still, 1.0)),
        "none": lambda: found(),
        "mass": lambda: found(*pair, 1.3),
        "start": lambda: found(recording(samples=11), start=[1.0, 2.0]),
        "soon": lambda: found(recording(samples=11), clock=count(step=30.0).__next__),
        "never": lambda: found(recording(samples=11), time_limit=0.0),
        "millimetres": lambda: found(Recording(short, np.full(12, 59.0), still, 2.3)),
        "bar": lambda: found(Recording(short, np.full(12, 0.059), PressureStep(3.6e6, 3.6e6), 2.3)),
    }


def asked_of_dynamic_fits():
    return in_turn(dynamic_questions())


def asked_of_recordings():
    step = PressureStep(2.6e5, 4.0e5, 0.05, 0.03)
    seen = np.array([-0.001, 0.012, 0.03])
    plain = Recording([0.0, 0.2, 0.35], seen, step, 1.3)
    return in_turn(
        plain=lambda: plain.residual(TRUE),
        start=lambda: replace(plain, start=0.02).residual(TRUE),
        trace=lambda: Recording([0.0, 0.2, 0.35], seen, [2e5, 2.2e5, 2.1e5], 1.3).residual(TRUE),
        shape=lambda: Recording([0.0, 0.1], seen, step, 1.3),
        rising=lambda: Recording([0.0, 0.1, 0.1], seen, step, 1.3),
        mass=lambda: Recording([0.0, 0.1, 0.2], seen, step, 0.0),
        begins=lambda: Recording([0.0, 0.1, 0.2], seen, step, 1.0, np.nan),
        trace_shape=lambda: Recording([0.0, 0.1, 0.2], seen, [2e5, 3e5], 1.0),
    )


ASKED = {
    "fits": asked_of_fits,
    "regions": asked_of_regions,
    "doubts": asked_of_doubts,
    "possible": asked_of_possible_states,
    "dynamic_fits": asked_of_dynamic_fits,
    "recordings": asked_of_recordings,
}
#: Those that take longer than 0.15 s.
LONGER = {"fits", "doubts"}


@each_of(ASKED, LONGER)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
