"""The command `ocjax bench`."""

import json

from tests.support.command import run


def test_bench(tmp_path):
    out = tmp_path / "times.jsonl"
    result = run("bench", "Pong", "--envs", 2, "--seconds", 0.01, "--json", out)
    assert result.exit_code == 0, result.output
    found = [json.loads(line) for line in out.read_text().splitlines()]
    assert {m["what"] for m in found} >= {"REM", "VEM", "environment without objects", "environment with REM", "environment with VEM"}
    assert all(0 < m["low"] <= m["median"] <= m["high"] for m in found)
    assert all(m["processor"] and m["jax"] for m in found)
    assert "first call, s" in result.output
    assert run("bench", "Pongg").exit_code == 2
