"""The package `ocatari.vision`, for imports as in OCAtari."""

__all__: list[str] = []
