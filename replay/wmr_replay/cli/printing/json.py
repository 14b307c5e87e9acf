"""JSON on standard output."""

import json

import click


def echo_json(content: object) -> None:
    """Print one JSON document."""
    click.echo(json.dumps(content, indent=2, ensure_ascii=False))
