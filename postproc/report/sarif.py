"""Findings and welds as SARIF 2.1.0 (OASIS, 2020), which code hosts, editors and other tools show at their lines."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from hashlib import sha256
from pathlib import PurePath
from typing import Any
from urllib.parse import quote

from postproc import __version__
from postproc.files import explanations

SARIF_SCHEMA = "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"
SARIF_LEVELS = {"error": "error", "warning": "warning", "info": "note"}


WELD_RULE = "weld"
WELD_TITLE = "What is expected of a weld"
WELD_HELP = (
    "The largest deviation that the arc sees in a weld, sideways and along the stick-out: of the arm in its model, "
    "before and after the correction, and the 95 % interval that is expected on the arm itself. It stands at the "
    "statement where the arc starts."
)
_NUMBER = re.compile(r"(?<![\w.])[-+]?\d[\d.]*")


def sarif(findings: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """Return findings as a SARIF log with one run of this tool; a finding on stdin or without a file has no location.

    Each result has a fingerprint of its rule, file and wording without numbers, so that a finding that moves to another
    line, or whose figures change, stays the same one; findings that are alike are counted.

    Args:
        findings: as documents have them, see ``Diagnostic.as_json``; those without a code are notes on welds.
    """
    listed, explained = [(finding["code"] or WELD_RULE, finding) for finding in findings], explanations()
    ids = sorted({rule for rule, _ in listed})
    rules, results = [], []
    for rule in ids:  # the section's heading becomes the title, and its text the help
        head, _, text = explained.get(rule, f"{WELD_TITLE}\n{WELD_HELP}").partition("\n")
        title = head.removeprefix(f"## {rule}").strip()
        rules.append({"id": rule, "shortDescription": {"text": title}, "help": {"text": text.strip() or title}})
    seen: Counter[str] = Counter()
    for rule, finding in listed:
        message, advice = finding["message"], finding["help"]
        subject = message.partition(":")[0] if rule == WELD_RULE else message
        wording = f"{rule} {finding['path']} {_NUMBER.sub('', subject)}"
        mark = sha256(wording.encode("utf-8", "surrogateescape")).hexdigest()[:32]
        seen[mark] += 1
        results.append(
            {
                "ruleId": rule,
                "ruleIndex": ids.index(rule),
                "level": SARIF_LEVELS[finding["severity"]],
                "message": {"text": f"{message}; {advice}" if advice else message},
                "locations": _locations(finding),
                "partialFingerprints": {"wording/v1": f"{mark}:{seen[mark]}"},
            }
        )
    return _log(rules, results)


def merged(logs: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """Return logs of this tool as one log with one run, as code hosts want it."""
    runs = [run for log in logs for run in log["runs"]]
    rules = {rule["id"]: rule for run in runs for rule in run["tool"]["driver"]["rules"]}
    ids = sorted(rules)
    results = [{**one, "ruleIndex": ids.index(one["ruleId"])} for run in runs for one in run["results"]]
    return _log([rules[rule] for rule in ids], results)


def _log(rules: Sequence[Mapping[str, Any]], results: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the SARIF log with one run of this tool."""
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
        column = {} if finding["column"] is None else {"startColumn": finding["column"]}
        place["region"] = {"startLine": finding["line"], **column}
    return [{"physicalLocation": place}]
