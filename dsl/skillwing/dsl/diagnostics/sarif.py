"""Diagnostics as SARIF 2.1.0, the format of code hosts for findings of static analysis.

https://docs.oasis-open.org/sarif/sarif/v2.1.0/sarif-v2.1.0.html
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TypeAlias
from urllib.parse import quote

from skillwing.dsl.diagnostics.codes import CODES
from skillwing.dsl.diagnostics.diagnostic import Diagnostic
from skillwing.dsl.spans import Span

Json: TypeAlias = dict[str, object]

_SCHEMA = "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"


def sarif_log(diagnostics: Iterable[Diagnostic], version: str, page_on: Callable[[str], str]) -> Json:
    """One run with a result for each diagnostic and a rule for each code among them.

    version: of this package. page_on: gives the page on a code, in Markdown.
    """
    found = list(diagnostics)
    codes = sorted({diagnostic.code for diagnostic in found})
    driver = {"name": "skillwing", "version": version, "rules": [_rule(code, page_on(code)) for code in codes]}
    results = [_result(diagnostic, codes.index(diagnostic.code)) for diagnostic in found]
    run = {"tool": {"driver": driver}, "columnKind": "unicodeCodePoints", "results": results}
    return {"$schema": _SCHEMA, "version": "2.1.0", "runs": [run]}


def _rule(name: str, page: str) -> Json:
    code = CODES[name]
    return {
        "id": code.name,
        "shortDescription": {"text": code.title},
        "help": {"text": page, "markdown": page},
        "defaultConfiguration": {"level": code.severity},
    }


def _result(diagnostic: Diagnostic, rule: int) -> Json:
    sentences = [diagnostic.message, diagnostic.help]
    result: Json = {
        "ruleId": diagnostic.code,
        "ruleIndex": rule,
        "level": diagnostic.severity,
        "message": {"text": " ".join(sentence for sentence in sentences if sentence)},
        "locations": [{"physicalLocation": _place(diagnostic.span)}],
    }
    if diagnostic.related is not None:
        span, words = diagnostic.related
        result["relatedLocations"] = [{"id": 0, "physicalLocation": _place(span), "message": {"text": words}}]
    return result


def _place(span: Span) -> Json:
    file = Path(span.file)
    region = {
        "startLine": span.line,
        "startColumn": span.column,
        "endLine": span.end_line,
        "endColumn": span.end_column,
    }
    uri = file.as_uri() if file.is_absolute() else quote(file.as_posix())
    return {"artifactLocation": {"uri": uri}, "region": region}
