"""``python -m wmr_replay`` is ``wmr-replay``."""

from wmr_replay.cli import main

if __name__ == "__main__":
    main()
