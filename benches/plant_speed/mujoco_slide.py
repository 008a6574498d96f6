"""MuJoCo on the lightest axis there is: one slide with friction loss and damping, pushed by a sine, at a 25 us step.

Prints times real time. Run by the plant benchmark where Python has mujoco; `python3 mujoco_slide.py` by hand.
"""
import math
import time

import mujoco

MODEL = """<mujoco><option timestep="0.000025" gravity="0 0 0"/><worldbody><body>
  <joint name="x" type="slide" axis="1 0 0" frictionloss="20" damping="200"/><geom type="box" size=".1 .1 .1" mass="95"/>
</body></worldbody><actuator><motor joint="x"/></actuator></mujoco>"""

model = mujoco.MjModel.from_xml_string(MODEL)
data = mujoco.MjData(model)
STEPS = 40
best = math.inf
for _ in range(3):
    begin = time.process_time()
    for cycle in range(1000):
        data.ctrl[0] = 60.0 * math.sin(2 * math.pi * 0.5 * cycle * 1e-3)
        mujoco.mj_step(model, data, STEPS)
    best = min(best, time.process_time() - begin)
print(f"{1.0 / best:.1f}")
