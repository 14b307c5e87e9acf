"""Manoeuvres that separate effects which one log may not tell apart."""

from enum import Enum


class Manoeuvre(Enum):
    """What to drive; several are named in this order."""

    REVERSING = "drive the same stretch forwards and in reverse"
    HEADINGS = "drive the same profile in several headings"
    SPEEDS = "hold several speeds, slow to fast, each for some seconds"
    STEPS = "change the torque fast: steps or a chirp, several times a second"
    TURNING = "turn at several yaw rates at one speed, and at several speeds at one yaw rate"
    SLOW_AND_FAST_TURNS = "turn slowly and fast, each for some seconds"
    LONGER = "drive for longer"
    STRAIGHT_THEN_SPOT = "drive straight, then turn on the spot"
    TWICE = "cross the same place a second time"
    GO_ON = "go on driving for a while after the change"
    GENTLE_AND_HARD = "drive gently, with torques near zero, and hard"
    SPOT_AND_STRAIGHT = "turn on the spot with hard torques, and go straight"
