"""Fuzzing for a stated time: ``python fuzz.py --seconds 600 [--corpus FOLDER] [--seed K]``.

Inputs of the corpus are changed at random and go to their target, see ``targets.py``; every eighth is a whole
damaged log. An input that finds a fault is stored in the corpus, whose files ``make test`` replays.
"""

import argparse
import hashlib
import sys
import time
import traceback
from pathlib import Path

import numpy as np
from mutations import DAMAGES, damaged
from targets import TARGETS, try_out, warm_up

CORPUS = Path(__file__).parent / "corpus"
LOG_EVERY = 8


def stored(corpus: Path) -> list[tuple[str, bytes]]:
    """Target and content of every stored input; files are named TARGET-ANYTHING."""
    files = sorted(path for path in corpus.iterdir() if path.name.partition("-")[0] in TARGETS)
    return [(path.name.partition("-")[0], path.read_bytes()) for path in files]


def changed(rng: np.random.Generator, content: bytes, others: list[bytes]) -> bytes:
    """An input with one to six changes, or spliced with another one."""
    out = bytearray(content or b"\0")
    if rng.random() < 0.2 and others:
        other = others[rng.integers(len(others))]
        cut = int(rng.integers(len(out)))
        out[cut:] = other[int(rng.integers(max(len(other), 1))) :]
    for _ in range(int(rng.integers(1, 7))):
        out = out or bytearray(b"\0")
        DAMAGES[rng.integers(len(DAMAGES))](rng, out)
    return bytes(out)


def main() -> int:
    """Fuzz until the time is over; 1 where a fault was found."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--seconds", type=float, default=600)
    parser.add_argument("--corpus", type=Path, default=CORPUS)
    parser.add_argument("--seed", type=int, default=None, help="of the changes; by default the clock's")
    asked = parser.parse_args()
    seed = asked.seed if asked.seed is not None else time.time_ns() % (1 << 32)
    rng, inputs = np.random.default_rng(seed), stored(asked.corpus)
    warm_up()
    stop, n, faults = time.monotonic() + asked.seconds, 0, 0
    while time.monotonic() < stop:
        if n % LOG_EVERY == 0:
            target, content = "log", damaged(int(rng.integers(1 << 32))).content
        else:
            target, origin = inputs[rng.integers(len(inputs))]
            content = changed(rng, origin, [other for kind, other in inputs if kind == target])
        n += 1
        try:
            try_out(target, content)
        except Exception:
            faults += 1
            path = asked.corpus / f"{target}-{hashlib.sha256(content).hexdigest()[:12]}"
            path.write_bytes(content)
            print(f"{path}:\n{traceback.format_exc()}", flush=True)
    print(f"seed {seed}: {n} inputs, {faults} faults")
    return int(faults > 0)


if __name__ == "__main__":
    sys.exit(main())
