"""Linear elasticity of gearboxes and drives."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Array
from postproc.effects.base import Effect, State, param
from postproc.effects.roles import Role


class JointCompliance(
    Effect,
    role=Role.JOINT_SPRINGS,
    reads=("load",),
    confused_with={
        "arm_load": "weigh the part, or two payloads: compliance scales with the payload, a mass does not",
        "gravity_compensator": "two payloads at the same joint angles",
        "payload_error": "weigh the tool; compliance also answers to a known horizontal force",
        "transmission_error": "two payloads: a first harmonic of the gear does not change with the load",
        "joint_offset": "poses that load joints 2 and 3 in both directions",
    },
):
    """Joints wind up under load.

    Equation: dq_j = c_j tau_j, with tau_j the load on joint j [N m], positive where it turns the joint forward.
    Source: Salisbury (1980), active stiffness control; virtual joint method of Pashkevich, Klimchik and Chablat (2011).
    Typical size: 3e-7 rad/(N m) on the main axes of a 60 kg arm, 2e-6 on the wrist; 0.5 to 1 mm of droop under its own
    weight and payload. Axis 1 shows only under forces that turn it (a horizontal wrench, or acceleration).
    """

    compliance_rad_per_Nm: Array = param(unit="rad/(N m)", shape=(6,), low=-1e-5, high=1e-3, typical=1e-6, least=0.0)

    def displacement(self, state: State) -> Array:
        """Return the joint angles (n, 6) [rad] that the springs give way: compliance times load of the joint [N m]."""
        return self.compliance_rad_per_Nm * np.asarray(state.joint_load)
