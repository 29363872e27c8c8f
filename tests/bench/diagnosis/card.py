"""The figures of many sets as a page."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

Line = dict[str, Any]
WORDS = ("right", "inseparable", "part, harmless", "abstained rightly", "part", "needless", "wrong", "abstained", "missed", "wrong channel", "false alarm", "refused", "harmed", "error")  # fmt: skip
BAD = ("part", "needless", "wrong", "missed", "abstained", "wrong channel", "false alarm", "harmed", "error")
ODDS = ((1, 10), (10, 100), (100, 1e4), (1e4, np.inf))
WHAT = {
    "library": "one effect of the library, at 1, 0.5 and 2 times an ordinary size",
    "pairs": "two effects of the library",
    "four": "four effects of the library at once",
    "beside": "an effect of the library beside a law that it does not have",
    "outside": "a law that the library does not have",
    "clean": "nothing, at rest and moving",
    "cell": "a track, gantry, column or positioner that is askew, crooked or leans",
    "clean cell": "nothing, of arms on tracks and gantries and beside positioners",
    "few": "one effect, 22 poses",
    "moving": "moving arms",
    "orientation": "positions and orientations",
    "encoder": "joint encoders alone: lag, lost motion, a wave, nothing",
    "arms": "other arms, an effect or nothing",
    "new payload": "one effect, asked at a payload that no measured row has",
    "new side": "one effect, asked where joints 2 and 3 come from different sides, which they never did",
    "new temperature": "one effect, asked at the last degrees of a warm-up, beyond all measured ones",
    "new region": "one effect, asked in a sector of joint 1 that was not measured",
    "two joints": "waves and products of two joint angles, repeats in one visit or at other times",
    "regions": "nothing or a law, in the library or outside, with a quarter of a joint's range, a quadrant or an octant not measured",
    "memory": "growth and drift that lag the temperature, creep, hysteresis of a joint, warm-up, a restart; asked between the rows or after",
    "slips and cycles": "a joint zero that jumps, zeros of each power cycle, a tool or a tracker that moved; a column tells half of the cycles alone",
    "directions missing": "lost motion in rows in order, without columns for the sides",
    "bad rows": "2 to 25 % of the rows in turned axes, shifted, in another unit, with columns or points swapped",
}


def read(path: Path) -> list[Line]:
    """The lines of a file of results; of equal ones the last."""
    found: dict[tuple[Any, ...], Line] = {}
    for text in path.read_text().splitlines() if path.exists() else ():
        x = json.loads(text)
        found[x["kind"], x["index"], x["method"], x["without"], x["label"]] = x
    return list(found.values())


def _simulated(lines: Sequence[Line]) -> list[Line]:
    return [x for x in lines if x["kind"] in WHAT]


def _of(lines: Sequence[Line], name: str, over: str = "") -> np.ndarray:
    some = [x for x in lines if x.get(name) is not None and (not over or x.get(over))]
    return np.array([x[name] / (x[over] if over else 1.0) for x in some])


def _said(value: float, digits: int = 2) -> str:
    return "" if not np.isfinite(value) else f"{value:.{digits}f}"


def _quantile(values: np.ndarray, share: float) -> float:
    return float(np.quantile(values, share)) if len(values) else np.nan


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    every = [list(head), ["---"] * len(head), *map(list, rows)]
    return "\n".join("| " + " | ".join(row) + " |" for row in every)


def verdicts(lines: Sequence[Line]) -> str:
    """One row a kind: how many sets ended in which word."""
    some = _simulated(lines)
    kinds = [k for k in WHAT if any(x["kind"] == k for x in some)]
    used = [w for w in WORDS if any(x.get("word") == w for x in some)]
    rows = []
    for name in [*kinds, "all"]:
        mine = [x for x in some if name in ("all", x["kind"])]
        count = Counter(x.get("word") for x in mine)
        rows.append([name, str(len(mine)), *(str(count[w] or "") for w in used)])
    return table(["kind", "sets", *used], rows)


def figures(lines: Sequence[Line]) -> str:
    """One row a kind: names, errors, coverage, cost."""
    some = _simulated(lines)
    kinds = [k for k in WHAT if any(x["kind"] == k for x in some)]
    rows = []
    for name in [*kinds, "all"]:
        mine = [x for x in some if name in ("all", x["kind"])]
        hidden, found = sum(x.get("hidden", 0) for x in mine), sum(x.get("found", 0) for x in mine)
        hits = [h for x in mine for h in x.get("hits", ())]
        known = [x for x in mine if x.get("said") != "unknown"]
        ratio, over = _of(known, "after", "noise"), _of(known, "after", "true_error")
        inside, cpu = _of(mine, "inside"), _of(mine, "diagnose_s")
        rows.append(
            [
                name,
                f"{found} of {hidden}" if hidden else "",
                f"{hits.count(False)} of {len(hits)}" if hits else "",
                _said(_quantile(ratio, 0.5)),
                _said(_quantile(ratio, 0.9)),
                _said(float(np.mean(over <= 1.2)) if len(over) else np.nan),
                _said(float(inside.mean()) if len(inside) else np.nan, 3),
                _said(_quantile(cpu, 0.5)),
                _said(_quantile(cpu, 0.9)),
            ]
        )
    head = ["kind", "found", "needless names", "error/noise, median", "90 %", "within 1.2 of the true model", "95 % intervals hold", "CPU s, median", "90 %"]  # fmt: skip
    return table(head, rows)


def calibration(lines: Sequence[Line]) -> str:
    """Of names given with some odds, how many are right, against what the odds say."""
    pairs = [(float(np.exp(min(e, 1000.0) / 2)), h) for x in _simulated(lines) for e, h in zip(x.get("evidence", ()), x.get("hits", ()), strict=False)]  # fmt: skip
    rows = []
    for low, high in ODDS:
        mine = [(odds, hit) for odds, hit in pairs if low <= odds < high]
        if mine:
            told = np.mean([odds / (1 + odds) for odds, _ in mine])
            right = np.mean([hit for _, hit in mine])
            name = f"{low:g}:1 to {high:g}:1" if np.isfinite(high) else f"{low:g}:1 and more"
            rows.append([name, str(len(mine)), f"{told:.3f}", f"{right:.3f}"])
    return table(["odds", "names", "said", "right"], rows)


def stability(lines: Sequence[Line]) -> str:
    """How often the first name stays on random parts of the poses."""
    some = [x for x in lines if x["kind"] == "stability" and "names" in x]
    rows = []
    for name, mine in (("above three times the noise", [x for x in some if x["strong"]]), ("weaker", [x for x in some if not x["strong"]])):  # fmt: skip
        same = [n == x["names"][0] for x in mine for n in x["names"][1:]]
        if same:
            rows.append([name, str(len(mine)), str(len(same)), f"{np.mean(same):.3f}"])
    return table(["effect", "sets", "parts of 70 %", "same first name"], rows)


def sizes(lines: Sequence[Line]) -> str:
    some = sorted((x for x in lines if x["kind"] == "size" and "rows" in x), key=lambda x: x["rows"])
    rows = [[str(x["rows"]), f"{x['fit_s']:.2f}", f"{x['diagnose_s']:.1f}", f"{x['memory_mb']:.0f}"] for x in some]
    return table(["rows", "fit, CPU s", "diagnose, CPU s", "memory of the process MB"], rows)


def real(lines: Sequence[Line]) -> str:
    """Errors in space of rows held out, a fifth at a time: of all, and of those that a model could reach."""
    some = [x for x in lines if x["kind"] == "real" and "held" in x]
    rows = []
    for name in dict.fromkeys(x["set"].removeprefix("real: ").partition(" #")[0] for x in some):
        mine = [x for x in some if name in x["set"]]
        before = f"{1e3 * np.sqrt(3 * np.mean(_of(mine, 'before') ** 2)):.3f}"
        median = f"{1e3 * np.mean(_of(mine, 'held_median')):.3f}"
        groups = [_together([x[which] for x in mine]) for which in ("held", "held_reached", "held_among")]
        named = Counter(k for x in mine for k in x["named"])
        told = ", ".join(f"`{k}` {n}" for k, n in named.most_common())
        rows.append([name, before, *groups, median, told])
    header = ["table", "base", "with what was named", "rows that can be reached", "among joint angles seen", "median"]
    return table([*header, "named in so many parts"], rows)


def octants(lines: Sequence[Line]) -> str:
    """One row a table and octant: the first model and the improved one in rows that can be reached, all octants last."""
    some = sorted((x for x in lines if x["kind"] == "octants" and "improved" in x), key=lambda x: x["set"])
    rows = []
    for name in dict.fromkeys(x["set"].split()[1] for x in some):
        mine = [x for x in some if name in x["set"]]
        count = np.array([x["held"][1] for x in mine], dtype=float)
        both = [np.array([x[which] for x in mine]).T for which in ("first", "improved")]
        share = count / count.sum()
        total = [[np.sqrt(share @ v[0] ** 2), np.sqrt(share @ v[1] ** 2), share @ v[2]] for v in both]
        every = [(x["set"].split()[2], x["held"], x["first"], x["improved"], ", ".join(x["named"])) for x in mine]
        held = np.sum([x["held"] for x in mine], axis=0).tolist()
        for octant, (all_, reached), first, improved, named in (*every, ("all", held, *total, "")):
            figures = [f"{1e3 * x:.3f}" if k < 2 else _said(x) for v in (first, improved) for k, x in enumerate(v)]
            rows.append([name, octant, f"{reached} of {all_}", *figures, named])
    head = ["table", "octant", "rows reached", "first", "stated", "inside", "improved", "stated", "inside", "named"]
    return table(head, rows)


def _together(parts: Sequence[tuple[float, int]]) -> str:
    """Root mean square [mm] of several groups of rows in one, and how many rows they are."""
    size, count = np.array(parts, dtype=float).T
    return f"{1e3 * np.sqrt(np.sum(size**2 * count) / np.sum(count)):.3f} ({int(count.sum())})"


def after_add(lines: Sequence[Line]) -> str:
    """One row a kind, half and group of rows: what `fit`, `diagnose` and `add` are worth on rows nobody measured."""
    some = [x for x in lines if "asked" in x]
    groups = dict.fromkeys((x["kind"], x["half"], where) for x in some for where in x["asked"])
    rows = []
    for kind, half, where in sorted(groups, key=lambda group: (list(WHAT).index(group[0]), group[1])):
        mine = [x["asked"][where] for x in some if (x["kind"], x["half"]) == (kind, half)]
        over = _of(mine, "improved", "first")
        held, held_first = _of(mine, "inside"), _of(mine, "inside_first")
        wide = _of(mine, "stated", "improved")
        every = [x for x in some if (x["kind"], x["half"]) == (kind, half)]
        declined, hidden = sum("declined" in x["added"] for x in every), [x for x in every if x["structure"] > 2]
        silent = sum(x["said"] == "complete" for x in hidden)
        rows.append(
            [
                *(
                    kind,
                    half,
                    where,
                    str(len(mine)),
                    str(declined or ""),
                    _said(_quantile(over, 0.5)),
                    _said(float(over.max())),
                ),
                *(str(int((over > 1.1).sum())), _said(float(held.mean())), _said(float(held.min()))),
                *(_said(float(held_first.mean())), _said(_quantile(wide, 0.5)), _said(float(wide.max()))),
                f"{silent} of {len(hidden)}",
            ]
        )
    head = ["kind", "hidden", "rows", "sets", "declined", "improved over first, median", "worst", "above 1.1", "95 % intervals hold", "worst set", "those of the first model", "width, median", "worst", "complete over twice the noise"]  # fmt: skip
    return table(head, rows)


def misses(lines: Sequence[Line]) -> str:
    """Every set that was not answered as it should be."""
    rows = []
    for x in _simulated(lines):
        if x.get("word") in BAD:
            said = ", ".join(x.get("named", ())) or x.get("said", x.get("error", ""))
            more = f"; {x['suspects'][0]}: {x['pattern']}" if x.get("suspects") and x.get("said") == "unknown" else ""
            rows.append([x["set"], _said(x.get("structure", np.nan), 1), x["word"], (said + more).replace("|", "/")])
    return table(["set", "over the noise", "judged", "said"], rows)


def baselines(lines: Sequence[Line], own: Sequence[Line]) -> str:
    """Other methods beside the product, on the sets that both have run."""
    names = {"bic": "stepwise BIC over the library", "gp": "Gaussian process beside the base", "sparse": "sparse regression beside the base"}  # fmt: skip
    mine = {(x["kind"], x["index"]): x for x in _simulated(own)}
    rows = []
    for method, title in names.items():
        some = [x for x in _simulated(lines) if x["method"] == method and (x["kind"], x["index"]) in mine]
        if not some:
            continue
        for label, every in ((title, some), ("`diagnose` on the same", [mine[x["kind"], x["index"]] for x in some])):
            words = Counter(x.get("word") for x in every)
            ratio = _of(every, "after", "noise")
            good = words["right"] + words["inseparable"] + words["abstained rightly"] + words["part, harmless"]
            right = f"{good}" if any("word" in x and x["word"] != "error" for x in every) else ""
            hits = [h for x in every for h in x.get("hits", ())]
            needless = str(hits.count(False)) if hits else ""
            cpu = _quantile(_of(every, "diagnose_s"), 0.5)
            rows.append([label, str(len(every)), right, needless, _said(_quantile(ratio, 0.5)), _said(_quantile(ratio, 0.9)), _said(cpu)])  # fmt: skip
    return table(["method", "sets", "right", "needless names", "error/noise, median", "90 %", "CPU s"], rows)


def summary(lines: Sequence[Line]) -> str:
    """Everything about one revision, as it is read on a terminal."""
    parts: list[Callable[[Sequence[Line]], str]] = [
        verdicts,
        figures,
        after_add,
        calibration,
        stability,
        sizes,
        real,
        octants,
    ]
    return "\n\n".join(part(lines) for part in parts)


def compared(every: Sequence[Line], label: str, against: str) -> str:
    """Two revisions, and every rule switched off, on the sets that both have run."""
    own = {(x["kind"], x["index"]): x for x in _simulated(every) if (x["label"], x["without"], x["method"]) == (label, "", "postproc")}  # fmt: skip
    others = dict.fromkeys((x["label"], x["without"]) for x in every if x["method"] == "postproc")
    rows = []
    for other, without in others:
        if (other, without) == (label, "") or (other != label and (without or other not in against.split(","))):
            continue
        pairs = [(own[x["kind"], x["index"]], x) for x in _simulated(every) if (x["label"], x["without"], x["method"]) == (other, without, "postproc") and (x["kind"], x["index"]) in own]  # fmt: skip
        if not pairs:
            continue
        changed = [(a, b) for a, b in pairs if a.get("word") != b.get("word")]
        better = sum(b.get("word") in BAD and a.get("word") not in BAD for a, b in changed)
        worse = sum(a.get("word") in BAD and b.get("word") not in BAD for a, b in changed)
        good = [sum(x.get("word") not in BAD for x in side) for side in zip(*pairs, strict=True)]
        cpu = [sum(x.get("diagnose_s", 0.0) for x in side) for side in zip(*pairs, strict=True)]
        name = f"without {without}" if without else f"`{other}`"
        rows.append([name, str(len(pairs)), f"{good[0]}", f"{good[1]}", str(better), str(worse), f"{cpu[1] / max(cpu[0], 1e-9):.2f}"])  # fmt: skip
    head = ["against", "sets", "good here", "good there", "better here", "worse here", "CPU there / here"]
    return table(head, rows)


def page(every: Sequence[Line], label: str, rest: str = "") -> str:
    """docs/scorecard.md. Args: rest: label whose lines stand for sets that the first one has not run."""
    own, older = (
        [x for x in every if (x["label"], x["without"], x["method"]) == (r, "", "postproc")] for r in (label, rest)
    )
    new = {(x["kind"], x["index"]) for x in own}
    own += [x for x in older if (x["kind"], x["index"]) not in new]
    what = "\n".join(f"- **{k}**: {v}" for k, v in WHAT.items() if any(x["kind"] == k for x in own))
    text = Path(__file__).with_name("card.md").read_text()
    found = {
        "count": f"{len(_simulated(own))} simulated sets",
        "kinds": what,
        "verdicts": verdicts(own),
        "figures": figures(own),
        "calibration": calibration(own),
        "stability": stability(own),
        "sizes": sizes(own),
        "real": real(own),
        "octants": octants(own),
        "after_add": after_add(own),
        "baselines": baselines(every, own),
        "misses": misses(own),
    }
    for name, part in found.items():
        text = text.replace("{" + name + "}", part)
    return text
