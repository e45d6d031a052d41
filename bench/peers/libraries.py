"""Whole training loops of Stable-Baselines3 and SBX on the tracking task."""

from tracking import Tracking


def sb3(batch, state, action):
    import torch
    from stable_baselines3 import TD3

    torch.set_num_threads(1)
    return learn(TD3, batch, dict(net_arch=[400, 300]))


def sbx(batch, state, action):
    from sbx import TD3

    return learn(TD3, batch, dict(net_arch=[400, 300]))


def learn(algorithm, batch, policy):
    model = algorithm("MlpPolicy", Tracking(), batch_size=batch, learning_starts=batch, buffer_size=20_000,
                      train_freq=1, gradient_steps=1, policy_kwargs=policy, seed=0, verbose=0)
    model.learn(300)

    def run(steps):
        model.learn(max(steps, 1), reset_num_timesteps=False)

    return run
