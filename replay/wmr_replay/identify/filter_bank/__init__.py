"""A bank of extended Kalman filters over sequences of contact modes, with α, stiffness and slip as states."""

from wmr_replay.identify.filter_bank.bank import Bank, BankSettings, torque_model
from wmr_replay.identify.filter_bank.identifier import BankIdentifier

__all__ = ["Bank", "BankIdentifier", "BankSettings", "torque_model"]
