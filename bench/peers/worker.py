"""One peer in a process of its own: says `ready`, then for every line with a number of seconds the rate in that time."""

import importlib
import sys
import time

name, batch, state, action = sys.argv[1], *map(int, sys.argv[2:5])
module, function = name.split(".")
run = getattr(importlib.import_module(module), function)(batch, state, action)
least = getattr(run, "least", 1)
run(2 * least + 20)
print("ready", flush=True)
for line in sys.stdin:
    seconds, done, count = float(line), 0, max(least, 10)
    begin = time.process_time()
    while (passed := time.process_time() - begin) < seconds:
        run(count)
        done += max(count // least, 1) * least
    print(done / passed, flush=True)
