"""Times the networks of a learned map in PyTorch on the CPU, on features that are already there.

The sizes are those of `surefoot bench learned-map`: encoder, four softmax heads, radial flow, evidence head.
"""

import math

import work


def more(parser):
    parser.add_argument("--networks", default="96-64:16", help="hidden-hidden:latent")
    parser.add_argument("--chunk", type=int, default=8192, help="footprints that go through all layers at a time")


chosen = work.arguments(__doc__, more)  # before PyTorch counts the processors

import torch
from torch import nn

torch.set_num_threads(chosen.threads)
torch.manual_seed(7)

N_POSES, N_FEATURES, N_BINS, N_HEADS = 81 * 96 * 13, 144, 12, 4
HEAD_HIDDEN, EVIDENCE_HIDDEN, N_FLOW_LAYERS = 32, 16, 8
hidden, latent = chosen.networks.split(":")
HIDDEN, N_LATENT = [int(width) for width in hidden.split("-")], int(latent)
LOG_BUDGET = 0.5 * N_LATENT * math.log(4 * math.pi)


class RadialFlow(nn.Module):
    def __init__(self):
        super().__init__()
        self.centres = nn.Parameter(torch.rand(N_FLOW_LAYERS, N_LATENT) - 0.5)
        self.alpha = nn.Parameter(torch.rand(N_FLOW_LAYERS))
        self.beta = nn.Parameter(torch.rand(N_FLOW_LAYERS))

    def forward(self, z):
        log_determinant = torch.zeros(len(z))
        a = nn.functional.softplus(self.alpha)
        b = nn.functional.softplus(self.beta) - a
        for layer in range(N_FLOW_LAYERS):
            off = z - self.centres[layer]
            h = 1 / (a[layer] + off.norm(dim=1))
            bh = b[layer] * h
            z = z + bh[:, None] * off
            log_determinant += (N_LATENT - 1) * torch.log1p(bh) + torch.log1p(a[layer] * bh * h)
        return log_determinant - 0.5 * (N_LATENT * math.log(2 * math.pi) + (z * z).sum(1))


class Networks(nn.Module):
    def __init__(self):
        super().__init__()
        widths = [N_FEATURES, *HIDDEN]
        layers = [part for pair in zip(widths, widths[1:]) for part in (nn.Linear(*pair), nn.LeakyReLU(0.01))]
        self.encoder = nn.Sequential(*layers, nn.Linear(widths[-1], N_LATENT))

        def head(width, n):
            return nn.Sequential(nn.Linear(N_LATENT, width), nn.LeakyReLU(0.01), nn.Linear(width, n))

        self.heads = nn.ModuleList(head(HEAD_HIDDEN, N_BINS) for _ in range(N_HEADS))
        self.evidence = head(EVIDENCE_HIDDEN, N_HEADS)
        self.flow = RadialFlow()

    def forward(self, features):
        z = self.encoder(features)
        n = torch.exp((self.flow(z) + LOG_BUDGET).clamp(-30, 30))
        probabilities = [head(z).softmax(1) for head in self.heads]
        return probabilities, torch.sigmoid(self.evidence(z)) * n[:, None]


networks = Networks().eval()
features = torch.randn(N_POSES, N_FEATURES)


def update():
    with torch.inference_mode():
        for chunk in features.split(chosen.chunk):
            _, evidence = networks(chunk)
        return evidence.numpy()


work.report(f"PyTorch {torch.__version__}, networks {chosen.networks}, chunks of {chosen.chunk}", chosen, update)
