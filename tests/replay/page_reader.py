"""What every page must be: well-formed HTML, closed to the network, each figure with data."""

import json
from html.parser import HTMLParser
from typing import Any

VOID = {"meta", "br", "link", "img", "input", "hr"}


class Reader(HTMLParser):
    """Elements, text and attributes of a page; fails where elements are not closed in their order."""

    def __init__(self, page: str) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.elements: list[tuple[str, dict[str, str]]] = []
        self.scripts: list[str] = []
        self.text = ""
        self.feed(page)
        self.close()
        assert not self.open

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, {name: value or "" for name, value in attrs}))
        if tag not in VOID:
            self.open.append(tag)
        if tag == "script":
            self.scripts.append("")

    def handle_endtag(self, tag):
        assert self.open, f"</{tag}> closes nothing"
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] == "script":
            self.scripts[-1] += data
        elif not (self.open and self.open[-1] == "style"):
            self.text += data

    def figures(self) -> dict[str, Any]:
        """Specifications and data of the figures."""
        return json.loads(self.scripts[0])

    def drawn(self) -> set[str]:
        """The elements in which figures are drawn."""
        return {values["id"] for _, values in self.elements if values.get("class") == "chart"}


def checked(page: str) -> Reader:
    """A page that is well-formed, loads nothing, and draws each figure from data."""
    read = Reader(page)
    assert len(read.scripts) == 3
    tags = {tag for tag, _ in read.elements}
    assert not tags & {"link", "img", "iframe", "object", "embed", "base", "form"}
    for tag, values in read.elements:
        assert not {"src", "srcset", "action", "data", "background"} & set(values), tag
        assert not any(name.startswith("on") for name in values), tag
        assert "//" not in values.get("href", ""), "a link leads elsewhere"
    policy = [v["content"] for t, v in read.elements if v.get("http-equiv") == "Content-Security-Policy"]
    assert policy[0].startswith("default-src 'none'")
    style = page.partition("<style>")[2].partition("</style>")[0]
    assert "@import" not in style
    assert "url(" not in style
    figures = read.figures()
    assert read.drawn() == set(figures["specs"])
    for name, spec in figures["specs"].items():
        check_figure(name, spec, figures["data"])
    return read


def check_figure(name: str, spec: dict[str, Any], data: dict[str, Any]) -> None:
    """Each layer draws a data set that is there, and at least one has a row."""
    assert spec["usermeta"]["data"], name
    filled = 0
    for one in spec["usermeta"]["data"]:
        lengths = {len(column) for column in data[one].values()}
        assert len(lengths) == 1, f"{name}: {one}"
        filled += any(value is not None for column in data[one].values() for value in column)
    assert filled, name
    for layer in spec["layer"]:
        assert "values" in layer["data"] or layer["data"]["name"] in spec["usermeta"]["data"], name


def with_rows(spec: dict[str, Any], data: dict[str, Any], width: int = 600) -> dict[str, Any]:
    """A figure as the page's script completes it."""
    whole = json.loads(json.dumps(spec)) | {"width": width, "datasets": {}}
    for name in spec["usermeta"]["data"]:
        columns = data[name]
        rows = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
        whole["datasets"][name] = rows
    return whole
