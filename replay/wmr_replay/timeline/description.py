"""The text panel: what the run found, and how to read the recording."""

from wmr_schemas.text import markdown

_HOW_TO_READ = """\
**Path**: as measured, in the colour of the estimated mode{true_path}. Green: ideal; orange: skidding; \
pink: slipping; dark red: both; grey: undecided. Skidding drives C_k, slipping C_d, away from zero.

**Lanes** and **α**: at the time t at which they were known{lanes}.{hindsight}

**Velocities**, **C_k** = −v_lat and **C_d** = dv_long/dt − α·Σeffort: at the instant that they describe, \
t − delay{true_lines}.

x forward, y left, yaw counter-clockwise. Drawn at {drawn_hz:.4g} Hz of the pose's {rate_hz:.4g} Hz; \
changes of mode and status are exact.
"""


def description(
    log_name: str,
    verdict: str | None,
    rate_hz: float,
    drawn_hz: float,
    has_truth: bool,
    has_hindsight: bool = False,
) -> str:
    """Markdown for the text panel."""
    heading = f"## {markdown(log_name)}\n\n" + (f"{markdown(verdict.strip())}\n\n" if verdict else "")
    return heading + _HOW_TO_READ.format(
        true_path="; the true path thin and white over it" if has_truth else "",
        lanes="; the true mode leads by the detection delay" if has_truth else "",
        hindsight=" Lane **hindsight**: the mode at t as the whole recording shows it."
        if has_hindsight
        else "",
        true_lines=", with the true value in red" if has_truth else "",
        rate_hz=rate_hz,
        drawn_hz=drawn_hz,
    )
