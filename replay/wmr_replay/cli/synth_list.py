"""What `synth` can do, listed: scenarios and effects."""

import click


def show(scenarios: bool, as_json: bool) -> None:
    """The list that was asked for."""
    if scenarios:
        show_list(as_json)
    elif as_json:
        echo_json(list_effects())
    else:
        show_effects()


def show_list(as_json: bool) -> None:
    """Name and description of every scenario."""
    from wmr_synth import SCENARIOS

    if as_json:
        rows = [
            {
                "name": s.name,
                "description": s.description,
                "duration_s": s.duration_s,
                "rate_hz": s.sensors.rate_hz,
            }
            for s in SCENARIOS.values()
        ]
        echo_json(rows)
        return
    width = max(map(len, SCENARIOS))
    for entry in SCENARIOS.values():
        click.echo(f"{entry.name:{width}}  {entry.duration_s:4.0f} s  {entry.description}")


def list_effects() -> list[dict[str, object]]:
    """Every effect that can be hidden: its form, parameters with units, and the ranges of a bare name."""
    from wmr_schemas.effects import BEYOND, EFFECTS
    from wmr_synth.hidden.drawing import describe_range
    from wmr_synth.hidden.registry import words_of

    return [
        {
            "name": name,
            "candidate": form.formula,
            "hidden": words_of(name),
            "parameters": form.units,
            "ranges": {key: describe_range(within) for key, within in form.ranges.items()},
        }
        for name, form in (EFFECTS | BEYOND).items()
    ]


def show_effects() -> None:
    """The effects for a person."""
    rows = list_effects()
    width = max(len(str(row["name"])) for row in rows)
    for row in rows:
        ranges = row["ranges"]
        assert isinstance(ranges, dict)
        drawn = ", ".join(f"{key} {text}" for key, text in ranges.items())
        click.echo(f"{row['name']:{width}}  {drawn}\n{'':{width}}  {row['candidate']}; here: {row['hidden']}")


def echo_json(content: object) -> None:
    """One JSON document on standard output."""
    import json

    click.echo(json.dumps(content, indent=2, ensure_ascii=False))
