"""The command `ocjax`: one file a command."""
