"""Environments survive misuse, interruptions and lost workers: errors name the remedy, and the game
continues."""

import functools
import itertools
import json
import os
import pickle
import signal
import subprocess
import sys
import textwrap
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from gymnasium.error import AlreadyPendingCallError, NoAsyncCallError

import ocjax
from ocjax.emulators import ale, memory, process
from ocjax.envs import AlePool, Settings, States, Vector, WorkerError, make
from tests.support.marks import slow_but

PONG = ocjax.load("Pong")
OBS = {
    "ram": "ram",
    "vector": Vector(history=3),
}  # one shows the emulators, and one has a memory


@pytest.fixture(params=[0, 2])
def envs(request):
    envs = ocjax.make_vec("Pong", 4, obs=OBS, num_workers=request.param)
    envs.reset(seed=0)
    yield envs
    envs.close()


@functools.cache
def history(steps=100):
    """The observations of undisturbed environments."""
    envs = ocjax.make_vec("Pong", 4, obs=OBS, num_workers=0)
    envs.reset(seed=0)
    out = [envs.step(np.full(4, t % 6))[0] for t in range(steps)]
    envs.close()
    return out


def goes_on(envs, first=0, steps=8):
    """True if further steps give the observations of undisturbed environments."""
    observed = [envs.step(np.full(4, t % 6))[0] for t in range(first, first + steps)]
    return all(
        np.array_equal(o[k], w[k])
        for o, w in zip(observed, history()[first:], strict=False)
        for k in OBS
    )


def run(code, *arguments, seconds=60):
    """The output of a program in a separate process, which may fork although JAX warns about it."""
    command = [sys.executable, "-W", "ignore", "-c", textwrap.dedent(code), *arguments]
    return subprocess.run(
        command, capture_output=True, text=True, check=True, timeout=seconds
    ).stdout


# Calls in the wrong order, and wrong arguments.


@pytest.mark.parametrize("envs", [2], indirect=True)
def test_calls_while_a_step_is_pending_are_refused_and_change_nothing(envs):
    states, ram = envs.clone_state(), envs.get_ram()
    envs.step_async(np.zeros(4, int))
    for refused in (
        lambda: envs.step_async(np.full(4, 3)),
        lambda: envs.step(np.full(4, 3)),
        lambda: envs.reset(seed=9),
        lambda: envs.reset(options={"reset_mask": np.array([True, False, False, False])}),
        lambda: envs.clone_state(),
        lambda: envs.restore_state(states),
        lambda: envs.set_ram(255 - ram),
        lambda: envs.pool.send(np.full(4, 3)),
        lambda: envs.pool.reset([9] * 4),
        lambda: envs.pool.set_ram(255 - ram),
        lambda: envs.pool.restore_state(states),
    ):
        with pytest.raises(AlreadyPendingCallError, match=r"a step is pending: call"):
            refused()
    observed, *_ = envs.step_wait()
    assert all(np.array_equal(observed[k], history()[0][k]) for k in OBS)
    assert goes_on(envs, 1)


def test_waiting_without_a_step_is_refused(envs):
    with pytest.raises(NoAsyncCallError, match=r"call step_async\(\) before step_wait\(\)"):
        envs.step_wait()
    assert goes_on(envs)
    if len(envs.pool._workers):
        with pytest.raises(NoAsyncCallError, match=r"call send\(\)"):
            envs.pool.wait()
    assert goes_on(envs, 8)


@pytest.mark.parametrize("workers", [0, 2])
def test_calls_before_the_first_reset_are_refused(workers):
    pool, source = (AlePool(PONG, 4, num_workers=n) for n in (workers, 0))
    source.reset([0] * 4)
    some = np.array([True, True, False, True])
    for refused in (
        lambda: pool.send(np.zeros(4, int)),
        lambda: pool.clone_state(),
        lambda: pool.set_ram(np.zeros(128, np.uint8)),
        lambda: pool.reset([0] * 4, some),
        lambda: pool.restore_state(source.clone_state(), some),
    ):
        with pytest.raises(
            ValueError,
            match=r"call reset\(\) before the first step|the first reset, .* must be of all",
        ):
            refused()
    if not workers:
        with pytest.raises(ValueError, match=r"call reset\(\)"):
            pool.emulator(0)
    pool.reset([0, 1, 2, 3])
    pool.send(np.zeros(4, int))
    pool.wait()
    assert (pool.episode_length == 1).all()
    pool.close()
    source.close()


def test_wrong_masks_seeds_and_actions_are_refused_and_change_nothing(envs):
    states, ram, pool = envs.clone_state(), envs.get_ram(), envs.pool
    for mask in ([True] * 4, np.array([0, 2]), np.array([1, 0, 1, 0]), np.array([True]), "all"):
        for refused in (
            lambda mask=mask: envs.set_ram(255 - ram, mask),
            lambda mask=mask: envs.restore_state(states, mask),
            lambda mask=mask: envs.reset(options={"reset_mask": mask}),
            lambda mask=mask: pool.reset([9] * 4, mask),
        ):
            with pytest.raises(ValueError, match=r"mask must be a bool array of shape \(4,\)"):
                refused()
    for seed in (
        1.5,
        "seed",
        True,
        -1,
        2**63,
        2**63 - 1,
        [1, 2.5, 3, 4],
        [1, "2", 3, 4],
        [1, 2, 3],
        [1, 2, 3, -4],
        [0, 0, 0, 2**63],
    ):
        with pytest.raises(
            ValueError, match=r"seed must be an integer from 0 to 2\*\*63 - 1, or 4 of them"
        ):
            envs.reset(seed=seed)
    for seeds in ([1], [1, -2, 3, 4], [1, 2, 3, 2**63], 5):
        with pytest.raises(ValueError, match="seed must be"):
            pool.reset(seeds)
    for actions in (
        np.zeros(3, int),
        np.zeros(4),
        np.array([0, 0, 0, 6]),
        np.array([-1, 0, 0, 0]),
        0,
    ):
        with pytest.raises(ValueError, match="actions must be"):
            pool.send(actions)
    assert goes_on(envs)


def test_a_refused_reset_of_a_single_environment_changes_nothing():
    env = make("Pong", mode="raw")
    env.reset(seed=3)
    ram, state = env.get_ram(), env.np_random.bit_generator.state
    for wrong in ({"seed": -1}, {"seed": 1.5}, {"seed": 5, "options": {"mode": 1}}):
        with pytest.raises(ValueError, match=r"seed must be|unknown options"):
            env.reset(**wrong)
    assert env.np_random.bit_generator.state == state
    assert np.array_equal(env.get_ram(), ram)
    env.step(0)
    env.close()


def test_wrong_options_are_refused():
    for options, message in (
        ({"num_envs": 2.0}, "num_envs must be an integer of at least 1"),
        ({"num_envs": True}, "num_envs must be an integer"),
        ({"num_envs": 0}, "num_envs must be an integer"),
        ({"num_envs": 10**12}, "num_envs must be an integer"),
        ({"num_workers": 1.5}, "num_workers must be an integer of at least 0"),
        (
            {"noop_max": 2.5},
            "noop_max must be an integer of at least 0 and at most 108,000, got 2.5",
        ),
        ({"noop_max": 10**9}, "noop_max must be an integer"),
        (
            {"frame_skip": 2.5},
            "frame_skip must be an integer of at least 1 and at most 108,000, got 2.5",
        ),
        ({"frame_skip": "4"}, "frame_skip must be an integer"),
        ({"frame_skip": (2, 3, 4)}, r"a pair \(low, high\)"),
        ({"frame_skip": (4, 4)}, "upper end of frame_skip must be an integer of at least 5"),
        ({"frame_skip": 10**9}, "frame_skip must be an integer"),
        ({"max_episode_frames": 10**12}, "max_episode_frames must be an integer"),
        ({"repeat_action_probability": "0.25"}, "repeat_action_probability must be in"),
        ({"repeat_action_probability": float("nan")}, "repeat_action_probability must be in"),
        ({"full_action_space": "no"}, "full_action_space must be True or False, got 'no'"),
        ({"worker_timeout": 0}, "worker_timeout must be a number of seconds above 0"),
    ):
        with pytest.raises(ValueError, match=message):
            ocjax.make_vec("Pong", **{"num_envs": 2, **options})
    with pytest.raises(
        MemoryError,
        match=r"num_envs 2,000,000,000 needs about 1,400,000\.0 GB of memory, and this machine has",
    ):
        ocjax.make_vec("Pong", 2_000_000_000)
    with pytest.raises(TypeError, match="worker_timeout is an option of make_vec"):
        make("Pong", worker_timeout=1.0)
    envs = ocjax.make_vec("Pong", np.int64(2), frame_skip=np.int64(3), num_workers=0)
    assert (envs.num_envs, envs.spec.kwargs["frame_skip"]) == (2, 3)
    assert type(envs.spec.kwargs["frame_skip"]) is int
    envs.close()


# Workers that do not reply, and processes that end.


@pytest.mark.parametrize("how", ["stopped", "hanging"])
def test_a_worker_that_does_not_reply_is_named(how):
    def hang(ram):
        while ram[0] != ram[0] + 1:
            time.sleep(0.01)

    pool = AlePool(
        PONG, 4, num_workers=2, worker_timeout=100.0, hook=hang if how == "hanging" else None
    )
    pool.reset([0] * 4)
    assert pool._workers._time_limit == 100
    pool._workers._time_limit = 1.0  # from now on; starting takes long on a busy machine
    pids = [w.process.pid for w in pool._workers]
    if how == "stopped":
        os.kill(pids[1], signal.SIGSTOP)
    pool.send(np.zeros(4, int))
    with pytest.raises(
        WorkerError,
        match=(
            r"environments \d-\d \(process \d+\) is busy, .* not replied for 1 s[\s\S]*larger "
            r"worker_timeout"
        ),
    ):
        pool.wait()
    assert pool.closed
    assert not any(Path(f"/proc/{pid}").exists() for pid in pids)


@pytest.mark.parametrize("stopped", slow_but(["all"], ["all", "parent"]))
def test_a_suspension_is_no_silence(stopped):
    """Clusters and containers suspend entire jobs, a terminal suspends the parent. The suspension
    counts as one wait at most."""
    program = """
import os, time
import numpy as np, ocjax
from ocjax.envs import AlePool
def wait(ram):
    time.sleep(0.15)
pool = AlePool(ocjax.load("Pong"), 1, num_workers=1, hook=wait)
pool.reset([0])
pool._workers._time_limit = 1.5
print(os.getpid(), *(w.process.pid for w in pool._workers), flush=True)
pool.send(np.zeros(1, int))
pool.wait()
print("stepped", flush=True)
pool.close()
"""
    with subprocess.Popen(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, text=True
    ) as parent:
        assert parent.stdout is not None
        pids = [int(pid) for pid in parent.stdout.readline().split()][
            : None if stopped == "all" else 1
        ]
        time.sleep(0.2)
        for number, pause in ((signal.SIGSTOP, 2.0), (signal.SIGCONT, 0.0)):
            for pid in pids:
                os.kill(pid, number)
            time.sleep(pause)
        assert parent.stdout.readline() == "stepped\n"
    assert parent.returncode == 0


def test_slow_starts_are_no_silence():
    """Each started emulator restarts the time limit; together the starts take longer than the
    limit."""
    pool = AlePool(PONG, 12, num_workers=1)
    pool.reset([0] * 12)  # the first start takes longer: the process imports its modules
    counts, completed = [], pool._workers.completed
    pool._workers.completed = lambda progress, interval: completed(
        lambda: counts.append(progress()) or counts[-1], 0.01
    )
    pool.reset([0] * 12)
    assert len(set(counts)) > 2
    longest = max(sum(c == count for c in counts) for count in counts)
    pool._workers._time_limit = 0.01 * longest * 3
    assert pool._workers._time_limit < 0.01 * len(counts)
    pool.reset([0] * 12)
    pool.close()


def test_ending_workers_has_one_deadline_for_all(monkeypatch):
    """All stopped workers are killed at the same deadline."""
    grace, waits, wait = 1.0, [], subprocess.Popen.wait
    monkeypatch.setattr(process, "_GRACE", grace)
    monkeypatch.setattr(
        subprocess.Popen,
        "wait",
        lambda self, timeout=None: waits.append(timeout) or wait(self, timeout),
    )
    pool = AlePool(PONG, 3, num_workers=3)
    pool.reset([0] * 3)
    pids = [w.process.pid for w in pool._workers]
    for pid in pids:
        os.kill(pid, signal.SIGSTOP)
    pool.close()
    limited = [seconds for seconds in waits if seconds is not None]
    assert len(limited) == len(pids)
    assert sum(limited) <= grace
    assert not any(Path(f"/proc/{pid}").exists() for pid in pids)


def test_forked_children_change_nothing():
    """A child that holds the sockets does not delay close(). A child that ends, or uses the
    environments, does not disturb them."""
    out = run("""
        import os, sys, time, numpy as np, ocjax
        from ocjax.emulators import process
        from ocjax.envs import AlePool, WorkerError
        process._GRACE = 20
        pool = AlePool(ocjax.load("Pong"), 3, num_workers=3)
        pool.reset([0] * 3)
        if os.fork() == 0:
            try:
                pool.send(np.zeros(3, int))
            except WorkerError as error:
                print(error, flush=True)
            sys.exit()
        os.wait()
        pool.send(np.zeros(3, int)); pool.wait()
        print(pool.episode_length, flush=True)
        child = os.fork()
        if child == 0:
            time.sleep(60)
            os._exit(0)
        workers = list(pool._workers)
        pool.close()
        print([w.process.returncode for w in workers])
        os.kill(child, 9)
    """)
    assert (
        "belong to the process that this one was forked from: make environments in the process "
        "that uses them" in out
    )
    assert out.splitlines()[1:] == ["[1 1 1]", "[0, 0, 0]"]


@pytest.mark.slow
def test_workers_end_with_a_killed_parent_whose_forked_child_lives():
    """The workers end even while a hook hangs."""
    out = run("""
        import os, signal, time, numpy as np, ocjax
        from ocjax.envs import AlePool
        read, write = os.pipe()
        def hang(ram):
            while True:
                pass
        if os.fork() == 0:
            pools = [AlePool(ocjax.load("Pong"), 1, num_workers=1, hook=h) for h in (None, hang)]
            for pool in pools:
                pool.reset([0])
            pools[1].send(np.zeros(1, int))
            if os.fork() == 0:
                time.sleep(8)
                os._exit(0)
            ids = [w.process.pid for pool in pools for w in pool._workers]
            os.write(write, b" ".join(b"%d" % number for number in ids))
            os.kill(os.getpid(), signal.SIGKILL)
        pids = os.read(read, 100).split()
        def alive(pid):
            try:
                return open(f"/proc/{int(pid)}/stat").read().split()[2] != "Z"
            except FileNotFoundError:
                return False
        deadline = time.monotonic() + 5
        while any(map(alive, pids)) and time.monotonic() < deadline:
            time.sleep(0.1)
        print(len(pids), [pid for pid in pids if alive(pid)])
    """)
    assert out.strip() == "2 []"


def test_workers_outlive_the_thread_that_made_them():
    out = run("""
        import threading, time, numpy as np, ocjax
        from ocjax.envs import AlePool
        pools = []
        start = lambda: pools.append(AlePool(ocjax.load("Pong"), 2, num_workers=1))
        thread = threading.Thread(target=start)
        thread.start(); thread.join()
        time.sleep(1.5)
        pools[0].reset([0, 0]); pools[0].send(np.zeros(2, int)); pools[0].wait()
        print(pools[0].episode_length)
        pools[0].close()
    """)
    assert out.strip() == "[1 1]"


# Hooks.


def test_hooks_find_the_modules_of_their_process(tmp_path, monkeypatch):
    """A hook's module is pickled by value, and its imports resolve on the parent's path."""
    (tmp_path / "its_helper.py").write_text("def write(ram, value):\n    ram[14] = value\n")
    (tmp_path / "its_hook.py").write_text(
        "import its_helper\n\ndef hook(ram, value=7):\n    its_helper.write(ram, value)\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    import its_hook  # pyright: ignore[reportMissingImports]

    class Method:
        def hook(self, ram):
            ram[13] = ram[14] + 1  # sees the bytes of the previous hook

        def __call__(self, ram):
            self.hook(ram)

    for hook, score in (
        (its_hook.hook, 7),
        (functools.partial(its_hook.hook, value=5), 5),
        ([functools.partial(functools.partial(its_hook.hook), value=3), Method().hook], 3),
        ((its_hook.hook, Method()), 7),
    ):
        pool = AlePool(PONG, 1, num_workers=1, hook=hook)
        pool.reset([0])
        pool.send(np.zeros(1, int))
        pool.wait()
        assert pool.ram[0, 14] == score
        if isinstance(hook, list | tuple):
            assert pool.ram[0, 13] == score + 1
        pool.close()


def test_workers_have_their_parents_path():
    """In particular, the path lacks `ocjax/envs`, because its envpool.py would hide the package
    envpool. The standard library comes first, so that nothing hides it."""

    def report(ram):
        raise ArithmeticError(json.dumps(sys.path))

    pool = AlePool(PONG, 1, num_workers=1, hook=report)
    pool.reset([0])
    pool.send(np.zeros(1, int))
    with pytest.raises(WorkerError) as caught:
        pool.wait()
    text = str(caught.value)
    found = json.loads(text[text.rindex("ArithmeticError: ") + len("ArithmeticError: ") :])
    path = [entry or str(Path.cwd()) for entry in sys.path]
    library = str(Path(os.__file__).parent)
    standard = [entry for entry in path if entry in (library, f"{library}/lib-dynload")]
    assert found == standard + [entry for entry in path if entry not in standard]
    assert len(standard) == 2


@pytest.mark.parametrize("workers", [0, 1])
def test_hooks_that_fail_are_named(workers):
    def fine(ram):
        pass

    def broken(ram, by):
        ram[0] //= by

    pool = AlePool(PONG, 2, num_workers=workers, hook=[fine, functools.partial(broken, by=None)])
    pool.reset([0, 0])
    with pytest.raises(
        RuntimeError,
        match=r"the hook \S*test_robustness\.\S*broken failed in environment 0: .*TypeError",
    ):
        pool.send(np.zeros(2, int))
        pool.wait()
    for wrong, message in (
        (
            3,
            "hook must be a function of the RAM, the name of a variation, or a sequence of "
            "these, got 3",
        ),
        ([fine, 7], "got 7"),
        (
            functools.partial(fine, threading.Lock()),
            r"the hook \S*fine cannot be sent to worker processes: ",
        ),
    ):
        with pytest.raises(TypeError, match=message):
            AlePool(PONG, 2, num_workers=workers, hook=wrong)


def test_a_hook_that_a_worker_cannot_load_is_named():
    class Unloadable:
        def __call__(self, ram):
            pass

        def __reduce__(self):
            return int, ("no number",)

    pool = AlePool(PONG, 1, num_workers=1, hook=Unloadable())
    with pytest.raises(
        WorkerError,
        match=r"the hook \S*Unloadable cannot be loaded in a worker process: ValueError",
    ):
        pool.reset([0])


# Saved states.


def test_states_that_are_damaged_or_foreign_are_refused_and_change_nothing(envs):
    states = envs.clone_state()

    def damaged(change):
        rows = {name: array.copy() for name, array in states.rows.items()}
        change(rows)
        return States(states.md5, rows)

    def set_bytes(rows, start, new):
        rows["state"][1, start : start + len(new)] = np.frombuffer(new, np.uint8)

    for change, message in (
        (lambda r: r["state"].fill(7), "in an emulator's state, a text has 117901063 bytes"),
        (lambda r: r["state_bytes"].fill(3), "in an emulator's state, it is too short"),
        (lambda r: r["state_bytes"].fill(-3), "in an emulator's state, it is too short"),
        (lambda r: set_bytes(r, 5_000, b"no state"), "the state of the random numbers is damaged"),
        (lambda r: r["state_bytes"].__isub__(1), "in an emulator's state, it is too short"),
        (lambda r: r["phase"].fill(5), "'phase' has numbers out of range"),  # never saved
        (lambda r: r["held_strength"].fill(np.nan), "'held_strength' has numbers out of range"),
        (lambda r: r["generator"][1].__setitem__(4, 2), "'generator' has numbers out of range"),
        (lambda r: r["has_before"].view(np.uint8).fill(5), "'has_before' has bools that are not"),
        (lambda r: r.pop("phase"), "saved without phase"),
        (lambda r: r.update(ram=r["ram"].astype(int)), "expected 'ram' to be uint8 of shape"),
        (lambda r: r.update(lives=r["lives"][:, None]), "expected 'lives' to be int32"),
        (lambda r: r.update(state=np.zeros((4, 2**15), np.uint8)), "expected 'state' to be uint8"),
        (lambda r: r.pop("ram"), "saved without ram"),
        (lambda r: r.pop("over"), "with other observations"),
    ):
        with pytest.raises(ValueError, match=message):
            envs.restore_state(damaged(change))
    for wrong in (b"states", None, dict(states.rows)):
        with pytest.raises(
            TypeError, match=r"states must be States, from clone_state or States\.from_bytes"
        ):
            envs.restore_state(wrong)
    with pytest.raises(ValueError, match="with other observations"):
        envs.restore_state(envs.pool.clone_state())
    assert goes_on(envs)


def test_states_travel_in_files(envs, tmp_path):
    assert goes_on(envs, 0)
    path = tmp_path / "states"
    path.write_bytes(envs.clone_state().to_bytes())
    assert goes_on(envs, 8)
    other = ocjax.make_vec("Pong", 4, obs=OBS, num_workers=1)
    other.reset(seed=5)
    for restored in (envs, other):
        observed, _ = restored.restore_state(States.from_bytes(path.read_bytes()))
        assert all(np.array_equal(observed[k], history()[7][k]) for k in OBS)
    good = path.read_bytes()
    for data, message in (
        (b"", "expected undamaged bytes from States.to_bytes of this version, got 0 bytes"),
        (b"ocjaxSAV" + bytes(1_000), "expected undamaged bytes from States.to_bytes"),
        (good[:-1], "expected undamaged bytes"),
        (good[:10_000] + b"!" + good[10_001:], "expected undamaged bytes .*CRC"),
    ):
        with pytest.raises(ValueError, match=message):
            States.from_bytes(data)
    other.close()


def test_states_hold_no_pickles():
    """A state may come from a file, and also fits a pool with other actions."""
    pool = AlePool(PONG, 2, Settings(full_action_space=True), num_workers=0)
    pool.reset([0, 1])
    pool.send(np.full(2, 17))
    states = pool.clone_state()
    assert not any(
        pickle.PROTO in row.tobytes()[:1] or b"ale_py" in row.tobytes()
        for row in states.rows["state"]
    )
    small = AlePool(PONG, 2, num_workers=1)  # its action set lacks the last action of these states
    small.restore_state(states)
    assert np.array_equal(small.ram, pool.ram)
    small.send(np.zeros(2, int))
    small.wait()
    for p in (pool, small):
        p.close()


# Memory.


def test_shared_memory_that_is_too_small_is_reported(monkeypatch):
    """The error comes at once: a page that is missing later would kill the process."""

    def full(file, start, size):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(memory.os, "posix_fallocate", full, raising=False)
    with pytest.raises(
        MemoryError,
        match=(
            r"need 0\.\d{4} GB in /\S+, where [\d.]+ GB are free: make fewer environments, or "
            r"enlarge it"
        ),
    ):
        ocjax.make_vec("Pong", 8, mode="vem")


def test_shared_memory_is_allocated_at_once():
    with memory.shared_memory(10**6) as (file, view):
        assert os.fstat(file).st_blocks * 512 >= 10**6
        assert len(view) == 10**6


# Interruptions.


class Once:
    """Calls a function, and raises KeyboardInterrupt at the n-th call, before or after it."""

    def __init__(self, function, n, after):
        self.function, self.left, self.after = function, n, after

    def __call__(self, *args, **kwargs):
        self.left -= 1
        if self.left == 0 and not self.after:
            raise KeyboardInterrupt
        result = self.function(*args, **kwargs)
        if self.left == 0:
            raise KeyboardInterrupt
        return result


PLACES = {
    "sending": lambda envs: (process.WorkerProcess, "send"),
    "waiting": lambda envs: (envs.pool._workers._selector, "select"),
    "receiving": lambda envs: (process.WorkerProcess, "receive"),
    "extracting": lambda envs: (envs, "_observe"),
    "returning": lambda envs: (envs, "_observation"),
}


def test_an_interrupted_step_is_finished(monkeypatch):
    """Ctrl-C at any point lets the step end, and the next steps give the same results as without
    the interruption."""
    monkeypatch.setattr(ale, "_MIN_SHARD", 1)
    envs = ocjax.make_vec("Pong", 4, obs=OBS, num_workers=2)
    envs.reset(seed=0)
    t = 0
    for place, after, n in itertools.product(PLACES, (False, True), (1, 2)):
        owner, name = PLACES[place](envs)
        interrupted, times = Once(getattr(owner, name), n, after), 0
        with monkeypatch.context() as patch:
            patch.setattr(
                owner,
                name,
                functools.partialmethod(interrupted) if isinstance(owner, type) else interrupted,
            )
            while interrupted.left > 0:
                steps = envs.pool.steps
                try:
                    envs.step(np.full(4, t % 6))
                except KeyboardInterrupt:
                    times += 1
                t += envs.pool.steps - steps
        assert times == 1, "the interruption came"
        assert goes_on(envs, t, 2), (place, after, n)
        t += 2
    assert t <= len(history())
    envs.close()


@pytest.mark.parametrize(
    "name", slow_but(["reset", "set_ram"], ["reset", "restore_state", "clone_state", "set_ram"])
)
def test_other_interrupted_calls_leave_the_environments_usable(name, monkeypatch):
    """The next call works, or asks for a reset first; it never uses an incomplete result."""
    envs = ocjax.make_vec("Pong", 4, obs=OBS, num_workers=2)
    envs.reset(seed=0)
    states = envs.clone_state()
    calls = {
        "reset": lambda: envs.reset(
            seed=9, options={"reset_mask": np.array([True, False, False, False])}
        ),
        "restore_state": lambda: envs.restore_state(states),
        "clone_state": lambda: envs.clone_state(),
        "set_ram": lambda: envs.set_ram(envs.get_ram()),
    }
    with monkeypatch.context() as patch:
        patch.setattr(envs.pool._workers, "completed", Once(envs.pool._workers.completed, 1, False))
        with pytest.raises(KeyboardInterrupt):
            calls[name]()
    if name in ("reset", "restore_state"):
        with pytest.raises(
            ValueError,
            match=r"call reset\(\) before the first step, and after a call that was interrupted",
        ):
            envs.step(np.zeros(4, int))
        with pytest.raises(ValueError, match="so must one after an interrupted call"):
            calls["reset"]()
        envs.reset(seed=0)
    assert goes_on(envs)
    envs.close()


def test_an_interrupted_step_in_this_process_asks_for_a_reset():
    """Emulators may have stopped anywhere between two steps."""
    calls = []

    def hook(ram, interrupt):
        interrupt()

    def interrupt():
        calls.append(1)
        if len(calls) == 10:
            raise KeyboardInterrupt

    envs = ocjax.make_vec("Pong", 4, obs=OBS, num_workers=0)
    for emulator in envs.pool._local.emulators:
        emulator.hooks = [("interrupt", functools.partial(hook, interrupt=interrupt))]
        emulator.whole_steps, emulator.frames_per_act = False, 1
    envs.reset(seed=0)
    with pytest.raises(KeyboardInterrupt):
        envs.step(np.zeros(4, int))
    with pytest.raises(ValueError, match="after a call that was interrupted"):
        envs.step(np.zeros(4, int))
    with pytest.raises(ValueError, match="after an interrupted call, must be of all environments"):
        envs.reset(options={"reset_mask": np.array([True, False, False, False])})
    envs.reset(seed=0)
    assert goes_on(envs)
    envs.close()


def test_ctrl_c_interrupts_a_step_and_the_session_goes_on():
    """The test sends the signal while workers are busy."""
    out = run("""
        import os, signal, threading, time, numpy as np, ocjax
        signal.signal(signal.SIGINT, signal.default_int_handler)
        def slow(ram):
            time.sleep(0.1)
        envs = ocjax.make_vec("Pong", 2, num_workers=1, hook=slow, mode="raw")
        envs.reset(seed=0)
        threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT)).start()
        try:
            envs.step(np.zeros(2, int))
        except KeyboardInterrupt:
            print("interrupted")
        print(envs.step(np.zeros(2, int))[-1]["episode_length"])
        envs.reset(seed=0)
        envs.close()
    """)
    assert out.split("\n")[:2] == ["interrupted", "[2 2]"]
