"""What each function of a HAL thread costs: instructions per call, from callgrind's counts in rtapi_app.

A thread's loop in hal_lib.so calls every function that was added to it. callgrind writes each such call as
`cob=` (object), `cfn=` (function), `calls=` (how often), and on the next line the instructions spent in it and below.
Names are compressed: `(7) name` where it first stands, `(7)` after that.
"""
import re
from collections import defaultdict

# Of motion-controller, that all of gib may take; and what it takes at least when all works that is to work.
SHARE = (0.08, 0.15)


def read(paths):
    """{(object, function): (calls, instructions)} of all that is called from hal_lib.so into another module."""
    spent = defaultdict(lambda: [0, 0])
    for path in paths:
        names = {"ob": {}, "fn": {}}

        def name(kind, text):
            number, known = re.match(r"(\(\d+\))\s*(.*)", text).groups()
            if known:
                names[kind][number] = known
            return names[kind].get(number, number)

        here = called = None
        function, calls = "", 0
        with open(path, encoding="utf-8", errors="replace") as file:
            for line in file:
                key, _, value = line.rstrip("\n").partition("=")
                if key == "ob":
                    here = called = name("ob", value)
                elif key == "fn":
                    name("fn", value)
                    called = here
                elif key == "cob":
                    called = name("ob", value)
                elif key == "cfn":
                    function = name("fn", value)
                elif key == "calls":
                    calls = int(value.split()[0])
                elif calls:
                    if here and here.endswith("hal_lib.so") and not called.endswith("hal_lib.so"):
                        entry = spent[(called.rsplit("/", 1)[-1], function)]
                        entry[0] += calls
                        entry[1] += int(line.split()[1])
                    calls, called = 0, here
    return spent


def judge(spent, what):
    """Prints a table of a servo cycle in which `what`; whether gib stays within its share."""
    cycles = max((calls for (ob, _), (calls, _) in spent.items() if ob == "motmod.so"), default=0)
    if not cycles:
        return False
    per_cycle = {key: total / cycles for key, (calls, total) in spent.items() if calls > cycles / 2}
    motion = max(cost for (ob, _), cost in per_cycle.items() if ob == "motmod.so")
    print(f"test: instructions in a servo cycle in which {what} ({cycles} cycles)")
    gib = 0.0
    for (ob, function), cost in sorted(per_cycle.items(), key=lambda item: -item[1]):
        instances = spent[(ob, function)][0] / cycles
        print(f"test: {cost:8.0f} {ob} {function}, {instances:.0f} of them")
        if ob.startswith("gib_") and not ob.startswith("gib_sim"):
            gib += cost
    print(f"test: {gib:8.0f} all of gib, {gib / motion:.3f} of motion-controller, {SHARE[0]} to {SHARE[1]} allowed")
    return SHARE[0] * motion < gib <= SHARE[1] * motion
