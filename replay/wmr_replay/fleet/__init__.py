"""Many logs at once: a work list, workers, one dataset. Entrance: ``wmr_replay.fleet.batch.run_batch``."""
