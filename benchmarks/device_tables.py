"""Tables and picture of the comparison of devices (compare_devices.py)."""

import re

import numpy as np

from exo_pin.view.colours import BLUE, GREY, ORANGE, RED, SKY

MARKS = ("<!-- from benchmarks/compare_devices.py -->", "<!-- end -->")
#: Built as, what it is called in the tables, and its kind.
DEVICES = {
    "prototype": "3UPU wrist + S, pneumatic muscles",
    "optimised-table-c-2": "3UPU wrist + S, Table C-2",
    "three-linear-actuators": "3SPS + S, found",
    "four-linear-actuators-worn": "4SPS + S, found",
    "four-cables": "four cables + S, found",
    "six-cables": "six cables + S, found",
    "spherical-3rrr": "spherical 3RRR",
    "3rps-passive-ball": "3RPS, sliding ball",
    "serial-y-x-z": "serial, Y-X-Z",
    "nesm": "serial, X-Y-Z",
    "spring-support": "passive spring",
}
#: Flexion, abduction, internal rotation of the poses with muscles and off the centre, degrees.
FEW = ((60.0, 0.0, 0.0), (0.0, 60.0, 0.0), (30.0, 45.0, 30.0))
COLOURS = (BLUE, RED, SKY)
HOLDING = {
    "device": "device",
    "kind": "kind",
    "held": "held, %",
    "clear": "clear, %",
    "useful": "held and clear, %",
    "lift": "lift held, %",
    "failed": "held after a failure, %",
    "reached": "reached, %",
    "singular": "singular, %",
    "dexterity": "dexterity",
}
SHOULDER = {
    "device": "device",
    "median": "median F_s, N",
    "peak": "peak F_s, N",
    "open": "undetermined",
    "off": "change by 10 mm, N",
    "cuff": "on a soft cuff, N",
    "contact": "contact, N",
    "relief": "relief, %",
}
DRIVES = {
    "device": "device",
    "moving": "device on the arm, kg",
    "links": "other links, kg",
    "effort": "largest efforts",
    "share": "of their limit, %",
    "travel": "travels",
}


def drive_count(exo):
    """Number of its drives."""
    return len(exo.limbs) if exo.is_wrist else len(exo.device.drives)


def number(value, digits=0):
    """A number of the table; a dash where it has no meaning."""
    return "-" if np.isnan(value) else "cannot follow" if np.isinf(value) else f"{value:.{digits}f}"


def row(name, found):
    """Texts of a row of the first two tables."""
    share = {key: number(100.0 * found[key]) for key in ("held", "lift", "reached", "clear", "useful", "singular")}
    if not found["all_known"] and found["held"] > 0.0:
        share["held"], share["useful"] = share["held"] + " at most", share["useful"] + " at most"
    failed, (with_device, without) = found["failed"], found["contact"]
    return {
        "device": f"`{name}`",
        "kind": DEVICES[name],
        **share,
        "dexterity": number(found["dexterity"], 2),
        "median": number(found["median"]),
        "peak": number(found["peak"]),
        "open": str(found["open"]),
        "failed": number(100.0 * failed.min()),
        "off": "over 1000" if 1e3 < found["off"] < np.inf else number(found["off"]),
        "cuff": number(found["cuff"]),
        "contact": ", ".join(map(number, with_device)),
        "relief": ", ".join(map(number, 100.0 * (1.0 - with_device / without))),
    }


def drive_row(name, found):
    """Texts of a row of the last table."""
    exo, (own, links) = found["exo"], found["masses"]
    count = drive_count(exo)
    turning = not exo.is_wrist and count and exo.device.unit_of(exo.device.drives[0]) == "N m"
    travel = np.degrees(found["travel"]) if turning else 1e3 * found["travel"]
    efforts = "-" if found["effort"] is None else ", ".join(f"{value:.0f}" for value in found["effort"][:count])
    units = ("N m", "°") if turning else ("N", "mm")
    return {
        "device": f"`{name}`",
        "moving": f"{own:.2f}" if own > 0.0 else "not known",
        "links": "not known" if exo.is_wrist else f"{abs(links):.2f}",
        "effort": efforts if efforts in ("", "-") else f"{efforts} {units[0]}",
        "share": number(100.0 * found["share"]),
        "travel": f"{', '.join(f'{value:.0f}' for value in travel)} {units[1]}" if count else "",
    }


def markdown(heads, rows):
    """A table of the docs."""
    lines = [heads.values(), ["---"] * len(heads), *([line[key] or "-" for key in heads] for line in rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def cells(page, heads):
    """Rows of a table with these heads in a page, as texts by device and head."""
    _, _, rest = page.partition(f"| {' | '.join(heads.values())} |")
    rows = [re.split(r" \| ", line[2:-2]) for line in rest.strip().split("\n\n")[0].splitlines()[1:]]
    return {texts[0].strip("`"): dict(zip(heads, texts, strict=True)) for texts in rows}


def draw(found, path):
    """Held share, |F_s|, contact force and mass of every device."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    names = list(found)[::-1]
    at = np.arange(len(names))
    figure, axes = plt.subplots(1, 4, figsize=(12, 5.4), sharey=True, layout="constrained")
    after = [100.0 * np.nan_to_num(found[name]["failed"].min()) for name in names]
    axes[0].barh(at + 0.2, [100.0 * found[name]["held"] for name in names], 0.38, color=BLUE, label="all drives")
    axes[0].barh(at - 0.2, after, 0.38, color=ORANGE, label="without the drive that matters most")
    axes[0].set_xlabel("poses held, %")
    drawn = [found[name]["force"] if len(found[name]["force"]) else [np.nan] for name in names]
    axes[1].boxplot(
        drawn, positions=at, orientation="horizontal", whis=(0, 100), manage_ticks=False, medianprops={"color": RED}
    )
    axes[1].set_xlabel("|F_s| of held poses, N")
    bare = next(iter(found.values()))["contact"][1]
    for pose, marker in enumerate("osv"):
        label = "flexion {:.0f}°, abduction {:.0f}°".format(*FEW[pose])
        with_device = [found[name]["contact"][0][pose] for name in names]
        axes[2].plot(with_device, at, marker, ms=5, color=COLOURS[pose], label=label)
        axes[2].axvline(bare[pose], color=COLOURS[pose], lw=1.0, ls=":")
    axes[2].set_xlabel("contact force, N\n(dotted: without device)")
    axes[3].barh(at, [found[name]["masses"][0] + found[name]["masses"][1] for name in names], 0.6, color=GREY)
    axes[3].set_xlabel("moving mass, kg\n(without limbs of parallel wrists)")
    axes[0].set_yticks(at, names)
    axes[0].set_title("poses held")
    axes[1].set_title("shoulder force at rest")
    axes[2].set_title("joint, with own muscles")
    axes[3].set_title("moving mass")
    # Legends stand below, where they hide no mark.
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower left", ncols=1, frameon=False)
    figure.legend(*axes[2].get_legend_handles_labels(), loc="outside lower right", ncols=3, frameon=False)
    figure.savefig(path, dpi=200)
    plt.close(figure)
