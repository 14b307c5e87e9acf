"""What the first use after installing costs: processor time and memory of the first run and the first gap.

Every measurement is a process of its own with an empty cache directory, and counts its children. Bounds:
first run 15 s, first gap 20 s, 600 MiB. Usage: python bench/first_use.py [--strict]
"""

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path

MEASURED = """
import resource, sys
from wmr_replay.cli import main
try:
    main()
except SystemExit as end:
    code = end.code
else:
    code = 0
who = [resource.getrusage(w) for w in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
seconds = sum(w.ru_utime + w.ru_stime for w in who)
print("MEASURED", seconds, max(w.ru_maxrss for w in who) / 1024, file=sys.stderr)
sys.exit(code)
"""
BOUNDS = {"first run": 15.0, "first gap": 20.0}
MOST_MIB = 600.0


def measure(cache: Path, *arguments: str) -> tuple[float, float]:
    """Processor time in s and peak memory in MiB of one command."""
    environment = os.environ | {"WMR_REPLAY_CACHE_DIR": str(cache)}
    command = [sys.executable, "-c", MEASURED, *arguments]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(done.stderr)
    _, seconds, mib = done.stderr.splitlines()[-1].split()
    return float(seconds), float(mib)


def main() -> None:
    """Print the table; with --strict a bound that does not hold is an error."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--strict", action="store_true")
    strict = parser.parse_args().strict
    with tempfile.TemporaryDirectory() as folder:
        at = Path(folder)
        log, out = str(at / "log.mcap"), str(at / "out")
        measure(at / "synth", "synth", "paper-acceleration", "--out", log)
        found = {
            "first run": measure(at / "run", "run", log, "--out", out),
            "second run": measure(at / "run", "run", log, "--out", out),
            "first gap": measure(at / "gap", "gap", log, "--out", out),
            "second gap": measure(at / "gap", "gap", log, "--out", out),
        }
    over = []
    for name, (seconds, mib) in found.items():
        bound = BOUNDS.get(name)
        holds = bound is None or (seconds <= bound and mib <= MOST_MIB)
        over += [] if holds else [name]
        asked = "" if bound is None else f"   asked {bound:.0f} s, {MOST_MIB:.0f} MiB"
        asked += "" if holds else ": exceeded"
        print(f"{name:11s} {seconds:6.1f} s of processor time, peak {mib:4.0f} MiB{asked}")
    print(f"first/second run {found['first run'][0] / found['second run'][0]:.1f}")
    if strict and over:
        raise SystemExit(1)


if __name__ == "__main__":
    main()
