"""The messages of each channel in use, set apart from the others in one compiled pass."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from wmr_replay.ingest.lean import lean
from wmr_replay.ingest.walk import Messages
from wmr_schemas.arrays import I64


@dataclass(frozen=True, eq=False)
class Share:
    """One channel's messages of a block, (n,) each: ``order`` counts those of all channels in use."""

    order: I64
    offset: I64
    length: I64
    publish_ns: I64
    log_ns: I64


def share_out(messages: Messages, role_of: I64, n_roles: int) -> tuple[int, list[Share]]:
    """How many messages are in use, and each role's; ``role_of[channel id]`` is −1 for the others."""
    table, counts = np.empty((n_roles, 5, len(messages)), np.int64), np.zeros(n_roles, np.int64)
    n_used = _share_out(
        messages.channel, messages.offset, messages.length, messages.publish_ns, messages.log_ns,
        role_of, table, counts,
    )  # fmt: skip
    return n_used, [Share(*table[role, :, :n]) for role, n in enumerate(counts.tolist())]


@lean
def _share_out(
    channel: I64, offset: I64, length: I64, publish_ns: I64, log_ns: I64, role_of: I64,
    table: Any, counts: I64,
) -> int:  # fmt: skip
    n_used = 0
    for row in range(len(channel)):
        role = role_of[channel[row]]
        if role < 0:
            continue
        n = counts[role]
        table[role, 0, n] = n_used
        table[role, 1, n] = offset[row]
        table[role, 2, n] = length[row]
        table[role, 3, n] = publish_ns[row]
        table[role, 4, n] = log_ns[row]
        counts[role] = n + 1
        n_used += 1
    return n_used
