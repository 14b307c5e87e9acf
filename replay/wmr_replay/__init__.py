"""Log replay for wheeled mobile robots: contact modes and α out of MCAP, into Rerun and polars."""

from wmr_schemas import __version__

__all__ = ["__version__"]
