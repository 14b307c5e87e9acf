"""Reading ahead: the next blocks are read, decompressed and checked while the present one is used."""

from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

from wmr_replay.ingest.chunks import Block, Span, load

_N_AHEAD = 2


def load_ahead(path: Path, spans: Sequence[Span]) -> Iterator[Block]:
    """The blocks of the spans, in their order; at most two wait in memory."""
    with (
        path.open("rb") as file,
        ThreadPoolExecutor(max_workers=1, thread_name_prefix="read-ahead") as worker,
    ):
        waiting: deque[Future[Block]] = deque()
        try:
            for span in spans:
                waiting.append(worker.submit(load, file, span))
                if len(waiting) > _N_AHEAD:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        finally:
            for future in waiting:
                future.cancel()
