"""What writing the Rerun timeline costs: ``python bench/timeline.py [--minutes 1 10] [--repeat 5]``.

A log is replayed with and without its timeline, in turns, in one process that has compiled and imported
everything. Processor seconds are the least of all turns, since other programs only add to them.
"""

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import wmr_replay as wr


def processor_s(log: Path, out: Path, *, timeline: bool) -> float:
    """Processor seconds of a run that writes its results."""
    began = time.process_time()
    wr.run(log, out, timeline=timeline, force=True)
    return time.process_time() - began


def import_s() -> float:
    """Processor seconds of importing Rerun, which a run without a timeline leaves out."""
    code = (
        "import time, numpy, pyarrow; t = time.process_time(); import rerun; print(time.process_time() - t)"
    )
    runs = (subprocess.run([sys.executable, "-c", code], capture_output=True, check=True) for _ in range(3))
    return min(float(done.stdout) for done in runs)


def main() -> None:
    """Print a row for each length."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--minutes", type=float, nargs="*", default=[1.0, 10.0])
    parser.add_argument("--repeat", type=int, default=5)
    asked = parser.parse_args()
    print(f"import of Rerun: {import_s():.2f} s")
    print("| log | without [s] | with [s] | the timeline's share [s] | its size [MB] |")
    print("| --- | --- | --- | --- | --- |")
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder, "out")
        for minutes in asked.minutes:
            log = Path(folder, f"drive-{minutes:g}.mcap")
            wr.synthesise("patrol", seed=1, duration_s=60 * minutes).save(log)
            wr.run(log, out)
            turns = [
                (processor_s(log, out, timeline=False), processor_s(log, out, timeline=True))
                for _ in range(asked.repeat)
            ]
            without, with_it = map(min, zip(*turns, strict=True))
            size = (out / f"{log.stem}.rrd").stat().st_size / 1e6
            cells = (without, with_it, with_it - without)
            print(f"| {minutes:g} min | {' | '.join(f'{s:.2f}' for s in cells)} | {size:.1f} |", flush=True)


if __name__ == "__main__":
    main()
