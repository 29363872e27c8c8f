"""Drives an independent elastic arm with a converted program."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from tests.independent import arm as A
from tests.independent import inverse as I
from tests.independent import paths as P
from tests.independent import rapid as R
from tests.independent.legal import check_added, check_text


@dataclass
class Segment:
    """One original move, lengths in m, deviations in mm."""

    index: int
    line: int
    name: str
    kind: str
    length: float
    welding: bool
    added: int
    before: float
    after: float
    goal_before: float
    goal_after: float
    worst_at: float = 0.0
    cut_after: float = 0.0
    counted: bool = True
    note: str = ""


@dataclass
class Report:
    """Deviations in mm over all counted lines and arcs."""

    segments: list[Segment] = field(default_factory=list)
    violations: list[str] = field(default_factory=list)
    skipped: list[str] = field(default_factory=list)
    before: float = 0.0
    after: float = 0.0
    goal_after: float = 0.0
    cut_after: float = 0.0
    added: int = 0
    seam_metres: float = 0.0
    added_per_metre: float = 0.0
    worst_seam_per_metre: float = 0.0


def align(original: list[R.Motion], output: list[R.Motion], arm: A.Arm) -> list[int] | None:
    """Index in ``output`` of each original move, so that matched goals lie closest together; None if moves are missing."""
    n, spare = len(original), len(output) - len(original)
    if spare < 0:
        return None

    def place(m: R.Motion) -> np.ndarray:
        return m.goal[:3, 3] if m.q is None else P.on_work(arm.forward(m.q[None], np.eye(4)).flange, m)[0, :3, 3]

    def kept(m: R.Motion) -> tuple[str, ...]:
        return m.name.lower(), *(x.lower() for x in m.positional[2 if m.kind == "C" else 1 :])

    goals = np.array([place(m) for m in output])
    texts = [kept(m) for m in output]
    names = np.array([t[0] for t in texts])
    cost = np.zeros(spare + 1)
    back = np.zeros((n, spare + 1), dtype=np.int32)
    for i, m in enumerate(original):
        arg = np.zeros(spare + 1, dtype=np.int32)
        running = np.minimum.accumulate(cost)
        fresh = cost <= running
        arg = np.maximum.accumulate(np.where(fresh, np.arange(spare + 1), 0)).astype(np.int32)
        window = slice(i, i + spare + 1)
        step = np.linalg.norm(goals[window] - place(m), axis=1) + 1e6 * (names[window] != m.name.lower())
        # What a move keeps, its speed, zone and tool, tells it from an added one close by.
        step += 1e2 * np.array([t != kept(m) for t in texts[window]])
        cost, back[i] = running + step, arg
    k = int(np.argmin(cost))
    if cost[k] >= 1e6:
        return None
    match = []
    for i in range(n - 1, -1, -1):
        match.append(i + k)
        k = int(back[i, k])
    return match[::-1]


def _distance(start: np.ndarray, m: R.Motion, p: np.ndarray) -> np.ndarray:
    if m.kind == "C":
        assert m.via is not None
        return P.circle(start[:3, 3], m.via[:3, 3], m.goal[:3, 3]).distance(p)
    return P.polyline_distance(p, np.stack([start[:3, 3], m.goal[:3, 3]]))


def check(
    original: str,
    output: str,
    arm: A.Arm,
    force: np.ndarray,
    moment: np.ndarray | None = None,
    displace: A.Displace | None = None,
    step: float = 0.002,
    blend: bool = False,
    on_arc: bool = False,
) -> Report:
    """Compare where the arm should go with where it goes.

    Args:
        force, moment: dead wrench on the TCP [N, N m], base axes; ``on_arc``: only while the arc burns.
        displace: springs of the real arm, Table 2 where none are given; step: longest distance between samples [m];
            blend: whether corners are compared, too (``cut_after``).
    """
    moment = np.zeros(3) if moment is None else moment
    displace = displace or A.joint_springs(A.TABLE_2)
    old, skipped = R.motions(original)
    new, skipped_new = R.motions(output)
    report = Report(skipped=[f"{n}: {why}" for n, why in skipped], violations=check_text(original, output))
    report.violations += [f"output line {n}: {why}" for n, why in skipped_new if len(skipped_new) > len(skipped)]
    match = align(old, new, arm)
    if match is None:
        report.violations.append(f"moves are missing or renamed: {len(old)} original, {len(new)} in the output")
        return report
    wanted, written = P.play(arm, old, step), P.play(arm, new, step)
    cut_old, cut_new = (P.cut_corners(wanted), P.cut_corners(written)) if blend else ([], [])
    report.violations += check_added(old, new, match, arm)
    previous = -1
    for i, m in enumerate(old):
        first, last = previous + 1, match[i]
        previous = last
        leg, final = wanted[i], written[last]
        seg = Segment(i, m.line, m.name, m.kind, P._length(leg.command), m.weld, last - first, 0, 0, 0, 0)
        report.segments.append(seg)
        for k in range(first, last + 1):
            if written[k].problem and not leg.problem:
                report.violations.append(f"output line {new[k].line}: {new[k].name}: {written[k].problem}")
        if final.conf_wrong and not leg.conf_wrong:
            report.violations.append(
                f"output line {new[last].line}: confdata {new[last].conf} is not where the joints are"
            )
        if new[last].conf != m.conf and len(final.q) and P.selects(arm, final.q[-1], m.conf, 2e-3):
            report.violations.append(
                f"output line {new[last].line}: confdata {m.conf} became {new[last].conf} for nothing"
            )
        if leg.problem or final.problem or not len(leg.q) or not len(final.q):
            seg.counted, seg.note = False, leg.problem or final.problem or "not played"
            continue
        goal = leg.command[-1][:3, 3]
        share = float(m.weld or not on_arc)
        bent = P.real(arm, leg.q, m, displace, share * force, share * moment)
        end = P.real(arm, final.q[-1:], m, displace, share * force, share * moment)
        seg.goal_before = 1e3 * float(np.linalg.norm(bent[-1] - goal))
        seg.goal_after = 1e3 * float(np.linalg.norm(end[0] - goal))
        if m.kind == "A":
            seg.counted, seg.note = False, "joint target"
            continue
        report.goal_after = max(report.goal_after, seg.goal_after)
        if m.kind == "J":
            continue
        if i == 0 or old[i - 1].kind == "A":
            seg.counted, seg.note = False, "starts at a joint target or nowhere"
        start = leg.command[0]
        seg.before = 1e3 * float(_distance(start, m, bent).max())
        for k in range(first, last + 1):
            if not len(written[k].q):
                continue
            p = P.real(arm, written[k].q, new[k], displace, share * force, share * moment)
            d = 1e3 * _distance(start, m, p)
            if d.max() > seg.after:
                seg.after = float(d.max())
                seg.worst_at = float(np.linalg.norm(p[int(d.argmax())] - start[:3, 3]))
        if blend:
            desired = np.concatenate([c[:, :3, 3] for c in cut_old[max(i - 1, 0) : i + 2]])
            for k in range(first, last + 1):
                q = I.follow(arm, P.to_flange(cut_new[k], new[k]), written[k].q[0]) if len(written[k].q) else None
                if q is not None:
                    p = P.real(arm, q, new[k], displace, share * force, share * moment)
                    seg.cut_after = max(seg.cut_after, 1e3 * float(P.polyline_distance(p, desired).max()))
    _sum_up(report)
    return report


def _sum_up(r: Report) -> None:
    r.added = sum(s.added for s in r.segments)
    moving = [s for s in r.segments if s.counted and s.kind in "LC"]
    r.before = max((s.before for s in moving), default=0.0)
    r.after = max((s.after for s in moving), default=0.0)
    r.cut_after = max((s.cut_after for s in moving), default=0.0)
    seams = [s for s in moving if s.welding and s.kind == "L"]
    r.seam_metres = sum(s.length for s in seams)
    if r.seam_metres:
        r.added_per_metre = sum(s.added for s in seams) / r.seam_metres
        r.worst_seam_per_metre = max(s.added / s.length for s in seams if s.length > 1e-6)
