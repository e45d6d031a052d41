"""Resident memory of one cell over a long training with small networks, before and after its replay is full.

    cargo build --release && python bench/memory.py --mpgx target/release/mpgx

Prints samples of VmRSS with the steps done, the peak, how far it grew after the replay was full, and what `mpgx run --dry-run`
foretold. Fails if it grew by more than 5 % after that, or if peak and forecast differ by more than 1.5 times.
"""

import argparse
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

SCENARIO = Path(__file__).parent.parent / "scenarios" / "track_random.scn"
UNITS = {"kB": 1e3, "MB": 1e6, "GB": 1e9}


def scenario(steps, replay):
    text = SCENARIO.read_text()
    learner = f"learn mpg with tuned {{ steps = {steps}, replay = {replay}, hidden = [32, 32] }}"
    text, count = re.subn(r"^learn mpg.*$", learner, text, flags=re.M)
    assert count == 1, "one line that declares the learner"
    return re.sub(r"^compare .*$", "", text, flags=re.M)


def status(pid):
    """VmRSS and VmHWM in bytes; None when the process is gone."""
    try:
        text = Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return None
    values = dict(re.findall(r"^(VmRSS|VmHWM):\s+(\d+) kB", text, flags=re.M))
    return {name: 1024 * int(value) for name, value in values.items()} if len(values) == 2 else None


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--mpgx", required=True)
    parser.add_argument("--steps", type=int, default=600_000)
    parser.add_argument("--replay", type=int, default=100_000)
    parser.add_argument("--every", type=float, default=0.5, help="seconds between samples")
    args = parser.parse_args()
    mpgx = str(Path(args.mpgx).resolve())
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "long.scn"
        file.write_text(scenario(args.steps, args.replay))
        run = [mpgx, "run", str(file), "--seeds", "1", "--threads", "1", "--out", f"{folder}/out"]
        told = subprocess.run([*run, "--dry-run"], capture_output=True, text=True, check=True)
        amount, unit = re.search(r"([\d.]+) (kB|MB|GB) of memory", told.stdout + told.stderr).groups()
        forecast = float(amount) * UNITS[unit]
        process = subprocess.Popen(run, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        begin, samples = time.monotonic(), []
        while process.poll() is None:
            if (now := status(process.pid)) is not None:
                samples.append((time.monotonic() - begin, now["VmRSS"], now["VmHWM"]))
            time.sleep(args.every)
    # Steps take the same time throughout; the first half of the time left after the replay is full is left out,
    # so that neither a slow start nor the report at the end decides.
    end = samples[-1][0]
    full = [rss for at, rss, _ in samples if at > 1.5 * end * args.replay / args.steps and at < 0.98 * end]
    peak = max(hwm for _, _, hwm in samples)
    for at, rss, _ in samples[:: max(1, len(samples) // 12)]:
        print(f"{at:7.1f} s  about step {args.steps * at / end:9.0f}  {rss / 1e6:7.1f} MB")
    growth, ratio = max(full) / full[0] - 1, peak / forecast
    print(f"peak {peak / 1e6:.1f} MB, forecast {forecast / 1e6:.1f} MB ({ratio:.2f} of it); grew {100 * growth:.1f} % once full")
    return 0 if process.returncode in (0, 1) and growth < 0.05 and 1 / 1.5 < ratio < 1.5 else 1


if __name__ == "__main__":
    sys.exit(main())
