"""The text panels: what the run found, and how to read the recording."""

from collections.abc import Mapping, Sequence
from typing import Any

from wmr_schemas.text import markdown, shown

_HOW_TO_READ = """\
**Path**: as measured, in the colour of the estimated mode{true_path}. Green: ideal; orange: skidding; \
pink: slipping; dark red: both; grey: undecided. The robot is not drawn to scale. Its white arrow is the \
heading{velocity}.

**Lanes**, **probabilities** and {learnt}: at the time t at which they were known{lanes}.{hindsight}

{quantities}

x forward, y left, yaw counter-clockwise. Drawn at {drawn_hz:.4g} Hz of the pose's {rate_hz:.4g} Hz; \
changes of mode and status are exact.
"""

_BY_TORQUES = """\
**Velocities**, **C_k** = −v_lat and **C_d** = dv_long/dt − α·Σeffort: at the instant that they describe, \
t − delay{true_lines}. Skidding drives C_k, slipping C_d, out of the thresholds about zero. \
**α** in 1/(kg·m), which is (m/s²)/(N·m), with its 95 % band and the nominal value. **τ**: wheel torques.\
"""

_BY_WHEEL_SPEEDS = """\
**Velocities**, **C_k** = −v_lat and **slip**, a wheel's speed minus the ground's: at the instant that they \
describe, t − delay{true_lines}. Skidding drives C_k out of the thresholds about zero; a wheel surely slips \
where the 95 % band of its slip leaves zero. **Learnt of the wheels**: their true over their stated \
speed, the half track that turning shows, the x of the centre of rotation, each with its 95 % band.\
"""


def verdict_text(log_name: str, verdict: str | None, findings: Sequence[Mapping[str, Any]] = ()) -> str:
    """Markdown: the verdict, the findings on the data, the log."""
    said = markdown((verdict or "").strip())
    blocks = (said and f"**{said}**", findings_text(findings), f"Log: {markdown(log_name)}")
    return "\n\n".join(block for block in blocks if block)


def finding_line(found: Mapping[str, Any]) -> str:
    """A finding as an entry of a list."""
    text, advice = markdown(found["text"]), markdown(found["advice"])
    return f"- **{markdown(found['code'])}** ({found['severity']}): {text}. {advice}"


def findings_text(findings: Sequence[Mapping[str, Any]]) -> str:
    """Markdown: the findings as a list below their heading; empty without any."""
    return "\n".join(["**Data quality**", "", *map(finding_line, findings)]) if findings else ""


def log_text(found: Mapping[str, Any]) -> str:
    """A finding as an entry of a log, whose view cuts long lines off: its kind, and where to read on."""
    return shown(f"{found['code']} (see Verdict)")


def how_to_read(
    rate_hz: float,
    drawn_hz: float,
    arrow_s: float | None,
    has_truth: bool,
    has_hindsight: bool = False,
    by_wheel_speeds: bool = False,
) -> str:
    """Markdown; ``arrow_s`` is the length in m of the arrow of a velocity of 1 m/s."""
    true_lines = ", with the true value in red over the estimate" if has_truth else ""
    quantities = _BY_WHEEL_SPEEDS if by_wheel_speeds else _BY_TORQUES
    return _HOW_TO_READ.format(
        learnt="what is **learnt of the wheels**" if by_wheel_speeds else "**α**",
        quantities=quantities.format(true_lines=true_lines),
        true_path="; the true path thin and white over it" if has_truth else "",
        velocity=""
        if arrow_s is None
        else f", the blue one the velocity: {arrow_s:g} m on the plane for 1 m/s",
        lanes="; the true mode leads by the detection delay" if has_truth else "",
        hindsight=" Lane **hindsight**: the mode at t as the whole recording shows it."
        if has_hindsight
        else "",
        rate_hz=rate_hz,
        drawn_hz=drawn_hz,
    )
