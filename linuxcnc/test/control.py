"""The control at work, for a test: what is commanded, waited for, told and recorded. Each finding prints a line `test: ...`."""
import csv
import glob
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
    return (state().interp_state == linuxcnc.INTERP_IDLE and stat.exec_state == linuxcnc.EXEC_DONE
            and stat.state != linuxcnc.RCS_EXEC)


def mdi(line, seconds=60):
    """One line, to its end."""
    command.mode(linuxcnc.MODE_MDI)
    command.wait_complete()
    command.mdi(line)
    # A busy machine may take its time; until then the control is idle from the line before.
    wait(lambda: state().echo_serial_number >= command.serial, 10, f"{line} is taken")
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
