"""The program of a worker process, which steps a block of emulators into shared memory.

`interface` declares the data that a pool shares with its workers, `emulator` runs one environment,
`program` runs a block of them. These modules do not import ocjax: see `__main__.py`.
"""
