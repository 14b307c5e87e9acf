"""Messages that rosbag2 compressed one by one (``compression_mode: message``)."""

from collections.abc import Sequence

from wmr_replay.ingest.storage.file_check import ZSTD_MAGIC

MOST_BYTES = 64 << 20
"""Messages of one span are unpacked up to this size together; behind it they stay as they are."""


def unpacked(messages: Sequence[bytes]) -> Sequence[bytes]:
    """The messages, each unpacked that is a zstd frame; what cannot be unpacked stays as it is.

    No message of CDR starts with zstd's magic: its first byte is 0.
    """
    if not any(message.startswith(ZSTD_MAGIC) for message in messages):
        return messages
    import zstandard  # noqa: PLC0415 – only bags that use it pay for it

    stream, left, out = zstandard.ZstdDecompressor(), MOST_BYTES, list[bytes]()
    for message in messages:
        content = message
        try:
            if message.startswith(ZSTD_MAGIC) and 0 <= zstandard.frame_content_size(message) <= left:
                content = stream.decompress(message)
                left -= len(content)
        except zstandard.ZstdError:
            pass
        out.append(content)
    return out
