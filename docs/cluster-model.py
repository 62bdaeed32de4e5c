#!/usr/bin/env python3
"""How long `mpirun -n N mesolux bake` takes, by a model with measured constants.

    docs/cluster-model.py            the tables of docs/clusters.md
    docs/cluster-model.py N E        of N ranks and E elements

A rank has one device. What all ranks need of the scene is sent once. Of each source drawn, one of
the ranks draws the item buffer, all receive it, and each finds the form factors to its share of the
elements; the first rank receives the coupling, solves, and asks for the next batch. """

import sys

# Seconds. A core of lavapipe: `--json` of `LP_NUM_THREADS=1 mesolux bake cornell --patches 100000
# --no-cache`, see docs/clusters.md. An H200: form factors by docs/report-h200.md, 10⁹ a second, the
# rest of a source as long as 10⁶ of them.
CORE = {"name": "lavapipe, a core", "pair": 1.94e-7, "draw": 2.5e-3, "gather": 2.0e-9}
H200 = {"name": "H200", "pair": 1.0e-9, "draw": 1.0e-3, "gather": 2.0e-11}

SETUP = 2.2e-5  # of an element, on one core of the first rank
SOLVE = 0.7e-3  # of a source, on the first rank
PACK = 0.5e-3  # of a source: packing its share, unpacking all
SCENE = 140  # bytes of an element that every rank receives
ITEMS = 11e3  # bytes of an item buffer, packed
PART = 2e3  # bytes of the part of a row that each rank sends to the first
BATCH = 32  # sources that are drawn at once
LATENCY = 50e-6  # of a message, with the wait for whoever looks for it
ROW = 1.4  # bytes of a kept form factor, of all elements, with what is not in sight
HELD = 300  # bytes of an element on each device beside kept rows


def sources(elements):
    """Drawn, for a bound of 10⁻³ in `cornell`: grows with the 0.15th power."""
    return 1346 * (elements / 1e5) ** 0.15


def seconds(ranks, elements, device, gigabits):
    drawn = sources(elements)
    wire = gigabits * 1e9 / 8
    setup = SETUP * elements
    if ranks > 1:
        setup += SCENE * elements / wire
    source = device["draw"] / ranks + device["pair"] * elements / ranks + SOLVE
    if ranks > 1:
        source += PACK + (ITEMS + ranks * PART) / wire + 3 * ranks * LATENCY / BATCH
    gather = device["gather"] * elements / ranks * drawn
    return setup + drawn * source + gather


def gibibytes(ranks, elements):
    """Of the memory of each device."""
    return (HELD + ROW * sources(elements) / ranks) * elements / 2**30


def table(device, gigabits):
    print(f"\n{device['name']}, {gigabits} Gbit/s: seconds (times as fast as one rank)\n")
    ranks = [1, 2, 4, 8, 16, 32, 64, 128, 256]
    print("| elements | " + " | ".join(map(str, ranks)) + " |")
    print("| --- |" + " --- |" * len(ranks))
    for elements in (10**6, 10**7, 10**8):
        alone = seconds(1, elements, device, gigabits)
        cells = []
        for n in ranks:
            took = seconds(n, elements, device, gigabits)
            cells.append(f"{took:,.0f} ({alone / took:.1f})")
        print(f"| {elements:,} | " + " | ".join(cells) + " |")


if len(sys.argv) == 3:
    n, e = int(sys.argv[1]), int(float(sys.argv[2]))
    for device in (CORE, H200):
        print(f"{device['name']}: {seconds(n, e, device, 10):.1f} s, {gibibytes(n, e):.2f} GiB a rank")
else:
    for device in (CORE, H200):
        for gigabits in (10, 100):
            table(device, gigabits)
