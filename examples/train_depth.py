"""A small network learns depth from pictures that are rendered while it trains. Needs PyTorch.

    python examples/train_depth.py --steps 200

Nothing is written but the last prediction, beside the picture and the depth that was rendered. With `--workers 4`
processes render while the network trains; on an NVIDIA card without workers, tensors stay on the card.
"""

import argparse
from itertools import islice

import numpy as np
import torch
from torch import nn

import pica

NEAR, FAR = 4.0, 30.0  # metres


def target(depth: torch.Tensor) -> torch.Tensor:
    """Depth as 0 to 1, near is 1: (batch, height, width)."""
    return (NEAR / depth.clamp(NEAR, FAR) - NEAR / FAR) / (1 - NEAR / FAR)


def main() -> None:
    """Train, and write the last prediction."""
    parser = argparse.ArgumentParser(description="A network learns depth from rendered pictures.")
    parser.add_argument("--steps", type=int, default=200)
    parser.add_argument("--batch", type=int, default=4)
    parser.add_argument("--size", default="96x64")
    parser.add_argument("--workers", type=int, default=0)
    parser.add_argument("--output", default="depth.png")
    arguments = parser.parse_args()
    width, height = (int(length) for length in arguments.size.split("x"))
    device = "cuda" if torch.cuda.is_available() else "cpu"

    samples = pica.torch_dataset(
        pica.scenes.machine_world,
        cameras="sphere",
        labels=("depth",),
        size=(width, height),
        frames=2,
        settings=pica.Settings.preset("performance"),
    )
    context = "spawn" if arguments.workers else None
    loader = torch.utils.data.DataLoader(
        samples, batch_size=arguments.batch, num_workers=arguments.workers, multiprocessing_context=context
    )
    layers = [nn.Conv2d(first, 32, 5, padding=2, padding_mode="replicate") for first in (3, 32, 32)]
    network = nn.Sequential(*(part for layer in layers for part in (layer, nn.ReLU())), nn.Conv2d(32, 1, 1)).to(device)
    optimizer = torch.optim.Adam(network.parameters(), lr=1e-3)
    for step, batch in enumerate(islice(loader, arguments.steps), start=1):
        pictures = batch["picture"].to(device).permute(0, 3, 1, 2) / 255
        wanted = target(batch["depth"].to(device))
        predicted = network(pictures)[:, 0]
        loss = nn.functional.l1_loss(predicted, wanted)
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        if step % 20 == 0 or step == arguments.steps:
            print(f"step {step}: mean absolute error {loss.item():.4f}")
    columns = [pictures[0].permute(1, 2, 0), *(plane[0][..., None].expand(-1, -1, 3) for plane in (wanted, predicted))]
    sheet = torch.cat(columns, dim=1).detach().clamp(0, 1).cpu().numpy()
    pica.images.pictures.write_png(arguments.output, (sheet * 255 + 0.5).astype(np.uint8))


if __name__ == "__main__":
    main()
