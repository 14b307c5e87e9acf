"""Which channel serves as pose, torque or true mode, in which frames and by which clock.

This room holds the rules by which a role is given to a channel, and the bindings that turn its fields into
the signal's columns. It looks at the first messages of a channel only; :mod:`wmr_replay.ingest.reading` reads
them all.
"""
