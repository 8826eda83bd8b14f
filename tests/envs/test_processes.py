"""Environments and extraction in processes that are forked or spawned, and environments that are
pickled or copied."""

import copy
import pickle
import subprocess
import sys
import textwrap

import cloudpickle
import gymnasium
import numpy as np
import pytest

import ocjax
from ocjax.envs import AlePool, make
from ocjax.ocatari import OCAtari
from tests.support.marks import slow_but

# this starts JAX's threads
COMPUTE = "import numpy as np; ocjax.load('Pong').rem(np.zeros(128, np.uint8))"
REFUSAL = "forked from one that had already computed with JAX"
SPAWN = "context='spawn'"


def run(code, *arguments, seconds=120):
    """The output and the errors of a program in a separate process, which ends in time.

    JAX warns about forks.
    """
    command = [sys.executable, "-W", "ignore", "-c", textwrap.dedent(code), *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=seconds)
    return done.stdout, done.stderr


@pytest.mark.slow
def test_making_environments_does_not_start_jax():
    out, errors = run("""
        import gymnasium, ocjax
        from jax._src import xla_bridge
        from ocjax.envs.requests import NAMES
        from ocjax.ocatari import OCAtari
        games = [ocjax.load(name, hud=hud) for name in ocjax.games() for hud in (True, False)]
        for mode in ("rem", "vem", "both"):
            gymnasium.make("ocjax/Alien-v5", mode=mode, obs=list(NAMES), render_mode="objects")
            reward = lambda before, after, action: 0.0
            ocjax.make_vec("Alien", 2, mode=mode, obs=list(NAMES), num_workers=0, reward_fn=reward)
        for mode in ("ram", "vision", "both"):
            OCAtari("Alien", mode=mode, obs_mode="dqn")
        print(len(games), xla_bridge.backends_are_initialized())
    """)
    assert out.split() == [str(2 * len(ocjax.games())), "False"], errors


CHILD = """
    import os, sys, time, ocjax, numpy as np
    exec(sys.argv[1])
    child = os.fork()
    if child == 0:
        print("child", flush=True)
        sys.exit(3)
    end = time.monotonic() + 60
    while not (ended := os.waitpid(child, os.WNOHANG))[0]:
        if time.monotonic() > end:
            os.kill(child, 9)
        time.sleep(0.05)
    print(os.waitstatus_to_exitcode(ended[1]))
"""
USED = {
    "few": "ocjax.load('Pong').rem(np.zeros(128, np.uint8)).valid.block_until_ready()",
    "many": "kept = ocjax.load('Pong').rem(np.zeros((4096, 128), np.uint8))",
    "environments": (
        "envs = ocjax.make_vec('Pong', 64, num_workers=2); envs.reset(seed=0); "
        "envs.step(envs.action_space.sample())"
    ),
    "closed": "envs = ocjax.make_vec('Pong', 2, num_workers=0); envs.reset(seed=0); envs.close()",
}


@pytest.mark.parametrize("used", USED)
def test_forked_processes_end(used):
    """Forked processes end with their own exit status, although they lack JAX's threads."""
    out, errors = run(CHILD, USED[used])
    assert out.split() == ["child", "3"], errors


STREAMS = """
    import os, sys, ocjax
    def hook(ram):
        ram[0] = ram[0]
    with open(sys.argv[1], "w") as file:
        try:
            envs = ocjax.make_vec("Pong", 2, num_workers=2, hook=hook)
            envs.reset(seed=0)
            envs.step(envs.action_space.sample())
            envs.close()
            print("stepped", file=file)
        except BaseException as error:
            print(repr(error), file=file)
"""


@pytest.mark.parametrize("closed", ["<&-", ">&-", "2>&-", "<&- >&-", "<&- >&- 2>&-"])
def test_closed_standard_streams(tmp_path, closed):
    command = [
        "sh",
        "-c",
        f'exec "$0" -W ignore -c "$1" "$2" {closed}',
        sys.executable,
        textwrap.dedent(STREAMS),
        tmp_path / "out",
    ]
    subprocess.run(command, check=False, timeout=120, capture_output=True)
    # Messages of XLA can be in the file, which has the number of the closed stream.
    assert (tmp_path / "out").read_text().splitlines()[-1] == "stepped"


@pytest.mark.parametrize(
    "before",
    [
        "import os, tempfile; folder = tempfile.mkdtemp(); os.chdir(folder); os.rmdir(folder)",
        "import sys; sys.path += [f'/missing/{i}' + '/deep' * 20 for i in range(5_000)]",
        "import pathlib, sys, tempfile, typing; f = tempfile.mkdtemp(); sys.path.insert(0, f); "
        "pathlib.Path(f, 'typing.py').touch()",
    ],
    ids=["deleted working directory", "long path of modules", "hidden standard library"],
)
def test_unusual_processes(tmp_path, before):
    _, errors = run(f"{before}\n" + textwrap.dedent(STREAMS), tmp_path / "out")
    assert (tmp_path / "out").read_text() == "stepped\n", errors


def test_hooks_that_write_to_stderr(caplog, monkeypatch):
    """The message appears once, and the file does not grow without limit."""

    def hook(ram):
        import sys

        sys.stderr.write("look at this " + "-" * 10_000 + "\n")
        sys.stderr.flush()

    envs = ocjax.make_vec("Pong", 2, num_workers=1, hook=hook)
    envs.reset(seed=0)
    (worker,) = envs.pool._workers
    sizes = []
    for _ in range(20):
        envs.step(np.zeros(2, int))
        sizes.append(worker.stderr.seek(0, 2))
    envs.close()
    assert max(sizes) < 200_000
    assert (
        len(
            [
                record
                for record in caplog.records
                if "wrote to its standard error" in record.getMessage()
            ]
        )
        == 1
    )


NO_HOME = """
    import os, pwd, sys
    for name in ("HOME", "XDG_CACHE_HOME", "JAX_COMPILATION_CACHE_DIR"):
        os.environ.pop(name, None)
    def getpwuid(uid):
        raise KeyError(uid)
    pwd.getpwuid = getpwuid
"""


def test_no_home_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    _, errors = run(NO_HOME + "    import ocjax; ocjax.use_compilation_cache()")
    assert (
        "FileNotFoundError: the user has no home folder for compiled programs: set HOME" in errors
    )
    out, errors = run(
        NO_HOME + "    from ocjax.cli.app import app; app(['games', '--suite', 'atari5'])"
    )
    assert "Phoenix" in out, errors
    assert not list(tmp_path.iterdir())


FORKS = """
    import sys, gymnasium, ocjax
    from gymnasium.vector import AsyncVectorEnv
    from ocjax.ocatari import OCAtari
    before, made = sys.argv[1:]
    exec(before)
    envs = eval(made)
    envs.reset(seed=0)
    observation = envs.step(envs.action_space.sample())[0]
    envs.close()
    print("stepped")
"""
MADE = [
    "gymnasium.make_vec('ocjax/Pong-v5', num_envs=2, vectorization_mode='async', obs='vector')",
    "AsyncVectorEnv([lambda: gymnasium.make('ocjax/Pong-v5', obs=('objects', 'dqn', 'planes'))] "
    "* 2)",
    "AsyncVectorEnv([lambda: OCAtari('Pong', obs_mode='dqn')] * 2)",
]


@pytest.mark.parametrize("made", slow_but(MADE[:1], MADE))
def test_environments_run_in_forked_processes(made):
    out, errors = run(FORKS, "", made)
    assert out == "stepped\n", errors


@pytest.mark.parametrize("made", slow_but(MADE[:1], MADE))
def test_forked_processes_say_that_jax_does_not_work_in_them(made):
    out, errors = run(FORKS, COMPUTE, made)
    assert out == ""
    assert REFUSAL in errors
    assert SPAWN in errors


def test_what_needs_no_jax_runs_in_forked_processes_all_the_same():
    out, errors = run(
        FORKS,
        COMPUTE,
        "AsyncVectorEnv([lambda: gymnasium.make('ocjax/Pong-v5', mode='raw', obs=('pixels', "
        "'ram'))] * 2)",
    )
    assert out == "stepped\n", errors


def test_extraction_is_refused_in_forked_processes():
    """The children of a forked process refuse it, too."""
    code = """
        import os, sys, numpy as np, ocjax
        game = ocjax.load("Pong")
        game.rem(np.zeros(128, np.uint8))
        if os.fork() == 0 and os.fork() == 0:
            cases = (game.rem, (3, 128)), (game.vem, (210, 160)), (game.vem, (2, 210, 160, 3))
            for extract, shape in cases:
                try:
                    extract(np.zeros(shape, np.uint8))
                except RuntimeError as error:
                    print(error, flush=True)
            os._exit(0)
        os._exit(0)
    """
    out, errors = run(code)
    assert out.count(REFUSAL) == 3, errors


@pytest.mark.slow
def test_environments_run_in_spawned_processes():
    vectorized = (
        "gymnasium.make_vec('ocjax/Pong-v5', num_envs=2, vectorization_mode='async', "
        "vector_kwargs={'context': 'spawn'})"
    )
    out, errors = run(FORKS, COMPUTE, vectorized)
    assert out == "stepped\n", errors
    out, errors = run(
        FORKS,
        COMPUTE,
        "AsyncVectorEnv([lambda: gymnasium.make('ocjax:ocjax/Pong-v5')] * 2, context='spawn')",
    )
    assert out == "stepped\n", errors


def test_pickles_and_copies_of_environments_are_refused():
    made = [
        ocjax.make_vec("Pong", 2, num_workers=1),
        make("Pong"),
        OCAtari("Pong"),
        AlePool(ocjax.load("Pong"), 1, num_workers=0),
    ]
    for env in made:
        env.reset()
        for function in (pickle.dumps, cloudpickle.dumps, copy.deepcopy, copy.copy):
            with pytest.raises(
                TypeError,
                match=(
                    rf"{type(env).__name__} cannot be pickled or copied.* Save instead: "
                    r"\w*clone_state\(\)"
                ),
            ):
                function(env)
        env.close()


def test_what_to_save_instead_of_environments_restores_them():
    envs = ocjax.make_vec("Pong", 2, num_workers=0)
    envs.reset(seed=0)
    envs.step(np.array([2, 3]))
    states, spec = pickle.loads(pickle.dumps((envs.clone_state().to_bytes(), envs.spec)))
    again = gymnasium.make_vec(spec)
    again.reset()
    again.unwrapped.restore_state(ocjax.envs.States.from_bytes(states))
    for _ in range(3):
        assert np.array_equal(
            envs.step(np.array([2, 3]))[0]["xywh"], again.step(np.array([2, 3]))[0]["xywh"]
        )
    single = OCAtari("Pong")
    single.reset(seed=0)
    state, spec = pickle.loads(pickle.dumps((single._clone_state(), single.spec)))
    copied = gymnasium.make(spec)
    copied.reset()
    copied.unwrapped._restore_state(state)
    assert np.array_equal(copied.unwrapped.get_ram(), single.get_ram())
