"""The second pass over a log: what the recording as a whole says about every moment. Not causal.

The first pass records its rows and the identifier's bins. Then the identifier goes over the bins once more
with what it has learned, and looks back by a fixed lag; motion is moved to the instant that it describes.
With the learned parameters given, a row at t depends on the log up to t + lag alone.
"""

from wmr_replay.pipeline.hindsight.record import Record
from wmr_replay.pipeline.hindsight.second_pass import SecondPass
from wmr_replay.pipeline.hindsight.whole_noise import WholeNoise

__all__ = ["Record", "SecondPass", "WholeNoise"]
