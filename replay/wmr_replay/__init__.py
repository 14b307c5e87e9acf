"""Log replay for wheeled mobile robots: contact modes and α from MCAP, as Rerun timelines and polars tables."""

from wmr_schemas import __version__

__all__ = ["__version__"]
