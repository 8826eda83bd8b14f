"""Work on a Ray cluster of several nodes; one node is lost."""

import dataclasses
import shutil

import numpy as np
import pytest

import ocjax
from ocjax import datasets, files
from ocjax.datasets import shards
from ocjax.files import InputError, cluster, pipeline
from tests.support.states import excerpt

ray = pytest.importorskip("ray")
pytest.importorskip("pyarrow")
parquet = pytest.importorskip("pyarrow.parquet")
pytestmark = [pytest.mark.filterwarnings("ignore"), pytest.mark.xdist_group("ray")]

NODE = {"num_cpus": 1, "object_store_memory": 80_000_000}


@pytest.fixture
def nodes():
    """A cluster of two nodes with one CPU each, beside the head, which has none."""
    utils = pytest.importorskip("ray.cluster_utils")
    started = utils.Cluster(
        initialize_head=True, head_node_args={**NODE, "num_cpus": 0, "include_dashboard": False}
    )
    yield started, [started.add_node(**NODE) for _ in range(2)]
    ray.shutdown()
    started.shutdown()


def contents(folder):
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def test_lost_node(nodes, tmp_path):
    started, workers = nodes
    plan = dataclasses.replace(
        datasets.plan(ocjax.load("Pong"), 60), shard_states=10, sequence_states=2
    )
    reported, kept = [], {}

    def report(done, total):
        reported.append(done)
        if done >= 10 and not kept:
            kept.update(
                {p: p.stat().st_mtime_ns for p in (tmp_path / "cluster" / "data").glob("train*")}
            )
            # The driver connects to any of the nodes, and that one must stay.
            own = ray.get_runtime_context().get_node_id()
            lost = next(node for node in workers if node.node_id != own)
            started.remove_node(lost, allow_graceful=False)

    datasets.generate(plan, tmp_path / "cluster", ray=started.address, report=report)
    assert reported == list(range(0, 61, 10)), "each file is reported once"
    assert kept
    assert {p: p.stat().st_mtime_ns for p in kept} == kept, "what was done is not done again"
    datasets.generate(plan, tmp_path / "local")
    assert contents(tmp_path / "cluster") == contents(tmp_path / "local")


def test_relabel(nodes, tmp_path):
    game, reported = ocjax.load("Pong"), []
    datasets.generate(
        dataclasses.replace(datasets.plan(game, 20), shard_states=10, sequence_states=2),
        tmp_path / "local",
    )
    shutil.copytree(tmp_path / "local", tmp_path / "cluster")
    for path in (tmp_path / "cluster" / "data").iterdir():
        shards._write(
            path, parquet.read_table(path), game, shards.facts(path) | {"code": "old", "counts": {}}
        )
    datasets.relabel(
        tmp_path / "cluster", ray=nodes[0].address, report=lambda done, total: reported.append(done)
    )
    assert reported == [0, 10, 20]
    assert contents(tmp_path / "cluster") == contents(tmp_path / "local")


def test_extraction_and_errors(nodes, tmp_path, monkeypatch):
    address, rams = nodes[0].address, excerpt("Pong")["rams"]
    monkeypatch.setitem(pipeline.BLOCK_ROWS, "rem", 16)
    np.save(tmp_path / "Pong.npy", rams)
    files.extract(tmp_path / "Pong.npy", tmp_path / "local.npz")
    files.extract(tmp_path / "Pong.npy", tmp_path / "cluster.npz", ray=address)
    assert (tmp_path / "cluster.npz").read_bytes() == (tmp_path / "local.npz").read_bytes()
    (tmp_path / "Pong.npy").write_bytes(
        (tmp_path / "Pong.npy").read_bytes()[: 128 + 36 * 128]
    )  # in the last block: any of several damaged blocks may come first
    with pytest.raises(InputError, match="ends in row 36"):
        files.extract(tmp_path / "Pong.npy", tmp_path / "damaged.npz", ray=address)


def test_no_cluster(tmp_path):
    np.save(tmp_path / "Pong.npy", excerpt("Pong")["rams"])
    with pytest.raises(ValueError, match="no Ray cluster at 'auto'"):
        list(cluster.completed(print, [0], "auto"))
