"""How fast ingest is, as ratios from one run: against decompression alone, and against mcap-ros2-support.

The floor decompresses every chunk with the library that ingest uses and copies the result once; it is
measured with one thread, and with as many threads as ingest uses.

    python bench/ingest.py [--messages 2000000] [--dir DIR] [--repeats 3]
"""

import argparse
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import islice
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import numpy as np
import zstandard
from biglogs import write_log
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from wmr_replay.ingest import open_log
from wmr_replay.ingest.prefetch import N_THREADS

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
    """All columns of pose and torque, kept."""
    kept = list(open_log(path).batches())
    pose = np.concatenate([batch.pose.values for batch in kept], axis=1)
    torque = np.concatenate([batch.torque.values for batch in kept], axis=1)
    return pose.shape[1] + torque.shape[1]


def peer(path: Path) -> int:
    """The first messages through mcap and mcap-ros2-support."""
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        decoded = reader.iter_decoded_messages(log_time_order=False)
        return sum(1 for _ in islice(decoded, PEER_MESSAGES))


def best(work: Callable[[], int], repeats: int) -> tuple[float, int]:
    """Shortest wall time of several, and what the work returned."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        result = work()
        times.append(time.perf_counter() - start)
    return min(times), result


def measure(encoding: str, path: Path, repeats: int) -> bool:
    """One encoding: print its ratios; whether they are within their targets."""
    columns(path)
    single_s, n_bytes = best(lambda: floor(path, 1), repeats)
    threads_s, _ = best(lambda: floor(path, N_THREADS), repeats)
    ours_s, n = best(lambda: columns(path), repeats)
    ratio, target = ours_s / single_s, TARGETS[encoding]
    print(f"{encoding:<9} {path.stat().st_size / 1e6:6.0f} MB, {n_bytes / 1e6:6.0f} MB raw, {n} messages")
    print(f"  floor, one thread             {single_s:7.2f} s")
    print(f"  floor, {N_THREADS} threads              {threads_s:7.2f} s")
    print(f"  columns, {N_THREADS} threads            {ours_s:7.2f} s  {n / ours_s / 1e3:6.0f} k messages/s")
    print(f"  columns / floor               {ratio:7.2f}    target ≤ {target:g}")
    print(f"  columns / floor, {N_THREADS} threads    {ours_s / threads_s:7.2f}")
    if encoding != "ros2":
        return ratio <= target
    peer_s, n_peer = best(lambda: peer(path), 1)
    gain = (peer_s / n_peer) / (ours_s / n)
    print(f"  mcap + mcap-ros2-support      {peer_s / n_peer * n:7.1f} s  scaled from {n_peer} messages")
    print(f"  columns are faster by         {gain:7.1f}    target ≥ {PEER_TARGET:g}")
    return ratio <= target and gain >= PEER_TARGET


def main() -> None:
    """Write the logs, measure, exit 1 when a target is missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--messages", type=int, default=2_000_000)
    parser.add_argument("--dir", type=Path, help="where the logs are written, and kept")
    parser.add_argument("--repeats", type=int, default=3)
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
