"""The command `ocjax`, run in this process."""

from typer.testing import CliRunner

from ocjax.cli.app import app

runner = CliRunner()


def run(*args):
    return runner.invoke(app, [str(a) for a in args], terminal_width=200)
