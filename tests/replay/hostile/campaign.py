"""Many damaged logs through ``info`` and ``run`` in this process: ``python campaign.py FIRST N OUT``.

Whatever is no error of the package's own is a fault, and so is a log that takes longer than its time. Faults
are printed with the seed that makes the file again.
"""

import json
import signal
import sys
import time
from collections import Counter
from pathlib import Path

from mutations import KINDS, damaged, intact
from worker import measured

MOST_S = 60
"""For both commands; a clean log takes .1 s once its code is compiled."""
LONG_S = 10


class TooLong(BaseException):
    """A log that takes longer than its time."""


def one(seed: int, folder: Path) -> list[dict]:
    """What the two commands made of the damaged log of a seed."""
    path = write(folder, damaged(seed).content)
    commands = (["info", path], ["run", path, "--out", folder / "out"])
    return [twice(command) for command in commands]


def twice(command: list[object]) -> dict:
    """A command that took long once more: the first time may have compiled what no log before needed."""
    found = measured(command)
    return measured(command) if found["cpu_s"] > LONG_S else found


def write(folder: Path, content: bytes) -> Path:
    """A file of that content."""
    path = folder / "damaged.mcap"
    path.write_bytes(content)
    return path


def main() -> int:
    """The damaged logs of N seeds from FIRST on."""
    first, n, folder = int(sys.argv[1]), int(sys.argv[2]), Path(sys.argv[3])
    folder.mkdir(parents=True, exist_ok=True)
    codes, n_faults, start = Counter(), 0, time.process_time()

    def alarm(*_: object) -> None:
        raise TooLong

    signal.signal(signal.SIGVTALRM, alarm)
    measured(["run", write(folder, intact(KINDS[0])), "--out", folder / "out"])  # compiles
    for seed in range(first, first + n):
        signal.setitimer(signal.ITIMER_VIRTUAL, MOST_S)
        found = one(seed, folder)
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        for command in found:
            codes[command["command"], command["code"]] += 1
            if command["code"] not in {0, 3} or command["cpu_s"] > LONG_S:
                n_faults += 1
                print(json.dumps({"seed": seed, "story": damaged(seed).story, **command}), flush=True)
    print(f"{n} logs, {n_faults} faults, {time.process_time() - start:.0f} s: {dict(codes)}", flush=True)
    return int(n_faults > 0)


if __name__ == "__main__":
    sys.exit(main())
