"""Three robots keep a square with a leader that runs on a circle."""
import gymnasium as gym
import numpy as np


class SquareOnCircle(gym.Env):
    def __init__(self, side=0.4, k_c=1.0):
        self.dt, self.horizon, self.safety = 0.1, 200, 0.1  # s, steps, m
        self.side, self.k_c = side, k_c  # m, m
        self.slots = np.array([[-side, 0.0], [-side, -side], [0.0, -side]])
        self.radius, self.pace = 0.6, 0.3  # m, m/s
        self.hand, self.rate = 0.15, 100.0  # m, Hz
        self.max_speed, self.max_drive, self.max_turn = 0.7, 1.0, 5.0  # m/s, m/s, rad/s
        self.observation_space = gym.spaces.Box(-np.inf, np.inf, (6,), np.float32)
        self.action_space = gym.spaces.Box(-1.0, 1.0, (6,), np.float32)

    def reset(self, seed=None, options=None):
        super().reset(seed=seed)
        self.steps = 0
        self.phase = self.np_random.uniform(0.0, 2 * np.pi)
        self.leader = self._leader()
        angle = self.np_random.uniform(0.0, 2 * np.pi, 3)
        away = 0.1 * np.sqrt(self.np_random.uniform(0.0, 1.0, 3))
        near = np.stack([away * np.cos(angle), away * np.sin(angle)], axis=1)
        self.p = self.leader + self.slots + near
        self.heading = self.np_random.uniform(-np.pi, np.pi, 3)
        return self._observe(), {}

    def step(self, action):
        command = self.max_speed * np.clip(np.asarray(action, float).reshape(3, 2), -1.0, 1.0)
        inner = max(1, round(self.dt * self.rate))
        for _ in range(inner):
            self._drive(command, self.dt / inner)
        self.phase = (self.phase + self.pace * self.dt / self.radius) % (2 * np.pi)
        self.leader = self._leader()
        self.steps += 1

        gap = -np.linalg.norm(self.p - self._places(), axis=1).sum()
        collisions = self._collisions()
        crash = -self.k_c * collisions
        info = {"gap": gap, "crash": crash}
        return self._observe(), gap + crash, collisions > 0, self.steps >= self.horizon, info

    def _drive(self, command, dt):
        """Hand-point control of a unicycle: (v, w) from the commanded velocity, then an exact arc."""
        cos, sin = np.cos(self.heading), np.sin(self.heading)
        v = np.clip(cos * command[:, 0] + sin * command[:, 1], -self.max_drive, self.max_drive)
        w = np.clip((-sin * command[:, 0] + cos * command[:, 1]) / self.hand, -self.max_turn, self.max_turn)
        axle = self.p - self.hand * np.stack([cos, sin], axis=1)
        turn = w * dt
        straight = np.abs(turn) < 1e-9
        safe = np.where(straight, 1.0, w)
        after = self.heading + turn
        dx = np.where(straight, v * dt * cos, v / safe * (np.sin(after) - sin))
        dy = np.where(straight, v * dt * sin, v / safe * (cos - np.cos(after)))
        self.heading = (after + np.pi) % (2 * np.pi) - np.pi
        self.p = axle + np.stack([dx, dy], axis=1)
        self.p += self.hand * np.stack([np.cos(after), np.sin(after)], axis=1)

    def _leader(self):
        return self.radius * np.array([np.cos(self.phase), np.sin(self.phase)])

    def _places(self):
        return self.leader + self.slots

    def _observe(self):
        return (self._places() - self.p).astype(np.float32).ravel()

    def _collisions(self):
        all_p = np.vstack([self.leader, self.p])
        i, j = np.triu_indices(4, 1)
        return int((np.linalg.norm(all_p[i] - all_p[j], axis=1) < self.safety).sum())
