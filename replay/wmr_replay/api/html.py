"""A result as a notebook shows it: the verdict, the modes over time as strips, the main figures."""

import html
from typing import TYPE_CHECKING

import polars as pl

from wmr_replay.timeline.colours import MODE_COLOURS, mode_name
from wmr_schemas.modes import MODES, ContactMode
from wmr_schemas.text import shown

if TYPE_CHECKING:
    from wmr_replay.api.result import Result

WIDTH, HEIGHT = 720, 22
SHOWN = (*MODES, ContactMode.UNDECIDED)
HEX = {mode.label: "#{:02x}{:02x}{:02x}".format(*colour) for mode, colour in MODE_COLOURS.items()}


def result_html(result: "Result") -> str:
    """The card of a result."""
    row = result.summary.row(0, named=True)
    facts = [f"{row['duration_s']:.1f} s", f"{row['n_pose']} poses"]
    if row["alpha"] is not None:
        facts.append(f"α {row['alpha']:.4g} ± {1.96 * row['alpha_sd']:.2g} (m/s²)/(N·m)")
    if row["accuracy"] is not None:
        later = row.get("hindsight_accuracy")
        facts.append(f"accuracy {row['accuracy']:.1%}" + (f", in hindsight {later:.1%}" if later else ""))
    return (
        f'<div style="font-family:sans-serif;max-width:{WIDTH}px">'
        f"<b>{escape(row['log'])}</b> <span style='opacity:.7'>{escape(' · '.join(facts))}</span>"
        f"{strips(result)}{key(row)}"
        f"<p style='margin:.4em 0 0'>{escape(result.verdict)}</p>{found(result)}</div>"
    )


def found(result: "Result") -> str:
    """The findings on the data's quality as a list."""
    entries = "".join(
        f"<li><b>{escape(f['severity'])}</b> {escape(f['code'])}: "
        f"{escape(f['text'])}; {escape(f['advice'])}</li>"
        for f in result.findings
    )
    return f"<ul style='margin:.4em 0 0;padding-left:1.2em'>{entries}</ul>" if entries else ""


def escape(text: object) -> str:
    """Text of a page: control codes and what HTML would read as its own are escaped."""
    return html.escape(shown(text))


def strips(result: "Result") -> str:
    """The modes over time as they were known at the time, and below them, where there was a second pass, as
    the whole log shows them.
    """
    if not len(result.hindsight_segments):
        return strip(result.segments)
    return strip(result.segments, "as known at the time") + strip(result.hindsight_segments, "in hindsight")


def strip(segments: pl.DataFrame, name: str = "") -> str:
    """Segments over time, in the colours of their modes, below the strip's name."""
    total_s = float(segments["end_s"].max() or 0.0) if len(segments) else 0.0  # type: ignore[arg-type]
    if not total_s > 0:
        return ""
    bars = "".join(
        f'<rect x="{WIDTH * start / total_s:.1f}" width="{WIDTH * (end - start) / total_s:.2f}" '
        f'height="{HEIGHT}" fill="{HEX[mode]}"><title>{start:.2f} … {end:.2f} s: {mode}</title></rect>'
        for start, end, mode in segments.select("start_s", "end_s", "mode").iter_rows()
    )
    label = f"<div style='opacity:.7;font-size:smaller'>{name}</div>" if name else ""
    return (
        f'{label}<svg viewBox="0 0 {WIDTH} {HEIGHT}" width="100%" height="{HEIGHT}" '
        f'preserveAspectRatio="none" style="display:block;margin:.2em 0 .4em;border-radius:3px">{bars}</svg>'
    )


def key(row: dict[str, object]) -> str:
    """Colour, name and share of each mode that occurs: in hindsight where there is one, as in the verdict."""
    later = "hindsight_" if row.get("hindsight_share_ideal") is not None else ""
    entries = []
    for mode in SHOWN:
        share = row[f"{later}share_{mode.label}"]
        if isinstance(share, float) and share > 0:
            square = f'<span style="color:{HEX[mode.label]}">■</span>'
            entries.append(f"{square} {mode_name(mode)} {share:.1%}")
    return f"<div>{' &nbsp; '.join(entries)}</div>"
