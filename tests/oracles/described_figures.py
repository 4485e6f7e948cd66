"""A figure of matplotlib as plain data: what is drawn, where, in which colours and sizes; not how, and no fonts."""

import numpy as np
from descriptions import numbers
from matplotlib import rcParams
from matplotlib.cm import ScalarMappable
from matplotlib.collections import QuadMesh
from matplotlib.colors import to_hex
from matplotlib.contour import ContourSet
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.text import Annotation
from matplotlib.ticker import (
    FixedFormatter,
    FixedLocator,
    FuncFormatter,
    MaxNLocator,
    MultipleLocator,
    StrMethodFormatter,
)

_LINE = ("label", "color", "linestyle", "linewidth", "drawstyle", "alpha", "zorder", "markevery", "clip_on",
         "solid_joinstyle", "solid_capstyle")  # fmt: skip
_MARK = ("marker", "markersize", "markerfacecolor", "markeredgecolor", "markeredgewidth")
_FACE = ("label", "facecolor", "edgecolor", "linewidth", "hatch", "alpha", "zorder", "rasterized", "linestyle")
_TEXT = ("text", "color", "fontsize", "fontweight", "horizontalalignment", "verticalalignment", "zorder")
#: What matplotlib does where nothing is asked.
_USUAL = {
    "linestyle": "-", "drawstyle": "default", "clip_on": True, "solid_joinstyle": "round",
    "solid_capstyle": "projecting", "fontweight": "normal", "rasterized": False, "color": "#000000ff",
    "horizontalalignment": "left", "verticalalignment": "baseline", "edgecolor": "#00000000",
}  # fmt: skip
#: Order of drawing of each kind.
_ORDER = {"Line2D": 2.0, "Text": 3.0, "Annotation": 3.0, "LineCollection": 2.0}


def figure_description(figure):
    """A figure, or a part of one."""
    found = {"size": numbers([figure.bbox.width / figure.dpi, figure.bbox.height / figure.dpi])} if (
        figure.get_figure(root=True) is figure
    ) else {}  # fmt: skip
    own = {name: getattr(figure.subplotpars, name) for name in ("left", "right", "bottom", "top", "wspace", "hspace")}
    if any(value != rcParams[f"figure.subplot.{name}"] for name, value in own.items()):
        found["subplots"] = numbers([*own.values()])
    for name in ("suptitle", "supxlabel"):
        text = getattr(figure, f"_{name}", None)
        if text is not None:
            found[name] = _looks(text, _TEXT[:4])
    found["legends"] = [_legend(legend, figure) for legend in figure.legends]
    for k, ax in enumerate(figure.axes):
        if ax.get_figure(root=False) is figure:
            found[f"axes {k}"] = axes_description(ax)
    # Such a scale has its limits once it is drawn, which moves legends as far as fonts are wide.
    for child in (child for ax in figure.axes for child in ax.child_axes):
        figure.draw_without_rendering()
        found[f"scale {child.get_ylabel()}"] = numbers(child.get_ylim())
    for k, part in enumerate(figure.subfigs):
        found[f"part {k}"] = figure_description(part)
    return {name: value for name, value in found.items() if value not in ([], {}, None)}


def axes_description(ax):
    """Words, scales and everything that is drawn."""
    three = hasattr(ax, "get_zlim")
    titles = (ax._left_title, ax.title, ax._right_title)
    found = {f"title {k}": _looks(title, _TEXT[:3]) for k, title in enumerate(titles) if title.get_text()}
    if not ax.get_visible():
        return {"visible": False}
    for name in ("x", "y", "z")[: 3 if three else 2]:
        axis = getattr(ax, f"{name}axis")
        found[name] = {
            "label": axis.get_label().get_text(), "limits": numbers(getattr(ax, f"get_{name}lim")()),
            "scale": axis.get_scale(), **_ticks(axis),
        }  # fmt: skip
    grid = ax.get_subplotspec() and ax.get_subplotspec().get_topmost_subplotspec()
    if grid:
        whole = grid.get_gridspec()
        ratios = [numbers(each) for each in (whole.get_width_ratios(), whole.get_height_ratios())]
        found["cell"] = [whole.nrows, whole.ncols, grid.num1, *ratios]
    found["spines"] = "".join(name[0] for name, spine in ax.spines.items() if spine.get_visible())
    found |= {"aspect": ax.get_aspect(), "anchor": ax.get_anchor(), "on": bool(ax.axison), "below": ax.get_axisbelow()}
    found["face"] = _hex(ax.get_facecolor())
    if three:
        found |= {"view": [ax.elev, ax.azim], "box": numbers(ax._box_aspect)}
    if bar := getattr(ax, "_colorbar_info", {}):
        found["bar"] = {name: bar.get(name) for name in ("fraction", "shrink", "aspect", "pad", "location")}
    if ax.get_legend() is not None:
        found["legend"] = _legend(ax.get_legend(), ax)
    found["drawn"] = _drawn(ax)
    return {name: value for name, value in found.items() if value not in ("", [], None, ["", "", ""])}


def _ticks(axis):
    found, locator, formatter = {}, axis.get_major_locator(), axis.get_major_formatter()
    if isinstance(locator, FixedLocator):
        found["ticks"] = numbers(locator.locs)
    elif isinstance(locator, MultipleLocator):
        found["ticks"] = numbers(axis.get_majorticklocs())
    elif isinstance(locator, MaxNLocator) and locator._nbins != "auto":
        found["most"] = locator._nbins
    elif isinstance(locator, MaxNLocator) and locator._integer:
        found["whole"] = True
    if isinstance(formatter, FixedFormatter):
        found["words"] = list(formatter.seq)
    elif isinstance(formatter, FuncFormatter):
        found["words"] = [formatter(at) for at in axis.get_majorticklocs()]
    elif isinstance(formatter, StrMethodFormatter):
        found["format"] = formatter.fmt
    looks = axis.get_tick_params()
    names = ("labelsize", "labelbottom", "labelleft", "labelright")
    names += ("grid_color", "grid_linewidth") if looks.get("gridOn") else ()
    return found | {name: looks[name] for name in names if looks.get(name, True) is not True}


def _legend(legend, parent):
    frame = getattr(parent, "transAxes", None) or parent.transSubfigure
    corner = frame.transform((0.0, 0.0))
    box = (legend.get_bbox_to_anchor().get_points() - corner) / legend.get_figure(root=True).dpi
    found = {"texts": [text.get_text() for text in legend.get_texts()], "columns": legend._ncols}
    found |= {"place": [legend._loc, getattr(legend, "_outside_loc", None)], "from": numbers(box.ravel())}
    found["size"] = legend.get_texts()[0].get_fontsize() if legend.get_texts() else None
    found |= {"frame": legend.get_frame_on(), "spacing": legend.columnspacing}
    handles = legend.legend_handles
    found["marks"] = [_looks(h, _LINE[1:4] + _MARK if isinstance(h, Line2D) else _FACE[1:5]) for h in handles]
    return found


def _drawn(ax):
    """Everything that is drawn, in its order; bars of one look together."""
    found = []
    for artist in (*ax.lines, *ax.patches, *ax.collections, *ax.texts):
        one = _artist(artist, ax)
        last = found[-1] if found else {}
        if "bars" in one and one | {"bars": 0} == last | {"bars": 0}:
            last["bars"] += one["bars"]
        else:
            found.append(one)
        if isinstance(artist, ContourSet):
            found += [_artist(text, ax) for text in artist.labelTexts if text not in ax.texts]
    return found


def _artist(artist, ax):
    kind = type(artist).__name__
    if isinstance(artist, Line2D):
        one = _looks(artist, _LINE) | (_looks(artist, _MARK) if artist.get_marker() not in ("None", "", None) else {})
        dashes = getattr(artist, "_unscaled_dash_pattern", (0, None))[1]
        one["dashes"] = None if dashes is None else numbers(dashes)
        one["at"] = numbers(
            np.stack(artist.get_data_3d(), 1) if hasattr(artist, "get_data_3d") else artist.get_xydata()
        )
    elif isinstance(artist, Rectangle):
        one = _looks(artist, _FACE) | {"bars": [numbers(artist.get_bbox().bounds)]}
    elif kind in ("Text", "Annotation", "Text3D"):
        one = _looks(artist, _TEXT) | {"at": numbers(getattr(artist, "get_position_3d", artist.get_position)())}
        if isinstance(artist, Annotation):
            one |= {"to": numbers(artist.xy), "in": [str(artist.xycoords), str(artist.anncoords)]}
        if (box := artist.get_bbox_patch()) is not None:
            one["box"] = _looks(box, (*_FACE[1:4], "alpha")) | {"style": [type(box.get_boxstyle()).__name__,
                numbers(box.get_boxstyle().pad)]}  # fmt: skip
        one["outline"] = [str(getattr(effect, "_gc", "")) for effect in artist.get_path_effects() or ()]
    elif hasattr(artist, "get_patch_transform"):
        points = artist.get_patch_transform().transform(artist.get_path().vertices)
        one = _looks(artist, _FACE) | {"at": numbers(points)}
    else:
        one = _collection(artist)
    over = artist.get_transform().contains_branch_seperately(ax.transData)
    one |= {} if all(over) or kind == "Annotation" else {"over": list(map(bool, over))}
    return {"is": kind} | {name: value for name, value in one.items() if value is not None and value != []}


def _collection(artist):
    coloured = isinstance(artist, ScalarMappable) and artist.get_array() is not None
    names = [name for name in _FACE if not (coloured and name in ("facecolor", "edgecolor"))]
    one = _looks(artist, names)
    if coloured:
        one |= {
            "values": numbers(artist.get_array()),
            "colours": artist.get_cmap().name,
            "ends": numbers(artist.get_clim()),
        }
        if hasattr(artist.get_cmap(), "colors") and artist.get_cmap().N < 20:
            one["colours"] = [to_hex(colour) for colour in artist.get_cmap().colors]
        if hasattr(artist.norm, "boundaries"):
            one |= {"steps": numbers(artist.norm.boundaries), "beyond": artist.norm.extend}
        if artist.colorbar is not None:
            one["bar"] = artist.colorbar.extend
    if isinstance(artist, QuadMesh):
        return one | {"at": numbers(np.asarray(artist.get_coordinates()).reshape(-1, 2))}
    if isinstance(artist, ContourSet):
        one |= {"levels": numbers(artist.levels), "filled": artist.filled, "hatches": list(artist.hatches)}
    if hasattr(artist, "_offsets3d"):
        return one | {"at": numbers(np.stack(artist._offsets3d, 1)), "sizes": numbers(artist.get_sizes())}
    if hasattr(artist, "get_sizes") and len(artist.get_sizes()):
        shape = numbers(artist.get_paths()[0].vertices[:3])
        return one | {"at": numbers(artist.get_offsets()), "sizes": numbers(artist.get_sizes()), "shape": shape}
    # Lines of contours leave room for their words.
    worded = isinstance(artist, ContourSet) and artist.labelTexts
    paths = [path.vertices for path in artist.get_paths() if len(path.vertices) and not worded]
    return one | {"at": numbers(np.concatenate(paths))} if paths else one


def _looks(artist, names):
    found = {}
    for name in names:
        value = getattr(artist, f"get_{name}", lambda: None)()
        if "color" in name:
            value = _hex(value)
        elif name == "label" and str(value).startswith("_"):
            value = None
        elif name == "linestyle" and isinstance(value, list):
            value = str([each for each in value if each[1]]) if any(each[1] for each in value) else None
        elif name in ("linewidth", "zorder", "alpha", "markersize", "markeredgewidth") and value is not None:
            value = numbers(value)
        usual = _USUAL.get(name) if name != "zorder" else _ORDER.get(type(artist).__name__, 1.0)
        if value is not None and value not in ("", "None", "solid") and value != usual:
            found[name] = value if isinstance(value, str | int | float | bool | list | dict) else str(value)
    return found


def _hex(colour):
    """``#rrggbbaa``, and of several colours each once."""
    if isinstance(colour, np.ndarray) and colour.ndim == 2:
        names = list(dict.fromkeys(to_hex(each, keep_alpha=True) for each in colour))
        return names[0] if len(names) == 1 else names[:6] or None
    try:
        return to_hex(colour, keep_alpha=True)
    except (ValueError, TypeError):
        return str(colour)
