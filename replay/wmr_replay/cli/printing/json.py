"""JSON on standard output."""

import json
import sys

from wmr_replay.cli import activity
from wmr_schemas.text import json_text


def echo_json(content: object) -> None:
    """Print one JSON document, control codes as ``\\uXXXX``."""
    echo_document(json_text(content))


def echo_document(document: str) -> None:
    """Print a JSON document; what standard output cannot encode as ``\\uXXXX``, so that it reads back."""
    activity.stop()
    encoding = getattr(sys.stdout, "encoding", None) or "utf-8"
    try:
        document.encode(encoding)
    except UnicodeEncodeError:
        document = "".join(c if c.isascii() else json.dumps(c)[1:-1] for c in document)
    print(document, flush=True)
