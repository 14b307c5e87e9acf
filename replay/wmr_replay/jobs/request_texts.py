"""What a call was asked for besides its settings, as texts that a result holds: the same call again."""

from wmr_replay.ingest import Between
from wmr_schemas.mapping_file import LogMapping, mapping_toml
from wmr_schemas.model_file import Model, model_to_toml


def request_texts(mapping: LogMapping | None, between: Between | None, model: Model | None) -> dict[str, str]:
    """Mapping and model as TOML files, the limits as text; what was not asked for is left out."""
    texts = {
        "mapping": mapping_toml(mapping) if mapping else "",
        "model": model_to_toml(model) if model else "",
        "start": (between.start if between else None) or "",
        "end": (between.end if between else None) or "",
    }
    return {name: text for name, text in texts.items() if text}
