"""Channels whose schema is missing, or whose definition cannot be read while others of their type can."""

from collections.abc import Mapping, Sequence

from wmr_replay.ingest.channels.candidate import Candidate, DoesNotServe
from wmr_replay.ingest.channels.detect import Use


def without_schema(found: Sequence[Candidate]) -> list[str]:
    """A text for each channel with messages whose schema is not in the file: one of the two is damaged, and
    another channel may have taken the role unseen.
    """
    return [
        f"{candidate.channel.topic} names schema {candidate.channel.schema_id}, which the file does not hold"
        for candidate in found
        if candidate.schema is None and candidate.channel.schema_id and candidate.samples
    ]


def unreadable_kin(found: Sequence[Candidate], uses: Mapping[str, Use]) -> list[str]:
    """A text for each: a damaged definition would otherwise let another channel take the role unseen."""
    used, types = {use.channel.id for use in uses.values()}, {use.schema_name for use in uses.values()}
    texts = []
    for candidate in found:
        if candidate.channel.id in used or candidate.schema_name not in types or not candidate.samples:
            continue
        try:
            candidate.definition  # noqa: B018 – reading it is the test
        except DoesNotServe as reason:
            texts.append(f"{candidate.channel.topic} is of the type of a channel in use, but {reason}")
    return texts
