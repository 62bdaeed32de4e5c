#!/usr/bin/env python3
"""How long `mpirun -n N mesolux bake` takes, by a model with measured constants.

    docs/cluster-model.py                the tables of docs/clusters.md
    docs/cluster-model.py N E [S [C]]    of N ranks and E elements, with S sources drawn, where
                                     the ranks share C cores

A rank has one device and the cores of it. What all ranks need of the scene is sent once. Of each
source drawn, one of the ranks draws the item buffer, all receive it, and each finds the form
factors to its share of the elements; the first rank receives the coupling, solves, and asks for the
next batch. All search for near sources. Reading, other set-up and writing are the first rank's."""

import sys

# Seconds on one core of lavapipe, fitted to one bake by one process: `LP_NUM_THREADS=1 taskset -c 0
# mesolux bake cornell --patches 100000 --no-cache --checkpoint 0 --json`, of 34.2 s at `da0abae`.
# Divided by ranks:
PAIR = 1.98e-7  # of an element and a source drawn: sorted, looked at by rays, binned, kept
DRAW = 2.67e-3  # of a source: its item buffer
GATHER = 4.8e-9  # of an element and a source
SEARCH = 1.62e-5  # of an element: its near sources
# Not divided, of an element: other set-up, reading and writing, and once for pipelines.
FIRST = 1.24e-5
ONCE = 0.3
# What each of several ranks needs more than its even part: to wait for the slower one, to pack and
# unpack, and for MPI. Fitted to two ranks of the same bake, 20.5 s, which did not share the search.
TOGETHER = 1.12
# Bytes sent: of the scene, an element; of an item buffer of 128² pixels; of a rank's part of a
# row.
SCENE = 140
ITEMS = 7e3
PART = 1e3
BATCH = 32  # sources that are asked for at once
LATENCY = 50e-6  # of a message, with the wait for whoever looks for it: a guess
ROW = 1.4  # bytes of a kept form factor, of all elements, with what is not in sight
HELD = 300  # bytes of an element on each device beside kept rows
PROGRAM = 2.1e8  # bytes of a process with nothing to do
HOST = 1.3e3  # bytes of an element that the first rank holds beside


def sources(elements):
    """Drawn for a bound of 10⁻³ in `cornell`: grows with the 0.15th power."""
    return 1346 * (elements / 1e5) ** 0.15


def seconds(ranks, elements, gigabits, drawn=None, cores=None):
    """Of ranks with a core each, or that share so many, which the first has for set-up too."""
    drawn = drawn or sources(elements)
    wire = gigabits * 1e9 / 8
    first = FIRST * elements / (cores or 1) + ONCE
    cores = cores or ranks
    work = (PAIR * elements + DRAW + GATHER * elements) * drawn + SEARCH * elements
    work /= cores
    if ranks == 1:
        return first + work
    sent = SCENE * elements + drawn * (ITEMS + ranks * PART)
    return first + TOGETHER * work + sent / wire + drawn * 3 * ranks * LATENCY / BATCH


def gibibytes(ranks, elements, drawn=None):
    """Of the first rank, and of each other."""
    drawn = drawn or sources(elements)
    held = PROGRAM + (HELD + ROW * drawn / ranks) * elements
    return [(held + HOST * elements) / 2**30, held / 2**30]


def table(gigabits):
    print(f"\nA core of lavapipe a rank, {gigabits} Gbit/s: seconds (times as fast as one rank)\n")
    ranks = [1, 2, 4, 8, 16, 32, 64, 128, 256]
    print("| elements | " + " | ".join(map(str, ranks)) + " |")
    print("| --- |" + " --- |" * len(ranks))
    for elements in (10**6, 10**7, 10**8):
        alone = seconds(1, elements, gigabits)
        cells = []
        for n in ranks:
            took = seconds(n, elements, gigabits)
            cells.append(f"{took:,.0f} ({alone / took:.1f})")
        print(f"| {elements:,} | " + " | ".join(cells) + " |")


if len(sys.argv) > 2:
    n, e = int(sys.argv[1]), int(float(sys.argv[2]))
    more = [int(argument) for argument in sys.argv[3:]]
    first, other = gibibytes(n, e, *more[:1])
    took = seconds(n, e, 10, *more)
    print(f"{took:.1f} s; {first:.2f} GiB of the first rank, {other:.2f} of each other")
else:
    for gigabits in (10, 100):
        table(gigabits)
