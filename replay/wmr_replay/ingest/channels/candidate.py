"""A channel that may serve as a signal: its schema, its first messages, and whether a binding fits them."""

import re
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

from wmr_replay.ingest.budgets import BUDGETS, Allowance
from wmr_replay.ingest.decoding.bindings import Binding, NotConcerned, Recipe
from wmr_replay.ingest.decoding.encodings import Definition, define
from wmr_replay.ingest.decoding.layout import Undecodable
from wmr_replay.ingest.decoding.ros_definitions import UnknownDefinition
from wmr_replay.ingest.mcap.records import Channel, Schema
from wmr_replay.ingest.mcap.sampling import Sample

LONGEST_STEP_NS = 250_000_000
"""4 Hz: a window of ten poses is then as long as a skid, 2.5 s."""


class DoesNotServe(Exception):
    """Why a channel does not serve."""


@dataclass(frozen=True)
class Candidate:
    """A channel with its schema and its first messages."""

    channel: Channel
    schema: Schema | None
    samples: tuple[Sample, ...]
    n_messages: int = 0
    """As far as the file's index and statistics tell; a lower bound otherwise."""
    allowance: Allowance | None = None
    """What reading its definition and its layouts may cost; None: as a log of no size."""

    @property
    def schema_name(self) -> str:
        """The schema's name as it is shown to users."""
        return self.schema.name if self.schema else "no schema"

    @property
    def short_name(self) -> str:
        """The schema's name without its package."""
        return re.split(r"[/.:]", self.schema.name)[-1] if self.schema else ""

    def mentions(self, word: bytes) -> bool:
        """Whether the word occurs in the schema or, without a schema, in a first message: a cheap first
        test.
        """
        if self.schema and word in self.schema.data:
            return True
        return self.channel.message_encoding == "json" and any(word in sample.data for sample in self.samples)

    @cached_property
    def definition(self) -> Definition:
        """What its messages are made of. Raises DoesNotServe."""
        if not self.samples:
            most = f" of at most {BUDGETS.most_sample_bytes:,} bytes" if self.n_messages else ""
            raise DoesNotServe(f"no message{most}")
        try:
            return define(self.channel, self.schema, [sample.data for sample in self.samples], self.allowance)
        except UnknownDefinition as error:
            raise DoesNotServe(str(error)) from None

    @cached_property
    def is_slow(self) -> bool:
        """Whether its first messages come more rarely than motion of a wheeled robot can be followed."""
        stamps = sorted(sample.log_ns for sample in self.samples)
        steps = sorted(b - a for a, b in pairwise(stamps))
        return bool(steps) and steps[len(steps) // 2] > LONGEST_STEP_NS

    def has(self, *paths: str) -> bool:
        """Whether its messages have all of these fields."""
        return all(self.definition.has(path.partition("[")[0]) for path in paths)

    def try_out(self, binding: Binding) -> Recipe:
        """What the binding takes from the first message that concerns it. Raises DoesNotServe."""
        problem = ""
        for sample in self.samples:
            try:
                return binding.recipe(self.definition.layout(sample.data))
            except NotConcerned as reason:
                problem = problem or str(reason)
            except Undecodable as error:
                problem = problem or f"its first messages do not fit its schema ({error})"
        raise DoesNotServe(problem)
