"""How a log is cut: bins, held-out stretches, windows of the gap."""

from dataclasses import dataclass


@dataclass(frozen=True)
class BinSettings:
    """Binning of poses and contact modes."""

    bin_s: float = 0.04
    """Longest bin, s. Physics: the robot's dynamics are slower than 25 Hz; a bin averages the poses of a
    100 Hz log in fours. Lag and delay are compared in bins of half the length as well."""

    least_rows: int = 200
    """Fewest bins of a log, 8 s. Statistics: the first 8 s are fitted, so that less has no
    held-out window."""

    least_position_sd_m: float = 2e-5
    """Floor of the position noise, m. Physics: the resolution at which files store positions, 0.1 mm and
    finer; a noise of 0 would make every residual infinite."""

    least_yaw_sd_rad: float = 2e-5
    """Floor of the yaw noise, rad. Physics: as for positions, of single-precision quaternions."""

    label_s: float = 0.25
    """Width of the majority vote over mode labels, s. Patrol benchmark. Labels shorter than about half of
    it are outvoted and count as recording errors."""

    identified_switch_s: float = 0.3
    """How well an identifier knows when a mode begins or ends, s. Patrol benchmark. Lateral velocity
    is held loosely that near to a switch."""


@dataclass(frozen=True)
class TorqueSettings:
    """Torques between their stamps: held, or joined by lines."""

    slow_s: float = 0.02
    """Period from which on they may be lines, s. Physics: held ones lag half of it; less than 10 ms is no
    delay that robots are built to."""

    least_gain: float = 20.0
    """By how much −2 log likelihood must fall for lines. Judgement: on worlds for development with a stamp
    every 50 ms, one of 25 logs with held torques gains 13 and none more; of 24 that keep every fifth torque
    of a controller, 15 gain 19 to 490."""

    parts: int = 5
    """Held pieces that stand for a line. Numerics: of 50 ms, pieces as long as the steps of a 100 Hz log."""

    longest_periods: float = 3.0
    """Across a hole of more periods there is no line. Judgement: a controller may have stopped there."""


@dataclass(frozen=True)
class SplitSettings:
    """The held-out part of a log."""

    period_s: float = 12.0
    """Period of the split, s. Three turns of ``held_out_s`` hold each row out once: three-fold
    cross-validation."""

    held_out_s: float = 4.0
    """Held out of each period, its last part, s. One window of the gap, ``WindowSettings.window_s``."""

    start_s: float = 0.4
    """Poses from which the first speeds are fitted, s. Statistics: at a position noise of 5 cm a
    hundred poses a second give a speed to 0.1 m/s, well within the filter's first 0.5 m/s."""


@dataclass(frozen=True)
class WindowSettings:
    """Windows over which the simulation runs freely; the gap is what is left."""

    window_s: float = 4.0
    """Length, s. The definition of the reported metric (``position_rms_4s``), not a threshold."""

    slack_s: float = 0.06
    """By how much a window may fall short, s. Numerics: one and a half bins, so that four
    seconds of bins are a whole window."""

    longest_hole_s: float = 0.5
    """Longest step inside a window, s. Patrol benchmark: a window with a
    longer hole in its poses says too little."""

    start_rows: int = 10
    """Rows from which the initial motion is first guessed, 0.4 s of bins. As ``SplitSettings.start_s``."""

    rounds: int = 8
    """Most steps of the fit of an initial motion. Numerics."""

    tries: int = 4
    """Most dampings tried in a step. Numerics: each is 30 times the one before."""

    nudge_mps: float = 1e-3
    """Error of a window's first turning speed by which it is seen how such an error grows, m/s. Numerics: far
    above rounding, and small beside any motion."""

    far_sd: float = 1e6
    """Residual of a simulation that runs away, in standard deviations of a pose. Numerics: a number, and so
    large that its model is no good one."""
