"""Contact modes from wheel speeds: a bank of Kalman filters whose states are the slip velocities."""

from wmr_replay.identify.wheel_bank.identifier import WheelBankIdentifier

__all__ = ["WheelBankIdentifier"]
