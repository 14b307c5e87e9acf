"""Contact modes from torques and wheel speeds together: a bank of Kalman filters, its states those of the
wheel-speed bank, of traction and of disturbances.
"""

from wmr_replay.identify.joint_bank.identifier import JointBankIdentifier

__all__ = ["JointBankIdentifier"]
