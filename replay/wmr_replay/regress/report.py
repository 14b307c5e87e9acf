"""The outcome of a check as lines of text, as a JSON document and as JUnit XML."""

from collections.abc import Iterator, Sequence
from typing import Any
from xml.etree import ElementTree

from wmr_replay.regress.check import LogCheck
from wmr_replay.regress.differences import ColumnDifference, TableComparison
from wmr_schemas.text import figure, shown, shown_lines

COLUMNS_SHOWN = 6


def check_lines(check: LogCheck) -> Iterator[str]:
    """One log: a line when it passes, what is wrong with it when it does not. Control codes are escaped."""
    stem = shown(check.log.stem)
    if check.problem is not None:
        yield f"{stem}: FAILED: {shown_lines(check.problem)}"
        return
    if check.accepted:
        yield f"{stem}: stored as the new reference"
    elif check.tables:
        n_rows, n_values = check.tables[0].n_rows, sum(table.n_values for table in check.tables)
        verdict = "same" if check.same else "DIFFERS"
        yield f"{stem}: {verdict} ({n_rows} samples, {n_values} values)"
    else:
        yield f"{stem}: {'passed' if check.passed else 'FAILED'}"
    for table in check.tables:
        yield from (f"  {table.table}: {line}" for line in table_lines(table))
    for judged in check.criteria:
        value = "unknown" if judged.value is None else figure(judged.value, 6)
        yield f"  {'met' if judged.passed else 'NOT MET'}: {judged.criterion} (is {value})"
    yield from (f"  note: {shown(note)}" for note in check.notes)


def table_lines(table: TableComparison) -> Iterator[str]:
    """Problems of types and counts, else the columns that differ, as many as fit."""
    yield from table.problems
    for column in table.columns[:COLUMNS_SHOWN]:
        yield value_line(table, column) if table.n_rows == 1 else column_line(column, table.n_rows)
    if len(table.columns) > COLUMNS_SHOWN:
        yield f"… and {len(table.columns) - COLUMNS_SHOWN} columns more"


def column_line(column: ColumnDifference, n_rows: int) -> str:
    """How many values of a column lie beyond its tolerance, and how far."""
    worst = "" if column.worst is None else f", worst {figure(column.worst, 3, '+')}"
    may = f" ({column.allowed} may)" if column.allowed else ""
    return f"{column.column}: {column.n} of {n_rows} values{may}, first in row {column.first_row}{worst}"


def value_line(table: TableComparison, column: ColumnDifference) -> str:
    """New and reference value of a column that has one row."""
    (row,) = table.differences.filter(column=column.column).iter_rows(named=True)
    return shown(f"{column.column}: {row['new']}, not {row['reference']}")


def check_json(checks: Sequence[LogCheck], missing: Sequence[str], accept: str | None) -> dict[str, Any]:
    """The whole check as one document."""
    return {
        "passed": all(check.passed for check in checks) and bool(checks),
        "logs": [log_json(check) for check in checks],
        "references_without_log": list(missing),
        "accept": accept,
    }


def log_json(check: LogCheck) -> dict[str, Any]:
    """One log of the document."""
    return {
        "log": str(check.log),
        "passed": check.passed,
        "problem": check.problem,
        "accepted": check.accepted,
        "notes": list(check.notes),
        "tables": {
            table.table: {
                "passed": table.passed,
                "problems": list(table.problems),
                "rows": table.n_rows,
                "values": table.n_values,
                "columns": [vars(column) | {"passed": column.passed} for column in table.columns],
            }
            for table in check.tables
        },
        "criteria": [
            {"criterion": str(judged.criterion), "value": judged.value, "passed": judged.passed}
            for judged in check.criteria
        ],
    }


def junit_xml(checks: Sequence[LogCheck], missing: Sequence[str], accept: str | None) -> str:
    """One test case for each table and criterion of each log; skipped ones for references without a log.

    XML 1.0 cannot hold control codes even as references, so they are escaped as on a terminal.
    """
    suite = ElementTree.Element("testsuite", name="wmr-replay check")
    for check in checks:
        for name, problems in cases(check):
            case = ElementTree.SubElement(
                suite, "testcase", classname=shown(check.log.stem), name=shown(name)
            )
            if problems:
                kind = "error" if check.unusable else "failure"
                found = ElementTree.SubElement(case, kind, message=shown_lines(problems[0]))
                found.text = shown_lines(
                    "\n".join([*problems, *([f"to accept: {accept}"] if accept else [])])
                )
    for stem in missing:
        case = ElementTree.SubElement(suite, "testcase", classname=shown(stem), name="samples")
        ElementTree.SubElement(case, "skipped", message="the reference's log was not given")
    for attribute, path in (
        ("tests", "testcase"),
        ("failures", "*/failure"),
        ("errors", "*/error"),
        ("skipped", "*/skipped"),
    ):
        suite.set(attribute, str(len(suite.findall(path))))
    root = ElementTree.Element("testsuites")
    root.append(suite)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def cases(check: LogCheck) -> Iterator[tuple[str, list[str]]]:
    """The test cases of one log, each with its problems."""
    if check.problem is not None:
        yield "replay", [check.problem]
    for table in check.tables:
        yield table.table, [] if table.passed or check.accepted else [*table_lines(table)]
    for judged in check.criteria:
        value = "unknown" if judged.value is None else repr(judged.value)
        yield str(judged.criterion), [] if judged.passed else [f"{judged.criterion.column} is {value}"]
    if check.accepted and not check.tables:
        yield "stored as the new reference", []
