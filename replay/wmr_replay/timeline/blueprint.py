"""The layout that opens with the recording of a run: only views that have something to show."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import rerun.blueprint as rrb
from rerun.blueprint.components import PlayState

from wmr_replay.timeline.path import Frame
from wmr_replay.timeline.views import (
    Page,
    Plot,
    Span,
    lanes_view,
    pages_view,
    path_view,
    texts_view,
    window,
)


def _estimate_and_truth(quantity: str, column: str) -> Plot:
    return Plot(quantity, (f"/velocity/{column}/estimate", f"/velocity/{column}/true"))


def _constraint(quantity: str, column: str) -> Plot:
    return Plot(quantity, (f"/constraint/{column}/estimate", f"/constraint/{column}/threshold"))


def _with_band(quantity: str, entity: str, *others: str) -> Plot:
    return Plot(quantity, (f"{entity}/estimate", f"{entity}/band", *(f"{entity}/{one}" for one in others)))


ALPHA = _with_band("α [(m/s²)/(N·m)]", "/alpha", "nominal")
PROBABILITY = Plot("Probability of each mode", ("/posterior", "/posterior/both"), (-0.04, 1.04))
C_K = _constraint("C_k [m/s]", "c_k_mps")
MODES = Page("Modes and α", (PROBABILITY, C_K, _constraint("C_d [m/s²]", "c_d_mps2"), ALPHA))
SLIP = Page(
    "Modes and slip",
    (
        PROBABILITY,
        C_K,
        _with_band("Slip of the left wheel [m/s]", "/slip/left"),
        _with_band("Slip of the right wheel [m/s]", "/slip/right"),
    ),
    (39, 20, 20, 20),  # the key of four modes is taller than that of a line and its band
)
LEARNT = Page(
    "Learnt of the wheels",
    (
        _with_band("Wheel scale", "/learnt/wheel_scale", "stated"),
        _with_band("Effective half track [m]", "/learnt/effective_half_track_m"),
        _with_band("Centre of rotation [m]", "/learnt/icr_offset_m", "stated"),
    ),
)
TORQUE = Plot("Wheel torque [N·m]", ("/torque",))
VELOCITIES = (
    _estimate_and_truth("v_long [m/s]", "v_long_mps"),
    _estimate_and_truth("v_lat [m/s]", "v_lat_mps"),
    _estimate_and_truth("Yaw rate [rad/s]", "yaw_rate_radps"),
)
POSE = Page(
    "Pose",
    (
        Plot("Position [m]", ("/pose/x_m/measured", "/pose/y_m/measured")),
        Plot("Yaw [rad]", ("/pose/yaw_rad/measured", "/pose/yaw_rad/true")),
    ),
)


@dataclass(frozen=True)
class Contents:
    """What a recording holds: the series written, the path's frame, the stretch of time, α's range, whether
    there are findings on the data, a true path, a second pass. ``ranges`` are those of further plots, by the
    first entity of each.
    """

    written: Collection[str]
    frame: Frame
    span: Span | None
    alpha_range: tuple[float, float] | None = None
    found: bool = False
    true_path: bool = False
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)


def layout(held: Contents, play_state: PlayState = PlayState.Paused) -> rrb.Blueprint:
    """The blueprint for a recording."""
    texts = texts_view(found=held.found)
    lanes = ["/mode/**", "/status"]
    right = None if held.span is None else lanes_and_pages(lanes, _pages(held), held.written, held.span)
    if right is None:
        return window(rrb.Vertical(texts), None)
    name = "Path [m] by mode, true in white" if held.true_path else "Path [m] by mode"
    shares = [58, 42] if held.found else [68, 32]
    left = rrb.Vertical(path_view(held.frame, name), texts, row_shares=shares)
    return window(left, right, play_state=play_state)


def lanes_and_pages(
    lanes: Sequence[str], pages: Iterable[Page], written: Collection[str], span: Span, lanes_share: float = 31
) -> rrb.Container | None:
    """Lanes above the pages of plots, on one time axis; None without any plot."""
    plots = pages_view(pages, written, span)
    if plots is None:
        return None
    above = lanes_view(lanes, "Contact mode and status", span)
    return rrb.Vertical(above, plots, row_shares=[lanes_share, 100 - lanes_share])


def _pages(held: Contents) -> list[Page]:
    """The pages for a recording, by torques or by wheel speeds, α and what was learnt in their ranges."""
    ranges = {ALPHA.entities[0]: held.alpha_range, **held.ranges}
    first = [SLIP, LEARNT] if SLIP.plots[2].shown(held.written) else [MODES]
    driven = TORQUE.shown(held.written)
    motion = Page("Motion and torque" if driven else "Motion", (*VELOCITIES, TORQUE))
    return [_in_ranges(page, ranges) for page in (*first, motion, POSE)]


def _in_ranges(page: Page, ranges: Mapping[str, tuple[float, float] | None]) -> Page:
    """A page, the axes of its plots with the ranges that are known."""
    plots = (replace(one, range_y=ranges.get(one.entities[0]) or one.range_y) for one in page.plots)
    return replace(page, plots=tuple(plots))
