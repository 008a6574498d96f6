#!/usr/bin/python3
"""The simulated mill in the real control: LinuxCNC starts this program as its display and ends when it returns.

Each step prints one line `test: ...`. What counts is the plant's table, not what the control believes. Laws have two sides:
a compensation that did nothing fails, and so does one that works too well to be true.
"""
import glob
import json
import math
import os
import signal
import subprocess
import sys
import time

import hal
import linuxcnc

import cost
from control import check, columns, command, home_all, idle, machine_on, mdi, pin, recorded, stat, state, told, wait

# What a test changes of the plant, as it was.
MACHINE = {}


def rms(values):
    return math.sqrt(sum(value * value for value in values) / len(values))


def lost_motion(joint):
    """What a reversal loses on the plant, moving: clearance and wind-up, um."""
    of = f"gib-sim-axis.{joint}."
    on_table = (1 - pin(of + "motor-share")) * pin(of + "friction")
    return 1e3 * (pin(of + "clearance") + 2 * on_table / pin(of + "stiffness"))


def slides_freely(wanted):
    """Takes friction and clearance from x, or gives them back: a slide that sticks cannot follow some micrometres."""
    for name in ("clearance", "friction"):
        place = "gib-sim-axis.0." + name
        MACHINE.setdefault(place, pin(place))
        hal.set_p(place, "0" if wanted else str(MACHINE[place]))


def counted_for(seconds):
    """{(object, function): (calls, instructions)} of the servo thread, from now on."""
    rtapi = subprocess.run(["pgrep", "-f", "bin/rtapi_counted"], capture_output=True, text=True, check=True).stdout.split()[0]
    before = set(glob.glob("callgrind.out*"))
    subprocess.run(["callgrind_control", "-i", "on", rtapi], check=True)
    time.sleep(seconds)
    subprocess.run(["callgrind_control", "-i", "off", rtapi], check=True)
    subprocess.run(["callgrind_control", "-d", rtapi], check=True) # and begins to count anew
    time.sleep(1)
    return cost.read(set(glob.glob("callgrind.out*")) - before)


def counted():
    """Instructions of each function of the servo thread, while all axes move and z follows a tilted workpiece: at a speed
    that varies; at a steady one with the swing of the tool corrected, and what was learnt against it in force; and both."""
    machine_on()
    home_all()
    cut_measured(lambda: cut(50, 20))
    mdi("M119 P1")
    wait(lambda: pin("gib-tilt.0.active"), 10, "z follows the workpiece")
    mdi("M68 E0 Q0.5")
    mdi("M113 P20 Q2")

    def moving(to):
        command.mdi(f"G1 X{to} Y{to} Z{to} F200")
        time.sleep(1)
        spent = counted_for(5)
        wait(idle, 60, "the move")
        return spent
    wait(lambda: pin("gib-inertia.0.varying"), 30, "the speed varies")
    varying = moving(60)
    mdi("M114")
    hal.set_p("gib-vibration.0.on", "1")
    wait(lambda: pin("gib-vibration.0.in-force"), 30, "the correction is in force")
    slides_freely(True)
    hal.set_p("gib-learning.0.on", "1")
    wait(lambda: pin("gib-learning.0.done"), 60, "the swing is undone")
    swinging = moving(30)
    check(pin("gib-learning.0.done") and pin("gib-vibration.0.in-force") and pin("gib-tilt.0.active"), "all of it in force")
    mdi("M113 P10 Q2")
    wait(lambda: pin("gib-inertia.0.varying"), 30, "the speed varies")
    both = moving(60)
    check(pin("gib-learning.0.busy") and pin("gib-inertia.0.varying") and pin("gib-tilt.0.active"), "all of it at once")
    within = [cost.judge(spent, what) for spent, what in
              ((varying, "the speed varies"), (swinging, "the swing is corrected and undone"), (both, "both"))]
    check(all(within), "gib within its share of motion-controller")


def amounts_kept():
    with open("gib-amounts.json", encoding="utf-8") as file:
        return json.load(file)


def reversal_error(axis):
    """Table against program, one way and the other, over the middle of a slow to and fro, um."""
    def to_and_fro():
        mdi(f"G0 {axis}20")
        mdi(f"G1 {axis}21.5 F60")
        mdi(f"G1 {axis}20 F60")
    low = axis.lower()
    program, table = columns(recorded(to_and_fro), f"{low}.program_position_mm", f"{low}.table_position_mm")
    ways = {1: [], -1: []}
    for before, now, at in zip(program, program[1:], table[1:]):
        if 20.4 < now < 21.1 and abs(now - before) > 1e-6:
            ways[1 if now > before else -1].append(at - now)
    check(min(len(way) for way in ways.values()) > 500, "both ways are in the recording")
    up, down = (sum(way) / len(way) for way in (ways[1], ways[-1]))
    return 1e3 * (down - up)


def homing():
    machine_on()
    home_all()
    for joint in range(3):
        of = f"gib-sim-axis.{joint}."
        # The motor's place when the table touches its stop: behind by half the lost motion.
        touch = pin(of + "stop-min") - 0.5e-3 * lost_motion(joint)
        zero = pin(of + "drive-fb") - pin(f"joint.{joint}.pos-fb")
        check(abs(zero - (touch + 1)) < 0.010,
              f"joint {joint} is homed on its dead stop to {1e3 * (zero - touch - 1):.1f} um, uncertainty told "
              f"{pin(f'gib-homing.{joint}.uncertainty'):.1f}")


def lost_motion_measured():
    before = reversal_error("X")
    truth = lost_motion(0)
    check(0.9 * truth < before < 1.1 * truth + 5, f"uncompensated reversal error {before:.1f} um, lost motion {truth:.1f}")
    hal.set_p("gib-backlash.0.reversals", "2")
    mdi("M110 P0", 90)
    text = told()
    amount = 1e3 * pin("ini.0.backlash")
    check(abs(amount - truth) < 3, f"ini.0.backlash is {amount:.1f} um, truth {truth:.1f}; {text}")
    kept = amounts_kept()
    check(abs(1e3 * kept["joints"]["0"] - amount) < 0.01 and not kept["unfinished"], f"it is kept for the next start: {kept}")
    after = reversal_error("X")
    check(abs(after) < 0.1 * before, f"reversal error at the table {before:.1f} -> {after:.1f} um")
    check(pin("gib-backlash.0.active"), "the control applies the amount")


def abort_restores():
    amount = pin("ini.0.backlash")
    where = pin("joint.0.pos-cmd")
    command.mode(linuxcnc.MODE_MDI)
    command.wait_complete()
    command.mdi("M110 P0")
    wait(lambda: pin("gib-backlash.0.busy"), 5, "the measurement begins")
    wait(lambda: pin("ini.0.backlash") == 0, 5, "compensation off while measuring")
    time.sleep(2)
    command.abort()
    wait(lambda: not pin("gib-backlash.0.busy"), 10, "the measurement ends after an abort")
    wait(lambda: abs(pin("ini.0.backlash") - amount) < 1e-9, 5, "the amount of before is back")
    wait(idle, 10, "idle")
    time.sleep(0.5)
    kept = amounts_kept()
    check(abs(kept["joints"].get("0", 0) - amount) < 1e-9 and not kept["unfinished"], f"nothing is left half done: {kept}; {told()}")
    check(abs(pin("gib-backlash.0.drive-cmd") - where) < 0.1, "the axis is back where motion knows it")


PART = """(a part whose inertia is not known yet)
G21 G90
o100 if [EXISTS[#<_ina>]]
M68 E0 Q#<_ina>
o100 endif
M3 S600
G4 P2
M113 P20 Q2
G4 P5
M113 P80 Q0.5
G4 P3
M114
G4 P1
M5
M2
"""


def run_part():
    command.mode(linuxcnc.MODE_AUTO)
    command.wait_complete()
    command.auto(linuxcnc.AUTO_RUN, 0)
    time.sleep(0.2)
    wait(idle, 60, "the part")


def inertia_and_variation():
    with open("part.ngc", "w", encoding="utf-8") as file:
        file.write(PART)
    command.mode(linuxcnc.MODE_AUTO)
    command.wait_complete()
    command.program_open(os.path.abspath("part.ngc"))
    command.wait_complete()
    told()
    without_a_value()
    mdi("M112")
    with open("part.ngc", encoding="utf-8") as file:
        head = file.read()
    truth = pin("gib-sim-spindle.0.inertia") - pin("gib-inertia.0.own-inertia")
    written = [float(line.split("=")[1]) for line in head.splitlines() if line.startswith("#<_ina>=")]
    check(len(written) == 1 and abs(written[0] / truth - 1) < 0.02,
          f"INA in the program is {written} kg m2, truth {truth}; {told()}")
    check(sorted(head.splitlines()) == sorted(PART.splitlines() + [f"#<_ina>={written[0]:.4g}"]), "no other line is changed")
    path = recorded(run_part)
    check(pin("gib-inertia.0.ina") == written[0], f"INA reached the component: {pin('gib-inertia.0.ina')}; {told()}")
    speed_varies(columns(path, "time_s", "spindle.commanded_speed_rpm", "spindle.speed_rpm", "spindle.torque_nm"))


def without_a_value():
    """One slow, short ramp under a noisy torque does not determine the inertia: M112 ends with an error, no INA is written, and
    what was known before stays."""
    def known():
        with open("part.ngc", encoding="utf-8") as file:
            return pin("gib-inertia.0.inertia"), pin("gib-inertia.0.coulomb"), file.read()
    before = known()
    poor = {"gib-inertia.0.speed-high": 30, "gib-inertia.0.ramp": 5, "gib-inertia.0.ramp-count": 1, "gib-sim-spindle.0.noise": 15}
    good = {name: pin(name) for name in poor}
    for name, value in poor.items():
        hal.set_p(name, str(value))
    mdi("M112", 120)
    said = told()
    for name, value in good.items():
        hal.set_p(name, str(value))
    error = pin("gib-inertia.0.error")
    check(-399 <= error <= -300 and str(error) in said, f"M112 refuses what the motion does not determine: {error}; {said}")
    check(not pin("gib-inertia.0.done") and known() == before, "no value and no INA comes of it")


def speed_varies(recording):
    """First what was asked for, 600 rpm +-20 %, then +-80 % in 0.5 s, of which the motor's torque allows less."""
    rows = list(zip(*recording))
    first = next(i for i, row in enumerate(rows) if abs(row[1] - 600) > 1 and row[1] > 1)
    rows = [row for row in rows if rows[first][0] <= row[0] < rows[first][0] + 8]
    asked, limited = ([row for row in rows if low <= row[0] - rows[0][0] < high] for low, high in ((0.1, 4.9), (5.6, 7.9)))
    swing = [max(abs(row[1] / 600 - 1) for row in part) for part in (asked, limited)]
    sim = "gib-sim-spindle.0."
    turn = 2 * 3.14159265 / 60
    # J 4qS/R + Tc + B S(1 + q) = T
    per_share = (pin(sim + "inertia") * 4 / 0.5 + pin(sim + "viscous")) * 600 * turn
    possible = (pin("gib-inertia.0.torque-most") - pin(sim + "coulomb") - pin(sim + "viscous") * 600 * turn) / per_share
    check(abs(swing[0] - 0.2) < 0.002, f"the command swings by {swing[0]:.4f} where 0.2 was asked for")
    check(0.97 * possible < swing[1] < 1.002 * possible, f"and by {swing[1]:.4f} where the motor can do {possible:.4f}")
    seen = max(abs(row[2] / 600 - 1) for row in asked)
    check(0.15 < seen < 0.21, f"the spindle itself swings by {seen:.3f}")
    # The command stays within the motor's torque and power; the drive's servo rings a little at the corners.
    needed = [pin(sim + "inertia") * (now[1] - before[1]) * turn / (now[0] - before[0]) + pin(sim + "coulomb")
              + pin(sim + "viscous") * now[1] * turn for before, now in zip(rows, rows[1:])]
    power = max(abs(torque * row[1] * turn) for torque, row in zip(needed, rows))
    most = pin("gib-inertia.0.torque-most")
    check(0.95 * most < max(needed) < 1.005 * most, f"the command takes up to {max(needed):.1f} N m of {most:.0f}")
    check(power < pin("gib-inertia.0.power"), f"and up to {power:.0f} W of {pin('gib-inertia.0.power'):.0f}")
    seen = max(abs(row[3]) for row in rows)
    check(seen < 1.12 * most, f"the drive delivers up to {seen:.1f} N m")


def diagnosed():
    """The plant's y axis has a cable chain and a drive with play that the belief, machine.json, knows nothing of."""
    def moves():
        for feed, to in ((3000, 150), (1500, 20), (1000, 60), (2400, 10), (2000, 100), (3000, 5)):
            mdi(f"G1 Y{to} F{feed}")
    path = recorded(moves)
    gib = os.environ["GIB"]
    inspected = subprocess.run([gib, "inspect", path], capture_output=True, text=True, check=False)
    check(inspected.returncode == 0 and "diagnosis of the closed loop" in inspected.stdout and " 0 gaps" in inspected.stdout,
          f"gib inspect reads the recording; {inspected.stderr}")
    # Not ahead of everything, as the control is.
    subprocess.run(["chrt", "--other", "0", gib, "diagnose", "--machine", "machine.json", "--axis", "y", "--recording", path, "--json", "y.json"],
                   stdout=subprocess.DEVNULL, check=False)
    with open("y.json", encoding="utf-8") as file:
        findings = {f["cause"]: f for f in json.load(file)["findings"]}
    # N m/mm at the motor are N/mm at the table by 2 pi over the lead of 10 mm in m.
    truth = {("cable_force", "slope_nm_mm"): pin("gib-sim-axis.1.cable"), ("backlash", "backlash_um"): 1e3 * pin("gib-sim-axis.1.clearance"),
             ("drive_compliance", "stiffness_n_um"): 1e-3 * pin("gib-sim-axis.1.stiffness") * 2 * math.pi / 0.010}
    found = {key: findings.get(key[0], {}).get("parameters", {}).get(key[1], {}).get("value", 0) for key in truth}
    check(all(abs(found[key] / truth[key] - 1) < 0.05 for key in truth) and len(findings) == len(truth),
          f"gib diagnose names {sorted(findings)}: " + ", ".join(f"{key[1]} {found[key]:.4g}, truth {truth[key]:.4g}" for key in truth))


def refused():
    """What the machine is not ready for is refused with the reason, and nothing has moved."""
    time.sleep(0.5)

    def refuses(line, reason):
        where = [pin(f"gib-sim-axis.{joint}.drive-fb") for joint in range(3)]
        mdi(line)
        text = told()
        moved = max(abs(pin(f"gib-sim-axis.{joint}.drive-fb") - where[joint]) for joint in range(3))
        check(reason in text and moved < 0.01, f"{line} is refused, nothing has moved ({1e3 * moved:.1f} um): {text}")
    refuses("M110 P7", "no joint 7")
    refuses("M110", "P is missing")
    refuses("M112", "no program is loaded")
    refuses("M113 P10 Q2", "inertia is not known")
    refuses("M116", "no recording runs")
    mdi("M3 S300")
    refuses("M110 P0", "spindle turns")
    mdi("M5")


def no_number_reaches_motion():
    """The encoder reads no number in the middle of a move: the control is off at once and never sees it."""
    mdi("G0 Z10")
    seen = []
    command.mdi("G1 Z30 F600")
    wait(lambda: pin("joint.2.pos-cmd") > 15, 10, "the move")
    before = pin("joint.2.motor-pos-fb")
    hal.set_p("gib-sim-axis.2.break-encoder", "1")
    started = time.monotonic()
    # The control goes off in its next cycle; who asks may have to wait for it on a busy machine.
    while time.monotonic() < started + 10:
        seen.append((pin("joint.2.motor-pos-fb"), pin("gib-sim-axis.2.drive-cmd"), pin("gib-inertia.0.ok")))
        if not pin("gib-inertia.0.ok") and state().task_state != linuxcnc.STATE_ON:
            break
    check(pin("gib-sim-axis.2.drive-fb") != pin("gib-sim-axis.2.drive-fb"), "the plant's encoder reads no number")
    check(all(math.isfinite(v) for row in seen for v in row[:2]), f"motion and drive see numbers only ({len(seen)} looks)")
    check(stat.task_state != linuxcnc.STATE_ON and not pin("gib-inertia.0.ok"),
          f"the machine is off after {1e3 * (time.monotonic() - started):.0f} ms, ok is down; {told()}")
    check(abs(pin("joint.2.motor-pos-fb") - before) < 0.5, "the last position is held")
    hal.set_p("gib-sim-axis.2.break-encoder", "0")
    time.sleep(0.1)
    machine_on()
    mdi("G1 Z5 F1200")
    check(abs(pin("joint.2.pos-fb") - 5) < 0.01, f"and works again when the encoder does; {told()}")


def killed(phase):
    """The real-time process dies in that phase of a measurement. What was in force before stands in a note."""
    for joint in range(3):
        hal.set_p(f"gib-homing.{joint}.touch-count", "1")
    machine_on()
    home_all()
    before = pin("ini.0.backlash")
    check(before > 0.05, f"{1e3 * before:.1f} um from the first run is in force")
    hal.set_p("gib-backlash.0.reversals", "1")
    mdi("M115")
    command.mdi("M110 P0")
    wait(lambda: pin("gib-backlash.0.state") == int(phase), 60, f"phase {phase}")
    in_force = pin("ini.0.backlash")
    os.kill(int(subprocess.run(["pgrep", "-x", "rtapi_app"], capture_output=True, text=True, check=True).stdout),
            signal.SIGKILL)
    check(True, f"rtapi_app killed in phase {phase} with {1e3 * in_force:.1f} um in force")
    time.sleep(4)
    kept = amounts_kept()
    check(kept["unfinished"]["0"]["amount_mm"] == before, f"the note stands: {kept}; {told()}")
    recording = max(glob.glob("gib-*.csv"))
    inspected = subprocess.run([os.environ["GIB"], "inspect", recording], capture_output=True, text=True, check=False)
    check(inspected.returncode == 0, f"the recording made meanwhile is read: {inspected.stdout.splitlines()[1:2]}")


def restarted():
    """The amount of before is in force, and the operator is told."""
    kept = amounts_kept()["joints"]["0"]
    texts = []
    wait(lambda: texts.append(told()) or "did not end" in "".join(texts), 10, "the operator is told")
    check(abs(pin("ini.0.backlash") - kept) < 1e-9, f"told: {''.join(texts)}")
    wait(lambda: not amounts_kept()["unfinished"], 2, "told once")


def put_back():
    """The amount of before the measurement, by M-code. What follows starts again from an amount as if measured."""
    mdi("M111 P0")
    check(pin("ini.0.backlash") == 0 and amounts_kept()["joints"]["0"] == 0, f"M111 puts back what was before: {told()}")
    with open("gib-amounts.json", "w", encoding="utf-8") as file:
        json.dump({"joints": {"0": 0.055}, "unfinished": {}}, file)


def cut(*ways):
    """Passes along x."""
    mdi("G0 X20 Y20 Z6")
    mdi("G1 Z1.5 F1200")
    for to in ways:
        mdi("M64 P0")
        mdi(f"G1 X{to} F600")
        mdi("M65 P0")


def cut_measured(run):
    """What `run` answers, which cuts while the tilt is measured."""
    mdi("M3 S600")
    mdi("G4 P1.5")
    mdi("M117")
    answer = run()
    mdi("M118")
    return answer


def tilt_followed():
    """A workpiece that lies askew in x is cut twice: the depth along the path varies, and then does not."""
    def spread(path):
        x, depth = columns(path, "x.program_position_mm", "work.depth_mm")
        there = [d for before, at, d in zip(x, x[1:], depth[1:]) if 23 < at < 47 and at > before and d > 0]
        check(len(there) > 100, f"the cut is in the recording: {len(there)} of {len(x)} rows, x {min(x):.1f} to {max(x):.1f} mm, "
              f"at most {max(depth):.3f} mm deep")
        return max(there) - min(there)
    before = spread(cut_measured(lambda: recorded(lambda: cut(50, 20))))
    text, truth = told(), math.degrees(math.atan(pin("gib-sim-cut.0.slope-x")))
    check(abs(pin("gib-tilt.0.tilt") - truth) < max(0.02, pin("gib-tilt.0.uncertainty")),
          f"tilt {pin('gib-tilt.0.tilt'):.3f} deg, truth {truth:.3f}; {text}")
    check(pin("gib-tilt.0.offset-z") == 0, "nothing moves before the operator accepts")
    mdi("M119 P1")
    after = spread(recorded(lambda: cut(50)))
    check(after < 0.1 * before, f"depth of cut varies by {1e3 * before:.0f} -> {1e3 * after:.0f} um along the path; {told()}")
    mdi("M119 P0")
    check(pin("gib-tilt.0.offset-z") == 0 and not pin("gib-tilt.0.busy"), f"and off again; {told()}")
    mdi("M5")


def tilt_turned_away():
    """The same workpiece on a machine that could turn it about y: b is told to, and nothing else. The mill has no b."""
    for name, value in (("rotary-axis-0", 2), ("rtcp", 1)):
        hal.set_p("gib-tilt.0." + name, str(value))
    cut_measured(lambda: cut(50, 20))
    mdi("M119 P1")
    truth = math.degrees(math.atan(pin("gib-sim-cut.0.slope-x")))
    turned, others = pin("gib-tilt.0.offset-b"), [pin("gib-tilt.0.offset-" + axis) for axis in "acxyz"]
    check(abs(turned - truth) < max(0.02, pin("gib-tilt.0.uncertainty")) and max(map(abs, others)) < 1e-3,
          f"b is told to turn by {turned:.3f} deg, truth {truth:.3f}, the others by {others}; {told()}")
    mdi("M119 P0")
    check(pin("gib-tilt.0.offset-b") == 0 and not pin("gib-tilt.0.busy"), f"and back; {told()}")
    for name in ("rotary-axis-0", "rtcp"):
        hal.set_p("gib-tilt.0." + name, "0")
    mdi("M5")


def vibration_corrected():
    """Seat and bearing swing with the spindle: the corrected position is nearer to the truth than the scale."""
    mdi("M3 S600")
    hal.set_p("gib-vibration.0.on", "1")
    wait(lambda: pin("gib-vibration.0.blend") > 0.999, 10, "the correction is in force")
    time.sleep(1)
    path = recorded(lambda: mdi("G4 P1.5"))
    scale, corrected, true = columns(path, "x.table_position_mm", "work.corrected_position_mm", "work.true_position_mm")

    def error(position):
        return 1e3 * rms([a - b for a, b in zip(position, true)])
    check(error(scale) > 5 and error(corrected) < 0.1 * error(scale),
          f"position of the tool is wrong by {error(scale):.2f} um RMS on the scale, {error(corrected):.2f} corrected")
    hal.set_p("gib-vibration.0.on", "0")
    wait(lambda: pin("gib-vibration.0.correction") == 0, 5, "the correction fades out")
    check(pin("gib-vibration.0.error") == 0, "and ends well")
    mdi("M5")


def swing_learnt():
    """A slide without friction is told where to be so that the tool stands still against the workpiece."""
    slides_freely(True)
    mdi("G0 X30")

    def swing():
        place = [row[0] for row in zip(*columns(recorded(lambda: mdi("G4 P1.5")), "work.true_position_mm"))]
        mean = sum(place) / len(place)
        return 1e3 * rms([at - mean for at in place])
    told()
    mdi("M120 P1")
    text = told()
    check("spindle stands" in text and not pin("gib-learning.0.on"), f"M120 is refused: {text}")
    mdi("M3 S600")
    mdi("G4 P1.5")
    before = swing()
    mdi("M120 P1", 120)
    text, after = told(), swing()
    check(pin("gib-learning.0.done") and after < 0.15 * before,
          f"the tool swings against the workpiece by {before:.2f} um RMS, {after:.2f} with the learnt command; {text}")
    mdi("M120 P0")
    check(pin("gib-learning.0.correction") == 0 and not pin("gib-learning.0.busy"), "M120 P0 takes it out again")
    mdi("M5")
    slides_freely(False)


TESTS = [homing, refused, inertia_and_variation, lost_motion_measured, abort_restores, put_back, diagnosed,
         tilt_followed, tilt_turned_away, vibration_corrected, swing_learnt, no_number_reaches_motion]


def main(names):
    """All tests of one run, or those named, after homing; or what a run is killed in, or what one finds that was."""
    if names[:1] == ["killed"]:
        killed(names[1])
    elif names == ["restarted"]:
        restarted()
    elif names == ["cost"]:
        counted()
    else:
        for test in TESTS:
            if not names or test is homing or test.__name__ in names:
                began = time.monotonic()
                test()
                print(f"test: {test.__name__} took {time.monotonic() - began:.0f} s", flush=True)
    print("test: all passed", flush=True)


if __name__ == "__main__":
    main(sys.argv[3:])
