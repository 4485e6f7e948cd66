"""The designs of the search in motion beside the prototype: one experiment a row, with its CPU time.

    python benchmarks/designs_in_motion.py

The first run of a process compiles; it is not counted. CPU time is that of controller and integration, without plots.
"""

from __future__ import annotations

import time

from exo_pin.control import experiment

#: Experiments and controllers of the rows.
ROWS = (
    ("held-abduction", "pi"), ("held-abduction", "model"),
    *((f"{design}-{movement}", controller)
      for design in ("four-cables", "four-linear-actuators", "three-linear-actuators", "four-muscle-cables")
      for movement in ("abduction", "flexion", "hand-to-mouth") for controller in ("pi", "model")),
    ("four-cables-torn", "model"), ("four-cables-no-current", "model"), ("four-cables-slipping-brake", "model"),
)  # fmt: skip
#: Short runs that compile what the others need.
WARM_UP = ("held-abduction", "four-cables-abduction", "four-muscle-cables-abduction")


def row(name: str, controller: str) -> str:
    """One line of the table."""
    start = time.process_time()
    tracking = experiment(name, controller).run()
    spent = time.process_time() - start
    numbers = tracking.summary()
    push = numbers.get("peak_push_N", 0.0)
    return (
        f"| `{name}` | {controller} | {numbers['rms_error_deg']:.1f}° | {numbers['mean_F_s_N']:.0f} N | "
        f"{numbers['peak_F_s_N']:.0f} N | {numbers['peak_tension_N']:.0f} N | {push:.0f} N | "
        f"{numbers['mean_power_W']:.0f} W | {tracking.times[-1]:.0f} s | {spent:.1f} s |"
    )


def main() -> None:
    """Print the table."""
    for name in WARM_UP:
        for controller in ("pi", "model"):
            experiment(name, controller).replace(duration=0.2).run()
    print("| experiment | controller | rms error | mean F_s | peak F_s | pull | push | power | time | CPU |")
    print("| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |")
    for name, controller in ROWS:
        print(row(name, controller))


if __name__ == "__main__":
    main()
