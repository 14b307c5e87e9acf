"""The simulator: plant, drivers, sensors and scenarios, and the recorder that writes canonical logs.

log = synthesise("paper-acceleration", seed=1)
record(log, Path("demo.mcap"))
"""

from wmr_synth.hidden import Disturbance, World
from wmr_synth.hidden_log import hidden_log
from wmr_synth.recorder import record, write_mcap
from wmr_synth.scenarios import SCENARIOS, Scenario
from wmr_synth.sensors import Sensors
from wmr_synth.synthesis import SimulatedLog, synthesise
from wmr_synth.truth import truth_frame

__all__ = [
    "SCENARIOS",
    "Disturbance",
    "Scenario",
    "Sensors",
    "SimulatedLog",
    "World",
    "hidden_log",
    "record",
    "synthesise",
    "truth_frame",
    "write_mcap",
]
