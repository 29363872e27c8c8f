"""Data that every controller has: speeds, zones, ``tool0``, ``wobj0``, ``load0``.

Source: ABB RAPID reference manual, data types speeddata and zonedata.
"""

from __future__ import annotations

from types import MappingProxyType

SPEEDS = (
    5, 10, 20, 30, 40, 50, 60, 80, 100, 150, 200, 300, 400, 500, 600, 800, 1000, 1500, 2000, 2500, 3000, 4000, 5000,
    6000, 7000,
)  # fmt: skip
EXTERNAL = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)
# pzone_tcp, pzone_ori and pzone_eax [mm], zone_ori [deg], zone_leax [mm], zone_reax [deg]
ZONES = {
    "z0": (0.3, 0.3, 0.3, 0.03, 0.3, 0.03),
    "z1": (1.0, 1.0, 1.0, 0.1, 1.0, 0.1),
    "z5": (5.0, 8.0, 8.0, 0.8, 8.0, 0.8),
    "z10": (10.0, 15.0, 15.0, 1.5, 15.0, 1.5),
    "z15": (15.0, 23.0, 23.0, 2.3, 23.0, 2.3),
    "z20": (20.0, 30.0, 30.0, 3.0, 30.0, 3.0),
    "z30": (30.0, 45.0, 45.0, 4.5, 45.0, 4.5),
    "z40": (40.0, 60.0, 60.0, 6.0, 60.0, 6.0),
    "z50": (50.0, 75.0, 75.0, 7.5, 75.0, 7.5),
    "z60": (60.0, 90.0, 90.0, 9.0, 90.0, 9.0),
    "z80": (80.0, 120.0, 120.0, 12.0, 120.0, 12.0),
    "z100": (100.0, 150.0, 150.0, 15.0, 150.0, 15.0),
    "z150": (150.0, 225.0, 225.0, 23.0, 225.0, 23.0),
    "z200": (200.0, 300.0, 300.0, 30.0, 300.0, 30.0),
}
VMAX = 7000.0  # the robot's own maximum lies below; the timing is bounded by the joints anyway

_NULL = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
_LOAD0 = (0.001, (0.0, 0.0, 0.001), (1.0, 0.0, 0.0, 0.0), 0.0, 0.0, 0.0)

# Type and value by lower-case name.
PREDEFINED = MappingProxyType(
    {
        **{f"v{v}": ("speeddata", (float(v), 500.0, 5000.0, 1000.0)) for v in SPEEDS},
        # The speed of external axes alone: the TCP is as fast as they let it.
        **{f"vlin{v}": ("speeddata", (VMAX, 500.0, float(v), 1000.0)) for v in EXTERNAL[3:]},
        **{f"vrot{v}": ("speeddata", (VMAX, 500.0, 5000.0, float(v))) for v in EXTERNAL[:7]},
        "vmax": ("speeddata", (VMAX, 500.0, 5000.0, 1000.0)),
        "fine": ("zonedata", (True, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)),
        **{name: ("zonedata", (False, *zone)) for name, zone in ZONES.items()},
        "tool0": ("tooldata", (True, _NULL, _LOAD0)),
        "wobj0": ("wobjdata", (False, True, "", *(_NULL, _NULL))),
        "load0": ("loaddata", _LOAD0),
        "pi": ("num", 3.141592653589793),
    }
)
