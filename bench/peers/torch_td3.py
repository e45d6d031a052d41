"""TD3 updates in PyTorch: as CleanRL writes it, with a fused Adam, and as one compiled function."""

import torch
import torch.nn.functional as F
from torch import nn

GAMMA, TAU, ACTOR_RATE, CRITIC_RATE, DELAY = 0.99, 0.005, 1e-3, 1e-2, 2
NOISE = 0.2**0.5
KEPT = 10_000


def mlp(inputs, outputs):
    return nn.Sequential(nn.Linear(inputs, 400), nn.ReLU(), nn.Linear(400, 300), nn.ReLU(), nn.Linear(300, outputs))


class Learner:
    def __init__(self, batch, state, action, fused, compiled):
        torch.manual_seed(0)
        torch.set_num_threads(1)
        self.batch, self.updates = batch, 0
        self.actor = nn.Sequential(mlp(state, action), nn.Tanh())
        self.critics = [mlp(state + action, 1) for _ in range(2)]
        self.targets = [mlp(state + action, 1) for _ in range(2)]
        for critic, target in zip(self.critics, self.targets):
            target.load_state_dict(critic.state_dict())
        self.actor_adam = torch.optim.Adam(self.actor.parameters(), lr=ACTOR_RATE, fused=fused)
        both = [p for critic in self.critics for p in critic.parameters()]
        self.critic_adam = torch.optim.Adam(both, lr=CRITIC_RATE, fused=fused)
        self.states, self.nexts = torch.randn(KEPT, state), torch.randn(KEPT, state)
        self.actions, self.rewards = torch.rand(KEPT, action) * 2 - 1, torch.randn(KEPT)
        self.step = torch.compile(self.update) if compiled else self.update

    def update(self, delayed):
        rows = torch.randint(0, KEPT, (self.batch,))
        s, a, r, s2 = self.states[rows], self.actions[rows], self.rewards[rows], self.nexts[rows]
        with torch.no_grad():
            a2 = self.actor(s2)
            a2 = (a2 + torch.randn_like(a2) * NOISE).clamp(-1, 1)
            x2 = torch.cat([s2, a2], 1)
            q = torch.min(self.targets[0](x2), self.targets[1](x2)).view(-1)
            y = r + GAMMA * q
        x = torch.cat([s, a], 1)
        loss = sum(F.mse_loss(critic(x).view(-1), y) for critic in self.critics)
        self.critic_adam.zero_grad()
        loss.backward()
        self.critic_adam.step()
        if delayed:
            actor_loss = -self.critics[0](torch.cat([s, self.actor(s)], 1)).mean()
            self.actor_adam.zero_grad()
            actor_loss.backward()
            self.actor_adam.step()
            with torch.no_grad():
                for critic, target in zip(self.critics, self.targets):
                    for p, q in zip(critic.parameters(), target.parameters()):
                        q.copy_(TAU * p + (1 - TAU) * q)

    def run(self, count):
        for _ in range(count):
            self.updates += 1
            self.step(self.updates % DELAY == 0)


def eager(batch, state, action):
    return Learner(batch, state, action, fused=False, compiled=False).run


def fused(batch, state, action):
    return Learner(batch, state, action, fused=True, compiled=False).run


def compiled(batch, state, action):
    return Learner(batch, state, action, fused=True, compiled=True).run
