"""Effects of what came before: lags, creep, play, warm-up; slips, power cycles, bumps; lost motion of static rows.

They ask for the states of a whole history in the order of time, those that nobody measures among them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tests.independent import arm as A
from tests.independent import library_effects as K
from tests.independent.cells import DEG, Hidden, States, column, pick

CYCLE_S = 3500.0
"""Time [s] from one power cycle to the next."""
PAUSED_S = 600.0
"""Between rows that lie so far apart [s] nothing moved."""
IN_TIME = ("time", "temperature", "row")


def lagged(x: np.ndarray, time: np.ndarray, constant: float) -> np.ndarray:
    """(n,) of a first-order lag of a signal that is linear between the rows; midpoint rule in steps of 2 s."""
    t = np.arange(time[0], time[-1] + 2.0, 2.0)
    u = np.interp(t + 1.0, time, x)
    z = np.empty(len(t))
    z[0] = x[0]
    for i in range(len(t) - 1):
        z[i + 1] = z[i] + 2.0 / (constant + 1.0) * (u[i] - z[i])
    return np.interp(time, t, z)


def lagged_growth(g: np.random.Generator, arm: A.Arm) -> Hidden:
    """All links grow with a temperature that follows that of the air."""
    return _grown(g, arm, (float(np.exp(g.uniform(*np.log([600.0, 5000.0])))),) * 2)


def lagged_growth_of_two(g: np.random.Generator, arm: A.Arm) -> Hidden:
    """The heavy castings up to the upper arm follow the air slowly, the forearm and the wrist soon."""
    return _grown(g, arm, (float(g.uniform(3000.0, 7000.0)), float(g.uniform(300.0, 1200.0))))


def _grown(g: np.random.Generator, arm: A.Arm, constants: tuple[float, float]) -> Hidden:
    plain = K.thermal_growth(g, arm).body
    assert plain is not None

    def body(s: States, f: A.Frames, wrench: np.ndarray) -> np.ndarray:
        slow, soon = (replace(s, temperature=lagged(s.temperature, s.time, T)) for T in constants)
        assert plain is not None
        xi = plain(slow, f, wrench)
        xi[:, 3:] = plain(soon, f, wrench)[:, 3:]
        return xi

    note = f"{constants[0]:.0f} s, {constants[1]:.0f} s"
    return Hidden(
        "lagged_growth",
        "unknown",
        accept=("thermal_growth",),
        channels=("temperature", "time"),
        note=note,
        body=body,
    )


def lagged_drift(g: np.random.Generator, arm: A.Arm) -> Hidden:
    """Joint zeros drift with a temperature that follows that of the air."""
    plain, constant = K.thermal_joint_drift(g, arm), float(np.exp(g.uniform(*np.log([600.0, 5000.0]))))

    def joint(s: States, tau: np.ndarray) -> np.ndarray:
        assert plain.joint is not None
        return plain.joint(replace(s, temperature=lagged(s.temperature, s.time, constant)), tau)

    accept, channels = ("thermal_joint_drift",), ("temperature", "time")
    return Hidden("lagged_drift", "unknown", accept=accept, channels=channels, note=f"{constant:.0f} s", joint=joint)


def creep(g: np.random.Generator, arm: A.Arm) -> Hidden:
    """A spring yields further under a load that stays: T dz/dt = tau - z, the arm stands from one row to the next."""
    j, constant = int(g.choice([1, 2])), float(np.exp(g.uniform(*np.log([200.0, 2000.0]))))
    c = g.uniform(0.010, 0.025) * DEG / (1500 if j == 1 else 800)

    def joint(s: States, tau: np.ndarray) -> np.ndarray:
        z, now = np.zeros(len(s)), 0.0
        for i, step in enumerate(np.diff(s.time, prepend=s.time[0])):
            now = tau[i, j] + (now - tau[i, j]) * np.exp(-step / constant)
            z[i] = now
        return column(j, c * z)

    channels = (f"load{j + 1}", "time")
    return Hidden("creep", "unknown", channels=channels, needs="order", note=f"joint {j + 1} {constant:.0f} s", joint=joint)  # fmt: skip


def play(g: np.random.Generator, arm: A.Arm) -> Hidden:
    """What three play operators of one joint leave behind its angle: Prandtl and Ishlinskii's hysteresis."""
    j, widths = int(g.choice([0, 1, 2])), np.exp(g.uniform(*np.log([0.01, 1.0]), 3))
    sizes = g.dirichlet(np.ones(3)) * g.uniform(0.010, 0.025) * DEG

    def joint(s: States, tau: np.ndarray) -> np.ndarray:
        q = s.q[:, j]
        out, held = np.zeros(len(s)), q[0] + np.zeros(3)
        for i, x in enumerate(q):
            held = np.maximum(x - widths, np.minimum(x + widths, held))
            out[i] = np.sum(sizes * (x - held) / widths)
        return column(j, out)

    channels = (f"q{j + 1}", f"dir{j + 1}")
    note = f"joint {j + 1} widths {np.round(np.sort(widths), 3).tolist()} rad"
    return Hidden("play", "unknown", accept=("backlash",), channels=channels, needs="order", note=note, joint=joint)


def preisach(g: np.random.Generator, arm: A.Arm) -> Hidden:
    """Sixty relays of one joint, each of which switches up and down at angles of its own."""
    j = int(g.choice([0, 1, 2]))
    middle, half = g.uniform(-0.9, 0.9, 60), g.uniform(0.02, 0.6, 60)
    weights = g.exponential(1.0, 60)
    weights *= g.uniform(0.010, 0.025) * DEG / weights.sum()

    def joint(s: States, tau: np.ndarray) -> np.ndarray:
        out, state = np.zeros(len(s)), -np.ones(60)
        for i, x in enumerate(s.q[:, j]):
            state = np.where(x > middle + half, 1.0, np.where(x < middle - half, -1.0, state))
            out[i] = weights @ state
        return column(j, out)

    channels = (f"q{j + 1}", f"dir{j + 1}")
    return Hidden("preisach", "unknown", channels=channels, needs="order", note=f"joint {j + 1}", joint=joint)


def restart(g: np.random.Generator, arm: A.Arm) -> Hidden:
    """A joint warms up while the arm works, cools down in a pause, and warms up again; each start is a session."""
    j, size = int(g.choice([0, 1, 2])), g.uniform(0.015, 0.03) * DEG
    warm, cool = g.uniform(1200, 3000), g.uniform(2500, 6000)

    def joint(s: States, tau: np.ndarray) -> np.ndarray:
        z, now = np.zeros(len(s)), 0.0
        for i, step in enumerate(np.diff(s.time, prepend=s.time[0])):
            paused = step > PAUSED_S
            now = now * np.exp(-step / cool) if paused else 1 + (now - 1) * np.exp(-step / warm)
            z[i] = now
        return column(j, size * z)

    channels = (*IN_TIME, "session")
    return Hidden("restart", "unknown", channels=channels, needs="session", note=f"joint {j + 1}", joint=joint)


def slip(g: np.random.Generator, arm: A.Arm) -> Hidden:
    """The zero of a joint jumps once."""
    return _jumping(g, 1)


def slip_twice(g: np.random.Generator, arm: A.Arm) -> Hidden:
    """The zeros of two joints, or twice that of one, jump at times of their own."""
    return _jumping(g, 2)


def _jumping(g: np.random.Generator, count: int) -> Hidden:
    joints, at = g.integers(5, size=count), np.sort(g.uniform(3000, 11000, count))
    size = g.uniform(0.006, 0.025, count) * DEG * g.choice([-1, 1], count)

    def joint(s: States, tau: np.ndarray) -> np.ndarray:
        return sum((column(j, x * (s.time > t)) for j, x, t in zip(joints, size, at, strict=True)), np.zeros(s.q.shape))

    note = ", ".join(f"joint {j + 1} at {t:.0f} s" for j, t in zip(joints, at, strict=True))
    return Hidden("slip", "unknown", accept=("session",), channels=IN_TIME, note=note, joint=joint)


def power_cycle(s: States) -> np.ndarray:
    """(n,) number of the power cycle of each state."""
    return np.asarray(s.time // CYCLE_S, dtype=int)


def cycles(g: np.random.Generator, arm: A.Arm) -> Hidden:
    """One or two joints find their zeros anew after every power cycle."""
    joints = pick(g, [0, 1, 2, 3, 4], 2)
    zeros = np.zeros((20, 6))
    zeros[:, joints] = g.normal(0, g.uniform(0.006, 0.015), (20, len(joints))) * DEG
    channels = ("cycle", *IN_TIME)
    return Hidden("cycles", "unknown", channels=channels, joint=lambda s, tau: zeros[power_cycle(s)])


def bumped_tool(g: np.random.Generator, arm: A.Arm) -> Hidden:
    """From some time on the tool stands otherwise on the flange."""
    at, way = g.uniform(3000, 11000), g.normal(size=3)
    shift = way / np.linalg.norm(way) * g.uniform(0.08, 0.4) * 1e-3

    def body(s: States, f: A.Frames, wrench: np.ndarray) -> np.ndarray:
        xi = np.zeros((len(s), 7, 6))
        xi[:, 6, :3] = shift * (s.time > at)[:, None]
        return xi

    return Hidden("bumped_tool", "unknown", accept=("session",), channels=IN_TIME, note=f"{at:.0f} s", body=body)


def moved_tracker(g: np.random.Generator, arm: A.Arm) -> Hidden:
    """From some time on the instrument stands otherwise, and no column says so."""
    at, shift, turn = g.uniform(3000, 11000), g.normal(0, 1.2e-4, 3), g.normal(0, 5e-5, 3)

    def world(s: States, p: np.ndarray) -> np.ndarray:
        return (shift + np.cross(turn, p)) * (s.time > at)[:, None]

    return Hidden("moved_tracker", "unknown", accept=("session",), channels=IN_TIME, note=f"{at:.0f} s", world=world)


def lost_motion_of_one(g: np.random.Generator, arm: A.Arm) -> Hidden:
    """A joint stays behind by half its gap on the side that it came from."""
    return _lost(g, 1)


def lost_motion_of_two(g: np.random.Generator, arm: A.Arm) -> Hidden:
    """Two joints stay behind, each by half its own gap."""
    return _lost(g, 2)


def _lost(g: np.random.Generator, count: int) -> Hidden:
    gap = np.zeros(6)
    for j in g.choice(5, count, replace=False):
        gap[j] = g.uniform(0.004, 0.011) * DEG * (1 if j < 3 else 2)
    note = f"half gap deg {np.round(gap / DEG, 4).tolist()}"
    return Hidden("lost_motion", "backlash", needs="order", note=note, joint=lambda s, tau: -gap * s.approach)
