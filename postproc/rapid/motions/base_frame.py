"""The world, in which a program states its frames, and the base of the arm, in which everything else works."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from postproc.rapid.data.events import MotionEvent
from postproc.rapid.data.pose import pose_inv, pose_mult
from postproc.rapid.data.records import Pose, ToolData, WobjData


def seen_from_base(events: Iterable[MotionEvent], T_world_base: Pose) -> list[MotionEvent]:
    """Events whose frames are given in the arm's base: those of fixed work objects and of stationary tools.

    ``T_base_uframe = T_world_base^-1 T_world_uframe`` (ABB RAPID reference manual, wobjdata).
    """
    if T_world_base == Pose():
        return list(events)
    T_base_world = pose_inv(T_world_base)
    wobjs: dict[WobjData, WobjData] = {}
    tools: dict[ToolData, ToolData] = {}
    found = []
    for event in events:
        wobj, tool = event.wobj, event.tool
        if not wobj.robhold and wobj not in wobjs:
            wobjs[wobj] = replace(wobj, uframe=pose_mult(T_base_world, wobj.uframe))
        if not tool.robhold and tool not in tools:
            tools[tool] = replace(tool, tframe=pose_mult(T_base_world, tool.tframe))
        found.append(replace(event, wobj=wobjs.get(wobj, wobj), tool=tools.get(tool, tool)))
    return found
