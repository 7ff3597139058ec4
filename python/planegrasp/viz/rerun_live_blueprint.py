"""How a live recording is arranged in Rerun's viewer."""

from __future__ import annotations

from typing import Any

from planegrasp.viz.rerun_parts import rerun

__all__ = ["live_blueprint"]

_PLOTTED = 30.0  # how much of the past the plots show [s]


def live_blueprint() -> Any:
    """The scene and the states on the left; image, plots and events on the right.

    Raises:
        MissingExtraError: rerun-sdk is not installed.
    """
    rerun()
    import rerun.blueprint as rrb

    scene = rrb.Spatial3DView(
        origin="world",
        contents=["$origin/**", "- $origin/camera/outlines/**"],
        name="Scene",
        eye_controls=rrb.EyeControls3D(
            position=(0.3, -0.25, -0.2), look_target=(0.0, 0.05, 0.55), eye_up=(0.0, -1.0, 0.0)
        ),
    )
    states = rrb.StateTimelineView(origin="states", name="Objects")
    image = rrb.Spatial2DView(
        origin="world/camera",
        contents=["$origin/**", "/world/objects/**", "- /world/objects/*/*/faces/**"],
        name="Image",
    )
    recent = rrb.VisibleTimeRange(
        "time",
        start=rrb.TimeRangeBoundary.cursor_relative(seconds=-_PLOTTED),
        end=rrb.TimeRangeBoundary.cursor_relative(),
    )
    plots = [
        rrb.TimeSeriesView(origin=f"plots/{what}", name=name, time_ranges=[recent])
        for what, name in (
            ("rate", "Rates, Hz"),
            ("latency", "Latency of tracking, ms"),
            ("count", "Objects seen, frames dropped"),
        )
    ]
    events = rrb.TextLogView(origin="events", name="Events")
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(scene, states, row_shares=[4, 1]),
            rrb.Vertical(image, *plots, events, row_shares=[4, 2, 2, 2, 2]),
            column_shares=[3, 2],
        ),
        rrb.TimePanel(timeline="time"),
        collapse_panels=True,
    )
