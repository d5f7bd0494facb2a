"""A mobile robot, a person and walls in MuJoCo: the unit in which our CPU is told. Frozen.

Planar base and six-joint arm (9 dof), four walls and a person who moves; 2 ms, no controller.
"""

from __future__ import annotations

import time
from collections.abc import Callable

LINKS = [
    (0.18, "0 0 1", 7.4),
    (0.61, "0 1 0", 13),
    (0.57, "0 1 0", 4),
    (0.17, "0 1 0", 2),
    (0.12, "0 0 1", 2),
    (0.09, "0 1 0", 0.4),
]
"""Length, m, axis and mass, kg, of the links of the arm."""
STEPS, AT_ONCE, STEP_S = 10_200, 17, 0.002


def prepare() -> Callable[[], float]:
    """Load the model; returns what simulates its first 20.4 s and tells the CPU, µs per 33 ms."""
    import mujoco

    model = mujoco.MjModel.from_xml_string(model_text())

    def measure() -> float:
        data = mujoco.MjData(model)
        begin = time.process_time()
        for k in range(0, STEPS, AT_ONCE):
            data.ctrl[0] = 1.0 if (k // 2000) % 2 else -1.0
            data.ctrl[3] = 0.5
            data.mocap_pos[0, 0] = 3.0 + (k % 5000) * 1e-4
            mujoco.mj_step(model, data, AT_ONCE)
        return (time.process_time() - begin) / STEPS / STEP_S / 30 * 1e6

    return measure


def model_text() -> str:
    """The model as MuJoCo's XML."""
    arm = "".join(
        f'<body pos="0 0 {0.6 if i == 0 else LINKS[i - 1][0]}">'
        f'<joint name="j{i}" type="hinge" axis="{axis}" damping="5" armature="0.1"/>'
        f'<geom type="capsule" fromto="0 0 0 0 0 {length}" size="0.06" mass="{mass}"'
        ' contype="0" conaffinity="0"/>'
        for i, (length, axis, mass) in enumerate(LINKS)
    )
    return f"""<mujoco><option timestep="0.002" integrator="implicitfast"/><worldbody>
<geom type="plane" size="10 10 .1" contype="0" conaffinity="0"/>
<body name="base"><joint name="x" type="slide" axis="1 0 0"/>\
<joint name="y" type="slide" axis="0 1 0"/><joint name="w" type="hinge" axis="0 0 1"/>
<geom type="box" size=".49 .39 .3" pos="0 0 .3" mass="120"/>{arm}{"</body>" * 6}</body>
<body name="person" mocap="true" pos="3 0 .9"><geom type="cylinder" size=".5 .9"/></body>
<geom type="box" size=".1 8 1" pos="-4 0 1"/><geom type="box" size=".1 8 1" pos="8 0 1"/>\
<geom type="box" size="8 .1 1" pos="0 -6 1"/><geom type="box" size="8 .1 1" pos="0 6 1"/>
</worldbody><actuator><velocity joint="x" kv="2000"/><velocity joint="y" kv="2000"/>\
<velocity joint="w" kv="500"/>
{"".join(f'<position joint="j{i}" kp="2000" kv="200"/>' for i in range(6))}</actuator></mujoco>"""
