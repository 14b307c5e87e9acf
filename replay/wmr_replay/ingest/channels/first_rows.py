"""The first messages of a channel as rows: what a choice between channels and clocks looks at."""

from collections.abc import Sequence

import numpy as np

from wmr_replay.ingest.decoding.bindings import Binding
from wmr_replay.ingest.decoding.decoder import Decoded, Decoder
from wmr_replay.ingest.decoding.encodings import Definition
from wmr_replay.ingest.mcap.sampling import Sample
from wmr_schemas.arrays import F64


def first_rows(definition: Definition, binding: Binding, samples: Sequence[Sample]) -> Decoded:
    """Stamps (n,) and raw columns (n_raw, n) of the samples, a row each."""
    messages = [sample.data for sample in samples]
    lengths = np.array([len(message) for message in messages], np.int64)
    data = np.frombuffer(b"".join(messages), np.uint8)
    decoder = Decoder(definition, binding)
    columns = decoder.begin(len(lengths))
    decoder.read(columns, data, np.cumsum(lengths) - lengths, lengths)
    n_undecodable = decoder.settle(columns)
    columns.trim()
    used = columns.used
    return Decoded(columns.stamp_ns, columns.raw, columns.raw, used, bool(used.all()), n_undecodable)


def has_efforts(torques: F64) -> bool:
    """Whether a row (4, n) holds an effort of both wheels."""
    return bool(np.isfinite(torques[:2]).all(axis=0).any())


def has_speeds(torques: F64) -> bool:
    """Whether a row (4, n) holds a speed of both wheels."""
    return bool(np.isfinite(torques[2:]).all(axis=0).any())
