"""What a user would pick instead, on the same flight: compared in time and in what is found.

`task` is what every tool gets, `equations` the aircraft as a user writes it down; one module a tool; `contest` runs
them.
"""
