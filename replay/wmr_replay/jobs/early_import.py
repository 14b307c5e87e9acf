"""Slow imports in a thread, while the log is read.

Reading and identifying are done by kernels, polars and LLVM, which leave Python's lock to other threads.
"""

import importlib
import threading
from contextlib import suppress

RUN_TIMELINE = ("wmr_replay.timeline.writer", "pyarrow.compute")
GAP_TIMELINE = ("wmr_replay.timeline.gap.writer", "pyarrow.compute")
"""What writing a timeline needs. Rerun imports ``pyarrow.compute`` with the first colours."""


def import_early(modules: tuple[str, ...]) -> None:
    """Begin to import ``modules``.

    A later import of them waits for the rest, and raises what cannot be imported.
    """

    def load() -> None:
        with suppress(Exception):
            for module in modules:
                importlib.import_module(module)

    threading.Thread(target=load, name="early import").start()
