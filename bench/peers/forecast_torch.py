"""PyTorch on the processor, one thread, with the same weights."""

import pathlib

import numpy as np
import torch
from safetensors.torch import load_file

from exchange import Answer, read, times

STEPS = 9
WEIGHTS = pathlib.Path(__file__).parents[2] / "models" / "paper_lstm.safetensors"


class Network(torch.nn.Module):
    """Embedding, encoder over what was observed, then the cell for each further step, fed with its own mean."""

    def __init__(self):
        super().__init__()
        tensors = load_file(WEIGHTS)
        self.emb = torch.nn.Linear(2, tensors["emb.weight"].shape[0])
        self.enc = torch.nn.LSTMCell(tensors["emb.weight"].shape[0], tensors["enc.weight_hh"].shape[1])
        self.dec = torch.nn.Linear(tensors["enc.weight_hh"].shape[1], 5)
        self.load_state_dict(tensors)

    def forward(self, observed_m):
        state = None
        for frame in range(observed_m.shape[1]):
            state = self.enc(torch.relu(self.emb(observed_m[:, frame])), state)
        raw = [self.dec(state[0])]
        for _ in range(STEPS - 1):
            state = self.enc(torch.relu(self.emb(raw[-1][:, :2])), state)
            raw.append(self.dec(state[0]))
        raw = torch.stack(raw, 1)
        sigma_m = 0.001 + 0.1 * torch.nn.functional.softplus(raw[..., 2:4])
        return torch.cat([raw[..., :2], sigma_m, 0.95 * torch.tanh(raw[..., 4:])], -1)


def compared(ours, theirs):
    """The mean way of a person, and by how much the means and standard deviations differ at most, metres."""
    mean_m, sigma_m = theirs[..., :2], theirs[..., 2:4]
    apart_m = max(np.abs(mean_m - ours[..., :2]).max(), np.abs(sigma_m - np.sqrt(ours[..., [2, 4]])).max())
    return {"mean way, m": np.linalg.norm(mean_m, axis=2).sum(1).mean(), "most apart, m": apart_m}


def main():
    torch.set_num_threads(1)
    network, answer = Network().eval(), Answer()
    for people in [10, 100]:
        observed_m = torch.from_numpy(read(f"observed_{people}"))
        with torch.inference_mode():
            ms, foreseen = times(30, lambda: network(observed_m))
        answer.case(f"{people} people", ms, compared(read(f"foreseen_{people}"), foreseen.numpy()))
    answer.print()


if __name__ == "__main__":
    main()
