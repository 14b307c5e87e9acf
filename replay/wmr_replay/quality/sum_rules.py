"""What the monitors' sums are told of a row: sizes that no measurement has, speeds, lengths, even steps."""

HUGE = 1e30
"""Larger values are no measurement, and would swallow everything that is added to them."""
LEAST_SPEED_MPS = 0.05
"""Slower motion has no direction: trackers creep as fast."""
LEAST_SPEED_SD = 10.0
"""A slower velocity, in its own standard deviations, has a direction known to .1 rad at best."""
REST_MPS, REST_SD = 0.03, 3.0
"""At rest: slower than that, or than so many standard deviations."""
STEP_M, STEP_S = 0.15, 0.2
"""A step is .15 m and the way of .2 s: a tenth of a small robot's turning circle, and quicker robots steer in
time rather than in length."""
N_SUMS, STEP_NUMBER = 12, 11
"""Sums over the path, and which of them numbers the steps."""
UNEVEN = 0.25
"""Steps may be longer or shorter by that share: a lost pose is left out, jitter is not."""
