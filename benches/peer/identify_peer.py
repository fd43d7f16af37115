"""Typical Python script: constants of a stand from a record.

    python identify_peer.py decay|response|modal RECORD [REPORT]

decay: polars reads, an FFT gives the initial guess, scipy.optimize.least_squares fits a decaying sine with an
offset and a drift to every sample. response: scipy.signal.csd and welch give H1 (Hann, half overlapping
segments of 16384), least_squares fits two modes to it, starting at its peaks. modal: the same H1 into
sdypy-EMA, poles by LSCF up to order 30, those nearest to the peaks. Writes frequencies (Hz), damping
ratios and the seconds after reading as JSON.
"""

import json
import sys
import time

import numpy as np
import polars as pl
from scipy import optimize, signal

SEGMENT = 16_384
BAND_HZ = (100.0, 2300.0)


def decay(table):
    t, y = (table[:, i].to_numpy() for i in (0, 1))
    spectrum = np.abs(np.fft.rfft(y - y.mean()))
    frequency = np.fft.rfftfreq(len(y), t[1] - t[0])[spectrum.argmax()]

    def left(p):
        return p[0] * np.exp(-p[1] * t) * np.cos(p[2] * t + p[3]) + p[4] + p[5] * t - y

    start = [0.5 * np.ptp(y), 1.0, 2 * np.pi * frequency, 0.0, y.mean(), 0.0]
    fit = optimize.least_squares(left, start, method="lm", x_scale=[1, 1, 1, 1, 1, 1])
    natural = np.hypot(fit.x[1], fit.x[2])
    return [natural / (2 * np.pi)], [fit.x[1] / natural]


def h1(table):
    """Frequencies in the band, and H1 at them."""
    t, x, y = (table[:, i].to_numpy() for i in (0, 1, 2))
    rate = (len(t) - 1) / (t[-1] - t[0])
    frequency, cross = signal.csd(x, y, rate, nperseg=SEGMENT)
    _, power = signal.welch(x, rate, nperseg=SEGMENT)
    keep = (frequency >= BAND_HZ[0]) & (frequency <= BAND_HZ[1])
    return frequency[keep], (cross / power)[keep]


def peaks(frequency, frf):
    found, _ = signal.find_peaks(np.abs(frf), prominence=0.3 * np.abs(frf).max() / 5, distance=50)
    best = found[np.argsort(-np.abs(frf[found]))[:2]]
    return np.sort(frequency[best])


def response(table):
    frequency, frf = h1(table)
    s = 2j * np.pi * frequency
    starts = 2 * np.pi * peaks(frequency, frf)

    def left(p):
        total = p[8] + p[9] * 1e6 / s**2
        for k in range(2):
            pole = complex(-p[4 * k] * 10, p[4 * k + 1] * 1000)
            residue = complex(p[4 * k + 2], p[4 * k + 3]) * 1000
            total = total + residue / (s - pole) + residue.conjugate() / (s - pole.conjugate())
        off = total - frf
        return np.concatenate((off.real, off.imag))

    start = []
    for omega in starts:
        size = np.abs(frf[np.argmin(np.abs(frequency - omega / 2 / np.pi))]) * 0.02 * omega
        start += [0.002 * omega, omega / 1000, 0.0, -size / 1000]
    fit = optimize.least_squares(left, start + [0.0, 0.0])
    poles = [(fit.x[4 * k] * 10, fit.x[4 * k + 1] * 1000) for k in range(2)]
    natural = [np.hypot(*p) for p in poles]
    return [n / (2 * np.pi) for n in natural], [p[0] / n for p, n in zip(poles, natural)]


def modal(table):
    from sdypy import EMA

    frequency, frf = h1(table)
    acceleration = frf * -((2 * np.pi * frequency) ** 2)
    model = EMA.Model(
        acceleration[None, :], frequency, lower=BAND_HZ[0], upper=BAND_HZ[1], pol_order_high=30
    )
    model.get_poles(show_progress=False)
    model.select_closest_poles(list(peaks(frequency, frf)))
    return list(model.nat_freq), list(model.nat_xi)


def main():
    job, record = sys.argv[1], sys.argv[2]
    table = pl.read_csv(record)
    begun = time.perf_counter()
    frequencies, ratios = {"decay": decay, "response": response, "modal": modal}[job](table)
    found = {
        "frequency_hz": [float(f) for f in frequencies],
        "damping_ratio": [float(r) for r in ratios],
        "seconds": time.perf_counter() - begun,
    }
    text = json.dumps(found)
    if len(sys.argv) > 3:
        with open(sys.argv[3], "w", encoding="ascii") as file:
            file.write(text)
    else:
        print(text)


if __name__ == "__main__":
    main()
