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
    """Return findings as a SARIF log with one run of this tool; a finding on stdin or without a file has no location.

    Args:
        findings: as documents have them, see ``Diagnostic.as_json``.
    """
    listed, known = list(findings), explanations()
    codes = sorted({finding["code"] for finding in listed})
    rules, results = [], []
    for code in codes:  # the section's heading becomes the title, and its text the help
        head, _, text = known[code].partition("\n")
        title = head.removeprefix(f"## {code}").strip()
        rules.append({"id": code, "shortDescription": {"text": title}, "help": {"text": text.strip() or title}})
    for finding in listed:
        code, message, advice = (finding[key] for key in ("code", "message", "help"))
        result = {"ruleId": code, "ruleIndex": codes.index(code), "level": SARIF_LEVELS[finding["severity"]]}
        text = f"{message}; {advice}" if advice else message
        results.append({**result, "message": {"text": text}, "locations": _locations(finding)})
    driver = {"name": "postproc", "version": __version__, "rules": rules}
    run = {"tool": {"driver": driver}, "columnKind": "unicodeCodePoints", "results": results}
    return {"$schema": SARIF_SCHEMA, "version": "2.1.0", "runs": [run]}


def _locations(finding: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the SARIF locations of a finding: absolute paths as ``file:``, relative ones quoted."""
    if finding["path"] is None or finding["path"].startswith("<"):  # what came from stdin has no name
        return []
    path = PurePath(finding["path"])
    uri = path.as_uri() if path.is_absolute() else quote(path.as_posix().encode("utf-8", "surrogateescape"))
    place: dict[str, Any] = {"artifactLocation": {"uri": uri}}
    if finding["line"] is not None:
        place["region"] = {"startLine": finding["line"], "startColumn": finding["column"]}
    return [{"physicalLocation": place}]
