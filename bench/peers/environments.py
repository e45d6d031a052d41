"""Agent-steps a second of mpgx's environments and of VMAS, in turn on one core: medians, and how many times faster mpgx is.

    python -m venv env && env/bin/pip install -r requirements.txt
    cargo build --release && env/bin/python environments.py --mpgx ../../target/release/mpgx

`simple` is one agent that goes to a landmark, `navigation` four that each go to their own, without lidar and collisions. Ours are
`track_random` (a leader and a follower) and `square_unison_points` (a leader and three). Every step gives observations and rewards;
rates are by processor time, with one thread of torch.
"""

import argparse
import json
import os
import statistics
import subprocess
import time
from pathlib import Path

PAIRS = {"simple": "track_random", "navigation": "square_unison_points"}


class Vmas:
    """One VMAS scenario in this process; agent-steps a second with random actions that are drawn beforehand."""

    def __init__(self, name, count):
        import torch
        import vmas

        torch.set_num_threads(1)
        settings = {"n_agents": 4, "collisions": False} if name == "navigation" else {}
        self.env = vmas.make_env(name, num_envs=count, device="cpu", continuous_actions=True, seed=0, **settings)
        self.actions = [torch.rand(count, 2) * 2 - 1 for _ in self.env.agents]
        self.env.reset()
        self.agent_steps = count * len(self.env.agents)

    def rate(self, seconds):
        begin, steps = time.process_time(), 0
        while (passed := time.process_time() - begin) < seconds:
            if steps % 200 == 0:
                self.env.reset()
            self.env.step(self.actions)
            steps += 1
        return steps * self.agent_steps / passed


def ours(mpgx, count, seconds):
    """Agent-steps a second of each scenario."""
    words = [mpgx, "bench", "environment", "--json", "--environments", count, "--windows", 1, "--seconds", seconds]
    out = subprocess.run(list(map(str, words)), capture_output=True, text=True, check=True).stdout
    rates = {}
    for figure in json.loads(out)["figures"]:
        name, size = figure["what"].split(", ")
        agents = int(size.split()[2])
        # A figure of one environment is µs a step.
        rates[name] = agents / figure["value"] * 1e6 if figure["unit"] == "µs a step" else figure["value"] * 1e6
    return rates


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--mpgx", required=True)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--seconds", type=float, default=1.0)
    parser.add_argument("--core", type=int, default=0)
    parser.add_argument("--environments", type=int, nargs="*", default=[1, 32, 4096])
    args = parser.parse_args()
    mpgx = Path(args.mpgx).resolve()
    os.sched_setaffinity(0, {args.core})
    for count in args.environments:
        theirs = {name: Vmas(name, count) for name in PAIRS}
        rounds = []
        for _ in range(args.rounds):
            own = ours(mpgx, count, args.seconds)
            rounds.append({name: (own[PAIRS[name]], peer.rate(args.seconds)) for name, peer in theirs.items()})
        print(f"\n{count} environments, thousand agent-steps a second")
        for name, scenario in PAIRS.items():
            a, b = (statistics.median(round[name][k] for round in rounds) / 1e3 for k in (0, 1))
            ratio = statistics.median(round[name][0] / round[name][1] for round in rounds)
            print(f"  {scenario:<22} {a:9.1f}   VMAS {name:<12} {b:9.1f}   mpgx × {ratio:7.1f}", flush=True)


if __name__ == "__main__":
    main()
