"""Speed of ingest as ratios from one run: to decompression alone, and to mcap-ros2-support.

The floor decompresses every chunk with the library that ingest uses and copies the result once. It is
measured with one thread, and with as many threads as ingest uses. Times are the shortest of several runs, in
turns; CPU times are of the same runs, over all threads.

    python bench/ingest.py [--messages 2000000] [--dir DIR] [--repeats 3]
"""

import argparse
import math
import os
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import numpy as np
import zstandard
from biglogs import write_log
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from wmr_replay.ingest import open_log
from wmr_replay.ingest.mcap.prefetch import N_THREADS

TARGETS = {"ros2": 1.3, "protobuf": 3.0, "json": 4.0}
PEER_TARGET = 40.0
PEER_MESSAGES = 40_000


def stored_chunks(path: Path) -> list[tuple[int, int, int]]:
    """Start and length of every chunk's compressed records, and their size decompressed."""
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    return [
        (
            c.chunk_start_offset + 9 + 8 + 8 + 8 + 4 + 4 + len(c.compression) + 8,
            c.compressed_size,
            c.uncompressed_size,
        )
        for c in summary.chunk_indexes
    ]


def floor(path: Path, threads: int) -> int:
    """Read and decompress every chunk, copy the records once."""

    def part(chunks: list[tuple[int, int, int]]) -> int:
        total = 0
        with path.open("rb") as file:
            for start, n_bytes, size in chunks:
                file.seek(start)
                records = zstandard.ZstdDecompressor().decompress(file.read(n_bytes), max_output_size=size)
                total += len(np.frombuffer(records, np.uint8).copy())
        return total

    chunks = stored_chunks(path)
    if threads == 1:
        return part(chunks)
    with ThreadPoolExecutor(threads) as pool:
        return sum(pool.map(part, (chunks[k::threads] for k in range(threads))))


def columns(path: Path) -> int:
    """Read all columns of pose and torque and keep their batches; return the number of rows."""
    kept = list(open_log(path).batches())
    return sum(len(batch.pose) + len(batch.torque) for batch in kept)


def peer(path: Path) -> int:
    """Read all messages with mcap and mcap-ros2-support."""
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        return sum(1 for _ in reader.iter_decoded_messages(log_time_order=False))


@dataclass
class Times:
    """Shortest wall time, the CPU time of that run, and the return value of the work."""

    wall_s: float = math.inf
    cpu_s: float = math.inf
    result: int = 0

    def take(self, work: Callable[[], int]) -> None:
        """Time one more run."""
        wall_s, cpu_s = time.perf_counter(), time.process_time()
        self.result = work()
        wall_s, cpu_s = time.perf_counter() - wall_s, time.process_time() - cpu_s
        self.wall_s, self.cpu_s = min((self.wall_s, self.cpu_s), (wall_s, cpu_s))

    def line(self, what: str) -> str:
        """The times as text."""
        return f"  {what:<32}{self.wall_s:7.2f} s wall {self.cpu_s:7.2f} s CPU"


def measure(encoding: str, path: Path, repeats: int) -> bool:
    """Print the ratios of one encoding; return whether they meet their targets."""
    columns(path)
    single, threads, ours = Times(), Times(), Times()
    for _ in range(repeats):
        single.take(lambda: floor(path, 1))
        threads.take(lambda: floor(path, N_THREADS))
        ours.take(lambda: columns(path))
    n, ratio, target = ours.result, ours.wall_s / single.wall_s, TARGETS[encoding]
    print(
        f"{encoding:<9} {path.stat().st_size / 1e6:6.0f} MB, {single.result / 1e6:6.0f} MB raw, {n} messages"
    )
    print(single.line("floor, one thread"))
    print(threads.line(f"floor, {N_THREADS} threads"))
    print(ours.line(f"columns, {N_THREADS} threads"), f" {n / ours.wall_s / 1e3:6.0f} k messages/s")
    print(f"  columns / floor of one thread   {ratio:7.2f}    target ≤ {target:g}")
    print(f"  columns / floor of {N_THREADS} threads    {ours.wall_s / threads.wall_s:7.2f}")
    print(f"  CPU, columns / floor            {ours.cpu_s / single.cpu_s:7.2f}")
    print(f"  load of the machine             {os.getloadavg()[0]:7.2f}    {os.cpu_count()} cores")
    faster = beside_peer(path, ours.wall_s / n) if encoding == "ros2" else True
    return faster and ratio <= target


def beside_peer(path: Path, ours_s: float) -> bool:
    """Print the ratio of the reading times with mcap-ros2-support and with ingest."""
    short = write_log(path.with_name("peer.mcap"), "ros2", PEER_MESSAGES)
    theirs = Times()
    theirs.take(lambda: peer(short))
    gain = theirs.wall_s / theirs.result / ours_s
    print(theirs.line(f"mcap-ros2-support, {theirs.result} messages"))
    print(f"  columns are faster a message by {gain:7.1f}    target ≥ {PEER_TARGET:g}")
    return gain >= PEER_TARGET


def main() -> None:
    """Write the logs and measure; exit with 1 if a target is missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--messages", type=int, default=2_000_000)
    parser.add_argument("--dir", type=Path, help="where the logs are written, and kept")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--only", choices=list(TARGETS), action="append")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = options.dir or Path(scratch)
        held = True
        for encoding in options.only or TARGETS:
            path = folder / f"{encoding}-{options.messages}.mcap"
            if not path.exists():
                write_log(path, encoding, options.messages)
            held &= measure(encoding, path, options.repeats)
    sys.exit(0 if held else 1)


if __name__ == "__main__":
    main()
