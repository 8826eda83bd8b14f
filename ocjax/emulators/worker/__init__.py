"""The program of one worker process, which steps a block of emulators and leaves the results in
shared memory.

`interface` declares what a pool and its workers share, `emulator` runs one environment, `program`
runs a block of them. None of these modules imports ocjax: see `__main__.py`.
"""
