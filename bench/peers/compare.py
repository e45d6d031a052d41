"""Updates and steps a second of mpgx and of its peers, in turn on one core: medians, and how many times faster mpgx is.

    python -m venv env && env/bin/pip install -r requirements.txt
    cargo build --release && env/bin/python compare.py --mpgx ../../target/release/mpgx

Rates are by processor time. Every round asks each in turn, so that all meet the same weather.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
from pathlib import Path

UPDATES = {
    "PyTorch as CleanRL writes it": "torch_td3.eager",
    "PyTorch, fused Adam": "torch_td3.fused",
    "torch.compile, the whole update": "torch_td3.compiled",
    "JAX as CleanRL writes it": "jax_td3.cleanrl",
    "JAX, one jitted scan": "jax_td3.scan",
}
STEPS = {
    "Stable-Baselines3": "libraries.sb3",
    "SBX": "libraries.sbx",
    "JAX, environment and all in one jitted scan": "jax_td3.loop",
}
HERE = Path(__file__).parent
ONE_THREAD = {name: "1" for name in ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS")} | {
    "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1",
    "JAX_PLATFORMS": "cpu",
}


class Peer:
    def __init__(self, name, batch, state, action):
        words = [sys.executable, "worker.py", name, str(batch), str(state), str(action)]
        self.process = subprocess.Popen(words, cwd=HERE, env=os.environ | ONE_THREAD, text=True,
                                        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)

    def ready(self):
        return self.process.stdout.readline().strip() == "ready"

    def rate(self, seconds):
        print(seconds, file=self.process.stdin, flush=True)
        return float(self.process.stdout.readline())

    def end(self):
        self.process.stdin.close()
        self.process.wait()


def ours(mpgx, part, batch, state, action, seconds):
    words = [mpgx, "bench", part, "--json", "--batch", batch, "--state", state, "--action", action, "--algorithms", "td3",
             "--windows", 1, "--seconds", seconds]
    out = subprocess.run(list(map(str, words)), capture_output=True, text=True, check=True).stdout
    return json.loads(out)["figures"][0]["value"]


def compare(title, peers, measure, rounds, seconds, sizes):
    print(f"\n{title}, batch {sizes[0]}, state {sizes[1]}, action {sizes[2]}", flush=True)
    workers = {}
    for label, name in peers.items():
        worker = Peer(name, *sizes)
        if worker.ready():
            workers[label] = worker
        else:
            print(f"  {label}: did not start")
    rates = {label: [] for label in ["mpgx", *workers]}
    for _ in range(rounds):
        rates["mpgx"].append(measure(*sizes, seconds))
        for label, worker in workers.items():
            rates[label].append(worker.rate(seconds))
    for worker in workers.values():
        worker.end()
    for label, values in rates.items():
        ratio = statistics.median(a / b for a, b in zip(rates["mpgx"], values))
        print(f"  {label:<46} {statistics.median(values):8.0f} /s   mpgx × {ratio:5.2f}", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--mpgx", required=True)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--seconds", type=float, default=1.0)
    parser.add_argument("--core", type=int, default=0)
    parser.add_argument("--batches", type=int, nargs="*", default=[16, 100, 256])
    parser.add_argument("--only", choices=["updates", "steps"])
    args = parser.parse_args()
    mpgx = Path(args.mpgx).resolve()
    os.sched_setaffinity(0, {args.core})
    for batch in args.batches:
        if args.only != "steps":
            for sizes in [(4, 2), (8, 6)] if batch == 16 else [(4, 2)]:
                measure = lambda *rest: ours(mpgx, "learners", *rest)
                compare("Updates", UPDATES, measure, args.rounds, args.seconds, (batch, *sizes))
        if args.only != "updates":
            measure = lambda *rest: ours(mpgx, "training", *rest)
            compare("Steps of training, tracking", STEPS, measure, args.rounds, args.seconds, (batch, 4, 2))


if __name__ == "__main__":
    main()
