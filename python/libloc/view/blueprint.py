"""How the viewer is laid out: picture left, space right, numbers and status below."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from libloc.view import space
from libloc.view.geometry import Floats
from libloc.view.pictures import IMAGE
from libloc.view.plots import SERIES
from libloc.view.recorder import TIMELINE

_LEGEND = 0.16  # of the picture's height, below it
_OF_FRAMES = (("reprojection", "nis"), ("features", "time"))
_OF_ESTIMATES = ("position_sigma", "heading_sigma")


@dataclass
class Layout:
    """What the layout depends on."""

    picture_px: tuple[int, int] | None = None
    has_pictures: bool = True
    has_frames: bool = True  # of SLAM; without them some numbers do not exist
    has_latency: bool = True
    centre: Floats | None = None  # of the scene, with radius: where the eye is put
    radius: float = 1.0
    follow: bool = False  # the newest, and only the last window_s of the numbers
    window_s: float = 60.0
    hide_local: bool = False  # the way before GPS has tied the map to the Earth: it was in another world
    in_frustum: bool = False  # the picture, where the camera's calibration is known


def blueprint(rr: Any, layout: Layout) -> Any:
    rrb = rr.blueprint
    bounds = None
    if layout.picture_px is not None:
        width, height = layout.picture_px
        bounds = rrb.VisualBounds2D(x_range=[0, width], y_range=[0, height * (1 + _LEGEND)])
    picture = rrb.Spatial2DView(origin=IMAGE, name="picture", visual_bounds=bounds, background=(25, 25, 25))
    top = [_space(rr, layout)]
    if layout.has_pictures:
        top.insert(0, picture)
    plots = [*(_OF_FRAMES if layout.has_frames else ()), _OF_ESTIMATES]
    if not layout.has_frames and layout.has_latency:
        plots.insert(0, ("time",))
    columns = [rrb.Vertical(*(_plot(rr, name, layout) for name in names)) for names in plots]
    axis = rrb.TimeAxis(link="LinkToGlobal") if not layout.follow else None
    lanes = rrb.StateTimelineView(origin="status", name="status", time_view=axis)
    shown = [rrb.encodings.TextLogColumn(kind) for kind in ("LogLevel", "Body")]
    words = rrb.TextLogView(
        origin="messages", name="messages", columns=rrb.TextLogColumns(text_log_columns=shown)
    )
    statistics = rrb.TimeSeriesView(
        origin="statistics",
        name="statistics",
        time_ranges=_recent(rr, layout),
        plot_legend=rrb.PlotLegend(visible=False),
    )
    return rrb.Blueprint(
        rrb.Vertical(
            rrb.Horizontal(*top, column_shares=[1, 1] if len(top) == 2 else [1]),
            rrb.Horizontal(*columns, rrb.Vertical(lanes, rrb.Tabs(words, statistics), row_shares=[3, 2])),
            row_shares=[3, 2],
        ),
        rrb.TimePanel(state="collapsed", timeline=TIMELINE, play_state="following"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        auto_layout=False,
        auto_views=False,
    )


def _plot(rr: Any, name: str, layout: Layout) -> Any:
    rrb = rr.blueprint
    contents = ["plots/time", "plots/latency"] if name == "time" else [f"plots/{name}"]
    return rrb.TimeSeriesView(
        origin="plots",
        contents=contents,
        name=SERIES[name][0],
        plot_legend=rrb.PlotLegend(visible=False),  # it would hide the lines: the title names them
        time_ranges=_recent(rr, layout),
    )


def _recent(rr: Any, layout: Layout) -> Any:
    if not layout.follow:
        return None
    boundary = rr.TimeRangeBoundary
    return rr.VisibleTimeRange(
        TIMELINE, start=boundary.cursor_relative(seconds=-layout.window_s), end=boundary.cursor_relative()
    )


def _space(rr: Any, layout: Layout) -> Any:
    rrb = rr.blueprint
    until_now = rrb.VisibleTimeRanges(
        rr.VisibleTimeRange(
            TIMELINE, start=rr.TimeRangeBoundary.infinite(), end=rr.TimeRangeBoundary.cursor_relative()
        )
    )
    contents = [
        "+ world/**",
        f"- {IMAGE}/features",
        f"- {IMAGE}/search",
        f"- {IMAGE}/residuals",
        f"- {IMAGE}/legend",
    ]
    if not layout.in_frustum:
        contents.append(f"- {IMAGE}/**")
    if layout.hide_local:
        contents.append(f"- {space.LOCAL_TRAJECTORY}")
    eye = None
    if layout.centre is not None:
        # From behind and above, so that the whole sphere is in view.
        direction = np.array([-0.55, -0.65, 0.52])
        eye = rrb.EyeControls3D(
            position=layout.centre + 2.2 * layout.radius * direction,
            look_target=layout.centre,
            tracking_entity="world/body" if layout.follow else None,
        )
    elif layout.follow:
        eye = rrb.EyeControls3D(tracking_entity="world/body")
    trails = {
        entity: until_now for entity in (space.TRAJECTORY, space.LOCAL_TRAJECTORY, space.REFERENCE, space.GPS)
    }
    return rrb.Spatial3DView(
        origin="world",
        contents=contents,
        name="space: way blue, reference grey, GPS orange",
        eye_controls=eye,
        overrides=trails,
        line_grid=True,
    )
