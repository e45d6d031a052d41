"""The tracking task as a Gymnasium environment: a follower's velocity, a leader of random velocity."""

import gymnasium
import numpy as np


class Tracking(gymnasium.Env):
    observation_space = gymnasium.spaces.Box(-2, 2, (4,), np.float32)
    action_space = gymnasium.spaces.Box(-1, 1, (2,), np.float32)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.leader, self.follower, self.steps = np.zeros(2), self.np_random.uniform(-1, 1, 2), 0
        return self.observation(), {}

    def observation(self):
        return np.concatenate([self.leader, self.follower]).astype(np.float32)

    def step(self, action):
        self.follower = np.clip(self.follower + 0.1 * 0.7 * np.asarray(action), -2, 2)
        self.leader = np.clip(self.leader + 0.1 * self.np_random.uniform(-0.5, 0.5, 2), -1, 1)
        self.steps += 1
        reward = -float(np.linalg.norm(self.leader - self.follower))
        return self.observation(), reward, False, self.steps == 200, {}
