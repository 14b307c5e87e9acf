"""Robot parameters without sense in a log's own metadata: what ``info`` and ``run`` make of them.

    python bench/quality_parameters.py [--logs 54]

Each log is written to a file whose metadata hold one damaged or absurd value, and read by both commands.
"said": the finding ``parameter_without_sense`` (a value that is none), or one that names the parameter (a
value that is wrong for this robot). "exit": exit codes of ``run``; 70 is an internal error.
"""

import argparse
import io
import sys
import tempfile
from collections import Counter
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from unittest.mock import patch

import numpy as np
from mcap.writer import Writer
from quality_logs import FAMILIES, clean_log

import wmr_replay as wr
from wmr_replay.cli import main as command_line
from wmr_schemas.messages import METADATA_NAME
from wmr_schemas.signals import Log
from wmr_synth.recorder import channels_of, find_codec, in_order, register

KEYS = ("alpha", "mass_kg", "wheel_radius_m", "half_track_m")
VALUES: dict[str, tuple[str, ...]] = {
    "no number": ("abc", "", "[0.1, 0.2]", "{}", "None", "true", "0,35", "0.35 m", "\x00", "0x10", "auto"),
    "nan, infinite": ("nan", "inf", "-inf", "1e400", "-1e400", "NaN"),
    "zero, negative": ("0", "-0.0", "-1", "-0.35", "-1e-300"),
    "too small": ("1e-9", "1e-300", "5e-324", "1e-12"),
    "too large": ("1e9", "1e300", "1.7e308", "1e12"),
}
ABSURD = {"wheel_radius_m": "100", "half_track_m": "500", "mass_kg": "1e8", "alpha": "1e7"}


def values_of(kind: str, key: str, rng: np.random.Generator) -> str:
    """A value of that kind."""
    return ABSURD[key] if kind == "absurd" else str(rng.choice(VALUES[kind]))


def written(log: Log, path: Path, changed: dict[str, str]) -> None:
    """Write the log with other texts in its metadata."""
    codec = find_codec("ros2")
    channels = channels_of(log, codec, None)
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(codec.profile, "made up")
        writer.add_metadata(METADATA_NAME, log.robot.to_metadata() | changed)
        ids = [register(writer, codec, channel) for channel in channels]
        for block in in_order(channels):
            for index, sequence, t_ns, data in block:
                writer.add_message(ids[index], t_ns, data, t_ns, sequence)
        writer.finish()


def exit_code(path: Path, out: Path) -> int:
    """The exit code of ``run``."""
    text, words = io.StringIO(), ["wmr-replay", "run", str(path), "--out", str(out)]
    with redirect_stdout(text), redirect_stderr(text), patch.object(sys, "argv", words):
        try:
            command_line()
        except SystemExit as done:
            return int(done.code or 0)
    return 0


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--logs", type=int, default=54)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    print(f"{'value':<16}{'logs':>5}{'said':>7}{'left out':>10}  exit")
    with tempfile.TemporaryDirectory() as folder:
        path, out = Path(folder, "log.mcap"), Path(folder, "out")
        for kind in (*VALUES, "absurd"):
            said, left_out, codes = 0, 0, Counter[int]()
            for seed in range(options.seed, options.seed + options.logs):
                rng = np.random.default_rng([seed, 11])
                key = KEYS[seed % len(KEYS)]
                log = clean_log(list(FAMILIES)[seed % 6], seed, rate_hz=50.0, duration_s=12.0)
                value = values_of(kind, key, rng)
                written(log, path, {key: value})
                info = wr.open_log(path).info()
                found = [f for f in info.findings if f["code"] == "parameter_without_sense"]
                said += any(f" {key}:" in f["text"] for f in found)
                left_out += key not in info.robot.known()
                codes[exit_code(path, out)] += 1
            n = options.logs
            print(f"{kind:<16}{n:>5}{said / n:>7.0%}{left_out / n:>10.0%}  {dict(codes)}", flush=True)


if __name__ == "__main__":
    main()
