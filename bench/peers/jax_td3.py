"""TD3 in JAX: jitted updates called from Python, as CleanRL writes it; many updates in one jitted scan; and the whole
loop with environment and replay in one jitted scan."""

from functools import partial

import jax
import jax.numpy as jnp
import optax

GAMMA, TAU, ACTOR_RATE, CRITIC_RATE = 0.99, 0.005, 1e-3, 1e-2
NOISE = 0.2**0.5
KEPT = 10_000
CHUNK = 200  # Updates in one call of the jitted scan.

actor_adam = optax.adam(ACTOR_RATE)
critic_adam = optax.adam(CRITIC_RATE)


def init(key, inputs, outputs):
    sizes = [inputs, 400, 300, outputs]
    layers = []
    for i, o in zip(sizes, sizes[1:]):
        key, w, b = jax.random.split(key, 3)
        bound = i**-0.5
        layers.append((jax.random.uniform(w, (i, o), minval=-bound, maxval=bound),
                       jax.random.uniform(b, (o,), minval=-bound, maxval=bound)))
    return layers


def mlp(layers, x):
    for w, b in layers[:-1]:
        x = jax.nn.relu(x @ w + b)
    w, b = layers[-1]
    return x @ w + b


def pi(actor, s):
    return jnp.tanh(mlp(actor, s))


def q_of(critic, s, a):
    return mlp(critic, jnp.concatenate([s, a], -1))[..., 0]


def learner(key, state, action):
    keys = jax.random.split(key, 3)
    actor = init(keys[0], state, action)
    critics = (init(keys[1], state + action, 1), init(keys[2], state + action, 1))
    return dict(actor=actor, critics=critics, targets=jax.tree.map(jnp.copy, critics), actor_adam=actor_adam.init(actor),
                critic_adam=critic_adam.init(critics), updates=jnp.zeros((), jnp.int32))


def critic_update(it, batch, key):
    s, a, r, s2 = batch
    a2 = pi(it["actor"], s2)
    a2 = jnp.clip(a2 + NOISE * jax.random.normal(key, a2.shape), -1, 1)
    y = r + GAMMA * jnp.minimum(*(q_of(target, s2, a2) for target in it["targets"]))
    loss = lambda critics: sum(jnp.mean((q_of(critic, s, a) - y) ** 2) for critic in critics)
    grads = jax.grad(loss)(it["critics"])
    steps, adam = critic_adam.update(grads, it["critic_adam"])
    return it | dict(critics=optax.apply_updates(it["critics"], steps), critic_adam=adam, updates=it["updates"] + 1)


def delayed_update(it, batch):
    s = batch[0]
    loss = lambda actor: -jnp.mean(q_of(it["critics"][0], s, pi(actor, s)))
    grads = jax.grad(loss)(it["actor"])
    steps, adam = actor_adam.update(grads, it["actor_adam"])
    targets = optax.incremental_update(it["critics"], it["targets"], TAU)
    return it | dict(actor=optax.apply_updates(it["actor"], steps), actor_adam=adam, targets=targets)


def draw(key, kept, size, batch):
    rows = jax.random.randint(key, (batch,), 0, size)
    return tuple(part[rows] for part in kept)


def update(it, kept, size, key, batch):
    rows, noise = jax.random.split(key)
    drawn = draw(rows, kept, size, batch)
    it = critic_update(it, drawn, noise)
    return jax.lax.cond(it["updates"] % 2 == 0, lambda it: delayed_update(it, drawn), lambda it: it, it)


def random_kept(key, state, action):
    keys = jax.random.split(key, 4)
    return (jax.random.normal(keys[0], (KEPT, state)), jax.random.uniform(keys[1], (KEPT, action), minval=-1.0),
            jax.random.normal(keys[2], (KEPT,)), jax.random.normal(keys[3], (KEPT, state)))


def cleanrl(batch, state, action):
    """Two jitted functions, called from Python with mini-batches that NumPy draws."""
    import numpy as np

    it = learner(jax.random.key(0), state, action)
    kept = tuple(np.asarray(part) for part in random_kept(jax.random.key(1), state, action))
    critics, delayed = jax.jit(critic_update), jax.jit(delayed_update)
    key, generator, count = jax.random.key(2), np.random.default_rng(0), 0

    def run(updates):
        nonlocal it, key, count
        for _ in range(updates):
            rows = generator.integers(0, KEPT, batch)
            drawn = tuple(part[rows] for part in kept)
            key, noise = jax.random.split(key)
            it = critics(it, drawn, noise)
            count += 1
            if count % 2 == 0:
                it = delayed(it, drawn)
        jax.block_until_ready(it)

    return run


def scan(batch, state, action):
    """Many updates in one jitted scan."""
    it = learner(jax.random.key(0), state, action)
    kept = random_kept(jax.random.key(1), state, action)

    @partial(jax.jit, donate_argnums=0)
    def many(it, kept, key):
        return jax.lax.scan(lambda it, key: (update(it, kept, KEPT, key, batch), None), it, jax.random.split(key, CHUNK))[0]

    key = jax.random.key(2)

    def run(updates):
        nonlocal it, key
        for _ in range(max(1, updates // CHUNK)):
            key, mine = jax.random.split(key)
            it = many(it, kept, mine)
        jax.block_until_ready(it)

    run.least = CHUNK
    return run


def loop(batch, state, action):
    """Environment, exploration, replay and update in one jitted scan: a follower tracks a leader of random velocity."""
    dt, capacity = 0.1, 20_000
    # state 4: both positions; action 2: the follower's velocity.
    assert (state, action) == (4, 2)
    it = learner(jax.random.key(0), state, action)
    kept = (jnp.zeros((capacity, 4)), jnp.zeros((capacity, 2)), jnp.zeros(capacity), jnp.zeros((capacity, 4)))

    def step(carry, key):
        it, kept, pushed, world = carry
        explore, lead, learn = jax.random.split(key, 3)
        u = jnp.clip(pi(it["actor"], world) + jax.random.normal(explore, (2,)), -1, 1)
        velocity = jax.random.uniform(lead, (2,), minval=-0.5, maxval=0.5)
        follower = jnp.clip(world[2:] + dt * 0.7 * u, -2, 2)
        leader = jnp.clip(world[:2] + dt * velocity, -1, 1)
        after = jnp.concatenate([leader, follower])
        reward = -jnp.linalg.norm(leader - follower)
        place = pushed % capacity
        kept = tuple(part.at[place].set(new) for part, new in zip(kept, (world, u, reward, after)))
        it = update(it, kept, jnp.minimum(pushed + 1, capacity), learn, batch)
        return (it, kept, pushed + 1, after), None

    @partial(jax.jit, donate_argnums=0)
    def many(carry, key):
        return jax.lax.scan(step, carry, jax.random.split(key, CHUNK))[0]

    carry, key = (it, kept, jnp.zeros((), jnp.int32), jnp.zeros(4)), jax.random.key(2)

    def run(steps):
        nonlocal carry, key
        for _ in range(max(1, steps // CHUNK)):
            key, mine = jax.random.split(key)
            carry = many(carry, mine)
        jax.block_until_ready(carry)

    run.least = CHUNK
    return run
