"""Sliders in a notebook for the pose and the dimensions of a design."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, TypedDict, Unpack

from ...core.conventions import shoulder_rotation
from ...core.errors import ExoPinError, InvalidInput, MissingExtra
from ...core.records import OneProcess
from ...core.validation import as_choice
from ...reaction import Reaction, Split
from .panels import ANGLES
from .scene_of_exo import Scene

if TYPE_CHECKING:
    from ...exo.shoulder_exo import ShoulderExo
    from ...person import Person

#: Dimensions of (4-2) that have sliders, what they are, and how far from the design's own value they go, m.
DIMENSIONS = {
    "r_A": ("base radius", 0.06),
    "r_B": ("platform radius", 0.06),
    "h_A": ("base distance", 0.08),
    "h_B": ("platform distance", 0.08),
}


class SceneOptions(TypedDict, total=False):
    """Arguments of :class:`Scene` after the device, for functions that hand them on by name."""

    human: bool | None
    limbs: str
    metres_per_newton: float | None
    person: Person | None
    device: bool


class Sliders(OneProcess):
    """Sliders for the pose and the main dimensions, over a scene.

    As the last line of a notebook cell it shows itself: sliders and the scene. The sliders need ipywidgets
    (extra ``notebooks``); without it the cell shows the scene as it is, and :meth:`set` moves it.

    The live scene is a frame to a port of the machine where Python runs. In a notebook whose server is elsewhere that
    port has to be forwarded (``ssh -L 7000:127.0.0.1:7000``), or take ``live=False``: then the scene travels through
    the notebook itself and is drawn anew when a slider is released.

    Parameters
    ----------
    exo : ShoulderExo
        Where to start.
    dimensions : sequence of str, optional
        Which of r_A, r_B, h_A, h_B have sliders; all, if the joints lie on circles, else none.
    live : bool
        Whether the scene is served on a port.
    split : str
        As in :meth:`exo_pin.ShoulderExo.reaction`.
    **options
        Further arguments of :class:`Scene`, and ``constraint_bounds``.

    Raises
    ------
    UnknownName
        If a dimension has no slider.
    InvalidInput
        If ``dimensions`` is given for a geometry made from points.

    Examples
    --------
    >>> from exo_pin.view import Sliders
    >>> panel = Sliders(ep.load("prototype"), human=False, live=False)
    >>> sorted(panel.values)
    ['abduction', 'flexion', 'h_A', 'h_B', 'internal_rotation', 'r_A', 'r_B']
    """

    _instead = "send or copy the ShoulderExo or ClosedChain, and make a new scene of it"

    def __init__(
        self,
        exo: ShoulderExo,
        dimensions: Sequence[str] | None = None,
        live: bool = True,
        split: str | Split = "spherical",
        constraint_bounds: Any = None,
        **options: Unpack[SceneOptions],
    ) -> None:
        circles = exo.geometry.circles
        chosen = tuple(DIMENSIONS if circles is not None else ()) if dimensions is None else tuple(dimensions)
        for name in chosen:
            as_choice("dimension with a slider", name, DIMENSIONS)
        if chosen and circles is None:
            raise InvalidInput("this geometry is given by points, so it has no dimensions to slide")
        self._start, self._live = exo, live
        self._query = {"split": split, "constraint_bounds": constraint_bounds}
        self._values: dict[str, float] = dict.fromkeys(ANGLES, 0.0)
        self._values.update({name: float(getattr(circles, name)) for name in chosen})
        self.scene = Scene(exo, **options)
        self.reaction: Reaction | None = None
        self._draw(self._values)

    @property
    def exo(self) -> ShoulderExo:
        """The design of the present slider values."""
        return self.scene.exo

    @property
    def values(self) -> dict[str, float]:
        """Values of the sliders: angles in degrees, dimensions in m."""
        return dict(self._values)

    def set(self, **values: float) -> Reaction | None:
        """Move sliders: angles in degrees, dimensions in m.

        Parameters
        ----------
        **values : float
            By the names of the sliders.

        Returns
        -------
        Reaction or None
            The forces there; None for a design without an arm.

        Raises
        ------
        UnknownName
            If there is no such slider.
        ExoPinError
            If there is no such mechanism; everything stays as it was.

        Examples
        --------
        >>> from exo_pin.view import Sliders
        >>> exo = ep.load("prototype")
        >>> panel = Sliders(exo, human=False, live=False)
        >>> answer = panel.set(flexion=25.0)
        >>> bool(np.isclose(answer.magnitude, exo.reaction(exo.pose(flexion=25)).magnitude))  # N
        True
        """
        for name in values:
            as_choice("slider", name, self._values)
        self._draw({**self._values, **values})
        return self.reaction

    def widget(self) -> Any:
        """The sliders as an ipywidgets box, with a line that says which values have no mechanism.

        Returns
        -------
        ipywidgets.VBox

        Raises
        ------
        MissingExtra
            If ipywidgets is not installed.

        Examples
        --------
        >>> from exo_pin.view import Sliders
        >>> box = Sliders(ep.load("prototype"), ["r_A"], human=False, live=False).widget()
        >>> type(box).__name__
        'VBox'
        """
        try:
            import ipywidgets
        except ImportError as error:
            raise MissingExtra("notebooks", "ipywidgets") from error
        picture = ipywidgets.HTML(self.scene.static_cell().data) if not self._live else None
        said = ipywidgets.Label()
        look = {"style": {"description_width": "130px"}, "layout": ipywidgets.Layout(width="420px")}
        look |= {"continuous_update": self._live, "readout_format": ".1f"}
        boxes = []

        def moved(name: str, scale: float, change: Any) -> None:
            try:
                self.set(**{name: change["new"] * scale})
                said.value = ""
            except ExoPinError as error:
                said.value = f"no such mechanism: {error}"
                return
            if picture is not None:
                picture.value = self.scene.static_cell().data

        for name, value in self._values.items():
            if name in ANGLES:
                low, high, step, scale, text = *ANGLES[name], 1.0, 1.0, f"{name.replace('_', ' ')}, °"
            else:
                meaning, reach = DIMENSIONS[name]
                low, high = 1e3 * max(value - reach, 0.01), 1e3 * (value + reach)
                step, scale, text = 0.5, 1e-3, f"{meaning} {name}, mm"
            span = {"value": value / scale, "min": low, "max": high, "step": step, "description": text}
            slider = ipywidgets.FloatSlider(**span, **look)
            slider.observe(lambda change, name=name, scale=scale: moved(name, scale, change), names="value")
            boxes.append(slider)
        half = len(ANGLES)
        columns = ipywidgets.HBox([ipywidgets.VBox(boxes[:half]), ipywidgets.VBox(boxes[half:])])
        return ipywidgets.VBox([columns, said] if picture is None else [columns, said, picture])

    def _ipython_display_(self) -> None:
        from IPython.display import display

        display(self.widget())
        if self._live:
            display(self.scene.cell())

    def _draw(self, values: dict[str, float]) -> None:
        """Draw a design and a pose; if they are impossible the picture does not change."""
        dimensions = {name: value for name, value in values.items() if name in DIMENSIONS}
        flexion, abduction, internal = (values[name] for name in ANGLES)
        pose = shoulder_rotation(flexion, abduction, internal, side=self._start.side, degrees=True)
        before = self.scene.exo
        if dimensions != {name: self._values[name] for name in dimensions}:
            self.scene.replace_exo(self._start.replace(geometry=self._start.geometry.replace(**dimensions)))
        try:
            self.reaction = self.scene.show(pose, **self._query)
        except ExoPinError:
            if self.scene.exo is not before:
                self.scene.replace_exo(before)
            raise
        self._values = values
