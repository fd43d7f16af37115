"""Writes the records for identify.sh: decay.csv and response.csv.

    python identify_make.py ROWS FOLDER

decay.csv: one mode at 590 Hz, decay rate 3 1/s, from 2 V, noise of 0.02 V, 200 kHz. response.csv: two
modes at 590 Hz and 1480 Hz driven by noise up to 2400 Hz, noise of 1 % on the response, 20 kHz. The output
is the frequency response times the spectrum of the whole record, so it is exact (and periodic).
"""

import sys

import numpy as np
import polars as pl

MODES = ((590.0, 0.02, 1.0), (1480.0, 0.01, 0.2))  # Hz, damping ratio, gain at rest


def response(frequency_hz):
    """Sum of the modes."""
    total = np.zeros_like(frequency_hz, dtype=complex)
    for natural, ratio, gain in MODES:
        r = frequency_hz / natural
        total += gain / (1.0 - r * r + 2j * ratio * r)
    return total


def main():
    rows, folder = int(sys.argv[1]), sys.argv[2]
    rng = np.random.default_rng(1)
    t = np.arange(rows) / 200_000.0
    ring = 2.0 * np.exp(-3.0 * t) * np.cos(2 * np.pi * 590.0 * t) + 0.1
    ring += 0.02 * rng.standard_normal(rows)
    pl.DataFrame({"time_s": t, "gage_V": ring}).write_csv(f"{folder}/decay.csv", float_precision=7)
    rate = 20_000.0
    frequency = np.fft.rfftfreq(rows, 1.0 / rate)
    spectrum = np.fft.rfft(rng.standard_normal(rows)) * (frequency < 2400.0)
    applied = np.fft.irfft(spectrum, rows)
    measured = np.fft.irfft(spectrum * response(frequency), rows)
    measured += 0.01 * measured.std() * rng.standard_normal(rows)
    table = {"time_s": np.arange(rows) / rate, "applied_N m": applied, "measured_N m": measured}
    pl.DataFrame(table).write_csv(f"{folder}/response.csv", float_precision=7)


if __name__ == "__main__":
    main()
