#!/usr/bin/python3
"""The simulated mill in the real control: LinuxCNC starts this program as its display and ends when it returns.

Each step prints one line `test: ...`. What counts is the plant's table, not what the control believes. Laws have two sides:
a compensation that did nothing fails, and so does one that works too well to be true.
"""
import csv
import glob
import json
import os
import sys
import time

import hal
import linuxcnc

command, stat, errors = linuxcnc.command(), linuxcnc.stat(), linuxcnc.error_channel()
pins = hal.component("gib-test")
pins.ready()


def pin(name):
    return hal.get_value(name)


def check(holds, what):
    print(f"test: {'holds' if holds else 'FAILS'}: {what}", flush=True)
    if not holds:
        told()
        sys.exit(1)


def told():
    """What the operator was told since the last call."""
    texts = []
    while (message := errors.poll()) is not None:
        texts.append(message[1])
        print("told:", message, flush=True)
    return " | ".join(texts)


def wait(condition, seconds, what):
    deadline = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > deadline:
            check(False, f"{what} within {seconds} s")
        time.sleep(0.02)


def state():
    stat.poll()
    return stat


def idle():
    return state().interp_state == linuxcnc.INTERP_IDLE and stat.exec_state == linuxcnc.EXEC_DONE


def mdi(line, seconds=60):
    """One line, to its end."""
    command.mode(linuxcnc.MODE_MDI)
    command.wait_complete()
    command.mdi(line)
    time.sleep(0.1)
    wait(idle, seconds, line)


def machine_on():
    command.state(linuxcnc.STATE_ESTOP_RESET)
    command.wait_complete()
    command.state(linuxcnc.STATE_ON)
    command.wait_complete()
    wait(lambda: state().task_state == linuxcnc.STATE_ON, 5, "machine on")


def home_all():
    command.mode(linuxcnc.MODE_MANUAL)
    command.wait_complete()
    command.teleop_enable(0)
    command.wait_complete()
    command.home(-1)
    wait(lambda: all(state().homed[:3]), 90, "all axes homed")
    command.teleop_enable(1)
    command.wait_complete()


def lost_motion(joint):
    """What a reversal loses on the plant, moving: clearance and wind-up, um."""
    of = f"gib-sim-axis.{joint}."
    on_table = (1 - pin(of + "motor-share")) * pin(of + "friction")
    return 1e3 * (pin(of + "clearance") + 2 * on_table / pin(of + "stiffness"))


def columns(path, *names):
    with open(path, encoding="utf-8") as file:
        rows = csv.DictReader(line for line in file if not line.startswith("#"))
        return list(zip(*[[float(row[name]) for name in names] for row in rows]))


def recorded(run):
    """The file of a recording made by M-code while `run` runs."""
    before = set(glob.glob("gib-*.csv"))
    mdi("M115")
    run()
    mdi("M116")
    made = set(glob.glob("gib-*.csv")) - before
    check(len(made) == 1, f"one recording was made: {[os.path.basename(m) for m in made]}; {told()}")
    return made.pop()


def reversal_error(axis):
    """Table against program, one way and the other, over the middle of a slow to and fro, um."""
    def to_and_fro():
        mdi(f"G0 {axis}20")
        mdi(f"G1 {axis}22 F60")
        mdi(f"G1 {axis}20 F60")
    low = axis.lower()
    program, table = columns(recorded(to_and_fro), f"{low}.program_position_mm", f"{low}.table_position_mm")
    ways = {1: [], -1: []}
    for before, now, at in zip(program, program[1:], table[1:]):
        if 20.5 < now < 21.5 and abs(now - before) > 1e-6:
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
    mdi("M110 P0", 90)
    text = told()
    amount = 1e3 * pin("ini.0.backlash")
    check(abs(amount - truth) < 3, f"ini.0.backlash is {amount:.1f} um, truth {truth:.1f}; {text}")
    with open("gib-amounts.json", encoding="utf-8") as file:
        kept = json.load(file)
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
    wait(lambda: pin("ini.0.backlash") == amount, 5, "the amount of before is back")
    wait(idle, 10, "idle")
    time.sleep(0.5)
    with open("gib-amounts.json", encoding="utf-8") as file:
        kept = json.load(file)
    check(kept["joints"]["0"] == amount and not kept["unfinished"], f"nothing is left half done: {kept}; {told()}")
    check(abs(pin("gib-backlash.0.drive-cmd") - where) < 0.1, "the axis is back where motion knows it")


def main():
    homing()
    lost_motion_measured()
    abort_restores()
    print("test: all passed", flush=True)


if __name__ == "__main__":
    main()
