"""A page as one file: text, tables, figures, their data, style and script. Nothing is loaded from elsewhere.

Every text goes through :func:`escape`, and the figures' data through :func:`embedded`: a log's names may hold
any character. A content security policy in the page forbids every connection.
"""

import html
import json
import re
from collections.abc import Iterable, Mapping, Sequence
from importlib.resources import files
from typing import Any

from wmr_replay.report.bundle import figure_script
from wmr_replay.report.charts import Columns, Figure, Key, Spec
from wmr_schemas import __version__
from wmr_schemas.text import encodable, shown

POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval'; style-src 'unsafe-inline'; img-src data:; "
    "form-action 'none'; base-uri 'none'"
)


def escape(text: object) -> str:
    """Text of a page: control codes, and what HTML would read as its own, are escaped."""
    return html.escape(encodable(shown(text)))


def embedded(content: object) -> str:
    """JSON inside a script element: no ``<`` can end the element, no line separator ends a string."""
    text = json.dumps(content, ensure_ascii=True, separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def asset(name: str) -> str:
    """A file of ``assets``."""
    return files("wmr_replay.report").joinpath("assets", name).read_text(encoding="utf-8")


class Page:
    """A page that grows from top to bottom; ``text()`` is the file."""

    def __init__(self, title: str, kind: str, *, wide: bool = False) -> None:
        self._title, self._kind, self._wide = title, kind, wide
        self._body: list[str] = []
        self._specs: dict[str, Spec] = {}
        self._data: dict[str, Columns] = {}

    def add(self, *pieces: str) -> None:
        """Append HTML."""
        self._body += [piece for piece in pieces if piece]

    def section(self, title: str, lead: str = "") -> None:
        """A heading, and a sentence in words of ours."""
        self.add(f"<h2>{escape(title)}</h2>", paragraph(lead) if lead else "")

    def figures(self, *columns: Iterable[Figure | None]) -> None:
        """Figures one below the other; several columns stand side by side where the screen is wide enough."""
        drawn = ["\n".join(self._placed(one) for one in column if one is not None) for column in columns]
        drawn = [column for column in drawn if column]
        if len(drawn) > 1:
            inside = "\n".join(f"<div>{column}</div>" for column in drawn)
            self.add(f'<div class="two">{inside}</div>')
        else:
            self.add(*drawn)

    def _placed(self, figure: Figure) -> str:
        """The element of a figure; specification and data go to the page's end, each data set once."""
        name = f"figure-{len(self._specs)}-{figure.name}"
        self._specs[name] = figure.spec
        for data, columns in figure.data.items():
            self._data.setdefault(data, columns)
        note = f"<figcaption>{escape(figure.note)}</figcaption>" if figure.note else ""
        return (
            f'<figure><div class="title">{escape(figure.title)}</div>{key_line(figure.key)}'
            f'<div class="chart" id="{escape(name)}" data-label="{escape(figure.title)}"></div>'
            f"{note}</figure>"
        )

    def text(self) -> str:
        """The whole file."""
        figures = embedded({"specs": self._specs, "data": self._data})
        body = "\n".join(self._body)
        return f"""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="{POLICY}">
<meta name="generator" content="wmr-replay {escape(__version__)}">
<title>{escape(self._title)} · {escape(self._kind)}</title>
<style>
{asset("page.css")}</style>
</head>
<body{" class=wide" if self._wide else ""}>
<main>
<header><div class="kind">wmr-replay · {escape(self._kind)}</div><h1>{escape(self._title)}</h1></header>
<noscript><p class="soft">The figures are drawn by scripts, which are off here: open the file in a
browser. Verdict, numbers and tables are complete.</p></noscript>
{body}
</main>
<div id="tip" role="status"></div>
<script type="application/json" id="figures">{figures}</script>
<script>{figure_script()}</script>
<script>
{asset("page.js")}</script>
</body>
</html>
"""


def paragraph(text: object, kind: str = "") -> str:
    """A paragraph."""
    return f'<p class="{kind}">{escape(text)}</p>' if kind else f"<p>{escape(text)}</p>"


def key_line(key: Sequence[Key]) -> str:
    """The key of a figure in a line that wraps."""
    entries = "".join(
        f'<span><i class="{one.form}" style="background:{one.colour};border-color:{one.colour}"></i>'
        f"{escape(one.name)}</span>"
        for one in key
    )
    return f'<div class="key">{entries}</div>' if entries else ""


def verdict(word: str, sentence: str, tone: str) -> str:
    """The answer, first and largest: a word in its colour and a sentence."""
    first = f"<b>{escape(word)}</b> " if word else ""
    return f'<div class="verdict" style="--tone:{tone}"><p>{first}{escape(sentence)}</p></div>'


def facts(entries: Iterable[tuple[str, str, str]]) -> str:
    """Numbers in boxes: name, value, and what is to be said of it."""
    boxes = "".join(
        f'<div><span class="name">{escape(name)}</span><span class="value">{escape(value)}</span>'
        f'<span class="more">{escape(more)}</span></div>'
        for name, value, more in entries
    )
    return f'<div class="facts">{boxes}</div>' if boxes else ""


def share_bar(shares: Sequence[tuple[str, str, float]]) -> str:
    """Shares of a whole as one bar with its key: name, colour, share."""
    parts = "".join(
        f'<i style="width:{100 * share:.2f}%;background:{colour}" title="{escape(name)} {share:.1%}"></i>'
        for name, colour, share in shares
    )
    return f'<div class="bar">{parts}</div>' + key_line([Key(c, f"{n} {s:.1%}") for n, c, s in shares])


def table(head: Sequence[str], rows: Iterable[Sequence[object]], *, numeric: Iterable[int] = ()) -> str:
    """A table; the columns of ``numeric`` are set flush right."""
    right = set(numeric)
    cells = [
        "".join(f"<td{' class=n' if k in right else ''}>{lines(cell)}</td>" for k, cell in enumerate(row))
        for row in rows
    ]
    if not cells:
        return ""
    heads = "".join(
        f"<th{' class=n' if k in right else ''}>{escape(name)}</th>" for k, name in enumerate(head)
    )
    body = "".join(f"<tr>{row}</tr>" for row in cells)
    return f'<div class="scroll"><table><thead><tr>{heads}</tr></thead><tbody>{body}</tbody></table></div>'


def details(summary: str, inside: str) -> str:
    """What only some readers want, closed."""
    return f"<details><summary>{escape(summary)}</summary>{inside}</details>" if inside else ""


def with_code(text: object) -> str:
    """The text as HTML; what stands between backticks as code."""
    return re.sub("`([^`]+)`", r"<code>\1</code>", escape(text))


def finding_list(findings: Sequence[Mapping[str, Any]]) -> str:
    """The findings on the data: weight, what was found and where, what it means, what to do."""
    words = {"bars": "bars an answer", "warning": "warning", "note": "note"}
    order = list(words)
    items = []
    for found in sorted(findings, key=lambda f: order.index(f["severity"]) if f["severity"] in order else 9):
        where = ", ".join(f"{start:.1f}–{end:.1f} s" for start, end in found["where"][:3])
        rest = " …" if len(found["where"]) > 3 else ""
        word = escape(words.get(found["severity"], "note"))
        items.append(
            f'<li><span class="badge {escape(found["severity"])}">{word}</span> '
            f"<code>{escape(found['code'])}</code> {with_code(found['text'])}"
            f"{f' <span class=soft>({escape(where + rest)})</span>' if where else ''}<br>"
            f'<span class="soft">{with_code(found["meaning"])}; {with_code(found["advice"])}</span></li>'
        )
    return f'<ul class="plain">{"".join(items)}</ul>' if items else ""


NOTHING_FOUND = (
    '<p><span class="badge good">nothing found</span> No check of the data found anything wrong.</p>'
)


def lines(text: object) -> str:
    """A text of several lines, escaped line by line."""
    return "\n".join(escape(line) for line in str(text).split("\n"))


def footer(lines: Iterable[str]) -> str:
    """What made the page, and out of what."""
    return "<footer>" + "<br>".join(map(escape, lines)) + "</footer>"
