"""ResNet-18 and ResNet-50 in PyTorch beside ours, in turn, on one core: one image of 64 x 64, and images a second of training.

    cargo build --release -p mpgx-vision --features vision --example latency
    taskset -c 0 python resnet.py ../../target/release/examples/latency
"""

import os
import statistics
import subprocess
import sys
import time

import torch
import torchvision

BATCH = 16
OUTPUTS = 12
ROUNDS = 3


def clock(work, times, warm):
    taken = []
    for _ in range(times):
        start = time.perf_counter()
        work()
        taken.append(time.perf_counter() - start)
    return statistics.median(taken[warm:])


def peer(depth, steps, layout):
    torch.manual_seed(0)
    net = getattr(torchvision.models, f"resnet{depth}")(num_classes=OUTPUTS).to(memory_format=layout)
    adam = torch.optim.Adam(net.parameters(), fused=True)
    images, targets = torch.randn(BATCH, 3, 64, 64).to(memory_format=layout), torch.rand(BATCH, OUTPUTS)

    def step():
        adam.zero_grad()
        (net(images) - targets).abs().mean().backward()
        adam.step()

    trained = BATCH / clock(step, steps, 3)
    net.eval()
    image = images[:1].contiguous(memory_format=layout)
    with torch.inference_mode():
        forward = 1e3 * clock(lambda: net(image), 30, 5)
    return f"resnet{depth}: {forward:.1f} ms an image, {trained:.1f} images/s of training"


torch.set_num_threads(1)
for number in range(ROUNDS):
    ours = subprocess.run([sys.argv[1]], env=os.environ | {"RAYON_NUM_THREADS": "1"}, capture_output=True, text=True, check=True)
    print(f"round {number + 1}", *(f"ours          {line}" for line in ours.stdout.splitlines()), sep="\n")
    for name, layout in [("eager", torch.contiguous_format), ("channels-last", torch.channels_last)]:
        for depth, steps in [(18, 20), (50, 12)]:
            print(f"{name:13} {peer(depth, steps, layout)}", flush=True)
