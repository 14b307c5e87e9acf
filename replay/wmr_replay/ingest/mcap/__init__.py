"""The MCAP container: records, chunks, index, and the messages inside them."""
