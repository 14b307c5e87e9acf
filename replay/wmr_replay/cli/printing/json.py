"""JSON on standard output."""

import click

from wmr_schemas.text import json_text


def echo_json(content: object) -> None:
    """Print one JSON document, control codes as ``\\uXXXX``."""
    click.echo(json_text(content))
