"""Findings as SARIF 2.1.0 (OASIS, 2020), which code hosts, editors and other tools show at their lines."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import PurePath
from typing import Any
from urllib.parse import quote

from postproc import __version__
from postproc.files import explanations

SARIF_SCHEMA = "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"
SARIF_LEVELS = {"error": "error", "warning": "warning", "info": "note"}


def sarif(findings: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """Return findings as a SARIF log with one run of this tool.

    Args:
        findings: as documents have them, see ``Diagnostic.as_json``.
    """
    listed = list(findings)
    known = explanations()
    codes = sorted({finding["code"] for finding in listed})
    driver = {"name": "postproc", "version": __version__, "rules": [_rule(code, known[code]) for code in codes]}
    results = [_result(finding, codes.index(finding["code"])) for finding in listed]
    run = {"tool": {"driver": driver}, "columnKind": "unicodeCodePoints", "results": results}
    return {"$schema": SARIF_SCHEMA, "version": "2.1.0", "runs": [run]}


def findings_in(document: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Return all findings of a document, those of its tasks (in that of a batch) included."""
    parts = [document, *document.get("tasks", ())]
    return [finding for part in parts for finding in part.get("diagnostics", ())]


def _rule(code: str, explained: str) -> dict[str, Any]:
    """Return the SARIF rule of a code.

    Args:
        explained: its section in Markdown, whose heading becomes the title and whose rest the help.
    """
    head, _, text = explained.partition("\n")
    title = head.removeprefix(f"## {code}").strip()
    return {"id": code, "shortDescription": {"text": title}, "help": {"text": text.strip() or title}}


def _result(finding: Mapping[str, Any], rule: int) -> dict[str, Any]:
    """Return a finding as a SARIF result of the rule with this index."""
    text = f"{finding['message']}; {finding['help']}" if finding["help"] else finding["message"]
    result = {"ruleId": finding["code"], "ruleIndex": rule, "level": SARIF_LEVELS[finding["severity"]]}
    return {**result, "message": {"text": text}, "locations": _locations(finding)}


def _locations(finding: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the SARIF locations of a finding; empty for stdin or without a file."""
    path = finding["path"]
    if path is None or path.startswith("<"):  # what came from stdin has no name
        return []
    place: dict[str, Any] = {"artifactLocation": {"uri": _uri(PurePath(path))}}
    if finding["line"] is not None:
        place["region"] = {"startLine": finding["line"], "startColumn": finding["column"]}
    return [{"physicalLocation": place}]


def _uri(path: PurePath) -> str:
    """Return a path as a URI: absolute ones as ``file:``, relative ones quoted."""
    return path.as_uri() if path.is_absolute() else quote(path.as_posix().encode("utf-8", "surrogateescape"))
