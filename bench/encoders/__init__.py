"""Benchmark logs of robots that wheel speeds drive: driver families, their split, and logs of them."""
