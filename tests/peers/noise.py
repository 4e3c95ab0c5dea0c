"""Noise beside other libraries: runs each program in turn, several times, and prints the medians as a table.

Run by `run_noise.sh`: noise.py SIDE REPEATS OURS PEER ...
"""

import statistics
import subprocess
import sys

ROUNDS = 3


def lines(program, side, repeats, name=()):
    """(kernel, octaves, library) and nanoseconds, of one run of a program."""
    told = subprocess.run([program, side, repeats], check=True, capture_output=True, text=True).stdout
    for line in told.splitlines():
        kernel, octaves, *library, ns = line.split()
        yield (kernel, octaves, *(library or name)), float(ns)


def main():
    side, repeats, ours, *peers = sys.argv[1:]
    times = {}
    for _ in range(ROUNDS):
        for program in (ours, *peers):
            for key, ns in lines(program, side, repeats, ("orograph",)):
                times.setdefault(key, []).append(ns)
    medians = {key: statistics.median(runs) for key, runs in times.items()}
    print("| kernel | octaves | program | side | processor ns/cell | ratio |\n| --- | --- | --- | --- | --- | --- |")
    for kernel, octaves in dict.fromkeys(key[:2] for key in medians):
        own = medians[kernel, octaves, "orograph"]
        for (_, _, library), ns in ((key, ns) for key, ns in medians.items() if key[:2] == (kernel, octaves)):
            print(f"| {kernel} | {octaves} | {' '.join(library.rsplit('-', 1))} | {side} | {ns:.2f} | {ns / own:.1f} |")


main()
