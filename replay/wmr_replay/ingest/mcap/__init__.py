"""The MCAP container: records, chunks, indexes, and where the messages are in them.

This room holds what knows the MCAP format. Messages are byte ranges here; what they mean is decided in
:mod:`wmr_replay.ingest.decoding`. It imports :mod:`wmr_replay.ingest.storage` only.
"""
